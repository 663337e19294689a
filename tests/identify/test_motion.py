"""Fits of single shots: recovered constants, remarks, and rejected input."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import CRUDE
from tests.identify import shots

import printhammer as ph
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle
from printhammer.identify.shots.motion import fit_motion
from printhammer.identify.shots.shot import find_touches

HAMMER = ph.load(CRUDE)
assert HAMMER.waveform is not None
WAVEFORM = HAMMER.waveform
MASS = HAMMER.mass
DAMPING = HAMMER.constants["backstop.damping"].si
FAR = HAMMER.replace({"mass": 1.3 * MASS, "backstop.damping": 0.7 * DAMPING})
"""Both constants 30 % off."""
NEAR = HAMMER.replace({"mass": 1.03 * MASS, "backstop.damping": 0.95 * DAMPING})
"""A quick start where its distance does not matter."""


def truth(key: str) -> float:
    """Constant of the hammer from which the records are generated, SI."""
    return HAMMER.constants[key].si


def test_starts_30_percent_off_lead_to_the_same_constants(tmp_path: Path) -> None:
    """The fit does not depend on the initial guess."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, seed=3, bandwidth=None)
    near = fit_motion([path], HAMMER)
    for mass, damping in ((0.7, 1.3), (1.3, 1.3)):
        start = HAMMER.replace({"mass": mass * MASS, "backstop.damping": damping * DAMPING})
        far = fit_motion([path], start)
        for key in ("mass", "backstop.damping"):
            assert far[key].value == pytest.approx(near[key].value, abs=0.01 * near[key].standard_error)
            assert far[key].standard_error == pytest.approx(near[key].standard_error, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.7, 1.3])
@pytest.mark.parametrize(
    "free",
    [
        ("spring.As",),
        ("mass", "backstop.damping", "backstop.stiffness", "pack.stiffness"),
    ],
)
def test_other_constants_may_be_30_percent_off_too(
    tmp_path: Path, free: tuple[str, ...], factor: float
) -> None:
    path = shots.write(tmp_path / "shot.csv", HAMMER, seed=3)
    start = HAMMER.replace({key: factor * truth(key) for key in free})
    near, far = fit_motion([path], HAMMER, free=free), fit_motion([path], start, free=free)
    for key in free:
        assert far[key].value == pytest.approx(near[key].value, abs=0.01 * near[key].standard_error)


@pytest.mark.parametrize(("factor", "key"), [(0.7, "motion"), (1.3, "fit")])
def test_a_magnet_too_far_off_is_told(tmp_path: Path, factor: float, key: str) -> None:
    path = shots.write(tmp_path / "shot.csv", HAMMER, seed=3, bandwidth=None)
    start = HAMMER.replace("magnet.Am", factor * truth("magnet.Am"))
    with refused(key):
        fit_motion([path], start, free=["magnet.Am"])


def test_two_fits_agree_to_the_bit(tmp_path: Path) -> None:
    """The same records give the same numbers."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, current_noise=5e-3, bandwidth=None)
    one, other = fit_motion([path], NEAR), fit_motion([path], NEAR)
    assert np.array_equal(one.covariance, other.covariance)
    assert [c.value for c in one.constants.values()] == [c.value for c in other.constants.values()]


def test_the_result_belongs_to_the_records(tmp_path: Path) -> None:
    """Series, lines and residuals equal those of the samples; the fragment defines a hammer."""
    paths = [
        shots.write(tmp_path / f"shot{i}.csv", HAMMER, seed=i, end=(1.6 - 0.2 * i) * 1e-3) for i in range(2)
    ]
    fit = fit_motion(paths, NEAR)
    assert fit.kind == "motion"
    assert fit.source == fit.series_names == ("shot0.csv", "shot1.csv")
    assert np.array_equal(fit.residuals, fit.data - fit.fitted)
    assert fit.residual_scale == pytest.approx(0.2e-6, rel=0.05)
    for number, path in enumerate(paths):
        rows = fit.series == number
        first = path.read_text().splitlines()[fit.lines[rows][0] - 1].split(",")
        assert [float(cell) for cell in first] == pytest.approx(
            [1e6 * fit.abscissa[rows][0], 1e6 * fit.data[rows][0]], rel=1e-12
        )
    made = fit.into(NEAR)
    assert made.mass == fit["mass"].value
    assert made.constants["mass"].status == "derived"
    assert "fitted to shot0.csv and shot1.csv" in made.constants["mass"].source
    one = fit_motion(paths[:1], NEAR)
    assert 0.65 < fit["mass"].standard_error / one["mass"].standard_error < 0.76


def test_outliers_are_left_out(tmp_path: Path) -> None:
    """Gross errors are listed and have no effect on a robust fit; without robustness they have."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, outliers=0.02, seed=5)
    fit = fit_motion([path], NEAR)
    assert 15 < fit.outliers.sum() < 55
    for key in ("mass", "backstop.damping"):
        assert abs(fit[key].value - truth(key)) < 4.0 * fit[key].standard_error
    assert fit_motion([path], HAMMER, robust=False).residual_scale > 5.0 * fit.residual_scale


