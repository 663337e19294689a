"""The magnetic circuit fitted to forces and inductances: known constants, and a published solenoid."""

from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.errors import InputError
from printhammer.parts.magnet.reluctance import ReluctanceMagnet, magnet_force, magnet_linkage

PUBLISHED = Path(ph.__file__).parent / "identify" / "static" / "pot-magnet.csv"
MADE = {
    "pole_area": 4e-5,
    "residual_gap": 2e-4,
    "fringe_perimeter": 2.2e-2,
    "fringe_height": 3e-3,
    "core_reluctance": 4e5,
    "saturation_flux": 1.2e-4,
    "leakage": 2e-2,
    "leakage_reach": 1.5e-2,
}


def write_table(path: Path, rows: list[tuple[float, float]]) -> Path:
    """Write what a circuit of 900 turns shows at gaps [m] and currents [A]."""
    c = ReluctanceMagnet(turns=900.0, closed_at=0.0, **MADE).packed(0.0)
    lines = ["gap [mm],current [mA],force [N],linkage [mWb]"]
    lines += [
        f"{1e3 * g!r},{1e3 * i!r},{magnet_force(c, -g, i)!r},{1e3 * magnet_linkage(c, -g, i)!r}"
        for g, i in rows
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_what_made_a_table_is_found(tmp_path: Path) -> None:
    rows = [(float(g), i) for g in np.geomspace(1e-4, 5e-3, 12) for i in (0.3, 1.2)]
    fit = ph.fit("solenoid", write_table(tmp_path / "made.csv", rows), turns=900.0)
    for name, value in MADE.items():
        assert fit[f"magnet.{name}"].value == pytest.approx(value, rel=1e-5)


def test_a_published_solenoid() -> None:
    fit = ph.fit("solenoid", PUBLISHED, turns=957.0, current=1.2)
    force, linkage = np.abs(fit.residuals).reshape(2, -1)
    # The field computation itself scatters by a percent: between 1.75 and 2.25 mm its force has a step.
    assert np.sqrt(np.mean(force**2)) < 0.01
    assert force.max() < 0.025
    assert np.sqrt(np.mean(linkage**2)) < 0.0025
    assert 'law = "reluctance"' in fit.fragment()


@pytest.mark.parametrize(("seed", "noise"), [(1, 0.01), pytest.param(0, 0.0, marks=pytest.mark.slow)])
def test_a_plain_plunger_without_fringe_and_saturation(tmp_path: Path, seed: int, noise: float) -> None:
    """L = mu0 N^2 A / (g + g0) + Lo, F = i^2/2 mu0 N^2 A / (g + g0)^2, with 60 mm^2, 0.12 mm and 8 mH."""
    gap = np.linspace(0.25e-3, 3e-3, 12)
    scale = 4e-7 * np.pi * 600.0**2 * 60e-6
    force, inductance = 0.5 * 0.8**2 * scale / (gap + 0.12e-3) ** 2, scale / (gap + 0.12e-3) + 8e-3
    rng = np.random.default_rng(seed)
    shown = [values * (1.0 + noise * rng.standard_normal(12)) for values in (inductance, force)]
    rows = zip(1e3 * gap, 1e3 * shown[0], shown[1], strict=True)
    path = tmp_path / f"plain{seed}.csv"
    lines = [f"{g:.6g},{length:.6g},{pull:.6g}" for g, length, pull in rows]
    path.write_text("\n".join(["gap [mm],inductance [mH],force [N]", *lines]) + "\n", encoding="utf-8")
    fit = ph.fit("solenoid", path, turns=600.0, current=0.8)
    for name, value in (("pole_area", 60e-6), ("residual_gap", 0.12e-3), ("leakage", 8e-3)):
        constant = fit[f"magnet.{name}"]
        close = max(1e-3 * value, 4.0 * constant.standard_error)
        assert abs(constant.value - value) < close < 0.2 * value
    held = [key for key, each in fit.constants.items() if each.held]
    assert {"magnet.fringe_height", "magnet.core_reluctance"} <= set(held)
    assert 'status = "assumed"' in fit.fragment()


def test_forces_in_a_wrong_unit_are_named_by_their_factor(tmp_path: Path) -> None:
    gap = np.linspace(0.25, 3.0, 12)
    slope = 4e-7 * np.pi * 600.0**2 * 60e-6 * 1e3
    rows = [f"{g},{1e3 * slope / (g + 0.12) + 8},{0.5e3 * slope * 0.64 / (g + 0.12) ** 2}" for g in gap]
    path = tmp_path / "small.csv"
    path.write_text("\n".join(["gap [mm],inductance [mH],force [mN]", *rows]) + "\n", encoding="utf-8")
    with refused("force") as caught:
        ph.fit("solenoid", path, turns=600.0, current=0.8)
    assert caught.value.value == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "options", "sentence"),
    [
        ("gap [mm],force [N]\n1,2\n", {"current": 1.0}, "neither 'inductance' nor 'linkage'"),
        (
            "gap [mm],force [N],inductance [H]\n1,2,1\n",
            {},
            "the column 'current' is missing: expected this column, or one",
        ),
        (
            "gap [mm],force [N],inductance [H]\n1,-2,1\n",
            {"current": 1.0},
            "line 2: the force is -2: expected",
        ),
        (
            "gap [mm],force [N],inductance [H]\n-1,2,1\n",
            {"current": 1.0},
            "line 2: gap -0.001 m: expected 0 or",
        ),
        ("gap [mm],force [N],inductance [H]\n1,2,1\n", {"current": 1.0}, "too few for the constants of the"),
        ("gap [mm],force [N],inductance [H]\n1,2,1\n", {"turns": 0.0}, "turns = 0: expected more than 0"),
    ],
)
def test_a_table_that_tells_too_little_is_refused(
    tmp_path: Path, text: str, options: dict[str, float], sentence: str
) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        ph.fit("solenoid", path, **{"turns": 100.0, **options})
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)
