"""Preparation for learning: robust starting table, test pulses and learning law, common to all units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, SupportsIndex

import numpy as np

from printhammer.control.learning.law import ADVANCE, WIDTH, Adjustable, LearningLaw, OpenLoop, order_loops
from printhammer.control.learning.lines import Rung, Surrogate, candidates, choose, printed
from printhammer.control.learning.production import Production
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.pulses import LARGEST_CURRENT
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import COLUMNS, clearance, driven_by, print_pulse
from printhammer.control.table.task import Task, single_of
from printhammer.control.table.tuning import tune
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.rates.variability import Variability
from printhammer.run.effort import Effort
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.window import scaled_rate
from printhammer.support.arrays import FloatArray
from printhammer.support.threads import together

FORGETTING: Final = 0.02  # Default of `forgetting`, the fraction of the corrections lost per stage; arbitrary
DOUBT: Final = 0.0  # Default of `doubt`: no posterior sample may print fewer dots with the table; arbitrary
MEMBERS: Final = 400
"""Default number of simulated hammers on which the sequence of test pulses is chosen; arbitrary."""
_FEW: Final = 24  # Number of simulated hammers on which the open loops are compared; arbitrary
_RATE: Final = 1275.0
"""Default slot rate for the paper's hammer, Hz: 1.5 times its measured safe rate in open loop, 850 Hz."""
# Smallest default slot rate, relative to the lowest rate at which successive pulses interact; arbitrary
_ABOVE: Final = 1.25


def default_rate(hammer: Hammer, driver: str, largest_current: float) -> float:
    """Compute the default slot rate [Hz] of learning, at which successive pulses of the device interact.

    The rate is 1275 Hz divided by the time scale of the device, but at least 1.25 times the rate whose period
    is the settling time of a single pulse; rounded to four digits.
    """
    driven = driven_by(hammer, driver, largest_current)
    pulse, _widest = print_pulse(driven, largest_current)
    settled = single_of(driven, pulse, DISPLAY_TOLERANCE).settled
    return float(f"{max(scaled_rate(hammer, _RATE), _ABOVE / settled):.4g}")


def law_for(
    hammer: Hammer,
    rate: float,
    *,
    driver: str = "switch",
    sensor: ImpactSensor | None = None,
    variability: Variability | None = None,
    limits: Limits | None = None,
    history: SupportsIndex = 2,
    reach: SupportsIndex = 2,
    largest_current: float = LARGEST_CURRENT,
    members: int = MEMBERS,
    forgetting: float = FORGETTING,
    doubt: float = DOUBT,
    seed: int = 1983,
    threads: int | None = None,
    report: Callable[[], None] = lambda: None,
) -> tuple[LearningLaw, CompensationTable]:
    """Prepare learning for a hammer at a slot rate [Hz]; return the learning law and its starting table.

    `report` is called after each step of the work; for the other arguments see `printhammer.learn`.
    """
    if not 0.0 < forgetting < 1.0:
        raise InputError.of("forgetting", forgetting, "a number above 0 and below 1")
    if not 0.0 <= doubt <= 1.0:
        raise InputError.of("doubt", doubt, "a number from 0 to 1")
    spread = Variability.of(hammer) if variability is None else variability
    bounds = Limits() if limits is None else limits
    driven = driven_by(hammer, driver, largest_current)
    shared: dict[str, Any] = {"limits": bounds, "largest_current": largest_current, "threads": threads}
    size: dict[str, Any] = {"history": history, "reach": reach, "variability": spread}
    table = tune(driven, rate=rate, **size, **shared)
    report()
    pulse, widest = print_pulse(driven, largest_current)
    task = Task(
        gaps=table.gaps,
        reach=table.reach,
        hammers=[driven],
        spread=[],
        pulse=pulse,
        largest=largest_current,
        widest=widest,
        wait=clearance(driven, pulse, widest, largest_current),
        single=single_of(driven, pulse, DISPLAY_TOLERANCE),
        limits=bounds,
        brake=True,
        effort=Effort(DISPLAY_TOLERANCE, threads),
        report=report,
    )
    base = np.array([getattr(table, name)[0] for name in COLUMNS])
    production = Production(task, rate, spread, ImpactSensor() if sensor is None else sensor)
    entries = Adjustable(task, rate, base, _own_loop(hammer, task, base) if driver != "own" else None)
    law = _law(production, entries, members, seed, forgetting, doubt)
    report()
    return law, table


def _law(
    production: Production, entries: Adjustable, members: int, seed: int, forgetting: float, doubt: float
) -> LearningLaw:
    """Build the learning law: choose the test pulses, and fit surrogates to readings of simulated hammers."""
    task, constants = production.task, production.constants
    drawn = production.variability.draw_rows(production.nominal, members, seed)
    press = production.press([hammer for _row, hammer in drawn])
    own = np.array([row for row, _hammer in drawn])
    limits = np.array([task.limits.arrival, task.limits.force])[:, None, None]
    line = press.line([entries.open_loop] * members)[0]
    lines = np.stack([line.flight_time, line.peak_force / task.single.nominal.force]) / limits
    offered = candidates(task)
    ladders = printed(together([press.order_ladder([rung]) for rung in offered]), task)
    rungs = tuple(
        choose(
            {rung: times / task.limits.arrival for rung, (times, _) in zip(offered, ladders, strict=True)},
            [Surrogate.of(own, each) for each in lines[0].T],
            Surrogate.of(own, press.ladder([Rung(1.0)])[1][:, 0]),
            own,
            float(production.noise[0]),
            production.offset / task.limits.arrival,
        )
    )
    rows = np.zeros((members, production.size))
    rows[:, :constants] = own
    both = np.concatenate([np.stack(press.ladder(rungs)) / limits, lines], axis=2)[: production.measured]
    seen = np.concatenate(list(both), axis=1)
    shown = tuple(Surrogate.of(own, each) for each in seen.T)
    few = production.press([hammer for _row, hammer in drawn[:_FEW]])
    first = entries.loops[int(np.argmax([good.mean() for good in printed(order_loops(few, entries), task)]))]
    return LearningLaw(entries, production, forgetting, doubt, seed, rungs, shown, rows, seen, first)


def _own_loop(hammer: Hammer, task: Task, base: FloatArray) -> OpenLoop | None:
    """Build the open loop of the hammer's own pulse, fired so that dots arrive as with the driver's pulse.

    `base` has the shape of table settings. The result is None if the own pulse has no width.
    """
    pulse: Any = hammer.waveform
    if not isinstance(getattr(pulse, "width", None), float):
        return None
    settings = np.zeros_like(base)
    settings[WIDTH] = pulse.width
    alone = nominal(hammer, tolerance=DISPLAY_TOLERANCE).flight_time
    settings[ADVANCE] = alone - task.single.nominal.flight_time
    return OpenLoop(settings, pulse)
