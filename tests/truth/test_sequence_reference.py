"""Sequences of different pulses, against the reference and differences, and against equal trains."""

import functools
from typing import Any

import numpy as np
import pytest
from tests.hammers import compare, crude
from tests.moved import far_off
from tests.tangents import before_slow_touches, deviation
from tests.truth.test_constant_flow_differences import compare_quantities

import printhammer as ph
from printhammer.derivatives.parameters import parameter_names
from printhammer.drive.waveforms.shapes import Chain, HalfSine, Rectangle, Sampled, Trapezoid, Waveform
from printhammer.hammer.equilibrium import rest_state
from printhammer.run.ensemble_group import closed_form

BOUND = 1e-8
"""Largest error at the default tolerance before the horizon, of the stroke."""
WANTED = 1e-6
END = 4e-3
MIXED = ["shapes", "a record"]


def pulse(amplitude: float, width: float) -> Rectangle:
    """A rectangle with the time constants of the crude hammer's waveform."""
    own: Any = crude().waveform
    return Rectangle(amplitude=amplitude, width=width, rise=own.rise, decay=own.decay)


def cases() -> dict[str, tuple[list[Waveform], list[float]]]:
    half = HalfSine(amplitude=0.35, width=2e-3)
    slope = Trapezoid(amplitude=0.7, rise=1e-4, width=2e-4, fall=3e-4)
    record = Sampled.from_samples([0.0, 2e-4, 4e-4, 6e-4], [0.0, 0.8, 0.7, 0.0])
    brake = Chain(parts=((0.0, pulse(0.93, 3.5e-4)), (1.6e-3, pulse(0.3, 2e-4))))
    return {
        "widths and amplitudes": ([pulse(0.93, 3.5e-4), pulse(0.85, 4.5e-4)], [0.0, 2.2e-3]),
        "a long pulse outlives two": (
            [pulse(0.5, 1e-3), pulse(0.5, 2e-4), pulse(0.4, 2e-4), pulse(0.93, 3.5e-4)],
            [0.0, 0.1e-3, 0.35e-3, 2.5e-3],
        ),
        "shapes": ([half, slope, pulse(0.9, 3.5e-4)], [0.0, 0.3e-3, 2.3e-3]),
        "a brake pulse": ([brake, pulse(0.93, 3.5e-4)], [0.0, 2.2e-3]),
        "a record": ([record, pulse(0.93, 3.5e-4), record.scaled(0.9)], [0.0, 1e-3, 2.5e-3]),
    }


def drive_of(case: str, overlap: Any = "add") -> ph.PulseSequence:
    return ph.PulseSequence(*cases()[case], overlap)


@functools.cache
def truth_of(case: str, overlap: Any) -> Any:
    return compare(crude(), drive_of(case, overlap), END)


@pytest.mark.parametrize("overlap", ["add", "replace"])
@pytest.mark.parametrize("case", cases())
def test_a_run_against_the_reference(case: str, overlap: Any) -> None:
    found = truth_of(case, overlap)
    assert found.motion.ok
    assert found.horizon > drive_of(case, overlap).times[-1]
    assert found.error < BOUND
    assert found.touches("pack")[0] == pytest.approx(found.touches("pack")[1], abs=1e-10)


def check_ensemble(names: list[str], engine: Any, overlap: Any) -> None:
    hammer = crude()
    assert hammer.front is not None
    assert hammer.position is not None
    truths = [truth_of(name, overlap) for name in names]
    drives = [drive_of(name, overlap) for name in names]
    times = [truth.truth.t for truth in truths]
    result = ph.Ensemble(hammer, drives, END).run(strobes=times, dots=True, engine=engine)
    assert result.ok.all()
    assert result.strobes is not None
    assert result.dots is not None
    for i, truth in enumerate(truths):
        before = truth.truth.t <= truth.horizon
        apart = np.abs(result.strobes.x[i] - truth.truth.x)[before] / (hammer.front - hammer.position)
        assert apart.max() < BOUND, names[i]
        touched = truth.touches("pack")[1]
        assert touched
        fired = np.searchsorted(drives[i].times, touched, side="right") - 1
        for firing in set(fired.tolist()):
            touch = result.dots.fired_at[i, firing] + result.dots.flight_time[i, firing]
            assert touch == pytest.approx(touched[fired.tolist().index(firing)], abs=1e-10)


@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_an_ensemble_against_the_reference(overlap: Any) -> None:
    check_ensemble(list(cases()), "plain", overlap)


@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_lanes_against_the_reference(overlap: Any) -> None:
    names = [name for name in cases() if name not in MIXED]
    assert all(closed_form(drive_of(name).kernel_arrays()[2])[1] == (2, False, False) for name in names)
    check_ensemble(names, "lanes", overlap)


@pytest.mark.slow
def test_lanes_of_mixed_shapes_against_the_reference() -> None:
    kinds = [closed_form(drive_of(name).kernel_arrays()[2])[1] for name in MIXED]
    assert kinds == [(2, True, True), (2, True, False)]
    check_ensemble(MIXED[:1], "lanes", "add")


