"""Measure how fast hammers print with feedback, as they should be and not quite so, and print tables.

Run it with ``.venv/bin/python docs/measure/feedback.py [--step HZ] [HAMMER ...]``; it takes hours a hammer.
Safe rates are those of `printhammer.printing.safe_rate`: all patterns of eight slots and the de Bruijn cycle.
The grid of rates has the step asked for, from 500 Hz on, and from the last rate that passes 5 Hz to the next.
"""

import argparse

import numpy as np

import printhammer as ph
from printhammer.control.controller import Controller
from printhammer.control.driver import driver_of
from printhammer.control.feedback import FeedbackStrategy
from printhammer.control.sensor import PositionSensor
from printhammer.ensemble import DISPLAY_TOLERANCE
from printhammer.printing.page import Page
from printhammer.printing.perturbation import Perturbation, perturbed
from printhammer.printing.safe_rate import safe_rate
from printhammer.printing.strategy import Strategy, open_loop

FIRST, FINE = 500.0, 5.0
CASES = [
    Perturbation(),
    *(Perturbation(current=share) for share in (-0.03, 0.03, -0.1, 0.1)),
    *(Perturbation(travel=way) for way in (-10e-6, 10e-6)),
    *(Perturbation(current=share, travel=way) for share in (-0.03, 0.03) for way in (-10e-6, 10e-6)),
    *(Perturbation(forms=share) for share in (-0.1, 0.1)),
    *(Perturbation(magnet=share) for share in (-0.02, 0.02)),
    *(Perturbation(damping=share) for share in (-0.2, 0.2)),
]
SEEDS = range(1, 6)
TEXT = "The quick brown fox\njumps over the lazy dog\n0123456789 !?"


def fastest(hammer: ph.Hammer, strategy: Strategy, controller: Controller, step: float) -> tuple[float, str]:
    """Return the safe rate, Hz, first on a coarse grid, then on a fine one, and what fails next."""
    given = {"nominal": controller.single, "tolerance": DISPLAY_TOLERANCE}
    coarse = safe_rate(hammer, strategy, first=FIRST, step=step, **given)
    if not np.isfinite(coarse.rate) or coarse.failure is None:
        return coarse.rate, "" if coarse.failure is None else coarse.failure.text
    fine = safe_rate(hammer, strategy, first=coarse.rate, last=coarse.rate + step, step=FINE, **given)
    return fine.rate, "" if fine.failure is None else fine.failure.text


def page_row(page: Page) -> str:
    """Return how good a page is."""
    on = page.printed
    place = 1e6 * page.placement_error[on]
    counts = f"{page.line.size} | {int(page.lost.sum())} | {int(page.good.sum())}"
    dark = np.std(page.darkness[on])
    return f"{counts} | {dark:.3f} | {np.std(place):.1f}, worst {np.abs(place).max():.1f}"


def measure(name: str, step: float) -> None:
    """Print what is found for one hammer."""
    hammer = ph.load(name)
    own = safe_rate(hammer).rate
    controller = Controller(hammer, driver_of(hammer))
    print(f"\n{hammer.name}: open loop {own:.0f} Hz\n\n| | safe rate, Hz | to open loop | first failure |")
    print("|---|---|---|---|")
    for case in CASES:
        rate, why = fastest(perturbed(hammer, case), FeedbackStrategy(controller), controller, step)
        print(f"| {case.name} | {rate:.0f} | {rate / own:.2f} | {why} |", flush=True)
    for seed in SEEDS:
        rate, why = fastest(hammer, FeedbackStrategy(controller, PositionSensor(seed=seed)), controller, step)
        print(f"| nominal, seed {seed} | {rate:.0f} | {rate / own:.2f} | {why} |", flush=True)
    print("\n| rate, Hz | | dots | lost | within limits | spread of darkness | placement, µm |")
    print("|---|---|---|---|---|---|---|")
    for share in (1.5, 2.2):
        for way in (open_loop, FeedbackStrategy(controller)):
            page = ph.print_page(hammer, TEXT, share * own, strategy=way)
            print(f"| {share * own:.0f} | {page.strategy} | {page_row(page)} |", flush=True)


def main() -> None:
    """Read the arguments and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("hammers", nargs="*", default=["hendriks-1983"])
    parser.add_argument("--step", type=float, default=50.0)
    given = parser.parse_args()
    for name in given.hammers:
        measure(name, given.step)


if __name__ == "__main__":
    main()
