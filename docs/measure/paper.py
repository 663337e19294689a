"""Measure the dots within limits for each driving strategy on paper that varies along the line.

Run ``.venv/bin/python docs/measure/paper.py``. The script draws hammers from the variability of a
production. Each hammer prints the de Bruijn cycle of order 8 on uniform paper, on paper that varies, and
on paper that varies twice as much; the script counts the dots within limits in open loop, with a table,
with a table learned from impact times and forces by a sensor of unknown offset, and with feedback. Five
units at one rate take some ten minutes of processor time.

``--units N`` sets the number of hammers, ``--share X`` the rate as a multiple of the open-loop safe rate.
"""

import argparse
import math
import time

import numpy as np
from measured import MOTION, Cell, Column, open_loop_rate, write

import printhammer as ph
from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.plant import driver_of
from printhammer.control.learning.learn import calibrate, table_of
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.production import OFFSET
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.table.drive import driven_by, with_pulse
from printhammer.printing.dots.nominal import Nominal, nominal
from printhammer.printing.dots.strategy import OpenLoop, Strategy
from printhammer.printing.rates.variability import Variability
from printhammer.run.ensemble import DISPLAY_TOLERANCE

PAPERS = {
    "even": None,
    "stiffness 5 %, front 3 µm": ph.Paper(),
    "stiffness 10 %, front 6 µm": ph.Paper(stiffness=0.1, front=6e-6),
}
ROOMS = (
    *MOTION,
    "derivatives",
    *(
        "control/feedback",
        "control/learning",
        "control/pulses",
        "control/table",
    ),
    *("printing/dots", "printing/rates", "support/threads"),
)
SPEED = 1.0
"""Impact speed, m/s, that converts a shift of the front into a shift of the impact time."""
FORCE = 1.0 / 3.7
"""Exponent with which the peak force of a power-law pack depends on its stiffness, at fixed energy."""


def sensor_on(paper: ph.Paper | None) -> ImpactSensor:
    """Return a sensor of times and forces whose noise includes the variation of the paper."""
    if paper is None:
        return ImpactSensor(force=0.03, offset=OFFSET)
    time, force = math.hypot(5e-6, paper.front / SPEED), math.hypot(0.03, FORCE * paper.stiffness)
    return ImpactSensor(noise=time, force=force, offset=OFFSET)


def good(
    ways: list[Strategy], units: list[ph.Hammer], rate: float, by: Nominal, paper: ph.Paper | None
) -> list[float]:
    """Return the fraction of dots within limits for each unit, each on its own sample of paper."""
    shares = []
    for number, (unit, way) in enumerate(zip(units, ways, strict=True)):
        own = None if paper is None else ph.Paper(paper.stiffness, paper.front, paper.length, number)
        printed = ph.quality(unit, rate, strategy=way, nominal=by, paper=own, tolerance=DISPLAY_TOLERANCE)
        shares.append(float((printed.fault < 0).mean()))
    return shares


def learned(hammer: ph.Hammer, units: list[ph.Hammer], rate: float, paper: ph.Paper | None) -> list[Strategy]:
    """Return the table that each unit learns from impact times and forces on the paper."""
    sensor = sensor_on(paper)
    law, base = law_for(hammer, rate, sensor=sensor, members=400)
    learners = calibrate(law, units, sensor)[0]
    return [table_of(learner, base, "switch", hammer).strategy(hammer) for learner in learners]


def measure(hammer: ph.Hammer, units: list[ph.Hammer], share: float) -> list[list[Cell]]:
    """Return one row for each paper and strategy at a rate."""
    rate, single, rows = share * open_loop_rate(hammer), nominal(hammer, tolerance=DISPLAY_TOLERANCE), []
    switched = driven_by(hammer, "switch", 2.0)
    fired = [with_pulse(unit, switched.waveform) for unit in units]
    quick = nominal(switched, tolerance=DISPLAY_TOLERANCE)
    controller = Controller(hammer, driver_of(hammer))
    table = ph.tune(hammer, rate=rate, driver="switch", variability=Variability()).strategy(hammer)
    count = len(units)
    for name, paper in PAPERS.items():
        ways = {
            "open loop, own pulse": ([OpenLoop()] * count, units, single),
            "open loop, switch": ([OpenLoop()] * count, fired, quick),
            "robust table, switch": ([table] * count, units, single),
            "learned from time and force, switch": (learned(hammer, units, rate, paper), units, single),
            "feedback": ([FeedbackStrategy(controller)] * count, units, controller.single),
        }
        for way, (drives, driven, by) in ways.items():
            shares = good(drives, driven, rate, by, paper)
            rows.append([share, name, way, 100.0 * float(np.mean(shares)), shares.count(1.0)])
            print(*rows[-1], time.strftime("%H:%M:%S"), flush=True)
    return rows


def main() -> None:
    """Measure the requested table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, action="append")
    asked = parser.parse_args()
    hammer = ph.load("hendriks-1983")
    units = Variability().draw(hammer, asked.units, asked.seed)
    rates = asked.share or [1.0, 1.5]
    rows = [row for share in rates for row in measure(hammer, units, share)]
    heads = [
        Column(name="rate / open-loop safe rate", format="g"),
        Column(name="paper"),
        Column(name="drive"),
        Column(name="dots within limits", unit="%", format=".1f"),
        Column(name="units that print all"),
    ]
    settings = {"units": asked.units, "seed": asked.seed, "rates": rates}
    write("paper", heads, rows, {**settings, "safe_rate": open_loop_rate(hammer)}, ROOMS)


if __name__ == "__main__":
    main()
