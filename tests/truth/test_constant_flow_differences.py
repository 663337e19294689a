"""The tangent flow of constants against differences of runs, for all kinds of parts and drives.

Central differences of runs of tolerance 1e-13, extrapolated after Richardson, touches faster than 1 mm/s.
"""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from tests import hammers
from tests.hammers import Draw, crude, interpreted
from tests.moved import WANTED, far_off, quantities, quantity_differences
from tests.tangents import before_slow_touches
from tests.truth.test_tangent_finite_differences import CASES, MOVING, drive_of, hammer_of

import printhammer as ph
from printhammer.derivatives.parameters import parameter_names, parameters
from printhammer.hammer.equilibrium import rest_state

LATER = 20e-6


@pytest.mark.parametrize("end", [0.3e-3, 0.33e-3, 0.4e-3, 0.5e-3, 0.56e-3, 0.8e-3, 1.5e-3])
def test_a_single_pulse(end: float) -> None:
    """The end lies in flight, in the pack on both branches, in the backstop, or between rebounds."""
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform)
    rest = rest_state(hammer), 0.0
    assert far_off(hammer, drive, parameter_names(hammer, drive), end, rest) == []


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: "-".join(word or "none" for word in case[:5]))
def test_parts_and_drives(case: tuple[str, str, str, str, str, float, float], tmp_path: Path) -> None:
    magnet, spring, pack, backstop, name, _start, end = case
    hammer = hammer_of(magnet, spring, pack, backstop, tmp_path)
    drive = drive_of(magnet, name)
    with interpreted():
        assert before_slow_touches(hammer, drive, end, MOVING) == end
        names = parameter_names(hammer, drive)
        if name == "sharp":
            names = [constant for constant in names if constant not in ("waveform.rise", "waveform.decay")]
        # At a firing the state has a kink in the time of that firing; a little later it has none.
        fired = bool(np.isclose(drive.times, end, rtol=1e-9).any())
        kinks = [constant for constant in names if fired and constant in ("period", "rate")]
        smooth = [constant for constant in names if constant not in kinks]
        assert far_off(hammer, drive, smooth, end, MOVING) == []
        if kinks:
            assert before_slow_touches(hammer, drive, end + LATER, MOVING) == end + LATER
            assert far_off(hammer, drive, kinks, end + LATER, MOVING) == []


@pytest.mark.parametrize(
    ("case", "constant"),
    [
        (3, "pack.damping"),
        (4, "pack.front"),
        (4, "period"),
        (6, "backstop.relaxation_time"),
        (6, "waveform.amplitude"),
        (7, "waveform.fall"),
        (8, "waveform.width"),
        (9, "backstop.restitution"),
        (9, "backstop.position"),
        (13, "backstop.damping"),
        (13, "waveform.frequency"),
    ],
)
def test_some_parts_and_drives(case: int, constant: str, tmp_path: Path) -> None:
    """Constants specific to each part; the slow test covers every constant of every case."""
    magnet, spring, pack, backstop, name, _start, end = CASES[case]
    with interpreted():
        hammer, drive = hammer_of(magnet, spring, pack, backstop, tmp_path), drive_of(magnet, name)
        assert far_off(hammer, drive, [constant], end, MOVING) == []


def compare_quantities(
    hammer: ph.Hammer, drive: ph.PulseTrain, duration: float, state: object = None
) -> None:
    """Compare all sensitivities of dots and run with differences of runs."""
    found = ph.sensitivities(hammer, drive, duration=duration, state=state, tolerance=1e-13)
    assert found.ok
    assert found.smooth
    typical = quantities(hammer, drive, duration, state)
    sizes = np.where(np.isfinite(typical) & (typical != 0.0), np.abs(typical), 1.0)
    for k, name in enumerate(found.constants):
        (parameter,) = parameters(hammer, drive, [name])
        mine = np.concatenate([found.derivatives[..., k].ravel(), found.run_derivatives[:, k]])
        mine = np.nan_to_num(mine * parameter.scale) / sizes
        error = np.full(mine.shape, np.inf)
        for how in ((1e-5, 2), (4e-5, 3), (4e-4, 3)):
            truth = quantity_differences(hammer, drive, name, duration, state, *how, typical) / sizes
            error = np.minimum(error, np.abs(mine - truth) / np.maximum(np.abs(truth), 0.1))
            if error.max() < WANTED:
                break
        assert error.max() < WANTED, name


def test_quantities_of_two_dots() -> None:
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform, period=1.5e-3, pulses=2)
    compare_quantities(hammer, drive, 3e-3)


def test_quantities_with_firing_times_of_their_own() -> None:
    """Two pulses, of which the second quenches; its time is a constant."""
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform, at=[0.1e-3, 1.2e-3])
    found = ph.sensitivities(hammer, drive, duration=2.5e-3)
    assert found.constants[-1] == "firing.1"
    compare_quantities(hammer, drive, 2.5e-3)


PARTS = [
    ("", "preload", "dashpot-pull", "elastomer-pull", "trapezoid"),
    ("inverse-root", "linear", "power", "rigid", "single"),
    ("", "linear", "power", "hertz-no-pull", "half-sine"),
    ("", "linear", "curve", "elastomer", "sampled"),
]
# Many touches, and laws that other slow tests have compiled: machine code is faster, even so.
COMPILED = PARTS[0]


@pytest.mark.slow
@pytest.mark.parametrize("case", PARTS, ids=lambda case: "-".join(word or "none" for word in case))
def test_quantities_with_other_parts(case: tuple[str, str, str, str, str], tmp_path: Path) -> None:
    """From an initial state; including energies of released backstops and impacts on rigid backstops."""
    magnet, spring, pack, backstop, name = case
    hammer = hammer_of(magnet, spring, pack, backstop, tmp_path)
    drive = drive_of(magnet, name)
    state = hammers.STOP + 20e-6, 0.3
    with nullcontext() if case == COMPILED else interpreted():
        end = before_slow_touches(hammer, drive, 0.9e-3, state)
        compare_quantities(hammer, drive, end, state)


@pytest.mark.slow
def test_random_hammers() -> None:
    """From rest states, which also depend on the constants."""
    draw = Draw(np.random.default_rng(5), spread=0.1)
    struck = 0
    while struck < 6:
        hammer = draw()
        drive = ph.PulseTrain(hammer.waveform, period=draw.rng.uniform(1.2e-3, 1.6e-3), pulses=2)
        end = before_slow_touches(hammer, drive, 2.4e-3)
        compare_quantities(hammer, drive, end)
        struck += ph.simulate(hammer, drive, duration=end, points=2).dots[0].struck
