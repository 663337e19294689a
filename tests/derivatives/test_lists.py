"""Derivatives through the kinks of list contacts against differences of runs."""

import numpy as np
import pytest

import printhammer as ph

QUANTITIES = ("flight_time", "impact_speed", "peak_force")
STEPS = ((1, 8.0), (-1, -8.0), (2, -1.0), (-2, 1.0))
"""Offsets and weights, times 12, of central differences: Abramowitz and Stegun (1964), table 25.2."""


def relay(law: str, stiffness: float, damping: float | None = None) -> ph.Hammer:
    """Armature with a contact between rest position and pole, and another contact behind the start."""
    hammer = ph.Hammer.build(1e-3).replace(
        {
            "spring": {"law": "preload", "preload": -0.5, "stiffness": 100.0},
            "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.3},
            "pack": {"law": "dashpot", "front": 0.5e-3, "stiffness": 1e6, "damping": 10.0},
            "waveform": {"shape": "half-sine", "amplitude": "3 N", "width": 1.5e-3},
            "force.weight": {"law": "gravity", "angle": "60 deg"},
            "contact.front": {"law": law, "side": "front", "position": 0.3e-3, "stiffness": stiffness},
            "contact.back": {"law": "linear", "side": "back", "position": 0.1e-3, "stiffness": 2e3},
        }
    )
    if damping is None:
        return hammer
    return hammer.replace({"contact.front.damping": damping, "contact.back.damping": 2.0 * damping})


def dots_of(hammer: ph.Hammer) -> np.ndarray:
    drive = ph.PulseTrain(hammer.waveform, period=3e-3, pulses=2)
    motion = ph.simulate(hammer, drive, tolerance=1e-14)
    return np.array([[getattr(dot, name) for name in QUANTITIES] for dot in motion.dots])


UNDAMPED = pytest.param(None, marks=pytest.mark.slow)
"""Kernels without damped contacts, which `tests/truth/test_lists_reference.py` runs as well."""


@pytest.mark.parametrize("damping", [UNDAMPED, 0.5])
@pytest.mark.parametrize(("law", "stiffness", "within"), [("linear", 3e3, 3e-8), ("hertz", 1e5, 3e-6)])
def test_sensitivities_follow_the_contacts(
    law: str, stiffness: float, within: float, damping: float | None
) -> None:
    """The columns use the steps of the run, which are less accurate at the touch of a Hertz contact."""
    hammer = relay(law, stiffness, damping)
    result = ph.sensitivities(hammer, ph.PulseTrain(hammer.waveform, period=3e-3, pulses=2), tolerance=1e-13)
    assert result.ok
    rows = [result.quantities.index(name) for name in QUANTITIES]
    for key in (
        "mass",
        "force.weight.angle",
        "contact.front.position",
        "contact.front.stiffness",
        "contact.back.position",
        "contact.back.stiffness",
        *(["contact.front.damping", "contact.back.damping"] if damping else []),
    ):
        value = hammer.constants[key].si
        step = 1e-4 * value
        moved = (weight * dots_of(hammer.replace(key, value + k * step)) for k, weight in STEPS)
        expected = sum(moved) / (12.0 * step)
        own = result.derivatives[:, rows, result.constants.index(key)]
        scale = np.abs(result.dots[:, rows]) / value
        assert np.abs((own - expected) / scale).max() < within, key


STOPPED = ("flight_time", "impact_speed", "net_loss", "return_time", "return_speed")
LOST = ("pack_loss", "damping_loss")


def between_stops(damping: float | None = None) -> ph.Hammer:
    """Armature with damping between two rigid stops, with a contact in front of the front stop."""
    hammer = relay("linear", 3e3, damping).replace("damping", {"law": "viscous", "coefficient": 0.05})
    return hammer.replace("pack", {"law": "rigid", "front": 0.5e-3, "restitution": 0.4})


def stopped_dots(hammer: ph.Hammer) -> tuple[np.ndarray, np.ndarray]:
    drive = ph.PulseTrain(hammer.waveform, period=3e-3, pulses=2)
    result = ph.sensitivities(hammer, drive, tolerance=1e-14, constants=["mass"])
    rows = [result.quantities.index(name) for name in STOPPED]
    return result.dots[:, rows], np.array([result.run[result.run_quantities.index(name)] for name in LOST])


@pytest.mark.parametrize("damping", [UNDAMPED, 0.5])
def test_sensitivities_between_two_rigid_stops(damping: float | None) -> None:
    hammer = between_stops(damping)
    result = ph.sensitivities(hammer, ph.PulseTrain(hammer.waveform, period=3e-3, pulses=2), tolerance=1e-13)
    assert result.ok
    rows = [result.quantities.index(name) for name in STOPPED]
    losses = [result.run_quantities.index(name) for name in LOST]
    own_keys = (
        ["contact.front.damping", "contact.front.position", "contact.back.stiffness"] if damping else []
    )
    for key in (
        "mass",
        "pack.front",
        "pack.restitution",
        "backstop.restitution",
        "damping.coefficient",
        *own_keys,
    ):
        value = hammer.constants[key].si
        step = 1e-4 * value
        moved = [(weight, *stopped_dots(hammer.replace(key, value + k * step))) for k, weight in STEPS]
        expected = sum(weight * dots for weight, dots, _loss in moved) / (12.0 * step)
        column = result.constants.index(key)
        scale = np.abs(result.dots[:, rows]) / value
        assert np.isfinite(expected).all()
        assert np.abs((result.derivatives[:, rows, column] - expected) / scale).max() < 1e-7, key
        lost = sum(weight * one for weight, _dots, one in moved) / (12.0 * step)
        own = result.run_derivatives[losses, column]
        assert (np.abs(own - lost) < 1e-6 * result.run[losses] / value).all(), key


def test_quantities_that_a_rigid_front_does_not_have() -> None:
    hammer = between_stops(0.5)
    result = ph.sensitivities(hammer, ph.PulseTrain(hammer.waveform))
    for name in ("peak_force", "contact_time"):
        assert np.isnan(result.derivatives[:, result.quantities.index(name)]).all()
