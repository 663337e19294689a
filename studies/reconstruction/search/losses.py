"""Losses of candidates: distances from the claims of the paper, continuous where possible.

A loss is 0 if the claim holds, and at most 1. Losses are computed in stages: expensive losses only for
candidates with small losses in the cheap stages; a loss that is not computed counts as 1. Losses only guide
the search: the verdicts are those of the claims, at the default tolerance.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.claims.context import TAIL
from printhammer.claims.judging import claims, rank_correlation
from printhammer.claims.pulses import half_rise
from printhammer.drive.trains import PulseTrain
from printhammer.hammer.equilibrium import holding_margin
from printhammer.run.ensemble import Ensemble, EnsembleResult
from studies.reconstruction.search.candidates import TOLERANCE
from studies.reconstruction.search.space import LOADING_EXPONENT, geometry

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.drive.trains import Drive
    from printhammer.support.arrays import FloatArray
    from studies.reconstruction.search.candidates import Candidate

Losses = dict[str, float]

_GRID: Final = 1e-6
_SETTLED: Final = 3.5e-3
_COARSE: Final = 4e-6
_RISE: Final = 0.1
"""Rank correlation between restitution and order of the touches above which the loss is 0."""

_STABLE: Final = 2.3
"""Largest stable step of the Runge-Kutta method, in oscillation time scales, with a safety margin."""

_STEP: Final = 10e-6
"""Step of the trial times between two pulses, s."""

_REACH: Final = 200e-6
"""Distance from the printed time at which a quench no longer reduces the loss, s."""

_CLEAR: Final = 0.06
"""Smallest overshoot of later pulses beyond the pack front, as a fraction of the distance to the pack."""

_CLEARLY: Final = 0.002
"""Smallest gap between a quenched pulse and the pack, as a fraction of the distance to the pack."""

_LATE: Final = 100e-6
"""Delay of the armature's rise after the second current at which the loss is largest, s."""

_SHORTER: Final = 25e-6
"""Shortfall of the flight-time gain of the second dot at which the loss is largest, s."""

_TAIL: Final = 1e-3
"""Time after the second of two pulses within which its displacement peak lies, s."""

CHUNK: Final = 64
_BURST_RATES: Final = 32
_SLOW_BURST: Final = 2000.0
"""Rate of the slowest simulated burst, Hz; hang-up is sought from the fastest burst downward."""

_PULSES: Final = 9


def hinge(excess: float, scale: float) -> float:
    """Compute the hinge loss excess / scale, clipped to the range 0 to 1; 1 if the excess is NaN."""
    if math.isnan(excess):
        return 1.0
    return min(max(excess / scale, 0.0), 1.0)


@dataclass
class Score:
    """Losses and measured values of a candidate."""

    losses: Losses = field(default_factory=dict)
    """Loss of each claim evaluated so far, by name."""
    measured: dict[str, Any] = field(default_factory=dict)
    """Values from which the losses were computed, for the log."""

    def total(self, weights: dict[str, float], step: float = 0.0) -> float:
        """Return the weighted sum of losses; an unknown loss counts as 1, a nonzero loss at least `step`."""
        return sum(
            weight * (step + (1.0 - step) * loss if (loss := self.losses.get(name, 1.0)) > 0.0 else 0.0)
            for name, weight in weights.items()
        )


def run_all(
    chosen: Sequence[Candidate], drives: Sequence[Drive], ends: Sequence[float], repeat: int, **wanted: Any
) -> EnsembleResult:
    """Run every candidate from rest under `repeat` drives each, in this thread."""
    hammers = [candidate.hammer for candidate in chosen for _ in range(repeat)]
    states = [candidate.state for candidate in chosen for _ in range(repeat)]
    return Ensemble(hammers, list(drives), ends, states=states, tolerance=TOLERANCE).run(threads=1, **wanted)


def statics(candidate: Candidate, score: Score) -> None:
    """Compute the losses of the static force: return from everywhere, release margin, 1983 time step."""
    place, hammer = geometry(), candidate.hammer
    held = holding_margin(hammer, np.linspace(place["b"], place["platen"], 48))
    magnet = candidate.constants["magnet.Am"] ** 2 / math.sqrt(place["b"]) - candidate.constants["magnet.F0"]
    least = float(held.min()) / magnet
    score.losses["return_from_everywhere"] = hinge(1e-3 - least, 0.2)
    share = float(held[0]) / magnet
    score.losses["release_margin"] = hinge(
        share - claims()["release_margin"].band["net_over_magnet_force"]["at_most"], 0.4
    )
    score.measured["margin"] = share
    # The schedule of 1983 is stable at rest in the backstop only if the backstop is soft enough for its
    # longest step.
    depth = geometry()["b"] - candidate.rest
    frequency = math.sqrt(1.5 * share * magnet / (depth * candidate.constants["mass"]))
    step = frequency * claims()["integrator_comparison"].settings["late_settle_step_s"]
    score.losses["integrator_comparison"] = hinge(step - _STABLE, _STABLE)
    score.measured["late_step"] = step


