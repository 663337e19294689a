"""Measure safe rates with feedback, for nominal and for perturbed hammers.

Run ``.venv/bin/python docs/measure/feedback.py [--step HZ] [HAMMER ...]``, which takes hours per
hammer. A hammer is a name, a file, or a number in the family such as ``02``; ``six`` stands for the six
hammers of the page. Safe rates are computed by `printhammer.safe_rate`, with all patterns of eight slots
and the de Bruijn cycle. The grid of rates begins at 500 Hz with the step ``--step``; between the last
rate that passes and the next, the step is 5 Hz.

``--grid FIRST`` evaluates every rate of a grid from FIRST to 2.2 times the open-loop safe rate, for the
nominal hammer, and continues after rates that fail; this takes some 24 seconds of processor time per
rate. ``--grid-step HZ`` sets the step of this grid, 5 Hz by default.
``--shares X [X ...]`` counts how many of the 128 patterns that begin with a dot are within limits, at
rates given as multiples of the open-loop safe rate, for all perturbed hammers; this takes some seconds
per number. ``--all`` reports the results at the requested rate, and for perturbed hammers at 1.5 times
the open-loop safe rate. ``--edge SECONDS ...`` counts the same patterns for other drivers, for the
nominal hammer.

These four options write the tables of the page.
"""

import argparse
import math

import numpy as np
from measured import MOTION, Cell, Column, write
from studies.reconstruction.family.family import family_hammers

import printhammer as ph
from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.plant import driver_of
from printhammer.control.feedback.sensor import PositionSensor
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.strategy import Strategy, open_loop
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.page.page import Page
from printhammer.printing.rates.safe_rate import from_rest, safe_rate
from printhammer.printing.rates.variability import Perturbation, perturbed
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
"""Rate requested of feedback, as a multiple of the open-loop safe rate."""
SIX = ("hendriks-1983", "02", "06", "10", "14", "18")
ROOMS = (*MOTION, "derivatives", "control/feedback", "control/pulses", "printing")
OFF = {
    "current −3 or +3 %": [Perturbation(current=share) for share in (-0.03, 0.03)],
    "travel −10 or +10 µm": [Perturbation(travel=way) for way in (-10e-6, 10e-6)],
    "current and travel both off, all four corners": [
        Perturbation(current=share, travel=way) for share in (-0.03, 0.03) for way in (-10e-6, 10e-6)
    ],
}
HARDER = 1.5
"""Rate at which perturbed hammers are evaluated, as a multiple of the open-loop safe rate."""
TEXT = "The quick brown fox\njumps over the lazy dog\n0123456789 !?"


def load(name: str) -> ph.Hammer:
    """Return a hammer by its name, its file, or its number in the family."""
    if not name.isdigit():
        return ph.load(name)
    return next(hammer for hammer in family_hammers() if hammer.name.endswith(f"-{name}"))


def fastest(hammer: ph.Hammer, strategy: Strategy, controller: Controller, step: float) -> tuple[float, str]:
    """Find the safe rate, Hz, on a coarse and then a fine grid; return the rate and the next failure."""
    given = {"nominal": controller.single, "tolerance": DISPLAY_TOLERANCE}
    coarse = safe_rate(hammer, strategy, first=FIRST, step=step, **given)
    if not np.isfinite(coarse.rate) or coarse.failure is None:
        return coarse.rate, "" if coarse.failure is None else coarse.failure.text
    fine = safe_rate(hammer, strategy, first=coarse.rate, last=coarse.rate + step, step=FINE, **given)
    return fine.rate, "" if fine.failure is None else fine.failure.text


def passes(hammer: ph.Hammer, strategy: Strategy, controller: Controller, rate: float) -> str:
    """Return a description of the failure at a rate, empty if all patterns and the cycle pass."""
    given = {"nominal": controller.single, "tolerance": DISPLAY_TOLERANCE}
    found = safe_rate(hammer, strategy, first=rate, last=rate, step=FINE, **given)
    return "" if found.failure is None else found.failure.text


