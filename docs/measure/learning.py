"""Measure the dots within limits on unmeasured units for each driving strategy, and the gain by learning.

Run ``.venv/bin/python docs/measure/learning.py``. The script draws hammers from the variability
of a production, and counts the dots of the de Bruijn cycle of order 8 and of rows of 200 slots within
limits, at multiples of the nominal hammer's open-loop safe rate. The strategies are open loop, table and
robust table, each with the hammer's own pulse and with a fast switch, and tables learned after some dots
from impact times with 5 us of noise, without and with forces to 3 %. All units learn from times with the
fast switch, the default of ``printhammer learn``, a quarter of them from forces too or, at 1.5 times the
safe rate, with the hammer's own pulse; none learn at the safe rate itself. The sensor of each unit has an
offset that the learner does not know, with a standard deviation of 25 us. It takes two hours on one core:
``--keep FOLDER`` stores what units learn, and reuses it; ``--at X [X ...]`` measures only these multiples of
the safe rate, for ``--keep``, and writes no table.

``--units N`` sets the number of units, ``--feedback N`` the number of units on which feedback prints a
cycle of order 6. ``--sensors [NAME ...]`` measures other sensors instead, with names of `SENSORS` only for
``--keep``; ``--safe-rate`` measures learning at the safe rate itself, ``--tolerance`` other variabilities,
and ``--family`` units of two other hammers of the family. ``--picture FILE`` only draws the dots of one unit
while it learns; ``drawings.py`` draws the tables.
"""

import argparse
import json
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from measured import MOTION, Cell, Column, open_loop_rate, write

import printhammer as ph
from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.plant import driver_of
from printhammer.control.learning.law import PRINTED, LearningLaw, order_loops
from printhammer.control.learning.learn import calibrate
from printhammer.control.learning.lines import printed
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.production import OFFSET
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.table.drive import driven_by, with_pulse
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.strategy import LEAD_IN, Strategy, cycle_with_lead_in, open_loop, slots_of
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.variability import Variability
from printhammer.run.ensemble import DISPLAY_TOLERANCE

SHARES = (1.0, 1.25, 1.5, 1.75)
ASKED = 1.5
"""Rate at which 90 of 100 units should print all dots, as a multiple of the open-loop safe rate."""
SENSORS = {"time": ImpactSensor(offset=OFFSET), "time and force": ImpactSensor(offset=OFFSET, force=0.03)}
OTHERS = {
    "white noise": {},
    "no offset": {"offset": 0.0},
    "another seed": {"seed": 7},
    "coloured noise, correlation 0.8": {"colour": 0.8},
    "2 % gain error": {"gain": 0.02},
    "1 of 100 missed": {"missed": 0.01},
    "1 of 100 missed, 1 of 100 false": {"missed": 0.01, "false": 0.01},
}
UNKNOWN = {"mass": 0.02, "backstop.stiffness": 0.1}
"""Constants that vary without being estimated by the learner, with their relative standard deviations."""
RATE = Column(name="rate / open-loop safe rate", format="g")
DRIVE = Column(name="drive")
GOOD = (Column(name="dots within limits", unit="%", format=".1f"), Column(name="units that print all"))
FEWER = (
    Column(name="units with a table that printed fewer dots than in the better open loop, up to this stage"),
    Column(name="units in the worse of two open loops"),
)
SHOWN = 2
"""Number of the unit in the picture: one of the many that an open loop does not print well."""
FAMILY = ("02", "06")
"""Numbers of two hammers of the family."""
AFTER = (50, 200, 1000)
LEARNED = {1.25: ("switch",), 1.5: ("switch", "own"), 1.75: ("switch",)}
"""Drivers with which units learn, by rate; learning at the open-loop safe rate takes the longest."""
USUAL = "switch", "time"
"""Driver and sensor that `printhammer learn` takes by default, with which all units learn."""
FEEDBACK = 10
"""Largest number of units on which feedback prints beside other drives, a shorter cycle."""
ROOMS = (
    *MOTION,
    "derivatives",
    "control/learning",
    "control/pulses",
    "control/table",
    "printing/dots",
    "printing/rates",
    "support/threads",
)


def shares(units: list[ph.Hammer], single: object, rate: float, way: Strategy) -> np.ndarray:
    """Return the fraction of dots of the cycle and the rows within limits, for each unit."""
    trial = attempt(
        [Case(unit, single, rate) for unit in units],
        [PRINTED],
        way,
        limits=Limits(),
        tolerance=DISPLAY_TOLERANCE,
        judged_from=LEAD_IN,
    )
    return trial.judgement.good.sum(axis=1) / trial.judgement.wanted.sum(axis=1)


