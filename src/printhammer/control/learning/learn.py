"""Learn a table on a unit: what it prints before, while and after."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, SupportsIndex

import numpy as np

from printhammer.control.learning.calibrate import calibrate
from printhammer.control.learning.law import PRINTED, RUNS
from printhammer.control.learning.preparation import DOUBT, FORGETTING, MEMBERS, law_for
from printhammer.control.learning.result import Learning
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.table.drive import COLUMNS, LARGEST_CURRENT
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.printing.rates.variability import Variability

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.limits import Limits


def learn(
    hammer: Hammer,
    unit: Hammer | None = None,
    *,
    rate: float | str,
    driver: str = "switch",
    sensor: ImpactSensor | None = None,
    variability: Variability | None = None,
    limits: Limits | None = None,
    history: SupportsIndex = 2,
    reach: SupportsIndex = 2,
    largest_current: float | str = LARGEST_CURRENT,
    members: SupportsIndex = MEMBERS,
    forgetting: float = FORGETTING,
    doubt: float = DOUBT,
    serial: str = "unit",
    seed: int = 1983,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Learning:
    """Let a hammer that nobody has measured calibrate its compensation table, from one number a dot.

    The unit prints test lines; after each dot the learner is told when it struck, with noise, and perhaps how
    hard. From run to run it corrects advance, width and brakes of a table that was tuned on the nominal
    hammer for the stated variability. The first line is printed in an open loop, and wherever the evidence is
    that the table would print fewer dots within limits, what is handed out stays the open loop.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer, which is all that the learner knows.
    unit : Hammer, optional
        The hammer that is driven; by default one drawn from the variability with the seed.
    rate : float or str
        Slots per second, Hz, or text with a unit.
    driver, limits, history, reach, largest_current, threads
        As for `printhammer.tune`; by default a fast switch. "own" for a hammer whose coil a driver switches:
        advance and time on the rail are then learned.
    sensor : ImpactSensor, optional
        By default one that tells times with a noise of 5 us.
    variability : Variability, optional
        What is known of the production; by default `Variability.of(hammer)`.
    members : int, optional
        Number of simulated hammers on which the ladder is chosen, 100 to 5000.
    forgetting : float, optional
        By which part the corrections of the stages before are taken back at each stage, above 0: where the
        sensor shows nothing of them, it is what keeps them from growing.
    doubt : float, optional
        Which share of the hammers that are held for possible may print fewer dots within limits with
        the table than in an open loop, for the table to be handed out; 0, none, by default.
    serial : str, optional
        Serial number of the unit; the table is refused for another one.
    seed : int, optional
        Of the simulated hammers, and of the unit where none is given.
    progress : callable, optional
        Called now and then with the number of steps done and of all.

    Returns
    -------
    Learning
        The table that is learned, and what the unit prints before, while and after.

    Raises
    ------
    InputError
        An argument is not what is described above.
    """
    speed = read_positive(rate, "Hz", "rate")
    largest = read_positive(largest_current, "A", "largest_current")
    count = read_count(members, "members")
    if not 100 <= count <= 5000:
        raise InputError(f"members = {count}, expected 100 to 5000")
    if not serial:
        raise InputError(f"serial = {serial!r}, expected a text")
    shown = ImpactSensor() if sensor is None else sensor
    spread = Variability.of(hammer) if variability is None else variability
    steps, total = iter(range(1, 3)), 2 + len(RUNS)

    def report() -> None:
        if progress is not None:
            progress(next(steps, total), total)

    law, base = law_for(
        hammer,
        speed,
        driver=driver,
        sensor=shown,
        variability=spread,
        limits=limits,
        history=history,
        reach=reach,
        largest_current=largest,
        members=count,
        forgetting=forgetting,
        doubt=doubt,
        seed=seed,
        threads=threads,
        report=report,
    )
    driven = spread.draw(hammer, 1, seed + 1)[0] if unit is None else unit
    learners, stages = calibrate(law, [driven], shown, report)
    entries = dict(zip(COLUMNS, learners[0].printed, strict=True))
    unknown = np.full_like(base.deviation, np.nan)
    table = replace(base, **{name: values[np.newaxis] for name, values in entries.items()}, deviation=unknown)
    judged = [stage.cycle for stage in stages]
    belief = learners[0].belief
    assert belief is not None
    off, apart = belief.moments()
    sizes = spread.constants(hammer)
    return Learning(
        hammer=hammer,
        unit=driven,
        table=replace(table.fired_by(driver, hammer), serial=serial),
        rate=speed,
        driver=driver,
        sensor=shown,
        variability=spread,
        limits=law.entries.task.limits,
        dots=np.array([stage.dots for stage in stages]),
        learned=np.array([bool(stage.learned[0]) for stage in stages]),
        slot=np.array(PRINTED),
        force_deviation=np.array([judgement.force_deviation[0] for judgement in judged]),
        arrival_deviation=np.array([judgement.arrival_deviation[0] for judgement in judged]),
        good=np.array([judgement.good[0] for judgement in judged]),
        constants=tuple(sizes),
        believed=np.array(
            [hammer.constants[key].si + size * z for (key, size), z in zip(sizes.items(), off, strict=False)]
        ),
        uncertainty=np.array([size * z for size, z in zip(sizes.values(), apart, strict=False)]),
        contraction=np.array(learners[0].contractions),
        seed=seed,
    )