def rounded_up(rate: float) -> float:
    """Return the rate rounded up to the fine grid, Hz."""
    return FINE * math.ceil(rate / FINE)


def asked_for(hammer: ph.Hammer, controller: Controller, own: float) -> list[Cell]:
    """Return the results of feedback at the requested rate, and on perturbed hammers."""
    strategy, rate = FeedbackStrategy(controller), rounded_up(ASKED * own)
    whole = not passes(hammer, strategy, controller, rate)
    cells: list[Cell] = [own, *((rate, round(rate / own, 2)) if whole else (f"not all at {rate:g}", None))]
    for group in OFF.values():
        driven = [perturbed(hammer, by) for by in group]
        whole = not any(passes(other, strategy, controller, rounded_up(HARDER * own)) for other in driven)
        cells.append("all" if whole else "not all")
    runs = [
        (hammer, ASKED * own),
        *((perturbed(hammer, by), HARDER * own) for by in OFF["travel −10 or +10 µm"]),
    ]
    cases = [Case(driven, controller.single, rate) for driven, rate in runs]
    seen = 0
    for seed in SEEDS:
        seen += sum(
            number == 128 for number in within(cases, FeedbackStrategy(controller, PositionSensor(seed=seed)))
        )
    return [*cells, f"{seen} of {len(cases) * len(SEEDS)}"]


def within(cases: list[Case], way: Strategy) -> list[int]:
    """Return the number of patterns beginning with a dot that are within limits, for each case."""
    found = attempt(cases, from_rest(every=False), way, limits=Limits(), tolerance=DISPLAY_TOLERANCE)
    return [int(number) for number in found.judgement.passed.reshape(len(cases), -1).sum(axis=1)]


def every_rate(
    hammer: ph.Hammer, controller: Controller, first: float, step: float, own: float
) -> list[Cell]:
    """Count the rates of a grid that fail, from a first rate to the requested rate."""
    strategy = FeedbackStrategy(controller)
    rates = np.arange(first, ASKED * own + step, step)
    failed = []
    for number, rate in enumerate(rates.tolist(), 1):
        why = passes(hammer, strategy, controller, rate)
        if why:
            failed.append(rate)
            print(why, flush=True)
        if number % 20 == 0 or number == rates.size:
            print(f"{number} of {rates.size} rates, to {rate:g} Hz: {len(failed)} fail", flush=True)
    return [hammer.name, first, float(rates[-1]), int(rates.size), len(failed)]


def counts(hammer: ph.Hammer, controller: Controller, own: float, shares: list[float]) -> list[Cell]:
    """Count the patterns within limits with feedback on perturbed hammers; print the counts of the open loop.

    For each hammer, return the number at the first rate, and the smallest number at any rate.
    """
    seen: list[Cell] = []
    print("| | " + " | ".join(f"{share:g} x, open loop | feedback" for share in shares) + " |")
    print("|---" * (2 * len(shares) + 1) + "|")
    for by in CASES:
        cases = [Case(perturbed(hammer, by), controller.single, share * own) for share in shares]
        found = [within(cases, way) for way in (open_loop, FeedbackStrategy(controller))]
        print(
            f"| {by.name} | " + " | ".join(str(n) for pair in zip(*found, strict=True) for n in pair) + " |"
        )
        seen.append(f"{found[1][0]}, {min(found[1])}")
    return seen


def drivers(hammer: ph.Hammer, own: float, edges: list[float], shares: list[float]) -> list[list[Cell]]:
    """Return the smallest number of patterns within limits, and its rate, for other driver time constants."""
    rows: list[list[Cell]] = []
    for edge in edges:
        controller = Controller(hammer, driver_of(hammer, edge=edge))
        cases = [Case(hammer, controller.single, share * own) for share in shares]
        found = within(cases, FeedbackStrategy(controller))
        rows.append(
            [1e6 * edge, sum(number == 128 for number in found), min(found), shares[int(np.argmin(found))]]
        )
        print(*rows[-1], flush=True)
    return rows


