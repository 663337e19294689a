"""Measure what each way to drive prints on hammers nobody has measured, and what learning adds.

Run it with ``.venv/bin/python docs/measure/learning.py``. It draws hammers from the variability of a
production, and counts the dots of the de Bruijn cycle of order 8 within limits at parts of the nominal
hammer's open-loop safe rate: open loop, table and robust table, each with the hammer's own pulse and with a
fast switch, and what is learned after some dots from times of impact with 5 us of noise, and with forces to 3
% as well. It takes some ten minutes on two cores.

``--units N`` draws another number, ``--feedback N`` lets feedback print a cycle of order 6 on as many of
them. ``--sensors`` tries other sensors instead, ``--tolerance`` the open-loop safe rate against the
variability. ``--picture FILE`` only draws what one unit prints while it learns.
"""

import argparse
import time
from io import BytesIO
from pathlib import Path

import numpy as np
from measured import MOTION, Cell, Column, write

import printhammer as ph
from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.driver import driver_of
from printhammer.control.learning.calibrate import calibrate
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.table.drivers import driven_by, with_pulse
from printhammer.printing.dots.limits import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.slots import LEAD_IN, cycle_with_lead_in, slots_of
from printhammer.printing.dots.strategy import Strategy, open_loop
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.variability import Variability
from printhammer.run.ensemble import DISPLAY_TOLERANCE

SHARES = (1.0, 1.25, 1.5, 1.75)
SAFE = 850.0
"""Open-loop safe rate of the shipped hammer, Hz."""
SENSORS = {"time": ImpactSensor(), "time and force": ImpactSensor(force=0.03)}
OTHERS = {
    "white noise": {},
    "another seed": {"seed": 7},
    "coloured noise, correlation 0.8": {"colour": 0.8},
    "2 % gain error": {"gain": 0.02},
    "1 of 100 missed": {"missed": 0.01},
    "1 of 100 missed, 1 of 100 false": {"missed": 0.01, "false": 0.01},
}
AFTER = (50, 200, 1000)
ROOMS = (*MOTION, "control/learning", "control/widths", "printing/dots", "printing/rates")
CYCLE = slots_of(cycle_with_lead_in())


def shares(units: list[ph.Hammer], single: object, rate: float, way: Strategy) -> np.ndarray:
    """Return the share of the dots of the cycle within limits, for each unit."""
    trial = attempt(
        [Case(unit, single, rate) for unit in units],
        [CYCLE],
        way,
        limits=Limits(),
        tolerance=DISPLAY_TOLERANCE,
        judged_from=LEAD_IN,
    )
    return trial.judgement.good.sum(axis=1) / trial.judgement.wanted.sum(axis=1)


def cells(good: np.ndarray, plain: np.ndarray | None = None) -> list[Cell]:
    """Return the share of dots, of units that print all, and how many print fewer than in an open loop."""
    fewer = None if plain is None else int((good < plain - 1e-12).sum())
    return [100.0 * float(good.mean()), int((good == 1.0).sum()), fewer]


def measure(hammer: ph.Hammer, units: list[ph.Hammer], share: float) -> list[list[Cell]]:
    """Return a row a way at a rate."""
    rate, single, rows = share * SAFE, nominal(hammer, tolerance=DISPLAY_TOLERANCE), []

    def add(way: str, good: np.ndarray, plain: np.ndarray | None = None) -> None:
        rows.append([share, way, *cells(good, plain)])
        print(*rows[-1], flush=True)

    for driver in ("own", "switch"):
        driven = driven_by(hammer, driver, 2.0)
        fired = [with_pulse(unit, driven.waveform) for unit in units]
        plain = shares(fired, nominal(driven, tolerance=DISPLAY_TOLERANCE), rate, open_loop)
        add(f"open loop, {driver}", plain)
        for name, options in (("table", {}), ("robust table", {"variability": Variability()})):
            table = ph.tune(hammer, rate=rate, driver=driver, **options)
            add(f"{name}, {driver}", shares(units, single, rate, table.strategy(hammer)), plain)
    for driver, sensors in (("own", SENSORS), ("switch", SENSORS)):
        for name, sensor in sensors.items():
            law, _base = law_for(hammer, rate, driver=driver, sensor=sensor)
            stages = calibrate(law, units, sensor)[1]
            first = stages[0].cycle.good[:, np.asarray(CYCLE) >= LEAD_IN].mean(axis=1)
            for stage in stages:
                if stage.dots in AFTER:
                    good = stage.cycle.good[:, np.asarray(CYCLE) >= LEAD_IN].mean(axis=1)
                    add(f"learned from {name}, {driver}, {stage.dots} dots", good, first)
    return rows