def test_the_bandwidth_counts(tmp_path: Path) -> None:
    """An undeclared sensor delay shifts the constants, and the fit is rejected."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, bandwidth=30e3, said=False)
    told, untold = fit_motion([path], NEAR, bandwidth=30e3), fit_motion([path], NEAR)
    assert abs(told["mass"].value - MASS) < 4.0 * told["mass"].standard_error
    assert not told.rejected
    assert abs(untold["mass"].value - MASS) > 10.0 * told["mass"].standard_error
    assert "the residuals of" in untold.rejected
    assert untold.p_value < 0.01


def test_shots_with_other_currents_fit_together(tmp_path: Path) -> None:
    """Each record is fitted with its own pulse, of the shape of the hammer's waveform."""
    width = truth("waveform.width")
    pulses = [Rectangle(**{**WAVEFORM.model_dump(), "width": factor * width}) for factor in (0.95, 1.0, 1.1)]
    paths = [
        shots.write(tmp_path / f"{i}.csv", HAMMER, waveform=pulse, current_noise=5e-3, seed=i)
        for i, pulse in enumerate(pulses)
    ]
    fit = fit_motion(paths, NEAR)
    assert list(fit.constants) == ["mass", "backstop.damping"]
    assert not fit.rejected
    for key, constant in fit.constants.items():
        assert abs(constant.value - truth(key)) < 4.0 * constant.standard_error


def test_a_current_of_another_shape_is_taken_from_the_record(tmp_path: Path) -> None:
    """A note of the result states this."""
    pulse = HalfSine(amplitude=1.5, width=450e-6)
    path = shots.write(tmp_path / "shot.csv", HAMMER, waveform=pulse, current_noise=2e-3, bandwidth=None)
    fit = fit_motion([path], NEAR)
    assert any("a rectangle does not describe the current" in note for note in fit.remarks)
    assert fit["mass"].value == pytest.approx(MASS, rel=2e-3)


def test_earlier_fits_are_improved(tmp_path: Path) -> None:
    """Their constants are recovered with smaller errors, which enter the error of the mass."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, seed=11)
    static = shots.static_fit(
        HAMMER, {"magnet.Am": 1e-3, "pack.stiffness": 5e-3, "backstop.stiffness": 1e-2}, 4
    )
    fit = fit_motion([path], static.into(NEAR), earlier=[static])
    carried = fit_motion([path], static.into(NEAR))
    alone = fit_motion([path], static.into(NEAR).replace("uncertainty", None))
    assert set(fit.constants) == {"mass", "backstop.damping", *static.keys}
    for key in static.keys:
        assert fit[key].standard_error < static[key].standard_error
        assert abs(fit[key].value - truth(key)) < 4.0 * fit[key].standard_error
    assert fit["mass"].standard_error > fit_motion([path], HAMMER)["mass"].standard_error
    assert not fit.rejected
    assert alone.rejected
    # A hammer carries what the fit before it knew.
    assert carried.keys == fit.keys
    np.testing.assert_allclose(carried.covariance, fit.covariance, rtol=1e-12)
    built = carried.into(static.into(NEAR))
    assert built.uncertainty is not None
    assert set(built.uncertainty.keys) == set(fit.constants)
    for key in fit.constants:
        assert built.uncertainty.error(key) == pytest.approx(carried[key].standard_error, rel=1e-9)


def test_a_record_counts_once(tmp_path: Path) -> None:
    path = shots.write(tmp_path / "shot.csv", HAMMER, seed=11, bandwidth=None)
    first = fit_motion([path], NEAR)
    built = first.into(NEAR)
    with refused("record", file="shot.csv"):
        fit_motion([path], built)
    other = shots.write(tmp_path / "other.csv", HAMMER, seed=12, bandwidth=None)
    twice = fit_motion([other], built)
    assert twice["mass"].standard_error < 0.85 * first["mass"].standard_error


def test_waveform_constants_can_be_free(tmp_path: Path) -> None:
    """A recorded current provides additional information on the constants."""
    keys = ["mass", "waveform.amplitude", "waveform.width"]
    for noise in (None, 5e-3):
        path = shots.write(tmp_path / "shot.csv", HAMMER, current_noise=noise)
        fit = fit_motion([path], HAMMER.replace("waveform.amplitude", "0.95 A"), free=keys)
        assert list(fit.constants) == keys
        for key, constant in fit.constants.items():
            assert abs(constant.value - truth(key)) < 4.0 * constant.standard_error


def test_a_restitution_gives_way_to_the_damping(tmp_path: Path) -> None:
    """A hammer with a different parametrisation of stiffness and damping is an equally good initial guess."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, bandwidth=None)
    start = HAMMER.replace(
        {"backstop.damping": None, "backstop.restitution": 0.7, "backstop.restitution_speed": 1.0}
    )
    fit, plain = fit_motion([path], start), fit_motion([path], HAMMER)
    assert fit["backstop.damping"].value == pytest.approx(plain["backstop.damping"].value, rel=1e-6)
    undamped = fit_motion([path], HAMMER.replace("backstop.damping", 0.0))
    assert undamped["backstop.damping"].value == pytest.approx(plain["backstop.damping"].value, rel=1e-6)


