"""The learning law: gains that are designed once, on simulated hammers, and then only applied.

After stage s the corrections u of the entries become

    u(s+1) = Q u(s) + L(s) e(s),    Q = 1 - forgetting,

where e(s) holds the deviations that the sensor has shown: of the ladder, on the mean of all runs so far, and
of the line, on the mean of the runs of this stage and of the one before. That is iterative learning control
of higher order, from run to run. L(s) = -G+ K(s): K(s) is the linear estimate, least in the mean square, of
all deviations of force and arrival from what the sensor shows, over hammers drawn from the stated
variability; G is the sensitivity of the deviations to the entries, of the nominal hammer, and G+ its
regularised inverse. The noise of a mean falls with the number of its runs, and the gains follow, as in
stochastic learning control (S. S. Saab, IEEE Trans. Autom. Control 46 (2001) 877).

Convergence: corrections that differ come together, or at least not apart, where no eigenvalue of Q + L(s) G
is beyond 1 in absolute value, L(s) being the columns for the line of the stage, and G the sensitivity of what
the sensor shows of it. `Stage.contraction` is the largest one on the nominal hammer; a gain for which it were
above 1 is halved until it is not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.learning.lines import LADDER, LINE, REPEATED, Press
from printhammer.printing.dots.slots import LEAD_IN, cycle_with_lead_in, slots_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.control.learning.sensor import ImpactSensor
    from printhammer.control.learning.settings import Adjustable
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import BoolArray, FloatArray

RUNS: Final = (1, 1, 2, 4, 8, 24)  # Number of runs of each stage
GATE: Final = 3.0  # Deviation, in parts of the limits, beyond which a reading counts as this
_DAMPING: Final = 1e-3  # Of the inverse of G: mean square of deviations, in parts of the limits, per `STEP`
_RIDGE: Final = 1e-3  # Of the estimate, in squares of the limits
PRINTED: Final = slots_of(cycle_with_lead_in())
"""Slots of the cycle on which tables are judged."""


@dataclass(frozen=True)
class Stage:
    """What is done after the runs of a stage, from its features (features,)."""

    runs: int
    gain: FloatArray  # L(s), shape (inputs, features)
    contraction: float
    estimate: FloatArray  # K(s), shape (deviations, features)
    # What K(s) estimates of each simulated hammer (members, deviations), and which share of the dots is then
    # within limits more than in an open loop (members,)
    seen: FloatArray
    edge: FloatArray


@dataclass(frozen=True)
class LearningLaw:
    """What a learner knows: the nominal hammer, and what to do with what it is shown. Nothing of a unit."""

    entries: Adjustable
    force: bool
    forgetting: float
    # Share of the simulated hammers most like the unit that may print fewer dots with the table than in an
    # open loop
    doubt: float
    ladder: tuple[FloatArray, FloatArray]  # Flight times, s, and forces that are expected, (widths,)
    stages: tuple[Stage, ...]

    def deviations(self, time: FloatArray, force: FloatArray | None, expected: Any) -> FloatArray:
        """Return what readings are off from what is expected, in parts of the limits; NaN if unseen."""
        limits = self.entries.task.limits
        off = [(time - expected[0]) / limits.arrival]
        if self.force and force is not None:
            off.append((force - expected[1]) / limits.force)
        return np.asarray(np.clip(np.stack(off), -GATE, GATE))


def features(ladder: FloatArray, lines: Sequence[FloatArray]) -> FloatArray:
    """Return the features of a stage: ladder, line of the stage, and line of the one before.

    Arrays are (..., measured, dots), NaN where nothing was seen; that counts as no deviation.
    """
    used = [ladder, *lines[:-3:-1]]
    flat = [np.nan_to_num(np.reshape(each, (*each.shape[:-2], -1))) for each in used]
    return np.concatenate(flat, axis=-1)


def sensitivity(press: Press, entries: Adjustable, hammer: Hammer) -> FloatArray:
    """Return the change of the deviations of a line with each input, per `STEP`, (2, dots, inputs)."""
    count = entries.inputs.shape[1]
    rows = [np.zeros(count), *np.eye(count)]
    off = Press(press.task, press.rate, [hammer] * len(rows)).deviations(
        [entries.settings(row) for row in rows]
    )
    return np.asarray(np.nan_to_num(np.moveaxis(off[1:] - off[0], 0, -1)))


def design(
    press: Press,
    entries: Adjustable,
    sensor: ImpactSensor,
    *,
    forgetting: float,
    doubt: float,
    seed: int,
    report: Callable[[], None],
) -> LearningLaw:
    """Design the gains on a press of simulated hammers, with a sensor of white noise."""
    rng = np.random.default_rng(seed)
    measured = 1 if sensor.force is None else 2
    limits, nominal = press.task.limits, press.task.hammers[0]
    noise = np.array([sensor.noise / limits.arrival, (sensor.force or 0.0) / limits.force])[:measured, None]

    def shown(true: FloatArray, count: float) -> FloatArray:
        noisy = true[:, :measured] + noise / np.sqrt(count) * rng.standard_normal(true[:, :measured].shape)
        return np.asarray(np.clip(noisy, -GATE, GATE))

    whole = sensitivity(press, entries, nominal)
    slopes = whole.reshape(-1, whole.shape[2])
    inverse = np.linalg.solve(slopes.T @ slopes + _DAMPING * len(LINE) * np.eye(slopes.shape[1]), slopes.T)
    expected = tuple(rung[0] for rung in Press(press.task, press.rate, [nominal]).ladder())
    rungs = [
        (each - own) / limit
        for each, own, limit in zip(press.ladder(), expected, (limits.arrival, limits.force), strict=True)
    ]
    ladder, seen_ladder, runs_so_far = np.stack(rungs, axis=1), np.zeros((1, 1, 1)), 0
    members = len(press.hammers)
    corrections = np.zeros((members, entries.inputs.shape[1]))
    now = [entries.open_loop] * members
    plain = _good(press, now)
    uncorrected = press.deviations([entries.settings(row) for row in corrections])
    lines: list[FloatArray] = []
    stages = []
    for number, runs in enumerate(RUNS):
        true = press.deviations(now)
        lines.append(shown(true, runs))
        # The mean of all runs so far: that of those before, and the new ones.
        fresh = shown(ladder, REPEATED * runs)
        seen_ladder = (runs_so_far * seen_ladder + runs * fresh) / (runs_so_far + runs)
        runs_so_far += runs
        evidence = features(seen_ladder, lines)
        # How far a line with the corrections made so far is off; the first line is an open loop.
        off = np.nan_to_num(np.clip(true if number else uncorrected, -GATE, GATE)).reshape(members, -1)
        moments = evidence.T @ evidence / members + _RIDGE * np.eye(evidence.shape[1])
        estimate = np.asarray(np.linalg.solve(moments, evidence.T @ off / members).T, np.float64)
        gain, contraction = _contracting(-inverse @ estimate, whole[:measured], forgetting, number)
        corrections = np.array(
            [
                entries.limited((1.0 - forgetting) * row, gain @ own)
                for row, own in zip(corrections, evidence, strict=True)
            ]
        )
        now = [entries.settings(row) for row in corrections]
        edge = _good(press, now).mean(axis=1) - plain.mean(axis=1)
        stages.append(Stage(runs, gain, contraction, estimate, evidence @ estimate.T, edge))
        report()
    return LearningLaw(entries, measured == 2, forgetting, doubt, (expected[0], expected[1]), tuple(stages))


def _contracting(
    gain: FloatArray, shown: FloatArray, forgetting: float, number: int
) -> tuple[FloatArray, float]:
    """Return a gain, halved until corrections do not move apart, and the largest eigenvalue.

    `shown` (measured, dots, inputs) is the sensitivity of what the sensor shows. The first gain works on an
    open loop, on which corrections have no influence.
    """
    keep = (1.0 - forgetting) * np.eye(gain.shape[0])
    if number == 0:
        return gain, 1.0 - forgetting
    start = shown.shape[0] * len(LADDER)
    slopes = shown.reshape(-1, shown.shape[2])
    while True:
        own = gain[:, start : start + slopes.shape[0]]
        largest = float(np.abs(np.linalg.eigvals(keep + own @ slopes)).max())
        if largest <= 1.0:
            return gain, largest
        gain = 0.5 * gain


def _good(press: Press, settings: Sequence[FloatArray]) -> BoolArray:
    """Return which dots of the cycle are within limits, (M, dots), those of the lead-in left out."""
    judgement = press.line(settings, PRINTED)[1]
    return np.asarray(judgement.good[:, np.asarray(PRINTED) >= LEAD_IN])
