"""From rest to the first touch: a push, and its release before impact, so that the armature flies freely."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.impact_map import AHEAD, FREE, ForceMap
from printhammer.drive.sequence import PulseSequence
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.control.feedback.plant import Plant

# Widths of pushes that are tried, in flight times of the single pulse
_WIDTHS: Final = np.linspace(0.2, 1.0, 81)
_LENGTH: Final = 4.0  # Length of their runs, likewise
_ALMOST: Final = 0.9  # Force that the touch alone is to print, in parts of that of the single pulse
_WEAKER: Final = 0.03  # Change of the scale of the currents from which derivatives are taken


@dataclass(frozen=True)
class Launch:
    """A start from rest."""

    width: float  # Of the push, s
    flight: float  # From firing to touch, s
    speed: float  # At the touch, m/s
    # By how much the displacement, m, and the speed, m/s, at the time of the touch grow with the
    # currents, for currents twice as large
    place_slope: float
    speed_slope: float


def launch(plant: Plant, forces: ForceMap) -> Launch:
    """Find the push from rest after which the touch alone prints almost the single-pulse force.

    The rest of the force comes from a short push into the pack, which can be measured out when the speed is
    known.

    Raises
    ------
    InputError
        No push does, with the current that there is.
    """
    driver, scale = plant.driver, plant.single.flight_time
    widths = _WIDTHS * scale
    pushes = [PulseSequence([driver.push(width)], at=[0.0]) for width in widths.tolist()]
    ok, dots, _ = plant.run(pushes, _LENGTH * scale)
    free = forces.kind == FREE
    wanted = float(np.interp(_ALMOST, forces.force[free, forces.off, 0], forces.speed[free]))
    speed, flight = dots.impact_speed[:, 0], dots.flight_time[:, 0]
    struck = ok & dots.struck[:, 0]
    if not struck.any() or not speed[struck].min() <= wanted <= speed[struck].max():
        raise InputError(
            f"{plant.hammer.path}: no push of {driver.current:g} A from rest touches the pack at {wanted:.3g}"
            " m/s, expected a stronger driver"
        )
    order = np.argsort(speed[struck])
    width, time = (
        float(np.interp(wanted, speed[struck][order], values[struck][order])) for values in (widths, flight)
    )
    # How displacement and speed before the touch depend on the scale of the currents: weaker, so that the
    # armature is not at the pack by then.
    pulse, before = driver.push(width), time - AHEAD
    drives = [PulseSequence([pulse.scaled(factor)], at=[0.0]) for factor in (1.0, 1.0 - _WEAKER)]
    _, _, states = plant.run(drives, before, strobes=[np.array([before])] * 2)
    place, faster = ((values[0, 0] - values[1, 0]) / _WEAKER for values in (states.x, states.v))
    return Launch(width, time, wanted, float(place), float(faster))
