"""Measure how often a verdict on a panel of Fig. 11 is another one as the schemes of 1983 compute it.

Random hammers of the search space, those of the base rates, each with the twelve panels. Panels of one
hammer hang together: intervals are those of the mean over hammers, two standard errors either way. Run it
with ``.venv/bin/python docs/measure/schemes.py``; it takes about an hour, or a share of it with --hammers.
"""

import argparse
import math

import numpy as np
from measured import MOTION, Cell, Column, write

from printhammer.chaos import strobes
from printhammer.chaos.strobe.schemes_1983 import SCHEMES, scheme_strobes
from printhammer.claims.verdicts import changed, printed_verdicts
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.schemes_1983 import READINGS, Reading, Scheme
from printhammer.reconstruction.judging.base_rates import draw
from printhammer.reconstruction.search.space import hammer_of

HAMMERS = 30
SEED = 15
"""Of the random hammers."""

CHANGE = 1e-5
"""By which all constants are changed at once, up."""

ROOMS = (*MOTION, "chaos/strobe", "reconstruction/search/space", "reconstruction/search/candidates")
Verdicts = list[str]


def computed(hammer: Hammer, scheme: Scheme | None, reading: Reading = "look-ahead") -> Verdicts:
    """Return the verdicts on the panels, exact or as a scheme computes them."""
    periods = list(printed_verdicts())
    if scheme is None:
        strobed = strobes(hammer, periods, points=1)
    else:
        strobed = scheme_strobes(hammer, periods, scheme, reading=reading, points=1)
    return ["" if strobe.verdict is None else strobe.verdict.name for strobe in strobed]


def shares(before: list[Verdicts], after: list[Verdicts]) -> list[Cell]:
    """Return how many verdicts differ, from periodic to strange and back, and their interval."""
    pairs = [list(zip(first, second, strict=True)) for first, second in zip(before, after, strict=True)]
    every = [pair for row in pairs for pair in row]
    each = np.array([np.mean([first != second for first, second in row]) for row in pairs])
    error = 2.0 * float(each.std(ddof=1)) / math.sqrt(len(each))
    to_strange = sum(first.startswith("period") and second == "strange" for first, second in every)
    to_period = sum(first == "strange" and second.startswith("period") for first, second in every)
    other = sum(first != second for first, second in every) - to_strange - to_period
    text = f"{100.0 * float(each.mean()):.1f} ± {100.0 * error:.1f} %"
    return [len(every), text, to_strange, to_period, other]


def main() -> None:
    """Measure the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--hammers", type=int, default=HAMMERS)
    count = parser.parse_args().hammers
    hammers = [hammer_of(constants) for constants in draw(count, SEED)]
    moved = [changed(hammer, lambda _: 1, CHANGE) for hammer in hammers]
    exact = [computed(hammer, None) for hammer in hammers]
    rows: list[list[Cell]] = [
        ["exact, constants changed by 1e-5", "", *shares(exact, [computed(hammer, None) for hammer in moved])]
    ]
    print(*rows[-1], flush=True)
    for scheme in SCHEMES:
        for reading in READINGS if scheme == SCHEMES[0] else READINGS[:1]:
            found = [computed(hammer, scheme, reading) for hammer in hammers]
            rows.append([scheme, reading, *shares(exact, found)])
            print(*rows[-1], flush=True)
            if reading == READINGS[0]:
                again = [computed(hammer, scheme, reading) for hammer in moved]
                rows.append([f"{scheme}, constants changed by 1e-5", reading, *shares(found, again)])
                print(*rows[-1], flush=True)
    columns = [Column(name="computed"), Column(name="short step"), Column(name="panels", format="d")]
    columns += [Column(name="another verdict"), Column(name="periodic to strange", format="d")]
    columns += [Column(name="strange to periodic", format="d"), Column(name="other changes", format="d")]
    write("schemes", columns, rows, {"hammers": count, "seed": SEED}, ROOMS)


if __name__ == "__main__":
    main()
