"""Losses of the panels of Fig. 11: deviation from the printed classifications, from short trains.

A classification changes abruptly, the loss does not. If a train settles that should be strange, the loss is
larger the sooner the train settles. If a train does not settle that should be periodic, the orbit of the
printed period is found by Newton's method, and the loss grows with the multiplier of this orbit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos.strobe.verdict import repeats
from printhammer.claims.judging import claims
from printhammer.claims.verdicts import printed_verdicts
from printhammer.drive.trains import PulseTrain
from printhammer.run.ensemble import Ensemble
from studies.reconstruction.search.candidates import TOLERANCE
from studies.reconstruction.search.losses import CHUNK, Score, hinge, run_all
from studies.reconstruction.search.space import geometry

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.support.arrays import FloatArray
    from studies.reconstruction.search.candidates import Candidate

FIRINGS: Final = 360
"""Number of firings of each panel in the search; the claims use more."""

HARD: Final = (1.35e-3, 1.2e-3, 1.1e-3, 0.9e-3)
"""Strobe times, s, of the panels that the fewest hammers reproduce; these panels are evaluated first."""

_WORST_HARD: Final = 2.6
"""Sum of the losses of the hard panels above which the other panels are not evaluated."""

PATIENT: Final = 2000
"""Number of firings within which a periodic panel settles, as in the claim."""

_PROMISING: Final = 7
"""Number of correct panels from which strange panels are simulated for longer, since many settle late."""

_POINTS: Final = 200
"""Number of points of a panel whose successive distances are compared."""

_AGREE: Final = 1e-8
"""Distance, in half-widths of the window, below which a train counts as settled."""

_LAST: Final = 40
_LONGEST: Final = 16
_ROUNDS: Final = 6
_NUDGE: Final = 1e-6
"""Finite-difference step of the derivative of the strobe map, in half-widths of the window."""

_FOUND: Final = 1e-6
_REPELS: Final = 30.0
"""Multiplier of a periodic orbit above which its loss is largest."""


def panels(chosen: Sequence[Candidate], scores: Sequence[Score]) -> None:
    """Compute the losses of the panels of Fig. 11 and of their window, the hard panels first."""
    printed = printed_verdicts()
    hard = [period for period in printed if round(period, 9) in HARD]
    rest = [period for period in printed if period not in hard]
    for start in range(0, len(chosen), CHUNK):
        some, own = chosen[start : start + CHUNK], scores[start : start + CHUNK]
        losses: list[dict[float, float]] = [{} for _ in some]
        names: list[dict[float, str]] = [{} for _ in some]
        shares: list[list[float]] = [[] for _ in some]
        ratios: list[dict[float, float]] = [{} for _ in some]
        open_ = list(range(len(some)))
        for periods in (hard, rest):
            if open_:
                looked_at = _looked_at([some[k] for k in open_], periods)
                for k, (loss, name, share, ratio) in zip(open_, looked_at, strict=True):
                    losses[k] |= dict(zip(periods, loss, strict=True))
                    names[k] |= dict(zip(periods, name, strict=True))
                    shares[k] += share
                    ratios[k] |= dict(zip(periods, ratio, strict=True))
            open_ = [k for k in open_ if sum(losses[k].values()) <= _WORST_HARD]
        for k in open_:
            if sum(names[k][period] == wanted for period, wanted in printed.items()) >= _PROMISING:
                _wait(some[k], losses[k], names[k])
        for k, score in enumerate(own):
            score.losses["poincare"] = sum(losses[k].get(period, 1.0) for period in printed) / len(printed)
            if len(losses[k]) == len(printed):
                score.losses["poincare_window"] = hinge(_least_share() - min(shares[k]), _least_share())
                score.losses["successive_points_apart"] = _successive(ratios[k])
            score.measured |= {
                "panels": sum(names[k].get(period) == wanted for period, wanted in printed.items()),
                "verdicts": [names[k].get(period, "") for period in printed],
                "least_share": min(shares[k]),
            }


def _wait(candidate: Candidate, losses: dict[float, float], names: dict[float, str]) -> None:
    """Simulate panels correctly found strange for longer; replace the losses of panels that settle late."""
    periods = [
        period for period, wanted in printed_verdicts().items() if names[period] == wanted == "strange"
    ]
    if periods:
        ((loss, name, _share, _ratio),) = _looked_at([candidate], periods, PATIENT)
        losses |= dict(zip(periods, loss, strict=True))
        names |= dict(zip(periods, name, strict=True))


def _successive(ratios: dict[float, float]) -> float:
    """Compute the loss for the distance of successive points in the panels that should be strange."""
    claim = claims()["successive_points_apart"]
    wanted = claim.settings["least_ratio"]
    strange = sorted(
        (ratios[period] for period, name in printed_verdicts().items() if name == "strange"), reverse=True
    )
    return hinge(wanted - strange[claim.band["panels_apart"]["at_least"] - 1], wanted)


def _ratio(states: FloatArray) -> float:
    """Return the median distance of successive points over that of all pairs; 0 for equal points."""
    from scipy.spatial.distance import pdist

    points = states[:_POINTS, :2] / _scales()[:2]
    pairs = float(np.median(pdist(points)))
    return float(np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))) / pairs if pairs > 0.0 else 0.0


def _looked_at(
    some: Sequence[Candidate], periods: Sequence[float], firings: int = FIRINGS
) -> list[tuple[list[float], list[str], list[float], list[float]]]:
    """Simulate panels; return each candidate's losses, classifications, fractions in window, and ratios."""
    printed = printed_verdicts()
    drives = [
        PulseTrain(candidate.waveform, period=period, pulses=firings + 1)
        for candidate in some
        for period in periods
    ]
    ends = [period * firings for _ in some for period in periods]
    table = run_all(some, drives, ends, len(periods), strobes="firings").strobes
    assert table is not None
    wandering: list[tuple[int, int, int, FloatArray]] = []
    looked_at: list[tuple[list[float], list[str], list[float], list[float]]] = []
    for k in range(len(some)):
        losses, names, shares, ratios = [], [], [], []
        for j, period in enumerate(periods):
            row = k * len(periods) + j
            states = np.column_stack([table.x[row], table.v[row], table.memory[row]])[:firings]
            branch = np.where(states[:, 0] > geometry()["xp"], table.branch[row, :firings], 0)
            shares.append(_share(states))
            ratios.append(_ratio(states))
            loss, name, wanted = _panel(states, branch, printed[period])
            losses.append(loss)
            names.append(name)
            if wanted:
                wandering.append((k, j, wanted, _closest(states, wanted)))
        looked_at.append((losses, names, shares, ratios))
    for (k, j, _q, _state), multiplier in zip(wandering, _multipliers(some, periods, wandering), strict=True):
        looked_at[k][0][j] = 1.0 if math.isnan(multiplier) else _repelled(multiplier)
    return looked_at


