"""Feedback control compared with the open loop and other strategies.

F. Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers* (1983), ends with the wish that "driving
current waveforms ought to respond to the phase of the hammer motion and the pattern to be printed". This
module tests the idea: a controller that knows the nominal hammer, and observes the real one with delay and
noise, prints all patterns of eight slots, as does the open loop. Then controller and open loop fire pairs of
pulses at a range of gaps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Final, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.plant import Driver, driver_of
from printhammer.control.feedback.policy import OFFSETS, STEPS
from printhammer.control.feedback.sensor import PositionSensor
from printhammer.control.pulses import current_bound
from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import Nominal
from printhammer.printing.dots.strategy import Strategy, name_of, open_loop, slots_of
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.safe_rate import from_rest
from printhammer.results import Declared, Result, column, coordinate, part, scalar
from printhammer.results.declare import Column
from printhammer.results.result import Entries
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    interval,
)
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.run.motion import Motion
from printhammer.run.simulate import simulate
from printhammer.run.window import wait_of
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BURST: Final = "11101101"  # Pattern of the recorded run; arbitrary
MOST_GAPS: Final = 500  # Largest number of gaps in a double-pulse test; arbitrary
# Defaults of the double-pulse test: first and last gap, in single-pulse flight times, and number of gaps;
# arbitrary
_GAPS: Final = (1.5, 6.0, 46)


class ObservedRun(Declared):
    """One run of the closed loop with the samples that the controller used."""

    pattern: str = part("requested slots: 1 for a dot, 0 for none")
    motion: Motion = part("motion of the run", repr=False)
    times: FloatArray = column("s", "times of the samples used", "sample")
    shown: FloatArray = column("m", "sensor readings", "sample")
    due: FloatArray = column("s", "requested touch times", "dot")


_DOTS: Final = "strategy pattern dot"


class Feedback(Result, rows=_DOTS):
    """Comparison of drive strategies on all patterns of eight slots; feedback is the last strategy."""

    hammer: Hammer = part("nominal hammer, for which the controller is designed")
    driven: Hammer = part("driven hammer")
    driver: Driver = part("driver of the coil for feedback")
    sensor: PositionSensor = part("sensor of the controller")
    limits: Limits = part("limits on the dots")
    single: Nominal = part("single-pulse dot of the nominal hammer, with which all dots are compared")
    rate: float = scalar("Hz", "slot rate")
    strategies: tuple[str, ...] = coordinate("", "name of the drive strategy", "strategy", name="strategy")
    passed: BoolArray = column("1", "whether all dots are within limits", "strategy pattern", dtype=np.int8)
    force: FloatArray = column(
        "1",
        "relative deviation of the force from the single pulse",
        _DOTS,
        more="NaN without a dot, and for a lost dot",
    )
    arrival: FloatArray = column(
        "s", "arrival minus slot time and single-pulse flight time", _DOTS, more="NaN without a dot"
    )
    lost: IntArray = column("1", "number of lost dots", "strategy", dtype=np.int32)
    extra_contacts: IntArray = column("1", "number of extra contacts", "strategy", dtype=np.int32)
    peak_current: FloatArray = column("A", "largest absolute value of the current", "strategy")
    gaps: FloatArray = coordinate("s", "time between two slots", "gap", name="gap")
    gap_force: FloatArray = column("1", "relative force deviation of the second of two dots", "strategy gap")
    gap_arrival: FloatArray = column("s", "arrival deviation of the second of two dots", "strategy gap")
    run: ObservedRun = part("recorded run with feedback")
    tolerance: float = part("error tolerance per integration step")

    @property
    def title(self) -> str:
        """One-line title with the name of the nominal hammer."""
        return f"feedback on {self.hammer.name}"

    def summary(self) -> Summary:
        """Tabulate the patterns within limits and the deviations of the dots, one row per strategy."""
        count = self.passed.shape[1]
        known = [force[np.isfinite(force)] for force in self.force]
        late = [times[np.isfinite(times)] for times in self.arrival]
        off = [
            f"{100.0 * each.min():+.1f} to {100.0 * each.max():+.1f} %" if each.size else None
            for each in known
        ]
        columns = [
            Cells("", self.strategies, left=True),
            Cells("patterns within limits", [f"{int(passed.sum())} of {count}" for passed in self.passed]),
            Cells("force off", off),
            Cells("arrival off", [interval(times, "s") for times in late]),
            self.cells("lost"),
            self.cells("extra_contacts", "extra"),
            self.cells("peak_current"),
        ]
        return Summary([Grid(columns)])

    def entries(self) -> Entries:
        """Return the columns of the comparison, and the sensor readings of the recorded run."""
        samples = {
            "sample_time": (Column("s", "time of a sample in the recorded run", ("sample",)), self.run.times),
            "shown": (Column("m", "reading of the sensor", ("sample",)), self.run.shown),
        }
        named = {name: (replace(note, name=name), values) for name, (note, values) in samples.items()}
        return {**super().entries(), **named}

    def notes(self) -> dict[str, Any]:
        """Return driver, sensor, limits and the pattern of the recorded run, as attributes of the Dataset."""
        return {
            "driven_fingerprint": self.driven.fingerprint,
            "largest_current": self.driver.current,
            "edge": self.driver.edge,
            **{f"sensor_{name}": value for name, value in asdict(self.sensor).items()},
            "force_limit": self.limits.force,
            "arrival_limit": self.limits.arrival,
            "extra_contacts_limit": self.limits.extra_contacts,
            "pattern_shown": self.run.pattern,
            "drive_fingerprint_shown": self.run.motion.drive.fingerprint,
        }

    def plot_run(self, **options: Any) -> Figure:
        """Plot the recorded run with the samples that the controller used; `options` are as for `plot`."""
        return self.plot(picture="run", **options)


@computation
def feedback(
    hammer: Hammer,
    rate: float | str,
    *,
    driven: Hammer | None = None,
    sensor: PositionSensor | None = None,
    current: float | str | None = None,
    edge: float | str | None = None,
    limits: Limits | None = None,
    beside: Sequence[Strategy] = (),
    gaps: npt.ArrayLike | None = None,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> Feedback:
    """Drive a hammer with feedback, and compare its dots with open-loop dots.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer, with a pack, a backstop and a waveform that is a current.
    rate : float or str
        Slot rate [Hz] or text with a unit.
    driven : Hammer, optional
        The driven hammer; by default the nominal hammer.
    sensor : PositionSensor, optional
        Sensor of the controller; by default with noise of 1 % of the stroke and a delay of 20 us.
    current : float or str, optional
        Largest absolute value of the driver's current [A]; by default 2 A, or the peak of the hammer's own
        pulse if it is larger.
    edge : float or str, optional
        Time constant of the driver, s; by default the decay time constant of the hammer's own waveform.
    limits
        As for `printhammer.safe_rate`.
    beside : sequence of Strategy, optional
        Further strategies to compare, for instance a compensation table.
    gaps : array, optional
        Times between the two slots of the double-pulse test, s; by default 46 values from 1.5 to 6 flight
        times of the single pulse.

    Returns
    -------
    Feedback
        The comparison; a failed simulation raises no exception, and its dots count as lost.
    """
    slot_rate = read_positive(rate, "Hz", "rate")
    time_constant = None if edge is None else read_positive(edge, "s", "edge")
    driver = driver_of(hammer, current_bound(hammer, current), time_constant)
    position_sensor = PositionSensor() if sensor is None else sensor
    bounds = Limits() if limits is None else limits
    actual = hammer if driven is None else driven
    between = None if gaps is None else _checked_gaps(gaps)
    tables = STEPS * len(OFFSETS)
    steps = tables + 2 * (2 + len(beside))

    def tell(done: int, _all: int) -> None:
        effort.report(done, steps)

    tell(0, steps)
    controller = Controller(hammer, driver, bounds, threads=effort.threads, progress=tell)
    own = FeedbackStrategy(controller, position_sensor, tolerance=effort.tolerance, threads=effort.threads)
    every: list[Strategy] = [open_loop, *beside, own]
    if between is None:
        between = np.linspace(*_GAPS) * controller.single.flight_time
    options: dict[str, Any] = {"limits": bounds, "effort": effort.quiet}
    patterns = from_rest(every=False)
    single = controller.single
    cases = [Case(actual, single, 1.0 / gap) for gap in between.tolist()]
    trials, doubles = [], []
    for number, way in enumerate(every):
        tell(tables + 2 * number, steps)
        trials.append(attempt([Case(actual, single, slot_rate)], patterns, way, **options))
        tell(tables + 2 * number + 1, steps)
        doubles.append(attempt(cases, [(0, 1)], way, **options))
    judged = [trial.judgement for trial in trials]
    return Feedback(
        hammer=hammer,
        driven=actual,
        driver=driver,
        sensor=position_sensor,
        limits=bounds,
        single=single,
        rate=slot_rate,
        strategies=tuple(name_of(way) for way in every),
        passed=np.array([judgement.passed for judgement in judged]),
        force=np.array([judgement.force_deviation for judgement in judged]),
        arrival=np.array([judgement.arrival_deviation for judgement in judged]),
        lost=np.array([int(judgement.lost.sum()) for judgement in judged]),
        extra_contacts=np.array([int(judgement.extra_contacts.sum()) for judgement in judged]),
        peak_current=np.array([max(drive.peak for drive in trial.drives) for trial in trials]),
        gaps=between,
        gap_force=np.array([double.judgement.force_deviation[:, 1] for double in doubles]),
        gap_arrival=np.array([double.judgement.arrival_deviation[:, 1] for double in doubles]),
        run=_observed(actual, own, slot_rate, effort.tolerance),
        tolerance=effort.tolerance,
    )


def _checked_gaps(asked: npt.ArrayLike) -> FloatArray:
    gaps = np.asarray(asked, dtype=np.float64)
    if gaps.ndim != 1 or not 0 < gaps.size <= MOST_GAPS or not (np.isfinite(gaps) & (gaps > 0.0)).all():
        raise InputError.of("gaps", asked, f"1 to {MOST_GAPS} positive times, s")
    return gaps


def _observed(hammer: Hammer, strategy: FeedbackStrategy, rate: float, tolerance: float) -> ObservedRun:
    loop = strategy.loops(hammer, [slots_of([mark == "1" for mark in BURST])], rate)[0]
    drive = loop.drive(strategy.controller.driver.edge)
    duration = max(float(loop.due[-1]), float(drive.times[-1])) + 0.5 * wait_of(hammer)
    motion = simulate(hammer, drive, duration=duration, tolerance=tolerance)
    times, shown = (np.concatenate(parts) for parts in zip(*loop.seen, strict=True))
    return ObservedRun(BURST, motion, times, shown, loop.due)