@pytest.mark.parametrize("overlap", ["add", "replace"])
@pytest.mark.parametrize("engine", ["plain", "lanes"])
def test_equal_waveforms_do_to_the_bit_what_the_train_does(engine: Any, overlap: Any) -> None:
    hammer = crude()
    w: Any = hammer.waveform
    pairs = []
    for rate in (500.0, 1100.0, 2600.0):
        train = ph.PulseTrain(w, rate=rate, pulses=6, overlap=overlap)
        pairs.append((train, ph.PulseSequence([w, w.model_copy()] * 3, train.times, overlap)))
    grid = np.linspace(0.0, 6e-3, 101)
    both = [
        ph.Ensemble(hammer, list(drives), 8e-3).run(dots=True, strobes=[grid] * 3, engine=engine)
        for drives in zip(*pairs, strict=True)
    ]
    assert both[0].strobes is not None
    assert both[1].strobes is not None
    assert both[0].dots is not None
    assert both[1].dots is not None
    np.testing.assert_array_equal(both[0].strobes.x, both[1].strobes.x)
    np.testing.assert_array_equal(both[0].strobes.v, both[1].strobes.v)
    np.testing.assert_array_equal(both[0].dots.flight_time, both[1].dots.flight_time)
    np.testing.assert_array_equal(both[0].dots.peak_force, both[1].dots.peak_force)
    motions = [ph.simulate(hammer, drive, duration=8e-3, ledger=True) for drive in pairs[1]]
    np.testing.assert_array_equal(motions[0].at(grid), motions[1].at(grid))
    assert motions[0].contacts == motions[1].contacts
    assert motions[0].energy == motions[1].energy


def test_a_member_does_not_depend_on_its_company() -> None:
    rng = np.random.default_rng(6)
    hammer = crude()
    some = [pulse(float(a), float(w)) for a, w in rng.uniform([0.7, 2.5e-4], [1.0, 4.5e-4], (4, 2))]
    drives = [
        ph.PulseSequence([some[k] for k in rng.integers(0, 4, 6)], np.arange(6) / rate)
        for rate in rng.uniform(400.0, 1600.0, 40)
    ]
    ends = [float(drive.times[-1]) + 2e-3 for drive in drives]
    together = ph.Ensemble(hammer, drives, ends).run(dots=True, engine="lanes").dots
    assert together is not None
    for i in (0, 17, 39):
        alone = ph.Ensemble(hammer, [drives[i]], ends[i]).run(dots=True, engine="lanes").dots
        assert alone is not None
        np.testing.assert_array_equal(alone.flight_time[0], together.flight_time[i])
        np.testing.assert_array_equal(alone.peak_force[0], together.peak_force[i])


@pytest.mark.parametrize("case", cases())
def test_the_ledger_closes(case: str) -> None:
    motion = ph.simulate(crude(), drive_of(case), duration=END)
    assert abs(motion.energy.residual) < 1e-8 * motion.energy.throughput


@pytest.mark.parametrize("overlap", ["add", "replace"])
@pytest.mark.parametrize("scheme", ["trapezoid", "runge-kutta-4"])
def test_the_schemes_of_1983_see_the_same_drive(scheme: Any, overlap: Any) -> None:
    drive = drive_of("a long pulse outlives two", overlap)
    hammer = crude()
    assert hammer.front is not None
    assert hammer.position is not None
    # Up to the pack, which their steps of contact do not resolve; one pulse has ended, another goes on.
    until = 0.36e-3
    exact, old = (
        ph.simulate(hammer, drive, duration=until, **options)
        for options in ({}, {"scheme": scheme, "step_scale": 0.1})
    )
    t = np.linspace(0.0, until, 61)
    apart = np.abs(exact.at(t)[0] - old.at(t)[0]).max() / (hammer.front - hammer.position)
    assert apart < 5e-4


@pytest.mark.parametrize("case", ["widths and amplitudes", "a long pulse outlives two", "a brake pulse"])
@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_the_tangent_flow_against_differences(case: str, overlap: Any) -> None:
    hammer, drive = crude(), drive_of(case, overlap)
    end = before_slow_touches(hammer, drive, 1.55e-3)
    assert end > 1e-3
    assert deviation(hammer, drive, 0.0, end, size=1e-5) < WANTED


@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_the_flow_of_constants_against_differences(overlap: Any) -> None:
    hammer, drive = crude(), drive_of("a long pulse outlives two", overlap)
    rest = rest_state(hammer), 0.0
    end = before_slow_touches(hammer, drive, 1.2e-3)
    assert end > 0.9e-3
    names = ["mass", "magnet.F0", "pack.front", "firing.1", "firing.2"]
    assert set(names) <= set(parameter_names(hammer, drive))
    assert far_off(hammer, drive, names, end, rest) == []


@pytest.mark.slow
def test_quantities_of_two_different_dots() -> None:
    drive = ph.PulseSequence([pulse(0.93, 3.5e-4), pulse(0.9, 3.7e-4)], [0.0, 1.5e-3])
    compare_quantities(crude(), drive, 3e-3)