def cells(good: np.ndarray) -> list[Cell]:
    """Return the percentage of good dots, and the number of units that print all."""
    return [100.0 * float(good.mean()), int((good == 1.0).sum())]


class Learned(NamedTuple):
    """Fractions of dots within limits, per unit: after some numbers of test dots, and in two open loops."""

    stages: dict[int, list[float]]
    loops: list[list[float]]

    def last(self) -> np.ndarray:
        """Return the fractions after all test dots."""
        return np.array(self.stages[AFTER[-1]])

    def cells(self, dots: int) -> list[Cell]:
        """Return the cells of a row: dots, units that print all, and the two counts of `FEWER`.

        A unit that prints as many dots as in one of the open loops counts as driven in open loop.
        """
        loops = np.array(self.loops)
        below, in_loop = (
            {n: test(np.array(good)) for n, good in self.stages.items() if 0 < n <= dots}
            for test in (
                lambda good: good < loops.max(axis=0) - 1e-12,
                lambda good: (np.abs(good - loops) < 1e-12).any(axis=0),
            )
        )
        losers = np.any([below[n] & ~in_loop[n] for n in below], axis=0)
        worse = int((below[dots] & in_loop[dots]).sum())
        return [*cells(np.array(self.stages[dots])), int(losers.sum()), worse]


def learned(law: LearningLaw, units: list[ph.Hammer], sensor: ImpactSensor) -> Learned:
    """Return the fractions of dots within limits of each unit, at all stages and in two open loops."""
    press = law.production.press([with_pulse(unit, law.entries.task.pulse) for unit in units])
    loops = printed(order_loops(press, law.entries), law.entries.task)
    stages = {stage.dots: stage.good.mean(axis=1).tolist() for stage in calibrate(law, units, sensor)[1]}
    return Learned(stages, [good.mean(axis=1).tolist() for good in loops])


def kept(folder: Path | None, name: str, measured: Callable[[], Learned]) -> Learned:
    """Return what units learned from a file of the folder, or measure it and write the file."""
    path = None if folder is None else folder / f"{name.replace(' ', '-')}.json"
    if path is not None and path.exists():
        stages, loops = json.loads(path.read_text())
        return Learned({int(dots): good for dots, good in stages.items()}, loops)
    found = measured()
    if path is not None:
        path.write_text(json.dumps(found))
    return found