def test_what_a_motion_cannot_tell_apart(tmp_path: Path) -> None:
    """Mass and all forces scale together; stiffness and thickness of the pack appear only in combination."""
    path = shots.write(tmp_path / "shot.csv", HAMMER)
    forces = ["mass", "magnet.F0", "magnet.Am", "magnet.Bm", "spring.Bs"]
    for free, named in (
        (
            [*forces, "pack.stiffness", "backstop.stiffness", "backstop.damping"],
            ("mass", "magnet.F0", "spring.Bs"),
        ),
        (["pack.stiffness", "pack.thickness"], ("pack.stiffness and pack.thickness",)),
        (["magnet.F0", "spring.Bs", "spring.As"], ("magnet.F0, spring.Bs and spring.As",)),
    ):
        with refused("free") as told:
            fit_motion([path], NEAR, free=free)
        assert all(name in str(told.value) for name in named)


def test_weak_constants_are_told_with_a_profile(tmp_path: Path) -> None:
    """Constants hidden by noise: messages, and the increase of the cost around the best value."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, noise=4e-6, spacing=4e-6, end=0.8e-3, seed=2)
    free = ["mass", "magnet.F0", "magnet.Am", "waveform.decay"]
    fit = fit_motion([path], HAMMER, free=free)
    assert any("only" in sentence or "hardly" in sentence for sentence in fit.indistinct)
    assert fit.profiles
    for key, profile in fit.profiles.items():
        assert fit[key].standard_error > 0.1 * abs(fit[key].value)
        assert (np.diff(profile.values) > 0.0).all()
        assert profile.increase.min() == 0.0
        assert profile.values[np.argmin(profile.increase)] == fit[key].value
        low, high = profile.interval
        assert low < fit[key].value < high


def test_an_offset_is_noticed(tmp_path: Path) -> None:
    """A record whose rest position differs from that of the hammer."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, offset=3e-6, bandwidth=None)
    fit = fit_motion([path], HAMMER)
    assert any("rests" in note and "offset of the sensor" in note for note in fit.remarks)
    assert not any(
        "rests" in note for note in fit_motion([shots.write(path, HAMMER, bandwidth=None)], HAMMER).remarks
    )


BAD: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "misses": (
        {"waveform": Rectangle(**{**WAVEFORM.model_dump(), "width": 150e-6})},
        {},
        "displacement",
    ),
    "ends early": ({"end": 0.4e-3}, {}, "end"),
    "begins late": ({"begin": 150e-6}, {}, "start"),
    "coarse": ({"spacing": 50e-6}, {}, "pack"),
    "no rebound": (
        {"end": 0.5e-3},
        {"free": ["mass", "backstop.damping"]},
        "backstop.damping",
    ),
    "unknown": ({}, {"free": ["weight"]}, "free"),
    "misspelt": ({}, {"free": ["backstop.dampng"]}, "free"),
    "platen": ({}, {"free": ["platen"]}, "free"),
    "twice": ({}, {"free": ["mass", "mass"]}, "free"),
    "nothing": ({}, {"free": []}, "free"),
    "bandwidth": ({}, {"bandwidth": -1.0}, "bandwidth"),
    "short": ({"end": 0.0, "begin": -15e-6}, {}, "samples"),
}