def _repelled(multiplier: float) -> float:
    """Return the loss of a panel whose periodic orbit exists, with a given multiplier, but is not reached."""
    if multiplier <= 1.0:
        # The orbit attracts nearby states, but not the train from rest.
        return 0.3
    return 0.4 + 0.5 * min(math.log(multiplier) / math.log(_REPELS), 1.0)


def _scales() -> FloatArray:
    settings = claims()["poincare_window"].settings
    width, speed = np.ptp(settings["window_x_m"]) / 2.0, np.ptp(settings["window_v_m_per_s"]) / 2.0
    return np.array([width, speed, width])


def _least_share() -> float:
    return float(claims()["poincare_window"].band["least_share_inside"]["at_least"])


def _share(states: FloatArray) -> float:
    """Return the fraction of the strobe points inside the window of Fig. 11."""
    settings = claims()["poincare_window"].settings
    (left, right), (low, high) = settings["window_x_m"], settings["window_v_m_per_s"]
    x, v = states[: settings["points"], 0], states[: settings["points"], 1]
    return float(((x >= left) & (x <= right) & (v >= low) & (v <= high)).mean())


def _panel(states: FloatArray, branch: npt.NDArray[np.int64], printed: str) -> tuple[float, str, int]:
    """Classify a short train; return loss, classification, and the period of an orbit to find.

    The period is 0 unless the loss depends on an orbit to which the train does not settle.
    """
    scales = _scales()
    late = repeats(states[-_LAST:], branch[-_LAST:], scales, _LONGEST)
    early = repeats(states[-2 * _LAST : -_LAST], branch[-2 * _LAST : -_LAST], scales, _LONGEST)
    now = np.where(np.isfinite(late), np.maximum(late, 1e-12), 10.0)
    before = np.where(np.isfinite(early), np.maximum(early, 1e-12), 10.0)
    near = np.flatnonzero((now < 1e-6) | ((now < 0.3 * before) & (now < 1e-2)))
    name = f"period-{near[0] + 1}" if near.size else "strange"
    if name == printed:
        return 0.0, name, 0
    if printed == "strange":
        return 0.4 + 0.6 * _haste(states, scales, int(near[0]) + 1), name, 0
    period = int(printed.rpartition("-")[2])
    if name == "period-1" and period == 2:
        # The sooner the train settles, the farther it is from a period doubling.
        return 0.5 + 0.5 * _haste(states, scales, 1), name, 0
    return 1.0, name, period