def single_pulse(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the losses of the single pulse: contacts with the pack, and settle-out."""
    for start in range(0, len(chosen), CHUNK):
        some, own = chosen[start : start + CHUNK], scores[start : start + CHUNK]
        drives = [PulseTrain(candidate.waveform) for candidate in some]
        times = np.arange(0.0, _SETTLED, _GRID)
        result = run_all(some, drives, [_SETTLED] * len(some), 1, times=times, dots=True)
        assert result.x is not None
        assert result.dots is not None
        for row, score in enumerate(own):
            _settling(result.x[row], score)
            score.losses["single_pulse_stroke"] = float(result.dots.extra_contacts[row, 0] != 0)
            flight, contact = (float(t[row, 0]) for t in (result.dots.flight_time, result.dots.contact_time))
            score.measured["flight_time"] = flight
            score.measured["leaving"] = None if math.isnan(contact) else flight + contact
            score.measured["force"] = float(result.dots.peak_force[row, 0])


def _settling(x: npt.NDArray[np.float32], score: Score) -> None:
    b = np.float32(geometry()["b"])
    stroke = geometry()["top"] - geometry()["b"]
    above = x > b
    peak = int(np.argmax(x))
    below = np.flatnonzero(~above[peak:])
    band = claims()["settle_out"].band
    if not below.size:
        for name in ("settle_out", "low_restitution", "backstop_force_dominates"):
            score.losses[name] = 1.0
        return
    touch = peak + int(below[0])
    later = x[touch:]
    highest = float(later.max() - b) / stroke
    up = np.flatnonzero(np.diff(above[touch:].astype(np.int8)) == 1) + 1
    down = np.flatnonzero(np.diff(above[touch:].astype(np.int8)) == -1) + 1
    count = min(len(up), len(down))
    heights = [float(later[up[k] : down[k]].max() - b) for k in range(count)]
    falls = all(after < before for before, after in itertools.pairwise(heights))
    wanted = band["rebounds"]["at_least"]
    score.measured |= {"first_touch": touch * _GRID, "highest": highest, "rebounds": count}
    _loudness(x, touch, score)
    ratios = [math.sqrt(after / before) for before, after in itertools.pairwise(heights) if before > 0.0]
    rise = rank_correlation(range(len(ratios)), ratios)
    score.losses["low_restitution"] = 1.0 if rise is None else hinge(_RISE - rise, 1.0)
    score.losses["settle_out"] = min(
        1.0,
        hinge(highest - band["largest_excursion_over_stroke"]["at_most"], 0.4)
        + 0.5 * hinge(wanted - count, wanted)
        + (0.0 if falls else 0.1),
    )


def _loudness(x: npt.NDArray[np.float32], touch: int, score: Score) -> None:
    """Compute the loss for the ratio of the largest acceleration in the backstop to that elsewhere."""
    size = np.abs(np.diff(x.astype(np.float64), 2))
    inside = x[1:-1] < np.float32(geometry()["b"])
    at_stop = inside & (np.arange(1, len(x) - 1) >= touch)
    ratio = float(size[at_stop].max(initial=0.0) / size[~at_stop].max())
    wanted = claims()["backstop_force_dominates"].band["force_ratio"]["at_least"]
    score.losses["backstop_force_dominates"] = hinge(wanted - ratio, wanted)
    score.measured["force_ratio"] = ratio


def _pair_gaps() -> tuple[FloatArray, int, int]:
    """Return trial times between two pulses, s, ascending, and the indices of the printed 660 and 700 us."""
    quenched = claims()["two_pulses_660us"].settings["interval_s"]
    caught = claims()["two_pulses_700us"].settings["interval_s"]
    slowest = 1.0 / claims()["second_dot_lost"].settings["first_rate_Hz"]
    early = quenched + np.arange(-16, round((caught - quenched) / _STEP)) * _STEP
    close = np.arange(caught, 1.3e-3, _STEP)
    return np.concatenate([early, close, np.arange(1.3e-3, slowest, 3.0 * _STEP)]), 16, len(early)


def pairs(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the losses of two pulses: quench, catch on the rise, and second dots at longer times."""
    gaps, quenched, caught = _pair_gaps()
    for start in range(0, len(chosen), CHUNK):
        some, own = chosen[start : start + CHUNK], scores[start : start + CHUNK]
        drives = [PulseTrain(candidate.waveform, at=[0.0, gap]) for candidate in some for gap in gaps]
        tails = np.full(len(gaps), _TAIL)
        # The excursion after the caught pulse has to be complete.
        tails[caught] = TAIL
        ends = np.tile(gaps + tails, len(some))
        half = half_times(some)
        moments = [np.array([gap + half[k]]) for k in range(len(some)) for gap in gaps]
        times = np.arange(0.0, float(ends.max()), _COARSE)
        result = run_all(some, drives, ends.tolist(), len(gaps), times=times, dots=True, strobes=moments)
        assert result.x is not None
        assert result.dots is not None
        assert result.strobes is not None
        shape = (len(some), len(gaps))
        x = result.x.reshape(*shape, len(times))
        force = result.dots.peak_force[:, 1].reshape(shape)
        flight = result.dots.flight_time.reshape(*shape, 2)
        speed = result.strobes.v[:, 0].reshape(shape)
        for k, score in enumerate(own):
            peaks = np.array([_peak_after(x[k, j], times, gap) for j, gap in enumerate(gaps)])
            _judge_quench(score, gaps, peaks, quenched)
            late = _late(x[k, caught], times, float(moments[k * len(gaps) + caught][0]))
            score.measured["rise_speed"] = float(speed[k, caught])
            struck_at = gaps[caught] + flight[k, caught, 1]
            score.measured["complete"] = bool(
                (x[k, caught][times > struck_at] <= np.float32(geometry()["b"])).any()
            )
            _judge_later(
                score,
                peaks[caught:],
                float(force[k, caught]),
                flight[k, caught],
                0.0 if speed[k, caught] > 0.0 else late,
            )


def half_times(some: Sequence[Candidate]) -> list[float]:
    """Return the time after the firing [s] at which each current first reaches half of its peak."""
    return [half_rise(candidate.waveform) for candidate in some]


def _peak_after(x: npt.NDArray[np.float32], times: FloatArray, gap: float) -> float:
    """Return the largest local maximum after the second firing, m; NaN without a maximum."""
    later = x[np.searchsorted(times, gap) :]
    later = later[np.isfinite(later)]
    tops = later[1:-1][(later[1:-1] >= later[:-2]) & (later[1:-1] > later[2:])]
    return float(tops.max()) if tops.size else math.nan


def _judge_quench(score: Score, gaps: FloatArray, peaks: FloatArray, place: int) -> None:
    """Compute the loss of the quench: distance in time of the nearest quenched second pulse."""
    front, way = geometry()["xp"], geometry()["xp"] - geometry()["b"]
    miss = (peaks - front) / way
    score.measured["quench"] = None if math.isnan(miss[place]) else float(miss[place])
    if math.isnan(miss[place]):
        score.losses["two_pulses_660us"] = 1.0
        return
    if miss[place] < -_CLEARLY:
        score.losses["two_pulses_660us"] = 0.0
        return
    lost = np.flatnonzero(miss < -_CLEARLY)
    nearest = float(np.abs(gaps[lost] - gaps[place]).min()) if lost.size else 2.0 * _REACH
    depth = hinge(float(np.nanmin(miss)) + _CLEARLY, 1.0)
    score.losses["two_pulses_660us"] = 0.2 + 0.4 * hinge(nearest, _REACH) + 0.2 * depth
    score.losses["two_pulses_660us"] += 0.2 * hinge(float(miss[place]) + _CLEARLY, 0.5)


def _late(x: npt.NDArray[np.float32], times: FloatArray, moment: float) -> float:
    """Return the delay [s] from a moment until the armature first rises; infinite if it never rises."""
    first = int(np.searchsorted(times, moment))
    up = np.flatnonzero(np.diff(x[first:]) > 0.0)
    return float(times[first + up[0]] - moment) + _COARSE if up.size else math.inf


def _judge_later(score: Score, peaks: FloatArray, force: float, flight: FloatArray, late: float) -> None:
    """Compute the losses of the second pulse caught on the rise, and of all later second pulses."""
    front, way = geometry()["xp"], geometry()["xp"] - geometry()["b"]
    # A second pulse without a displacement peak counts like a pulse whose armature stays in the backstop.
    miss = np.where(np.isnan(peaks), -1.0, (peaks - front) / way)
    band = claims()["two_pulses_700us"].band
    low, high = band["second_over_first_peak_force"]
    ratio = 0.0 if math.isnan(force) else float(force / score.measured["force"])
    gain = -math.inf if math.isnan(flight[1]) else float(flight[0] - flight[1])
    wanted = band["flight_time_gain_s"]["at_least"]
    score.losses["two_pulses_700us"] = min(
        1.0,
        0.5 * hinge(max(low - ratio, ratio - high), 0.3)
        + 0.4 * hinge(late, _LATE)
        + 0.3 * hinge(wanted - gain, _SHORTER)
        + (0.0 if score.measured["complete"] else 0.3),
    )
    # With a margin, since a dot lost between two trial times counts as well.
    score.losses["second_dot_lost"] = hinge(_CLEAR - float(miss.min()), _CLEAR + 0.5)
    score.measured |= {
        "ratio": ratio,
        "late": None if math.isinf(late) else late,
        "gain": None if math.isinf(gain) else gain,
        "gaps_lost": int(np.sum(miss <= 0.0)),
    }


def hung(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the losses of fast bursts: hang-up, and weak impacts while hung up."""
    settings = claims()["hang_up_at_high_rate"].settings
    top = claims()["weak_prints_when_hung_up"].band["largest_force_over_single"]["at_most"]
    must = claims()["hang_up_at_high_rate"].band["hang_up_rate_Hz"]["at_most"]
    b, xp = geometry()["b"], geometry()["xp"]
    for start in range(0, len(chosen), CHUNK):
        some, own = chosen[start : start + CHUNK], scores[start : start + CHUNK]
        plan = []
        for candidate in some:
            waveform = candidate.waveform
            limit = settings["current_limit_A"]
            fast = settings["last_rate_Hz"]
            while fast > must and _highest(PulseTrain(waveform, rate=fast, pulses=_PULSES)) > limit:
                fast -= 100.0
            plan.append(np.linspace(min(_SLOW_BURST, fast), fast, _BURST_RATES))
        drives = [
            PulseTrain(candidate.waveform, rate=float(rate), pulses=_PULSES)
            for candidate, rates in zip(some, plan, strict=True)
            for rate in rates
        ]
        ends = [float(drive.times[-1]) + 1e-3 for drive in drives]
        times = np.arange(0.0, max(ends), _COARSE)
        result = run_all(some, drives, ends, _BURST_RATES, times=times)
        assert result.x is not None
        for k, score in enumerate(own):
            free, strong = [], []
            for j in range(len(plan[k])):
                row = k * len(plan[k]) + j
                x = result.x[row]
                last = float(drives[row].times[-1])
                inside = np.flatnonzero(x > xp)
                out = np.flatnonzero(x[inside[0] :] < xp) if inside.size else inside
                left = times[inside[0] + out[0]] if out.size else math.inf
                between = (times > left) & (times < last)
                free.append(
                    bool(between.any() and (x[between] > b).all()) or (left >= last and inside.size > 0)
                )
                depth = _deepest_distinct(x, times, drives[row].times) - xp
                strong.append(max(depth / (geometry()["top"] - xp), 0.0) ** LOADING_EXPONENT)
            # From the fastest burst downward, as long as every burst hangs up.
            reach = len(free)
            while reach > 0 and free[reach - 1]:
                reach -= 1
            rates = plan[k]
            lowest = float(rates[reach]) if reach < len(rates) else 1.5 * float(rates[-1])
            score.losses["hang_up_at_high_rate"] = hinge(lowest - must, must)
            worst = max(strong[reach:], default=math.nan)
            score.losses["weak_prints_when_hung_up"] = hinge(worst - top + 0.03, 0.6)
            score.measured |= {"hang_up": lowest, "weak": None if math.isnan(worst) else worst}


def _deepest_distinct(x: npt.NDArray[np.float32], times: FloatArray, firings: FloatArray) -> float:
    """Return the largest displacement of distinct impacts after the first, m; 0 without such an impact."""
    inside = x > geometry()["xp"]
    starts = np.flatnonzero(inside[1:] & ~inside[:-1]) + 1
    if len(starts) < 2:
        return 0.0
    fired = np.searchsorted(firings, times[starts], side="right")
    distinct = np.diff(fired) <= 1
    return float(np.fmax.reduceat(x, starts)[1:][distinct].max(initial=0.0))


def _highest(drive: PulseTrain) -> float:
    """Return the approximate largest current [A] of a train from 400 samples."""
    return float(np.abs(drive.value(np.linspace(0.0, float(drive.times[-1]) + 1e-3, 400))).max())
