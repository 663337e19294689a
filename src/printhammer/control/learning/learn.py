"""Run-to-run calibration of units, and the result: dots before, during and after learning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final, NamedTuple, SupportsIndex, Unpack

import numpy as np

from printhammer.control.learning.law import COMPARED, JUDGED, PRINTED, RUNS, SURE, LearningLaw
from printhammer.control.learning.learner import Learner
from printhammer.control.learning.lines import DOTS, LINE, Press, printed
from printhammer.control.learning.preparation import DOUBT, FORGETTING, MEMBERS, default_rate, law_for
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.pulses import current_bound
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import COLUMNS, with_pulse
from printhammer.control.table.multipliers import with_multipliers
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Judgement, Limits
from printhammer.printing.dots.nominal import pulse_of
from printhammer.printing.dots.strategy import LEAD_IN
from printhammer.printing.rates.variability import Variability
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    quantity,
)
from printhammer.run.effort import DEFAULT, AtFixedTolerance, Effort, computation
from printhammer.support.arrays import BoolArray, FloatArray, IntArray
from printhammer.support.threads import together


class Progress(NamedTuple):
    """State of all units after `dots` printed dots: evaluated dots, last test line, and decisions."""

    dots: int
    cycle: Judgement  # Evaluation of the dots of `PRINTED`
    line: Judgement  # Evaluation of the dots of the test line
    # Estimates from the readings, arrays of shape (units,); NaN before the first reading
    learned: BoolArray  # Whether the learned table is used, rather than an open loop
    misfit: FloatArray  # RMS of the residuals of the readings, in standard deviations
    multiplier: FloatArray
    expected: FloatArray
    certainty: FloatArray
    loop_certainty: FloatArray

    @property
    def good(self) -> BoolArray:
        """Mask of the evaluated dots within limits, without the lead-in, shape (units, dots)."""
        return np.asarray(self.cycle.good[:, JUDGED])


# Fields of `Verdict`, in the order of `Progress`
_SAID: Final = ("multiplier", "expected", "certainty", "loop_certainty")


def compare(press: Press, learners: Sequence[Learner], sensor: ImpactSensor) -> None:
    """Print the line `COMPARED` once in each open loop on every unit; store the readings in the learners.

    Each hammer of `press` is the unit of one learner; all learners have the same learning law. With a single
    open loop nothing is printed.
    """
    loops, single = learners[0].law.entries.loops, press.task.single.nominal
    if len(loops) == 1:
        return
    count = len(learners)
    dots = [press.line([loop.settings] * count, COMPARED, [loop.pulse] * count)[0] for loop in loops]
    for unit, learner in enumerate(learners):
        learner.compare(
            [
                sensor.read(
                    shown.flight_time[unit], shown.peak_force[unit] / single.force, unit, 2 * sum(RUNS) + k
                )
                for k, shown in enumerate(dots)
            ]
        )


def calibrate(
    law: LearningLaw,
    units: Sequence[Hammer],
    sensor: ImpactSensor,
    report: Callable[[], None] = lambda: None,
) -> tuple[list[Learner], list[Progress]]:
    """Calibrate units, each with its own learner; return the learners and the progress at every stage.

    The simulation is deterministic: the runs of a stage print identical dots, so each stage is simulated
    once, and only the noise of the readings differs. `report` is called after each stage.
    """
    task = law.entries.task
    press = Press(task, law.entries.rate, [with_pulse(unit, task.pulse) for unit in units])
    flights, forces = press.ladder(law.rungs)
    learners = [Learner(law) for _ in units]
    single = task.single.nominal
    run, history = 0, []
    compare(press, learners, sensor)

    def record(line: Judgement) -> None:
        settings, pulses = ([getattr(each, name) for each in learners] for name in ("printed", "pulse"))
        cycle = press.line(settings, PRINTED, pulses)[1]
        said = [
            (each.learned, each.misfit, *(getattr(each.verdict, name) for name in _SAID)) for each in learners
        ]
        learned, *others = (np.array(values) for values in zip(*said, strict=True))
        history.append(Progress(run * (DOTS + len(LINE)), cycle, line, learned, *others))

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


def table_of(learner: Learner, base: CompensationTable, driver: str, hammer: Hammer) -> CompensationTable:
    """Convert the drive selected by a learner (a table or an open loop) to a table for a hammer.

    `base` is the starting table, tuned for the hammer with the coil driver `driver`.
    """
    entries = {key: row[np.newaxis] for key, row in zip(COLUMNS, learner.printed, strict=True)}
    unknown = np.full_like(base.deviation, np.nan)
    table = replace(base, **entries, deviation=unknown, multiplier=unknown)
    own = learner.law.entries.own
    if own is not None and learner.pulse is own.pulse:
        # The hammer's own pulse is fired at the slot, without advance.
        return replace(table, advance=np.zeros_like(table.advance)).delayed(0.0, "own", hammer)
    return table.fired_by(driver, hammer)


_DOTS = "stage dot"
_LIKELY: Final = 0.5
"""Smallest fraction of posterior samples that print every dot, for a unit to pass; arbitrary."""


def _percent(share: float) -> str:
    return "–" if np.isnan(share) else f"{100.0 * share:.1f} %"


def _worst(values: FloatArray) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else float("nan")


class Learning(Result, rows=_DOTS):
    """Result of a run-to-run calibration: the learned table, and the dots at each stage."""

    hammer: Hammer = part("the nominal hammer, known to the learner")
    unit: Hammer = part("the simulated unit, unknown to the learner", repr=False)
    table: CompensationTable = part("the learned table of the unit", repr=False)
    rate: float = scalar("Hz", "slot rate", name="rate_Hz")
    driver: str = scalar("", "driver of the coil")
    sensor: ImpactSensor = part("the impact sensor")
    variability: Variability = part("the variability of the production")
    limits: Limits = part("the limits of force and arrival")
    dots: IntArray = coordinate(
        "1",
        "number of test dots printed before the stage",
        "stage",
        name="dots_learned",
        more="without the line that compares the open loops",
    )
    learned: BoolArray = column(
        "1", "whether the learned table is used, rather than an open loop", "stage", dtype=np.int8
    )
    misfit: FloatArray = column(
        "1",
        "RMS of the residuals of the readings, in standard deviations of their noise",
        "stage",
        more="NaN before there are readings; above 2 no table is used",
    )
    multiplier: FloatArray = column(
        "1",
        "largest multiplier of rows printed with the table by posterior samples",
        "stage",
        more="NaN before there are readings, and where no row is periodic; above 1 no table is used",
    )
    expected: FloatArray = column(
        "1",
        "expected fraction of dots within limits, from the readings",
        "stage",
        more="NaN before there are readings, and where they are not explained",
    )
    certainty: FloatArray = column(
        "1",
        "fraction of posterior samples that print every dot within limits",
        "stage",
        more="NaN without an expected fraction",
    )
    loop_certainty: FloatArray = column(
        "1",
        "fraction of posterior samples that print no fewer dots in the open loop in use than in the other",
        "stage",
        more="below 0.9, the readings do not decide between the two; NaN where no posterior explains the"
        " readings in both, or the table is used; 1 for a single open loop",
    )
    slot: IntArray = coordinate("1", "number of the slot", "dot", name="slot")
    force_deviation: FloatArray = column(
        "1", "relative difference of the peak force from that of the single pulse", _DOTS
    )
    arrival_deviation: FloatArray = column(
        "s", "impact time minus slot time and single-pulse flight time", _DOTS
    )
    good: BoolArray = column("1", "whether the dot is within limits", _DOTS, dtype=np.int8)
    constants: tuple[str, ...] = coordinate("", "name of a constant that varies", "constant", name="constant")
    believed: FloatArray = column("SI", "estimated constant of the unit", "constant")
    uncertainty: FloatArray = column("SI", "standard deviation of the estimated constant", "constant")
    contraction: FloatArray = part("largest eigenvalue of the learning law at each update")
    offset: float = scalar("s", "estimated offset of the sensor's times", name="sensor_offset")
    offset_uncertainty: float = scalar("s", "standard deviation of the estimated offset")
    seed: int = scalar("1", "seed of the simulated hammers")

    @property
    def title(self) -> str:
        """One-line title with hammer and slot rate."""
        return f"{self.hammer.name} learns its table at {self.rate:g} Hz"

    def summary(self) -> Summary:
        """Summarise the dots at each stage and the final estimates of the constants."""
        stages = [
            Cells("test dots", self.dots),
            Cells(
                "printed with", ["table" if learned else "open loop" for learned in self.learned], left=True
            ),
            Cells("misfit", self.misfit, "", ".2f"),
            Cells("multiplier\nof rows", self.multiplier, "", ".2f"),
            Cells("dots expected\nwithin limits", [_percent(share) for share in self.expected]),
            Cells("all dots\nlikely", [_percent(share) for share in self.certainty]),
            Cells("this loop\nbetter", [_percent(share) for share in self.loop_certainty]),
            Cells("within limits\non the unit", [_percent(share) for share in self.share]),
            Cells("worst force", [f"{100.0 * _worst(force):.1f} %" for force in self.force_deviation]),
            Cells("worst arrival", [_worst(arrival) for arrival in self.arrival_deviation], "s"),
        ]
        nominal = np.array([self.hammer.constants[name].si for name in self.constants])
        off, error = self.believed / nominal - 1.0, self.uncertainty / np.abs(nominal)
        constants = [
            Cells("constant", [*self.constants, "offset of the sensor"], left=True),
            Cells("off by", [*(f"{100.0 * each:+.2f} %" for each in off), quantity(self.offset, "s")]),
            Cells(
                "known to",
                [*(f"{100.0 * each:.2f} %" for each in error), quantity(self.offset_uncertainty, "s")],
            ),
        ]
        unit = self.table.serial
        undecided = (
            "The readings do not decide which of the two open loops prints more dots on this unit."
            " Force readings help."
        )
        return Summary(
            [
                Grid(stages, f"Unit {unit} of {self.hammer.name} at {self.rate:g} Hz"),
                *([undecided] if not self.learned[-1] and not self.loop_certainty[-1] >= SURE else []),
                Grid(constants, f"Constants of unit {unit}, from its readings"),
            ]
        )

    @property
    def believed_hammer(self) -> Hammer:
        """Nominal hammer with the estimated constants of the unit."""
        spread = self.variability.constants(self.hammer)
        off = self.believed - np.array([self.hammer.constants[name].si for name in spread])
        sigma = np.array(list(spread.values()))
        row = np.divide(off, sigma, out=np.zeros_like(off), where=sigma > 0.0)
        (unit,) = self.variability.hammers(self.hammer, row[np.newaxis])
        if unit is None:
            raise InputError(
                f"{self.hammer.path}: no hammer with the estimated constants rests at its backstop",
                key="believed",
                expected="readings that a hammer of the production explains",
            )
        return unit

    @property
    def share(self) -> FloatArray:
        """Fraction of the simulated unit's dots within limits, at each stage, shape (stages,)."""
        return np.asarray(self.good[:, self.slot >= LEAD_IN].mean(axis=1))

    @property
    def passed(self) -> bool:
        """Whether at least half of the posterior samples print every dot within limits."""
        return bool(self.certainty[-1] >= _LIKELY)

    def notes(self) -> dict[str, Any]:
        """Return limits, sensor noise, variability and serial number, for the header of a file."""
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
    rate: float | str | None = None,
    driver: str | None = None,
    sensor: ImpactSensor | None = None,
    variability: Variability | None = None,
    limits: Limits | None = None,
    history: SupportsIndex = 2,
    reach: SupportsIndex = 2,
    largest_current: float | str | None = None,
    members: SupportsIndex = MEMBERS,
    forgetting: float = FORGETTING,
    doubt: float = DOUBT,
    serial: str = "unit",
    seed: int = 1983,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[AtFixedTolerance],
) -> Learning:
    """Calibrate the compensation table of a unit by iterative learning control from its impact times.

    The unit prints test lines; a sensor measures the impact time and, optionally, the force of each dot, with
    noise. From these readings, the constants of the unit and the offset and gain of the sensor are estimated
    by maximum a posteriori estimation with a Laplace approximation. The prior standard deviation of the
    offset is the `offset` of the sensor, or 25 us if the sensor has none; for the gain it is 1 %. Iterative
    learning control then corrects advance, width and brake pulses of a table that was tuned for the nominal
    hammer and the variability of the production. The first line is printed in open loop. The table is used
    only if the posterior explains the readings, and if no posterior sample prints fewer dots of the test
    cycle and of rows of 200 slots with the table than in open loop, or a row in which errors grow from dot to
    dot. Otherwise one of two open-loop drives is used: the pulse of the driver, or the hammer's own pulse.
    Before the first run, the unit prints a short line with each of the two. The drive that prints more dots
    over the production is used, unless 90 % of the samples of the posterior from all readings print no fewer
    dots with the other drive. `loop_certainty` of the result is that fraction for the drive in use; below
    0.9, or NaN, the readings do not decide between the two drives.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer, the only hammer that the learner knows.
    unit : Hammer, optional
        The unit to calibrate; by default drawn from the variability with the seed.
    rate : float or str, optional
        Slot rate [Hz] or text with a unit; by default 1275 Hz divided by the time scale of the device,
        but at least 1.25 times the rate up to which the device settles between pulses.
    driver, limits, history, reach, largest_current
        As for `printhammer.tune`; the default driver is a fast switch for a hammer whose waveform is a
        current, otherwise "own": the hammer's own driver, of which advance and on-time are learned.
    sensor : ImpactSensor, optional
        Impact sensor; by default one that measures times with a standard deviation of 5 us.
    variability : Variability, optional
        Variability of the production; by default `Variability.of(hammer)`.
    members : int, optional
        Number of simulated hammers on which the test pulses are chosen, 100 to 5000.
    forgetting : float, optional
        Fraction by which earlier corrections decay at each stage, above 0 and below 1. Without the decay,
        corrections that the readings do not determine could grow.
    doubt : float, optional
        Largest fraction of the posterior samples that may print fewer dots within limits with the table
        than in an open loop, for the table to be used (default: 0, none).
    serial : str, optional
        Serial number of the unit; the table is refused for any other unit.
    seed : int, optional
        Seed for the simulated hammers, and for the unit if `unit` is not given.

    Returns
    -------
    Learning
        The learned table, and the dots of the unit before, during and after learning.
    """
    largest = current_bound(hammer, largest_current)
    if driver is None:
        driver = "switch" if pulse_of(hammer).quantity == "current" else "own"
    speed = default_rate(hammer, driver, largest) if rate is None else read_positive(rate, "Hz", "rate")
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
    table = table_of(learners[0], base, driver, hammer)
    judged = [stage.cycle for stage in stages]
    belief = learners[0].belief
    assert belief is not None
    off, apart = belief.moments()
    sizes = spread.constants(hammer)
    result = Learning(
        hammer=hammer,
        unit=driven,
        table=replace(table, serial=serial),
        rate=speed,
        driver=driver,
        sensor=shown,
        variability=spread,
        limits=law.entries.task.limits,
        dots=np.array([stage.dots for stage in stages]),
        learned=np.array([bool(stage.learned[0]) for stage in stages]),
        **{name: np.array([getattr(stage, name)[0] for stage in stages]) for name in ("misfit", *_SAID)},
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
        offset=float(law.production.offset * off[-1]),
        offset_uncertainty=float(law.production.offset * apart[-1]),
        seed=seed,
    )
    with suppress(InputError):  # No hammer has the estimated constants: the multipliers stay unknown.
        made = with_multipliers(result.table, hammer, unit=result.believed_hammer, effort=effort.quiet)
        return replace(result, table=made)
    return result