def _haste(states: FloatArray, scales: FloatArray, period: int) -> float:
    """Return a measure of how soon states a period apart agree: 1 for at once, 0 for never."""
    apart = np.abs((states[period:] - states[:-period]) / scales).max(axis=1)
    agree = np.flatnonzero(apart < _AGREE)
    count = int(agree[0]) + 1 if agree.size else len(states)
    return 1.0 - math.log(count) / math.log(len(states))


def _closest(states: FloatArray, period: int) -> FloatArray:
    """Return displacement [m] and velocity [m/s] where the train came closest to repeating."""
    apart = np.abs((states[period:, :2] - states[:-period, :2]) / _scales()[:2]).max(axis=1)
    return np.asarray(states[int(np.nanargmin(apart)), :2] if np.isfinite(apart).any() else states[0, :2])


def _multipliers(
    some: Sequence[Candidate], periods: Sequence[float], wandering: Sequence[tuple[int, int, int, FloatArray]]
) -> list[float]:
    """Compute the largest absolute multiplier of each orbit; NaN for an orbit that is not found.

    Newton's method is applied to the strobe map, with finite-difference derivatives, from the states in
    `wandering`. The remainder of the current at the next firing is neglected, which has no visible effect at
    these periods.
    """
    if not wandering:
        return []
    scales = _scales()[:2]
    states = np.array([state for *_, state in wandering])
    found = np.full(len(wandering), math.nan)
    open_ = np.arange(len(wandering))
    for _ in range(_ROUNDS):
        if not open_.size:
            break
        starts = np.repeat(states[open_], 3, axis=0)
        starts[1::3, 0] += _NUDGE * scales[0]
        starts[2::3, 1] += _NUDGE * scales[1]
        ends = _after(some, periods, [wandering[int(i)] for i in open_], starts)
        kept = []
        for n, i in enumerate(open_):
            here = ends[3 * n : 3 * n + 3] / scales
            slope = np.column_stack([here[1] - here[0], here[2] - here[0]]) / _NUDGE
            miss = here[0] - states[i] / scales
            if not np.isfinite(here).all():
                continue
            if np.abs(miss).max() < _FOUND:
                found[i] = float(np.abs(np.linalg.eigvals(slope)).max())
                continue
            try:
                change = np.linalg.solve(np.eye(2) - slope, miss)
            except np.linalg.LinAlgError:
                continue
            change *= min(1.0, 0.3 / float(np.abs(change).max()))
            states[i] += change * scales
            kept.append(i)
        open_ = np.array(kept, dtype=np.int64)
    return found.tolist()


def _after(
    some: Sequence[Candidate],
    periods: Sequence[float],
    wanted: Sequence[tuple[int, int, int, FloatArray]],
    starts: FloatArray,
) -> FloatArray:
    """Compute displacement and velocity after one period of each orbit, from three initial states each."""
    hammers, drives, ends = [], [], []
    for k, j, period, _state in wanted:
        train = PulseTrain(some[k].waveform, period=periods[j], pulses=period)
        hammers += [some[k].hammer] * 3
        drives += [train] * 3
        ends += [period * periods[j]] * 3
    options: dict[str, Any] = {"threads": 1, "strobes": [np.array([end]) for end in ends]}
    states = np.ascontiguousarray(starts)
    table = Ensemble(hammers, drives, ends, states=states, tolerance=TOLERANCE).run(**options).strobes
    assert table is not None
    return np.column_stack([table.x[:, 0], table.v[:, 0]])
