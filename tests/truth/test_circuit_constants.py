"""Derivatives with respect to constants of the coil circuit, against differences of neighbouring runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.circuit_tangents import changed, deviations
from tests.constant_maps import constant_map
from tests.truth.test_circuit import TIGHT
from tests.truth.test_circuit_tangent import DRIVERS, PLAIN, TURN, WANTED, behind

import printhammer as ph
from printhammer.derivatives.states import tangent_map
from printhammer.drive.waveforms.drivers import Rail
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle

FIRINGS = {"period": 1.1e-3, "pulses": 2}


@pytest.mark.parametrize("name", DRIVERS)
def test_every_constant_of_a_device(name: str) -> None:
    """Coil, magnet, spring, contacts, driver and period: during a decay, and after the second firing."""
    drive = ph.PulseTrain(DRIVERS[name], **FIRINGS)
    for circuit, end in ((PLAIN, 2.7e-4), (TURN, 1.45e-3)):
        found = deviations(behind(circuit), drive, end)
        assert {"coil.resistance", "coil.inductance", "waveform.voltage", "waveform.width"} <= set(found)
        assert max(found.values()) < WANTED, found


@pytest.mark.parametrize(
    "waveform",
    [
        Rectangle(amplitude=20.0, width=2e-4, rise=2e-5, decay=3e-5, quantity="voltage"),
        Rectangle(amplitude=20.0, width=2e-4, rise=0.0, decay=0.0, quantity="voltage"),
        HalfSine(amplitude=25.0, width=3e-4, quantity="voltage"),
    ],
    ids=["smooth", "sharp", "half-sine"],
)
@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_an_ideal_source(waveform: Any, overlap: Any) -> None:
    drive = ph.PulseTrain(waveform, period=1.5e-4, pulses=2, overlap=overlap)
    names = ["coil.resistance", "coil.inductance", "period", "waveform.width", "mass", "backstop.position"]
    found = deviations(behind(PLAIN), drive, 4.1e-4, names)
    assert max(found.values()) < WANTED, found


@pytest.mark.slow
def test_a_held_armature_and_a_rigid_stop() -> None:
    """A rest in the backstop under a small current, and a rest on a rigid stop until the current lifts it."""
    names = [
        "coil.resistance",
        "coil.inductance",
        "waveform.voltage",
        "mass",
        "magnet.Am",
        "backstop.position",
    ]
    damped = behind(PLAIN).replace("damping", {"law": "viscous", "coefficient": 2.0})
    drive = ph.PulseTrain(Rail(voltage=0.6, width=6e-2), at=[0.0])
    assert max(deviations(damped, drive, 5e-2, names).values()) < WANTED
    # Past the decay, without current.
    assert max(deviations(damped, drive, 9e-2, names).values()) < WANTED
    place = damped.constants["backstop.position"].si
    rigid = behind(PLAIN).replace("backstop", {"law": "rigid", "position": place, "restitution": 0.4})
    found = deviations(rigid, ph.PulseTrain(DRIVERS["peak-and-hold"], period=3.1e-3, pulses=2), 3.4e-3, names)
    assert max(found.values()) < WANTED, found


def test_a_map_of_constants_whose_ends_move() -> None:
    """From firing to firing, with the period as the constant: both ends of the map depend on it."""
    hammer, names = behind(PLAIN), ["period"]
    drive = ph.PulseTrain(DRIVERS["capacitor"], period=1.1e-3, pulses=4)
    start, end = drive.times[1:3].tolist()
    state = tangent_map(hammer, drive, start, end, tolerance=TIGHT)
    found = constant_map(hammer, drive, start, end, names, tolerance=TIGHT)
    assert found.matrix.shape == (4, 1)
    whole = found.moving(state.matrix, 1.0, 2.0)[:, 0]
    begun = constant_map(hammer, drive, 0.0, start, names, tolerance=TIGHT)
    before = begun.moving(tangent_map(hammer, drive, 0.0, start, tolerance=TIGHT).matrix, 0.0, 1.0)[:, 0]
    through = constant_map(hammer, drive, 0.0, end, names, tolerance=TIGHT)
    both = through.moving(tangent_map(hammer, drive, 0.0, end, tolerance=TIGHT).matrix, 0.0, 2.0)[:, 0]
    assert whole + state.matrix @ before == pytest.approx(both, rel=1e-8)


def test_what_a_dot_is_sensitive_to() -> None:
    """Flight time, speed, force and losses of two dots with a chopper, against differences of tables."""
    hammer, drive = behind(PLAIN), ph.PulseTrain(DRIVERS["chopper"], **FIRINGS)
    names = ["coil.resistance", "waveform.voltage", "waveform.upper", "waveform.width", "pack.stiffness"]
    found = ph.sensitivities(hammer, drive, constants=names, duration=2.2e-3)
    assert found.smooth
    for k, name in enumerate(names):
        step = 1e-5 * found.values[k]
        tables = [
            ph.sensitivities(
                *changed(hammer, drive, name, float(found.values[k] + sign * step)),
                constants=["mass"],
                duration=2.2e-3,
            )
            for sign in (1.0, -1.0)
        ]
        dots = (tables[0].dots - tables[1].dots) / (2.0 * step)
        run = (tables[0].run - tables[1].run) / (2.0 * step)
        sizes = np.abs(found.dots / found.values[k])
        assert np.nanmax(np.abs(found.derivatives[..., k] - dots) / sizes) < 1e-5
        throughput = np.abs(found.run / found.values[k])
        assert np.abs(found.run_derivatives[:, k] - run)[throughput > 0.0].max() < 1e-5 * throughput.max()
