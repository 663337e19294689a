"""Measure the coverage of the intervals of fitted constants in synthetic laboratories.

Run ``.venv/bin/python docs/measure/recovery.py``, which takes several minutes. ``--labs N`` sets the
number of laboratories; ``--random`` uses a random hammer in each, with every constant within 20 % of the
shipped hammer.
"""

import argparse
import math
from collections.abc import Iterator

import numpy as np
from measured import MOTION, Cell, Column, write
from studies.recovery import Recovery, recover

import printhammer as ph

SPREAD = 0.2
"""Relative range of the constants of random hammers, on either side of the shipped hammer."""


def hammers(labs: int, random: bool) -> Iterator[ph.Hammer]:
    """Return one hammer per laboratory; hammers that do not print and return to the backstop are redrawn."""
    shipped = ph.load("hendriks-1983")
    rng = np.random.default_rng(1983)
    low, high = math.log(1.0 - SPREAD), math.log(1.0 + SPREAD)
    made = 0
    while made < labs:
        hammer = shipped
        if random:
            factors = np.exp(rng.uniform(low, high, len(shipped.constants)))
            changes = {key: c.si * f for (key, c), f in zip(shipped.constants.items(), factors, strict=True)}
            try:
                hammer = shipped.replace(changes)
                if hammer.warnings() or not prints(hammer):
                    continue
            except ph.InputError:
                continue
        made += 1
        yield hammer


def prints(hammer: ph.Hammer) -> bool:
    """Whether a single pulse prints a dot, after which the armature touches the backstop."""
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
    return motion.dots[0].struck and any(touch.surface == "backstop" for touch in motion.contacts[1:])


def table(found: list[Recovery]) -> list[list[Cell]]:
    """Return one row for each constant: from its own fit, and finally from all measurements."""
    rows: list[list[Cell]] = []
    for kind in found[0].fits:
        for key, constant in found[0].fits[kind].constants.items():
            if not constant.in_file:
                continue
            pairs = [(lab.fits[kind].constants.get(key), lab.true(key)) for lab in found]
            known = [(one, true) for one, true in pairs if one is not None]
            held = sum(one.interval[0] <= true <= one.interval[1] for one, true in known)
            error = np.median([one.standard_error / true for one, true in known])
            bias = np.mean([(one.value - true) / one.standard_error for one, true in known])
            where = "all" if kind == "motion" else kind
            rows.append([f"`{key}`", where, f"{held} of {len(known)}", 100.0 * float(error), float(bias)])
    return rows


def main() -> None:
    """Measure the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--labs", type=int, default=100)
    parser.add_argument("--random", action="store_true")
    options = parser.parse_args()
    found, failed = [], []
    for seed, hammer in enumerate(hammers(options.labs, options.random)):
        try:
            found.append(recover(hammer, seed))
        except ph.InputError as error:
            failed.append(f"laboratory {seed}: {error}")
    columns = [
        Column(name="constant"),
        Column(name="from"),
        Column(name="intervals that hold"),
        Column(name="standard error", unit="%", format=".2g"),
        Column(name="mean error in standard errors", format="+.2f"),
    ]
    settings = {"laboratories": options.labs, "random": options.random}
    write("recovery", columns, table(found), settings, (*MOTION, "identify", "studies/recovery"))
    print("\n".join(["", f"{len(failed)} of {options.labs} laboratories without a result", *failed]))


if __name__ == "__main__":
    main()