def page_row(page: Page) -> str:
    """Return the table row of a page: counts of dots, scatter of darkness, and placement errors."""
    on = page.printed
    place = 1e6 * page.placement_error[on]
    counts = f"{page.line.size} | {int(page.lost.sum())} | {int(page.good.sum())}"
    dark = np.std(page.darkness[on])
    return f"{counts} | {dark:.3f} | {np.std(place):.1f}, worst {np.abs(place).max():.1f}"


def measure(hammer: ph.Hammer, given: argparse.Namespace) -> dict[str, list]:
    """Measure the requested rows for one hammer, by table name."""
    own = safe_rate(hammer).rate
    controller = Controller(hammer, driver_of(hammer))
    print(f"\n{hammer.name}: open loop {own:.0f} Hz\n", flush=True)
    seen = {}
    if given.all:
        seen["feedback-rates"] = asked_for(hammer, controller, own)
    if given.grid is not None:
        seen["feedback-grid"] = every_rate(hammer, controller, given.grid, given.grid_step, own)
    if given.edge:
        seen["feedback-driver"] = drivers(hammer, own, given.edge, given.shares)
    elif given.shares:
        seen["feedback-shares"] = counts(hammer, controller, own, given.shares)
    if not seen:
        compare(hammer, controller, own, given.step)
    return seen


def save(found: list[dict[str, list]], hammers: list[ph.Hammer], given: argparse.Namespace) -> None:
    """Write the requested tables."""
    names = tuple(hammer.name for hammer in hammers)
    heads = [
        Column(name=name.rpartition("-")[2] if "family" in name else name, format=".4g") for name in names
    ]
    if given.all:
        first = ["open loop, safe rate, Hz", "feedback prints all at, Hz", "that is, in open-loop safe rates"]
        off = [f"{name}, at {HARDER:g} times the open loop" for name in OFF]
        labels = [*first, *off, "other seeds of the noise: runs that print all"]
        rows = list(map(list, zip(labels, *(seen["feedback-rates"] for seen in found), strict=True)))
        settings = {"asked": ASKED, "harder": HARDER, "seeds": list(SEEDS)}
        write("feedback-rates", [Column(name=""), *heads], rows, settings, ROOMS, names)
    if given.grid is not None:
        columns = [Column(name="hammer")]
        columns += [Column(name=name, unit="Hz", format="g") for name in ("from", "to")]
        columns += [Column(name=name) for name in ("rates", "not all within limits")]
        rows = [seen["feedback-grid"] for seen in found]
        write("feedback-grid", columns, rows, {"first": given.grid, "step": given.grid_step}, ROOMS, names)
    if given.edge:
        columns = [
            Column(name="time constant", unit="µs", format="g"),
            Column(name="rates at which all are within"),
        ]
        columns += [Column(name="fewest of 128"), Column(name="at, in open-loop safe rates", format="g")]
        rows = [row for seen in found for row in seen["feedback-driver"]]
        write("feedback-driver", columns, rows, {"shares": given.shares}, ROOMS, names)
    elif given.shares:
        labels = [by.name for by in CASES]
        rows = list(map(list, zip(labels, *(seen["feedback-shares"] for seen in found), strict=True)))
        write("feedback-shares", [Column(name=""), *heads], rows, {"shares": given.shares}, ROOMS, names)


def compare(hammer: ph.Hammer, controller: Controller, own: float, step: float) -> None:
    """Print the safe rates, and the quality of pages."""
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
    """Read the arguments, measure, write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("hammers", nargs="*", default=["hendriks-1983"])
    parser.add_argument("--step", type=float, default=50.0)
    parser.add_argument("--grid", type=float, metavar="FIRST")
    parser.add_argument("--grid-step", type=float, default=FINE, metavar="HZ")
    parser.add_argument("--shares", type=float, nargs="+", default=[])
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--edge", type=float, nargs="+", default=[])
    given = parser.parse_args()
    if given.edge and not given.shares:
        parser.error("--edge needs --shares")
    hammers = [load(name) for asked in given.hammers for name in (SIX if asked == "six" else (asked,))]
    save([measure(hammer, given) for hammer in hammers], hammers, given)


if __name__ == "__main__":
    main()
