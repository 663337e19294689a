"""Learn a table on a unit: what it prints before, while and after.

Units that are calibrated side by side, each by a learner of its own.

What a hammer prints while it learns its table.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, SupportsIndex, Unpack

import numpy as np

from printhammer.control.learning.law import PRINTED, RUNS, LearningLaw
from printhammer.control.learning.learner import Learner
from printhammer.control.learning.lines import DOTS, LINE, Press, printed
from printhammer.control.learning.preparation import DOUBT, FORGETTING, MEMBERS, law_for
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import COLUMNS, LARGEST_CURRENT, with_pulse
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Judgement, Limits
from printhammer.printing.rates.variability import Variability
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
)
from printhammer.run.effort import DEFAULT, AtFixedTolerance, Effort, computation
from printhammer.support.arrays import BoolArray, FloatArray, IntArray
from printhammer.support.threads import together


class Progress(NamedTuple):
    """Where units stand after some dots each: what they print on the cycle, and on the last test line."""

    dots: int
    cycle: Judgement
    line: Judgement
    learned: BoolArray  # Which units print with the table that is learned, not in an open loop


def calibrate(
    law: LearningLaw,
    units: Sequence[Hammer],
    sensor: ImpactSensor,
    report: Callable[[], None] = lambda: None,
) -> tuple[list[Learner], list[Progress]]:
    """Let a learner calibrate each of some units, hammers in which the pulse of the nominal one is fired.

    A unit prints the same every time that it prints the same; so what one run of a stage prints, all do, and
    only the readings differ. `report` is called after each stage.
    """
    task = law.entries.task
    press = Press(task, law.entries.rate, [with_pulse(unit, task.pulse) for unit in units])
    flights, forces = press.ladder(law.rungs)
    learners = [Learner(law) for _ in units]
    single = task.single.nominal
    run, history = 0, []

    def record(line: Judgement) -> None:
        cycle = press.line([learner.printed for learner in learners], PRINTED)[1]
        state = np.array([learner.learned for learner in learners])
        history.append(
            Progress(
                run * (DOTS + len(LINE)),
                cycle,
                line,
                state,
            )
        )

    for number, runs in enumerate(RUNS):
        dots, judgement = press.line([learner.settings for learner in learners])
        if not number:
            record(judgement)
        for _ in range(runs):
            for unit, learner in enumerate(learners):
                rungs = sensor.read(flights[unit], forces[unit], unit, 2 * run)
                line = sensor.read(
                    dots.flight_time[unit], dots.peak_force[unit] / single.force, unit, 2 * run + 1
                )
                learner.see(rungs, line)
            run += 1
        printed(together([learner.learn() for learner in learners]), task)
        record(judgement)
        report()
    return learners, history


_DOTS = "stage dot"


def _worst(values: FloatArray) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else float("nan")


class Learning(Result, rows=_DOTS):
    """A unit that calibrates its table, and what it prints at each stage, first in an open loop."""

    hammer: Hammer = part("the nominal hammer, all that the learner knows")
    unit: Hammer = part("the hammer that is driven", repr=False)
    table: CompensationTable = part("what is learned, for this unit", repr=False)
    rate: float = scalar("Hz", "slots per second", name="rate_Hz")
    driver: str = scalar("", "what switches the coil")
    sensor: ImpactSensor = part("what the learner is shown")
    variability: Variability = part("what is known of the production")
    limits: Limits = part("how far a dot may be off")
    dots: IntArray = coordinate("1", "dots of test lines printed before", "stage", name="dots_learned")
    learned: BoolArray = column(
        "1", "whether the table is printed with, and not an open loop", "stage", dtype=np.int8
    )
    slot: IntArray = coordinate("1", "number of the slot", "dot", name="slot")
    force_deviation: FloatArray = column(
        "1", "peak force less that of the single pulse, in parts of it", _DOTS
    )
    arrival_deviation: FloatArray = column("s", "touch less slot time and single-pulse flight time", _DOTS)
    good: BoolArray = column("1", "whether the dot is within limits", _DOTS, dtype=np.int8)
    constants: tuple[str, ...] = coordinate("", "a constant that varies", "constant", name="constant")
    believed: FloatArray = column("SI", "constant of the unit, as its readings tell it", "constant")
    uncertainty: FloatArray = column("SI", "its standard deviation", "constant")
    contraction: FloatArray = part("largest eigenvalue of the law at each update")
    seed: int = scalar("1", "seed of the simulated hammers")

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return f"{self.hammer.name} learns its table at {self.rate:g} Hz"

    def summary(self) -> Summary:
        """Return what is printed at each stage, and what is believed of the constants in the end."""
        stages = [
            Cells("test dots", self.dots),
            Cells(
                "printed with", ["table" if learned else "open loop" for learned in self.learned], left=True
            ),
            Cells("within limits", [f"{100.0 * share:.1f} %" for share in self.share]),
            Cells("worst force", [f"{100.0 * _worst(force):.1f} %" for force in self.force_deviation]),
            Cells("worst arrival", [_worst(arrival) for arrival in self.arrival_deviation], "s"),
        ]
        nominal = np.array([self.hammer.constants[name].si for name in self.constants])
        off, error = self.believed / nominal - 1.0, self.uncertainty / np.abs(nominal)
        constants = [
            Cells("constant", self.constants, left=True),
            Cells("off by", [f"{100.0 * each:+.2f} %" for each in off]),
            Cells("known to", [f"{100.0 * each:.2f} %" for each in error]),
        ]
        unit = self.table.serial
        return Summary(
            [
                Grid(stages, f"Unit {unit} of {self.hammer.name} at {self.rate:g} Hz"),
                Grid(constants, f"Constants of unit {unit}, from its readings"),
            ]
        )

    @property
    def share(self) -> FloatArray:
        """Share of the dots within limits at each stage."""
        return np.asarray(self.good.mean(axis=1))

    @property
    def passed(self) -> bool:
        """Whether all dots are within limits in the end."""
        return bool(self.good[-1].all())

    def notes(self) -> dict[str, Any]:
        """Return limits, sensor noise and what is known of the production."""
        return {
            "limits": self.limits.text,
            "variability": self.variability.text,
            "sensor_noise_s": self.sensor.noise,
            "serial": self.table.serial,
        }


@computation
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
    effort: Effort = DEFAULT,
    **_keywords: Unpack[AtFixedTolerance],
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
    driver, limits, history, reach, largest_current
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

    Returns
    -------
    Learning
        The table that is learned, and what the unit prints before, while and after.
    """
    speed = read_positive(rate, "Hz", "rate")
    largest = read_positive(largest_current, "A", "largest_current")
    count = read_count(members, "members")
    if not 100 <= count <= 5000:
        raise InputError.of("members", count, "100 to 5000", written=str(count))
    if not serial:
        raise InputError.of("serial", serial, "a text")
    shown = ImpactSensor() if sensor is None else sensor
    spread = Variability.of(hammer) if variability is None else variability
    steps, total = iter(range(1, 3)), 2 + len(RUNS)

    def report() -> None:
        effort.report(next(steps, total), total)

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
        threads=effort.threads,
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
