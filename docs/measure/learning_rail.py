"""Measure what a hammer behind a rail learns, from its coil alone and from a microphone.

Run it with ``.venv/bin/python docs/measure/learning_rail.py``. It draws units of the paper's hammer behind a
rail of 100 V, and counts the dots of the de Bruijn cycle of order 8 within limits, at parts of the open-loop
safe rate of the hammer with its current. It takes some minutes; ``--units N`` draws another number.
"""

import argparse

import numpy as np
from measured import MOTION, Cell, Column, write

import printhammer as ph
from printhammer.control.learning.calibrate import calibrate
from printhammer.control.learning.preparation import law_for
from printhammer.printing.dots.limits import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.slots import LEAD_IN, cycle_with_lead_in, slots_of
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.variability import Variability
from printhammer.run.ensemble import DISPLAY_TOLERANCE

SAFE = 850.0
"""Open-loop safe rate of the shipped hammer, Hz."""
SHARES = (1.25, 1.5)
AFTER = (0, 50, 200, 1000)
MEMBERS = 100
NOISE = "50 mV"
COIL = {"resistance": 28.6, "inductance": "6.547 mH"}
RAIL = {"shape": "rail", "voltage": 100.0, "width": "177.24 us", "decay_resistance": "159.1 ohm"}
CYCLE = slots_of(cycle_with_lead_in())
ROOMS = (
    *MOTION,
    "control/coil_current",
    "control/learning",
    "control/sensing",
    "control/table",
    "control/widths",
    "printing/dots",
    "printing/rates",
)


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=24)
    count = parser.parse_args().units
    hammer = ph.load("hendriks-1983").replace({"coil": COIL, "waveform": RAIL})
    units, single = Variability().draw(hammer, count, 7), nominal(hammer, tolerance=DISPLAY_TOLERANCE)
    coil = ph.impact_time(hammer, signal="voltage", noise=[NOISE], dots=200, units=50).sensor()
    print(coil, flush=True)
    judged = np.asarray(CYCLE) >= LEAD_IN
    rows: list[list[Cell]] = []

    def add(share: float, way: str, good: np.ndarray, plain: np.ndarray | None) -> None:
        fewer = None if plain is None else int((good < plain - 1e-12).sum())
        rows.append([share, way, 100.0 * float(good.mean()), int((good == 1.0).sum()), fewer])
        print(*rows[-1], flush=True)

    for share in SHARES:
        rate, plain = share * SAFE, None
        for name, sensor in (("its coil", coil), ("a microphone", ph.ImpactSensor())):
            law, table = law_for(hammer, rate, driver="own", sensor=sensor, members=MEMBERS, history=1)
            for stage in calibrate(law, units, sensor)[1]:
                good = stage.cycle.good[:, judged].mean(axis=1)
                if not stage.dots and plain is None:
                    plain = good
                    add(share, "open loop", good, None)
                    cases = [Case(unit, single, rate) for unit in units]
                    way, limits = table.strategy(hammer), Limits()
                    trial = attempt(
                        cases, [CYCLE], way, limits=limits, tolerance=DISPLAY_TOLERANCE, judged_from=LEAD_IN
                    )
                    whole = trial.judgement.good.sum(axis=1) / trial.judgement.wanted.sum(axis=1)
                    add(share, "robust table", whole, plain)
                if stage.dots and stage.dots in AFTER:
                    add(share, f"learned from {name}, {stage.dots} dots", good, plain)
    columns = [
        Column(name="times the safe rate", format=".2f"),
        Column(name="driven by"),
        Column(name="dots within limits", unit="%", format=".1f"),
        Column(name=f"units of {count} that print all", format="d"),
        Column(name="units with fewer than open loop", format="d"),
    ]
    settings = {"units": count, "members": MEMBERS, "noise": NOISE, "shares": list(SHARES)}
    write("learning-rail", columns, rows, settings, ROOMS)


if __name__ == "__main__":
    main()
