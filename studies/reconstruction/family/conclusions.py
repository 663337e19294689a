"""Conclusions: quantities that an engineer would compute with the model of a hammer, each with its unit.

The constants of the hammer of the paper are not known. Comparing the conclusions over a family of hammers
shows which conclusions do not depend on the unknown constants.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from printhammer.chaos.strobe.scan import scan
from printhammer.claims import Context
from printhammer.claims.context import NotMeasurableError
from printhammer.claims.judging import claims, spread
from printhammer.drive.trains import PulseTrain
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.printing.dots.settling import SETTLED, rebounds
from printhammer.printing.rates.safe_rate import safe_rate
from printhammer.results import Declared, scalar
from printhammer.results.declare import columns_of

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

ONSET_STEP: Final = 5e-6  # Step of the strobe times over which the onset of chaos is searched, s

GRID: Final = (100, 3000, 5)  # First rate, last rate and step of the grid for the safe rate, Hz

RATES: Final = (500, 1250, 5)
"""First rate, last rate and step of the grid of bursts, Hz: from independent dots to the erratic band."""

_AT_ONCE: Final = 40


class Conclusions(Declared):
    """Conclusions about one hammer; None for a value that does not exist. Field names end with the unit."""

    safe_rate_Hz: float | None = scalar(
        "Hz",
        "highest rate up to which the dots of every pattern of eight slots agree with the single-pulse dot to"
        " 10 % in force and to 50 us in flight time, on a grid of 5 Hz",
        name="safe rate",
    )
    chaos_onset_s: float | None = scalar(
        "s",
        "longest strobe time at which the train is strange, on a grid of 5 us, searched downward from 3 ms",
        name="chaos onset",
    )
    flight_time_spread_s: float = scalar(
        "s",
        "largest difference of flight times within a burst of nine pulses, over rates from 500 to 1250 Hz on"
        " a grid of 5 Hz",
        more="lost dots are excluded",
        name="flight-time spread",
    )
    engraved_limit_Hz: float | None = scalar(
        "Hz",
        "lowest rate at which the flight-time spread exceeds 30 us, the tolerance of engraved characters",
        name="spread exceeds 30 us from",
    )
    dot_matrix_limit_Hz: float | None = scalar(
        "Hz",
        "lowest rate at which the flight-time spread exceeds 200 us, the tolerance of dot-matrix printing",
        name="spread exceeds 200 us from",
    )
    energy_per_dot_J: float = scalar(
        "J", "work of the coil on the armature in the cycle of a single pulse", name="energy per dot"
    )
    pack_loss_J: float = scalar(
        "J", "energy absorbed by the pack in the cycle of a single pulse", name="pack loss"
    )
    backstop_loss_J: float = scalar(
        "J", "energy absorbed by the backstop in the cycle of a single pulse", name="backstop loss"
    )
    settle_out_s: float = scalar(
        "s",
        "time from the firing of a single pulse to the end of the last rebound higher than a hundredth of the"
        " stroke",
        name="settle-out",
    )
    print_force_N: float = scalar(
        "N",
        "peak force of the single-pulse dot",
        more="sets the common scale of mass and forces, which does not affect the motion",
        name="print force",
    )

    def as_dict(self) -> dict[str, Any]:
        """Return the values by name, for JSON."""
        return asdict(self)


QUANTITIES: Final = columns_of(Conclusions)
"""Declarations of the conclusions by field name in `Conclusions`: `unit`, `meaning`, and a short `name`."""


def conclude(hammer: Hammer, context: Context | None = None) -> Conclusions:
    """Compute the conclusions about a hammer with magnet, pack, backstop and waveform; `context` caches runs.

    Raises
    ------
    NotMeasurableError
        The single pulse does not print, or does not return to the backstop; or a run ended early.
    """
    shared = Context(hammer) if context is None else context
    force = shared.print_force
    largest, limits = flight_times(shared)
    energy = shared.single.energy
    return Conclusions(
        safe_rate_Hz=rate_from_rest(shared),
        chaos_onset_s=chaos_onset(shared),
        flight_time_spread_s=largest,
        engraved_limit_Hz=limits["engraved_s"],
        dot_matrix_limit_Hz=limits["dot_matrix_s"],
        energy_per_dot_J=energy.coil_work,
        pack_loss_J=energy.pack_loss,
        backstop_loss_J=energy.backstop_loss,
        settle_out_s=settle_out(shared),
        print_force_N=force,
    )


def rate_from_rest(context: Context) -> float | None:
    """Return the rate [Hz] up to which all patterns of eight slots from rest are within limits, or None.

    Raises
    ------
    NotMeasurableError
        The single pulse does not print.
    """
    force, flight = context.print_force, context.dot.flight_time
    assert flight is not None
    first, last, step = GRID
    rate = safe_rate(
        context.hammer,
        nominal=SinglePulse(force, flight),
        first=first,
        last=last,
        step=step,
        long=False,
        tolerance=context.tolerance,
    ).rate
    return None if math.isnan(rate) else rate


def settle_out(context: Context) -> float:
    """Return the time [s] at which the last rebound higher than `SETTLED` times the stroke ends.

    Raises
    ------
    NotMeasurableError
        No rebound is that high, or the last such rebound does not end within the run.
    """
    limit = SETTLED * context.stroke
    ends = [bounce.end for bounce in rebounds(context.single, context.position) if bounce.height > limit]
    if not ends:
        raise NotMeasurableError("The armature does not rebound from the backstop after a single pulse")
    return ends[-1] - float(context.single.drive.times[0])


def chaos_onset(context: Context) -> float | None:
    """Return the longest strobe time [s] at which a train is classified strange, or None."""
    settings = claims()["no_period_doubling_cascade"].settings
    first, last = settings["first_strobe_time_s"], settings["last_strobe_time_s"]
    # Rounded so that the strobe times are short decimal numbers.
    periods: list[float] = [
        round(first - ONSET_STEP * k, 12) for k in range(round((first - last) / ONSET_STEP) + 1)
    ]
    for start in range(0, len(periods), _AT_ONCE):
        some = periods[start : start + _AT_ONCE]
        for period, verdict in zip(
            some, scan(context.hammer, some, tolerance=context.tolerance), strict=True
        ):
            if verdict.strange:
                return period
    return None


def flight_times(context: Context) -> tuple[float, dict[str, float | None]]:
    """Return the largest flight-time spread of bursts [s] and the lowest rates [Hz] that exceed the limits.

    The spread of a burst is the peak-to-peak difference of the flight times of its struck dots. The rates are
    given for the limits "engraved_s" and "dot_matrix_s" of the claim `flight_time_spread`; None if the spread
    never exceeds the limit.

    Raises
    ------
    NotMeasurableError
        A run ended early.
    """
    settings = claims()["flight_time_spread"].settings
    rates = [float(rate) for rate in range(RATES[0], RATES[1] + 1, RATES[2])]
    dots = context.dots(
        [PulseTrain(context.waveform, rate=rate, pulses=settings["pulses"]) for rate in rates]
    )
    spreads = [
        spread(times[struck].tolist()) if struck.any() else 0.0
        for times, struck in zip(dots.flight_time, dots.struck, strict=True)
    ]
    limits = {
        name: next((rate for rate, wide in zip(rates, spreads, strict=True) if wide > settings[name]), None)
        for name in ("engraved_s", "dot_matrix_s")
    }
    return float(max(spreads)), limits
