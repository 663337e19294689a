"""From rest to the first touch: a push, and its release before impact, so that the armature flies freely."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.impact_map import AHEAD, FREE
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Switched
from printhammer.errors import InputError
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble

if TYPE_CHECKING:
    from printhammer.control.feedback.driver import Driver
    from printhammer.control.feedback.impact_map import ForceMap
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal

_WIDTHS: Final = np.linspace(0.2, 1.0, 81)
_ALMOST: Final = 0.9
_WEAKER: Final = 0.03


@dataclass(frozen=True)
class Launch:
    """A start from rest.

    Attributes
    ----------
    width : float
        Of the push, s.
    flight : float
        From firing to touch, s.
    speed : float
        At the touch, m/s.
    place_slope, speed_slope : float
        By how much the displacement, m, and the speed, m/s, at the time of the touch grow with the currents,
        for currents twice as large.
    """

    width: float
    flight: float
    speed: float
    place_slope: float
    speed_slope: float


def launch(
    hammer: Hammer, driver: Driver, single: Nominal, forces: ForceMap, *, threads: int | None = None
) -> Launch:
    """Find the push from rest after which the touch alone prints almost the single-pulse force.

    The rest of the force comes from a short push into the pack, which can be measured out when the speed is
    known. Parameters as for `printhammer.control.feedback.soft_landing.landing`.

    Raises
    ------
    InputError
        No push does, with the current that there is.
    """
    widths = _WIDTHS * single.flight_time
    drives = [
        PulseSequence([Switched(at=(0.0, width), levels=(driver.current, 0.0), edge=driver.edge)], at=[0.0])
        for width in widths.tolist()
    ]
    result = Ensemble(hammer, drives, 4.0 * single.flight_time, tolerance=DISPLAY_TOLERANCE).run(
        dots=True, threads=threads
    )
    dots = result.dots
    assert dots is not None
    free = forces.kind == FREE
    off = int(np.argmin(np.abs(forces.back)))
    wanted = float(np.interp(_ALMOST, forces.force[free, off, 0], forces.speed[free]))
    speed, flight = dots.impact_speed[:, 0], dots.flight_time[:, 0]
    struck = result.ok & dots.struck[:, 0]
    if not struck.any() or not speed[struck].min() <= wanted <= speed[struck].max():
        raise InputError(
            f"{hammer.path}: no push of {driver.current:g} A from rest touches the pack at {wanted:.3g} m/s,"
            " expected a stronger driver"
        )
    order = np.argsort(speed[struck])
    width, time = (
        float(np.interp(wanted, speed[struck][order], values[struck][order])) for values in (widths, flight)
    )
    return Launch(width, time, wanted, *_slopes(hammer, driver, width, time - AHEAD, threads))


def _slopes(
    hammer: Hammer, driver: Driver, width: float, time: float, threads: int | None
) -> tuple[float, float]:
    """Return how displacement and speed at a time before the touch depend on the scale of the currents."""
    pulse = Switched(at=(0.0, width), levels=(driver.current, 0.0), edge=driver.edge)
    # Weaker, so that none of the two is at the pack by then.
    scales = np.array([1.0, 1.0 - _WEAKER])
    drives = [PulseSequence([pulse.scaled(scale)], at=[0.0]) for scale in scales.tolist()]
    states = (
        Ensemble(hammer, drives, time, tolerance=DISPLAY_TOLERANCE)
        .run(strobes=[np.array([time])] * len(drives), threads=threads)
        .strobes
    )
    assert states is not None
    place, speed = ((values[0, 0] - values[1, 0]) / _WEAKER for values in (states.x, states.v))
    return float(place), float(speed)
