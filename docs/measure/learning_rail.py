"""Measure learning for hammers with a rail driver, from the coil current alone and from a microphone.

Run ``.venv/bin/python docs/measure/learning_rail.py``. The script draws units of the paper's hammer with
the 100 V rail of ``examples/behind_a_rail.py``, and counts the dots of the de Bruijn cycle of order 8 and of
rows of 200 slots within limits, at multiples of the open-loop safe rate of the current-driven hammer;
``--wire`` uses the shipped wire of a dot-matrix head instead, at 1200 Hz. The microphone of each unit has an
unknown offset, with a standard deviation of 25 us. Ten units take some 25 minutes
of processor time; ``--units N`` sets the number of units.
"""

import argparse
import runpy
from pathlib import Path

import matplotlib
import numpy as np
from measured import MOTION, Cell, Column, open_loop_rate, write

import printhammer as ph
from printhammer.control.learning.law import PRINTED
from printhammer.control.learning.learn import calibrate
from printhammer.control.learning.preparation import law_for
from printhammer.control.learning.production import OFFSET
from printhammer.control.pulses import LARGEST_CURRENT
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.strategy import LEAD_IN
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.variability import Variability
from printhammer.run.ensemble import DISPLAY_TOLERANCE

SHARES = (1.5,)
WIRE = 1200.0
"""Rate at which the wire prints, Hz; in open loop, all dots are good at 900 Hz, but not at 1000 Hz."""
BOUND = 5.0
"""Limit on the current of the wire, A."""
AFTER = (0, 50, 200, 1000)
MEMBERS = 150
NOISE = "50 mV"
VOLTAGE = 100.0
"""Rail voltage, V, one of those of `EXAMPLE`; arbitrary."""
EXAMPLE = Path(__file__).parents[2] / "examples" / "behind_a_rail.py"
"""Example that fits coil and rail drivers to the current of the paper's hammer."""
ROOMS = (
    *MOTION,
    "derivatives",
    "control/pulses",
    "control/learning",
    "control/impact_estimator",
    "control/impact_time",
    "identify/lowpass",
    "control/table",
    "printing/dots",
    "printing/rates",
    "support/threads",
)


def printed(
    hammer: ph.Hammer, units: list[ph.Hammer], rate: float, sensors: dict[str, ph.ImpactSensor], bound: float
) -> list[tuple[str, np.ndarray]]:
    """Return the fraction of dots within limits of each unit, by strategy: open loop, table, learned."""
    rows: list[tuple[str, np.ndarray]] = []
    single = nominal(hammer, tolerance=DISPLAY_TOLERANCE)
    for name, sensor in sensors.items():
        law, table = law_for(
            hammer, rate, driver="own", sensor=sensor, members=MEMBERS, history=1, largest_current=bound
        )
        for stage in calibrate(law, units, sensor)[1]:
            good = stage.good.mean(axis=1)
            if not stage.dots and not rows:
                rows.append(("open loop", good))
                trial = attempt(
                    [Case(unit, single, rate) for unit in units],
                    [PRINTED],
                    table.strategy(hammer),
                    limits=Limits(),
                    tolerance=DISPLAY_TOLERANCE,
                    judged_from=LEAD_IN,
                )
                whole = trial.judgement.good.sum(axis=1) / trial.judgement.wanted.sum(axis=1)
                rows.append(("robust table", whole))
            if stage.dots and stage.dots in AFTER:
                rows.append((f"learned from {name}, {stage.dots} dots", good))
            print(name, stage.dots, good.mean(), flush=True)
    return rows


def cells(rows: list[tuple[str, np.ndarray]]) -> list[list[Cell]]:
    """Return one row per strategy: dots within limits, perfect units, and units with a loss."""
    plain = rows[0][1]
    return [
        [way, 100.0 * float(good.mean()), int((good == 1.0).sum()), int((good < plain - 1e-12).sum())]
        for way, good in rows
    ]


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=16)
    parser.add_argument("--wire", action="store_true")
    asked = parser.parse_args()
    count = asked.units
    columns = [
        Column(name="driven by"),
        Column(name="dots within limits", unit="%", format=".1f"),
        Column(name=f"units of {count} that print all", format="d"),
        Column(name="units with fewer than open loop", format="d"),
    ]
    settings = {"units": count, "members": MEMBERS}
    if asked.wire:
        hammer = ph.load("impact-wire")
        units = Variability().draw(hammer, count, 7)
        rows = cells(printed(hammer, units, WIRE, {"a microphone": ph.ImpactSensor(offset=OFFSET)}, BOUND))
        write("learning-wire", columns, rows, {**settings, "rate": WIRE}, ROOMS, ("impact-wire",))
        return
    plain = ph.load("hendriks-1983")
    matplotlib.use("Agg")
    hammer, _error = runpy.run_path(str(EXAMPLE))["devices"][VOLTAGE]
    safe = open_loop_rate(plain)
    units = Variability().draw(hammer, count, 7)
    coil = ph.impact_time(hammer, signal="voltage", noise=[NOISE], dots=200, units=50).sensor()
    print(coil, flush=True)
    sensors = {"its coil": coil, "a microphone": ph.ImpactSensor(offset=OFFSET)}
    rows = [
        [share, *row]
        for share in SHARES
        for row in cells(printed(hammer, units, share * safe, sensors, LARGEST_CURRENT))
    ]
    columns = [Column(name="rate / open-loop safe rate", format="g"), *columns]
    settings |= {"noise": NOISE, "shares": list(SHARES), "safe_rate": safe}
    write("learning-rail", columns, rows, settings, ROOMS)


if __name__ == "__main__":
    main()
