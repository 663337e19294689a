"""Losses for the frequency-time map of Figs. 8 and 9: an erratic band between two regular ranges of rates."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.claims.bursts import erratic_pairs, erratic_share, rates_of
from printhammer.claims.judging import claims, spread
from printhammer.drive.trains import PulseTrain
from printhammer.maps.frequency import TAIL
from studies.reconstruction.search.losses import hinge, run_all

if TYPE_CHECKING:
    from collections.abc import Sequence

    from studies.reconstruction.search.candidates import Candidate
    from studies.reconstruction.search.losses import Score

_GRID: Final = 10.0
"""Step of the rates, Hz; twice that of the claim."""

_SPACING: Final = 20e-6
"""Sampling interval of a displacement record, s."""


def sensitivity(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the loss for the sensitivity of the record to the rate, in the erratic band over low rates."""
    settings = claims()["map_sensitivity"].settings
    wanted = claims()["map_sensitivity"].band["erratic_over_low"]["at_least"]
    onset = claims()["order_of_onset"].settings["flight_time_spread_s"]
    for candidate, score in zip(chosen, scores, strict=True):
        slower = np.arange(settings["first_rate_Hz"], score.measured["hang_up"], _GRID)
        rates = np.stack([slower, slower + settings["rate_step_Hz"]], axis=1).ravel().tolist()
        drives = [PulseTrain(candidate.waveform, rate=rate, pulses=settings["pulses"]) for rate in rates]
        ends = np.repeat([drive.times[-1] + TAIL for drive in drives[::2]], 2)
        times = np.arange(0.0, ends[0], _SPACING)
        result = run_all([candidate], drives, ends.tolist(), len(drives), times=times, dots=True)
        assert result.x is not None
        assert result.dots is not None
        changes = (np.diff(result.x.reshape(len(slower), 2, -1).astype(np.float64), axis=1)[:, 0]) ** 2
        varies = np.array(
            [
                spread(flights[struck].tolist()) > onset if np.count_nonzero(struck) > 1 else False
                for flights, struck in zip(result.dots.flight_time[::2], result.dots.struck[::2], strict=True)
            ]
        )
        ratio = math.nan
        if varies.any() and (slower < settings["low_rate_Hz"]).any():
            low = float(np.nanmean(changes[slower < settings["low_rate_Hz"]]))
            erratic = float(np.nanmean(changes[int(np.argmax(varies)) :]))
            ratio = math.sqrt(erratic / low) if low > 0.0 else math.nan
        score.losses["map_sensitivity"] = (
            1.0 if ratio == 0.0 else hinge(math.log(wanted / ratio), math.log(wanted))
        )
        score.measured["sensitivity"] = None if math.isnan(ratio) else ratio


def region(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the loss for the fraction of neighbouring rates between which a late dot changes."""
    claim = claims()["chaotic_region"]
    wanted = claim.band["erratic_share"]["at_least"]
    rates = rates_of(claim.settings)
    for candidate, score in zip(chosen, scores, strict=True):
        drives = [
            PulseTrain(candidate.waveform, rate=rate, pulses=claim.settings["pulses"]) for rate in rates
        ]
        ends = [float(drive.times[-1]) + TAIL for drive in drives]
        dots = run_all([candidate], drives, ends, len(drives), dots=True).dots
        assert dots is not None
        erratic, varies = erratic_pairs(dots.struck, dots.flight_time, claim.settings)
        share, _ = erratic_share(np.array(rates), erratic, varies, score.measured["hang_up"])
        score.losses["chaotic_region"] = hinge(wanted - (share or 0.0), wanted)
        score.measured["erratic_share"] = share