@pytest.mark.parametrize("which", BAD)
def test_bad_input_is_told_in_one_sentence(tmp_path: Path, which: str) -> None:
    """The error states the file, the fault and the expectation."""
    record, options, key = BAD[which]
    path = tmp_path / "shot.csv"
    if which == "short":
        path.write_text("time [us],displacement [um]\n0,50\n1,50\n2,50\n")
    else:
        shots.write(path, HAMMER, **record)
    with refused(key):
        fit_motion([path], HAMMER, **options)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("time [us]", "time", "time"),
        (
            "# bandwidth: 200000.0 Hz",
            "# bandwidth: 2 mm",
            "bandwidth",
        ),
        (
            "# bandwidth: 200000.0 Hz",
            "# bandwidth: -2 Hz",
            "bandwidth",
        ),
    ],
)
def test_bad_headings_and_comments(tmp_path: Path, old: str, new: str, key: str) -> None:
    """Also for sensor settings in the file."""
    path = shots.write(tmp_path / "shot.csv", HAMMER)
    path.write_text(path.read_text().replace(old, new))
    with refused(key):
        fit_motion([path], HAMMER)


def test_times_must_ascend(tmp_path: Path) -> None:
    """The error names the line."""
    path = shots.write(tmp_path / "shot.csv", HAMMER)
    lines = path.read_text().splitlines()
    lines[10], lines[11] = lines[11], lines[10]
    path.write_text("\n".join(lines))
    with refused("time"):
        fit_motion([path], HAMMER)


def test_a_current_that_is_none(tmp_path: Path) -> None:
    """Also a hammer without a waveform, if the record has no current."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, current_noise=1e-3)
    flat = [
        re.sub(r",[^,]*$", ",0.0", line) if line[0] in "-0123456789" else line
        for line in path.read_text().splitlines()
    ]
    path.write_text("\n".join(flat))
    with refused("current"):
        fit_motion([path], HAMMER)
    shots.write(path, HAMMER)
    with refused("current"):
        fit_motion([path], HAMMER.replace("waveform", None))


def test_without_a_rebound_only_the_mass_is_found(tmp_path: Path) -> None:
    """The result states the reason."""
    path = shots.write(tmp_path / "shot.csv", HAMMER, end=0.52e-3)
    fit = fit_motion([path], HAMMER.replace("mass", 1.3 * MASS))
    assert list(fit.constants) == ["mass"]
    assert abs(fit["mass"].value - MASS) < 4.0 * fit["mass"].standard_error
    assert any("backstop damping cannot be fitted" in note for note in fit.remarks)


@pytest.mark.parametrize(("depth", "contacts"), [(60e-6, 1), (2.5e-6, 1), (1.5e-6, 1), (0.2e-6, 0)])
def test_a_hard_pack_that_hardly_yields_is_touched(depth: float, contacts: int) -> None:
    """A relay's pole yields by 2.7 um, near 0.5 % of the stroke: one bit decided whether it was touched."""
    relay = ph.load("relay-5v")
    assert relay.front is not None
    times = np.arange(0.0, 8e-3, 5e-6)
    places = np.where(times < 5e-3, relay.front * (times / 5e-3) ** 2, relay.front)
    places = np.where(times > 5e-3, relay.front + depth * np.sin(np.pi * (times - 5e-3) / 100e-6), places)
    away = np.clip((times - 5.1e-3) / 2e-3, 0.0, 1.0)
    places = np.where(times > 5.1e-3, relay.front * (1.0 - away), places)
    places += np.random.default_rng(3).normal(0.0, 0.2e-6, len(times))
    touches, _smooth, _clear = find_touches(times, places, 0.2e-6, relay)
    found = [touch for touch in touches if touch.surface == "pack"]
    assert len(found) == contacts
    for touch in found:
        assert times[touch.first] == pytest.approx(5e-3, abs=20e-6)
        assert times[touch.last] == pytest.approx(5.1e-3, abs=20e-6)