def feedback(hammer: ph.Hammer, units: list[ph.Hammer]) -> list[list[Cell]]:
    """Return what feedback prints, of a shorter cycle, with its sensor and with one that is blinded."""
    controller = Controller(hammer, driver_of(hammer))
    slots, rows = slots_of(cycle_with_lead_in(6, 0)), []
    from printhammer.control.feedback.estimator.sensor import PositionSensor

    for share in SHARES:
        for name, noise in (("feedback", 0.01), ("feedback, sensor blinded", 100.0)):
            way = FeedbackStrategy(controller, PositionSensor(noise=noise))
            begin = time.time()
            cases = [Case(unit, controller.single, share * SAFE) for unit in units]
            trial = attempt(cases, [slots], way, limits=Limits(), tolerance=DISPLAY_TOLERANCE)
            good = trial.judgement.good.mean(axis=1)
            rows.append([share, name, *cells(good)])
            print(*rows[-1], f"{time.time() - begin:.0f} s", flush=True)
    return rows


def sensors(hammer: ph.Hammer, units: list[ph.Hammer]) -> list[list[Cell]]:
    """Return what is learned with other sensors at 1.5 times the safe rate."""
    rows = []
    for name, sensor in SENSORS.items():
        law, _base = law_for(hammer, 1.5 * SAFE, sensor=sensor)
        for other, options in OTHERS.items():
            shown = ImpactSensor(**{"force": sensor.force, **options})
            last = calibrate(law, units, shown)[1][-1]
            good = last.cycle.good[:, np.asarray(CYCLE) >= LEAD_IN].mean(axis=1)
            rows.append([name, other, *cells(good)[:2]])
            print(*rows[-1], flush=True)
    return rows


def tolerance(hammer: ph.Hammer, count: int) -> list[list[Cell]]:
    """Return the highest rate at which nine of ten units print all dots, by the variability."""
    rows = []
    single = nominal(hammer, tolerance=DISPLAY_TOLERANCE)
    driven = driven_by(hammer, "switch", 2.0)
    best: dict[tuple[str, float], float] = {}
    for factor in (0.25, 0.5, 1.0):
        spread = Variability().times(factor)
        units = spread.draw(hammer, count, 1)
        fired = [with_pulse(unit, driven.waveform) for unit in units]
        for share in (0.75, *SHARES):
            rate = share * SAFE
            ways = {
                "open loop": shares(units, single, rate, open_loop),
                "table": shares(
                    units, single, rate, ph.tune(hammer, rate=rate, driver="switch").strategy(hammer)
                ),
                "robust table": shares(
                    units,
                    single,
                    rate,
                    ph.tune(hammer, rate=rate, driver="switch", variability=spread).strategy(hammer),
                ),
            }
            for name, sensor in SENSORS.items():
                law, _base = law_for(hammer, rate, sensor=sensor, variability=spread)
                last = calibrate(law, units, sensor)[1][-1]
                ways[f"learned from {name}"] = last.cycle.good[:, np.asarray(CYCLE) >= LEAD_IN].mean(axis=1)
            for name, good in ways.items():
                whole = float((good == 1.0).mean())
                rows.append([factor, share, name, 100.0 * float(good.mean()), 100.0 * whole])
                print(*rows[-1], flush=True)
                if whole >= 0.9:
                    best[name, factor] = share
        assert fired
    return rows


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--feedback", type=int)
    parser.add_argument("--sensors", action="store_true")
    parser.add_argument("--tolerance", action="store_true")
    parser.add_argument("--picture", type=Path)
    asked = parser.parse_args()
    hammer = ph.load("hendriks-1983")
    if asked.picture is not None:
        drawn = BytesIO()
        ph.learn(hammer, rate=1.5 * SAFE, sensor=ImpactSensor(force=0.03)).plot().savefig(drawn, dpi=110)
        asked.picture.write_bytes(drawn.getvalue())
        return
    units = Variability().draw(hammer, asked.units, asked.seed)
    settings = {"units": asked.units, "seed": asked.seed}
    rate = Column(name="rate, in open-loop safe rates", format="g")
    good = [Column(name="dots within limits", unit="%", format=".1f"), Column(name="units that print all")]
    if asked.sensors:
        heads = [Column(name="learned from"), Column(name="sensor"), *good]
        write("learning-sensors", heads, sensors(hammer, units), settings, ROOMS)
    elif asked.tolerance:
        heads = [
            Column(name="standard deviations, in parts of those stated", format="g"),
            rate,
            Column(name="way"),
        ]
        heads += [good[0], Column(name="units that print all", unit="%", format=".0f")]
        write("learning-tolerance", heads, tolerance(hammer, asked.units), settings, ROOMS)
    elif asked.feedback:
        settings["units"] = asked.feedback
        rows = [row[:4] for row in feedback(hammer, units[: asked.feedback])]
        heads = [rate, Column(name="way"), *good]
        write("learning-feedback", heads, rows, settings, (*ROOMS, "control/feedback"))
    else:
        heads = [rate, Column(name="way"), *good, Column(name="units that print fewer than in the open loop")]
        rows = [row for share in SHARES for row in measure(hammer, units, share)]
        write("learning", heads, rows, settings, ROOMS)


if __name__ == "__main__":
    main()
