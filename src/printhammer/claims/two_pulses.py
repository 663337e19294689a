"""Claims about two pulses, Fig. 6: quench, and the hammer caught on the rise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from printhammer.claims.context import TAIL, Context
from printhammer.claims.judging import WHOLE, Measured, measures
from printhammer.printing.dots.settling import touches

if TYPE_CHECKING:
    from printhammer.claims.definition import Claim
    from printhammer.drive.waveforms.shapes import Waveform


@measures("two_pulses_660us", *WHOLE)
def two_pulses_660us(context: Context, claim: Claim) -> Measured:
    """Peak after the second of two pulses."""
    _ = context.dot
    interval = claim.settings["interval_s"]
    motion = context.pulses([0.0, interval], interval + TAIL)
    peak = motion.peak_after(1)
    _, x, v = motion.strobe
    value = {
        "peak_minus_pack_front_m": None if peak is None else peak[1] - context.front,
        "peak_after_firing_m": None if peak is None else peak[1],
        "position_at_firing_m": float(x[1]),
        "velocity_at_firing_m_per_s": float(v[1]),
    }
    after = "no peak follows" if peak is None else f"the peak after it is {peak[1] * 1e6:.1f} um"
    return Measured(
        value,
        f"Fired again at {x[1] * 1e6:.1f} um with {v[1]:+.3f} m/s: {after}, the pack at"
        f" {context.front * 1e6:.1f} um.",
    )


@measures("two_pulses_700us", *WHOLE)
def two_pulses_700us(context: Context, claim: Claim) -> Measured:
    """Force, flight time and phase of the second of two pulses."""
    interval = claim.settings["interval_s"]
    motion = context.pulses([0.0, interval], interval + TAIL)
    first, second = context.dot, motion.dots[1]
    _, x, v = motion.strobe
    back = [
        c for c in touches(motion) if second.flight_time and c.t_in > second.fired_at + second.flight_time
    ]
    ratio = second.peak_force / context.print_force if second.peak_force is not None else None
    gain = None
    if first.flight_time is not None and second.flight_time is not None:
        gain = first.flight_time - second.flight_time
    value = {
        "second_over_first_peak_force": ratio,
        "second_excursion_complete": second.struck and bool(back),
        "velocity_at_half_current_m_per_s": float(motion.at(interval + half_rise(context.waveform))[1][0]),
        "flight_time_gain_s": gain,
        "position_at_firing_m": float(x[1]),
        "velocity_at_firing_m_per_s": float(v[1]),
    }
    speed = value["velocity_at_half_current_m_per_s"]
    if ratio is None or gain is None:
        return Measured(
            value,
            f"The second pulse prints no dot; at half its current the armature moves at {speed:+.3f} m/s.",
        )
    return Measured(
        value,
        f"The second dot has {ratio:.3f} of the force of the first and flies {gain * 1e6:.1f} us shorter;"
        f" at half its current the armature moves at {speed:+.3f} m/s.",
    )


def half_rise(waveform: Waveform) -> float:
    """Return the time after the firing at which a waveform first reaches half its peak, s."""
    half = 0.5 * waveform.peak
    start, end = 0.0, waveform.support
    for _ in range(5):
        tau = np.linspace(start, end, 2001)
        there = int(np.argmax(np.abs(waveform.value(tau)) >= half))
        if there == 0:
            return float(tau[0])
        start, end = float(tau[there - 1]), float(tau[there])
    return end
