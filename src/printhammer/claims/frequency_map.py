"""The claim about the frequency-time map, Figs. 8 and 9: how fast the response changes with rate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.claims.bursts import hang_up_range, onsets
from printhammer.claims.context import Context, NotMeasurableError
from printhammer.claims.judging import WHOLE, Measured, measures
from printhammer.drive.trains import PulseTrain
from printhammer.maps.frequency import TAIL

if TYPE_CHECKING:
    from printhammer.claims.definition import Claim

_SPACING: Final = 10e-6
"""Time between samples of a displacement record, s."""


def sensitivity(context: Context, band: tuple[float, float], grid: float, step: float, pulses: int) -> float:
    """Return the root-mean-square change of the displacement record per hertz, m/Hz, in a band of rates.

    Each of the slower rates, `grid` apart, is compared with that `step` above it, Hz, in bursts of some
    pulses: at the same times, from the first firing to 1 ms after the last one at the slower rate.

    Raises
    ------
    NotMeasurableError
        The band is narrower than a step, or a run ended early.
    """
    low, high = band
    slower = low + grid * np.arange(math.floor((high - step - low) / grid * (1.0 + 1e-12)) + 1)
    if not len(slower):
        raise NotMeasurableError(f"From {low:.6g} to {high:.6g} Hz there are no two rates to compare")
    ends = np.repeat((pulses - 1) / slower + TAIL, 2)
    times = np.arange(0.0, ends[0], _SPACING)
    drives = [
        PulseTrain(context.waveform, rate=rate, pulses=pulses)
        for rate in np.stack([slower, slower + step], axis=1).ravel().tolist()
    ]
    result = context.ensemble(drives, ends, times=times)
    assert result.x is not None
    change = (result.x[1::2].astype(np.float64) - result.x[::2]) / step
    # Beyond the end of a record there is nothing.
    return float(np.sqrt(np.nanmean(change**2)))


@measures("map_sensitivity", *WHOLE)
def map_sensitivity(context: Context, claim: Claim) -> Measured:
    """Change of the displacement record per hertz below, in and above the erratic band."""
    settings = claim.settings
    first = context.once("onsets", lambda: onsets(context)).get("flight_time")
    hung, _, highest = context.once("hang-up", lambda: hang_up_range(context))
    bands: dict[str, tuple[float | None, float | None]] = {
        "low": (settings["first_rate_Hz"], settings["low_rate_Hz"]),
        "erratic": (first, hung),
        "hung_up": (hung, highest),
    }
    known = {name: (low, high) for name, (low, high) in bands.items() if low is not None and high is not None}
    grid, pulses = settings["rate_grid_Hz"], settings["pulses"]
    changes, coarse = (
        {name: sensitivity(context, band, grid, step, pulses) for name, band in known.items()}
        for step in (settings["rate_step_Hz"], settings["coarse_step_Hz"])
    )
    value: dict[str, Any] = {
        "erratic_over_low": _ratio(changes, "low"),
        "erratic_over_hung_up": _ratio(changes, "hung_up"),
        "low_m_per_Hz": changes.get("low"),
        "erratic_m_per_Hz": changes.get("erratic"),
        "hung_up_m_per_Hz": changes.get("hung_up"),
        "erratic_over_low_coarse": _ratio(coarse, "low"),
        "erratic_over_hung_up_coarse": _ratio(coarse, "hung_up"),
        "erratic_from_Hz": first,
        "hang_up_rate_Hz": hung,
    }
    if first is None or hung is None:
        missing = "Flight times do not vary" if first is None else "The armature does not hang up"
        return Measured(value, f"{missing} at any rate looked at: the erratic band has no end.")
    texts = {name: f"{change * 1e6:.3g} um" for name, change in changes.items()}
    fine, whole = settings["rate_step_Hz"], settings["coarse_step_Hz"]
    return Measured(
        value,
        f"Per hertz, taken over {fine:g} Hz, the record changes by {texts['low']} from"
        f" {bands['low'][0]:.0f} to"
        f" {bands['low'][1]:.0f} Hz, {texts['erratic']} from {first:.0f} to {hung:.0f} Hz, and"
        f" {texts['hung_up']} from there to {highest:.0f} Hz; taken over {whole:g} Hz, the ratios are"
        f" {value['erratic_over_low_coarse']:.2g} and {value['erratic_over_hung_up_coarse']:.2g}.",
    )


def _ratio(changes: dict[str, float], name: str) -> float | None:
    return changes["erratic"] / changes[name] if "erratic" in changes and changes.get(name) else None
