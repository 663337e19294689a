"""Measure how fast hammers print with feedback, as they should be and not quite so, and print tables.

Run it with ``.venv/bin/python docs/measure/feedback.py [--step HZ] [HAMMER ...]``; it takes hours a hammer.
Safe rates are those of `printhammer.safe_rate`: all patterns of eight slots and the de Bruijn cycle. The grid
of rates has the step asked for, from 500 Hz on, and from the last rate that passes 5 Hz to the next.

With ``--grid FIRST`` it looks at every rate of the grid of 5 Hz from there up to 2.2 times the open loop, for
the hammer as it should be, and goes on after one that fails; some six seconds a rate.
With ``--shares X [X ...]`` it counts how many of the 128 patterns that begin with a dot are within limits, at
rates in parts of the open loop's safe rate, for all hammers that differ; some seconds a number.
"""

import argparse

import numpy as np

import printhammer as ph
from printhammer.control.feedback.comparison import FeedbackStrategy
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.driver import driver_of
from printhammer.control.feedback.estimator.sensor import PositionSensor
from printhammer.printing.dots.limits import Limits
from printhammer.printing.dots.strategy import Strategy, open_loop
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.page.page import Page
from printhammer.printing.rates.perturbation import Perturbation, perturbed
from printhammer.printing.rates.safe_rate import from_rest, safe_rate
from printhammer.run.ensemble import DISPLAY_TOLERANCE

FIRST, FINE = 500.0, 5.0
CASES = [
    Perturbation(),
    *(Perturbation(current=share) for share in (-0.03, 0.03, -0.1, 0.1)),
    *(Perturbation(travel=way) for way in (-10e-6, 10e-6)),
    *(Perturbation(current=share, travel=way) for share in (-0.03, 0.03) for way in (-10e-6, 10e-6)),
    *(Perturbation(forms=share) for share in (-0.1, 0.1)),
    *(Perturbation(magnet=share) for share in (-0.01, 0.01)),
    *(Perturbation(damping=share) for share in (-0.2, 0.2)),
]
SEEDS = range(1, 6)
ASKED = 2.2
"""How many times faster than the open loop feedback is asked to be."""
TEXT = "The quick brown fox\njumps over the lazy dog\n0123456789 !?"


def fastest(hammer: ph.Hammer, strategy: Strategy, controller: Controller, step: float) -> tuple[float, str]:
    """Return the safe rate, Hz, first on a coarse grid, then on a fine one, and what fails next."""
    given = {"nominal": controller.single, "tolerance": DISPLAY_TOLERANCE}
    coarse = safe_rate(hammer, strategy, first=FIRST, step=step, **given)
    if not np.isfinite(coarse.rate) or coarse.failure is None:
        return coarse.rate, "" if coarse.failure is None else coarse.failure.text
    fine = safe_rate(hammer, strategy, first=coarse.rate, last=coarse.rate + step, step=FINE, **given)
    return fine.rate, "" if fine.failure is None else fine.failure.text


def every_rate(hammer: ph.Hammer, controller: Controller, first: float, own: float) -> None:
    """Print which rates fail on the fine grid, from a first one to that which is asked for."""
    strategy = FeedbackStrategy(controller)
    rates = np.arange(first, ASKED * own + FINE, FINE)
    failed = []
    for number, rate in enumerate(rates.tolist(), 1):
        found = safe_rate(
            hammer,
            strategy,
            first=rate,
            last=rate,
            step=FINE,
            nominal=controller.single,
            tolerance=DISPLAY_TOLERANCE,
        )
        if found.failure is not None:
            failed.append(rate)
            print(found.failure.text, flush=True)
        if number % 20 == 0 or number == rates.size:
            print(f"{number} of {rates.size} rates, to {rate:g} Hz: {len(failed)} fail", flush=True)


def counts(hammer: ph.Hammer, controller: Controller, own: float, shares: list[float]) -> None:
    """Print how many patterns are within limits on hammers that differ, open loop and with feedback."""
    patterns = from_rest(every=False)
    print("| | " + " | ".join(f"{share:g} x, open loop | feedback" for share in shares) + " |")
    print("|---" * (2 * len(shares) + 1) + "|")
    for by in CASES:
        cases = [Case(perturbed(hammer, by), controller.single, share * own) for share in shares]
        ways = [
            attempt(cases, patterns, way, limits=Limits(), tolerance=DISPLAY_TOLERANCE)
            for way in (open_loop, FeedbackStrategy(controller))
        ]
        found = np.stack([way.judgement.passed.reshape(len(cases), -1).sum(axis=1) for way in ways], axis=1)
        print(f"| {by.name} | " + " | ".join(map(str, found.ravel().tolist())) + " |", flush=True)


def page_row(page: Page) -> str:
    """Return how good a page is."""
    on = page.printed
    place = 1e6 * page.placement_error[on]
    counts = f"{page.line.size} | {int(page.lost.sum())} | {int(page.good.sum())}"
    dark = np.std(page.darkness[on])
    return f"{counts} | {dark:.3f} | {np.std(place):.1f}, worst {np.abs(place).max():.1f}"


def measure(name: str, given: argparse.Namespace) -> None:
    """Print what is asked for of one hammer."""
    hammer = ph.load(name)
    own = safe_rate(hammer).rate
    controller = Controller(hammer, driver_of(hammer))
    print(f"\n{hammer.name}: open loop {own:.0f} Hz\n", flush=True)
    if given.grid is not None:
        every_rate(hammer, controller, given.grid, own)
    if given.shares:
        counts(hammer, controller, own, given.shares)
    if given.grid is None and not given.shares:
        compare(hammer, controller, own, given.step)


def compare(hammer: ph.Hammer, controller: Controller, own: float, step: float) -> None:
    """Print safe rates, and pages."""
    print("| | safe rate, Hz | to open loop | first failure |")
    print("|---|---|---|---|")
    for case in CASES:
        rate, why = fastest(perturbed(hammer, case), FeedbackStrategy(controller), controller, step)
        print(f"| {case.name} | {rate:.0f} | {rate / own:.2f} | {why} |", flush=True)
    for seed in SEEDS:
        rate, why = fastest(hammer, FeedbackStrategy(controller, PositionSensor(seed=seed)), controller, step)
        print(f"| nominal, seed {seed} | {rate:.0f} | {rate / own:.2f} | {why} |", flush=True)
    print("\n| rate, Hz | | dots | lost | within limits | spread of darkness | placement, µm |")
    print("|---|---|---|---|---|---|---|")
    for share in (1.5, ASKED):
        for way in (open_loop, FeedbackStrategy(controller)):
            page = ph.print_page(hammer, TEXT, share * own, strategy=way)
            print(f"| {share * own:.0f} | {page.strategy} | {page_row(page)} |", flush=True)


def main() -> None:
    """Read the arguments and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("hammers", nargs="*", default=["hendriks-1983"])
    parser.add_argument("--step", type=float, default=50.0)
    parser.add_argument("--grid", type=float, metavar="FIRST")
    parser.add_argument("--shares", type=float, nargs="+", default=[])
    given = parser.parse_args()
    for name in given.hammers:
        measure(name, given)


if __name__ == "__main__":
    main()