def measure(hammer: ph.Hammer, units: list[ph.Hammer], share: float, folder: Path | None) -> list[list[Cell]]:
    """Return one row of the table for each strategy at a rate.

    All units learn with the fast switch from times alone, a quarter of them with the other combinations; see
    `LEARNED` for the rates.
    """
    rate, single, rows = share * open_loop_rate(hammer), nominal(hammer, tolerance=DISPLAY_TOLERANCE), []

    def add(way: str, count: int, found: list[Cell]) -> None:
        rows.append([share, way, count, *found])
        print(*rows[-1], time.strftime("%H:%M:%S"), flush=True)

    loops = {}
    for driver in ("own", "switch"):
        driven = driven_by(hammer, driver, 2.0)
        fired = [with_pulse(unit, driven.waveform) for unit in units]
        loops[driver] = shares(fired, nominal(driven, tolerance=DISPLAY_TOLERANCE), rate, open_loop)
    better = np.maximum(*loops.values())
    for driver, alone in loops.items():
        add(f"open loop, {driver}", len(units), [*cells(alone), None, None])
        for name, options in (("table", {}), ("robust table", {"variability": Variability()})):
            table = ph.tune(hammer, rate=rate, driver=driver, **options)
            good = shares(units, single, rate, table.strategy(hammer))
            fewer = int((good < better - 1e-12).sum())
            add(f"{name}, {driver}", len(units), [*cells(good), fewer, None])
    for driver in LEARNED.get(share, ()):
        for name, sensor in SENSORS.items():
            some = units if (driver, name) == USUAL else units[: len(units) // 4]

            def measured(
                driver: str = driver, sensor: ImpactSensor = sensor, some: list[ph.Hammer] = some
            ) -> Learned:
                return learned(law_for(hammer, rate, driver=driver, sensor=sensor)[0], some, sensor)

            seen = kept(folder, f"{share:g} {driver} {name}", measured)
            for dots in AFTER:
                add(f"learned from {name}, {driver}, {dots} dots", len(some), seen.cells(dots))
    return rows


def feedback(hammer: ph.Hammer, units: list[ph.Hammer]) -> list[list[Cell]]:
    """Return the results of feedback for a shorter cycle, with its sensor and with a blinded sensor."""
    controller = Controller(hammer, driver_of(hammer))
    slots, rows = slots_of(cycle_with_lead_in(6, 0)), []
    from printhammer.control.feedback.sensor import PositionSensor

    for share in SHARES:
        for name, noise in (("feedback", 0.01), ("feedback, sensor blinded", 100.0)):
            way = FeedbackStrategy(controller, PositionSensor(noise=noise))
            begin = time.time()
            cases = [Case(unit, controller.single, share * open_loop_rate(hammer)) for unit in units]
            trial = attempt(cases, [slots], way, limits=Limits(), tolerance=DISPLAY_TOLERANCE)
            good = trial.judgement.good.mean(axis=1)
            rows.append([share, name, *cells(good)])
            print(*rows[-1], f"{time.time() - begin:.0f} s", flush=True)
    return rows


def sensors(
    hammer: ph.Hammer, units: list[ph.Hammer], names: list[str], folder: Path | None
) -> list[list[Cell]]:
    """Return the results of learning with variants of the named sensors, at 1.5 times the safe rate."""
    rows: list[list[Cell]] = []
    for name in names:
        sensor = SENSORS[name]
        law, _base = law_for(hammer, ASKED * open_loop_rate(hammer), sensor=sensor)

        def add(
            variant: str,
            driven: list[ph.Hammer],
            shown: ImpactSensor,
            name: str = name,
            law: LearningLaw = law,
        ) -> None:
            seen = kept(folder, f"{name} {variant}", lambda: learned(law, driven, shown))
            rows.append([name, variant, *seen.cells(AFTER[-1])])
            print(*rows[-1], time.strftime("%H:%M:%S"), flush=True)

        for variant, options in OTHERS.items():
            add(variant, units, ImpactSensor(**{"force": sensor.force, "offset": OFFSET, **options}))
        for key, spread in UNKNOWN.items():
            rng = np.random.default_rng(5)
            off = 1.0 + spread * rng.standard_normal(len(units))
            changed = [
                unit.replace(key, unit.constants[key].si * by) for unit, by in zip(units, off, strict=True)
            ]
            add(f"white noise; {key} is off by {100.0 * spread:g} % as well", changed, sensor)
    return rows


def family(count: int, seed: int) -> list[list[Cell]]:
    """Return the results for units of two hammers of the family at 1.5 times their safe rates."""
    from studies.reconstruction.family.family import family_hammers

    rows = []
    for hammer in family_hammers():
        number = hammer.name.rpartition("-")[2]
        if number not in FAMILY:
            continue
        rate, units = ASKED * open_loop_rate(hammer), Variability().draw(hammer, count, seed)
        single = nominal(hammer, tolerance=DISPLAY_TOLERANCE)
        rows.append([number, "open loop, own", *cells(shares(units, single, rate, open_loop))])
        table = ph.tune(hammer, rate=rate, driver="switch", variability=Variability()).strategy(hammer)
        rows.append([number, "robust table, switch", *cells(shares(units, single, rate, table))])
        for name, sensor in SENSORS.items():
            law, _base = law_for(hammer, rate, sensor=sensor)
            good = learned(law, units, sensor).last()
            rows.append([number, f"learned from {name}, switch, 1000 dots", *cells(good)])
            print(*rows[-1], flush=True)
    return rows


def at_safe_rate(hammer: ph.Hammer, units: list[ph.Hammer], folder: Path | None) -> list[list[Cell]]:
    """Return the results in open loop and of learning from times, at the open-loop safe rate itself."""
    rows, rate = [], open_loop_rate(hammer)
    for driver in ("own", "switch"):
        driven = driven_by(hammer, driver, 2.0)
        fired = [with_pulse(unit, driven.waveform) for unit in units]
        good = shares(fired, nominal(driven, tolerance=DISPLAY_TOLERANCE), rate, open_loop)
        rows.append([f"open loop, {driver}", *cells(good), None, None])
        print(*rows[-1], flush=True)
    driver, name = USUAL
    seen = kept(
        folder,
        "safe rate",
        lambda: learned(law_for(hammer, rate, driver=driver, sensor=SENSORS[name])[0], units, SENSORS[name]),
    )
    return rows + [[f"learned from {name}, {driver}, {dots} dots", *seen.cells(dots)] for dots in AFTER]


def looped(controller: Controller, units: list[ph.Hammer], rate: float) -> np.ndarray:
    """Return the fraction of dots within limits with feedback, for each unit, for a cycle of order 6."""
    trial = attempt(
        [Case(unit, controller.single, rate) for unit in units],
        [slots_of(cycle_with_lead_in(6, 0))],
        FeedbackStrategy(controller),
        limits=Limits(),
        tolerance=DISPLAY_TOLERANCE,
    )
    return trial.judgement.good.mean(axis=1)


def tolerance(hammer: ph.Hammer, count: int, seed: int) -> list[list[Cell]]:
    """Return the results at 1.5 times the safe rate for productions with smaller and larger spread."""
    rows, rate = [], ASKED * open_loop_rate(hammer)
    single = nominal(hammer, tolerance=DISPLAY_TOLERANCE)
    table = ph.tune(hammer, rate=rate, driver="switch")
    switched = driven_by(hammer, "switch", 2.0)
    quick, controller = nominal(switched, tolerance=DISPLAY_TOLERANCE), Controller(hammer, driver_of(hammer))
    for factor in (0.25, 0.5, 1.0, 1.5):
        spread = Variability().times(factor)
        units = spread.draw(hammer, count, seed)
        robust = ph.tune(hammer, rate=rate, driver="switch", variability=spread)
        ways = {
            "open loop, own": shares(units, single, rate, open_loop),
            "open loop, switch": shares(
                [with_pulse(unit, switched.waveform) for unit in units], quick, rate, open_loop
            ),
            "table, switch": shares(units, single, rate, table.strategy(hammer)),
            "robust table, switch": shares(units, single, rate, robust.strategy(hammer)),
        }
        for name, sensor in SENSORS.items():
            law, _base = law_for(hammer, rate, sensor=sensor, variability=spread)
            ways[f"learned from {name}, switch"] = learned(law, units, sensor).last()
        ways[f"feedback, {min(FEEDBACK, count)} units"] = looped(controller, units[:FEEDBACK], rate)
        for name, good in ways.items():
            rows.append([factor, name, *cells(good)])
            print(*rows[-1], flush=True)
    return rows


def main() -> None:
    """Measure the requested tables, or draw the requested picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--feedback", type=int)
    parser.add_argument("--sensors", nargs="*", choices=SENSORS)
    parser.add_argument("--safe-rate", action="store_true")
    parser.add_argument("--tolerance", action="store_true")
    parser.add_argument("--family", action="store_true")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--at", type=float, nargs="+", choices=SHARES)
    asked = parser.parse_args()
    hammer = ph.load("hendriks-1983")
    if asked.picture is not None:
        drawn = BytesIO()
        unit = Variability().draw(hammer, asked.units, asked.seed)[SHOWN]
        learning = ph.learn(
            hammer, unit, rate=ASKED * open_loop_rate(hammer), sensor=SENSORS["time and force"]
        )
        learning.plot().savefig(drawn, dpi=110)
        asked.picture.write_bytes(drawn.getvalue())
        return
    units = Variability().draw(hammer, asked.units, asked.seed)
    settings = {"units": asked.units, "seed": asked.seed, "safe_rate": open_loop_rate(hammer)}
    if asked.sensors is not None:
        heads = [Column(name="learned from"), Column(name="sensor"), *GOOD, *FEWER]
        rows = sensors(hammer, units, asked.sensors or list(SENSORS), asked.keep)
        if not asked.sensors:
            write("learning-sensors", heads, rows, settings, ROOMS)
    elif asked.safe_rate:
        rows = at_safe_rate(hammer, units, asked.keep)
        write("learning-safe-rate", [DRIVE, *GOOD, *FEWER], rows, settings, ROOMS)
    elif asked.family:
        heads = [Column(name="hammer of the family"), DRIVE, *GOOD]
        names = tuple(f"hendriks-1983-family-{number}" for number in FAMILY)
        write("learning-family", heads, family(asked.units, asked.seed), settings, ROOMS, names)
    elif asked.tolerance:
        heads = [Column(name="standard deviations / stated ones", format="g"), DRIVE, *GOOD]
        rows = tolerance(hammer, asked.units, asked.seed)
        write("learning-tolerance", heads, rows, settings, (*ROOMS, "control/feedback"))
    elif asked.feedback:
        settings["units"] = asked.feedback
        rows = feedback(hammer, units[: asked.feedback])
        write("learning-feedback", [RATE, DRIVE, *GOOD], rows, settings, (*ROOMS, "control/feedback"))
    else:
        heads = [RATE, DRIVE, Column(name="units", format="d"), *GOOD, *FEWER]
        rows = [row for share in asked.at or SHARES for row in measure(hammer, units, share, asked.keep)]
        if asked.at is None:
            write("learning", heads, rows, settings, ROOMS)


if __name__ == "__main__":
    main()
