"""Comparison of a compensation table with open loop on patterns, rates and hammers not used in tuning."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Unpack

import numpy as np

from printhammer.control.table.compensation import CompensationTable
from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import Nominal, nominal
from printhammer.printing.dots.strategy import KINDS, Strategy, long_patterns, open_loop, slots_of
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.safe_rate import from_rest
from printhammer.printing.rates.variability import Perturbation, perturbed
from printhammer.printing.rates.words import multipliers
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    styled,
)
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import FloatArray

PERTURBATIONS: Final = (
    Perturbation(),
    *(Perturbation(current=share) for share in (0.03, -0.03, 0.1, -0.1)),
    *(Perturbation(travel=way) for way in (10e-6, -10e-6)),
    *(Perturbation(forms=share) for share in (0.1, -0.1)),
    *(Perturbation(magnet=share) for share in (0.01, -0.01)),
    *(Perturbation(damping=share) for share in (0.2, -0.2)),
)
"""Default perturbations of the hammers: supply, wire travel, paper forms, drift of magnet and damping."""

STRATEGIES: Final = ("open loop", "table")

# Pattern sets: all 255 of eight slots from rest; the cycle, rows and a line of text; long random patterns
SETS: Final = ("eight slots", *KINDS, "random")
_LONG: Final = 12  # Number of rates above which a table is judged between its rates; arbitrary

RANDOM: Final = 8  # Number of random patterns; arbitrary
RANDOM_SLOTS: Final = 128  # Length of a random pattern, slots; arbitrary

_AXES: Final = "strategy driven rate patterns"


class TableReport(Result, rows=_AXES):
    """Comparison of a compensation table with open loop, by hammer, rate and set of patterns."""

    table: CompensationTable = part("compensation table to be tested", repr=False)
    hammer: Hammer = part(
        "hammer that the table is made for", more="every dot is compared with its single-pulse dot"
    )
    hammers: tuple[str, ...] = coordinate(
        "", "deviation of the driven hammer from the design, in words", "driven", name="driven"
    )
    rates: FloatArray = coordinate("Hz", "slot rate", "rate", name="rate")
    limits: Limits = part("limits on the dots")
    good: FloatArray = column("1", "fraction of dots within limits", _AXES)
    force: FloatArray = column(
        "1",
        "largest deviation of the force, relative to that of the single pulse",
        _AXES,
        more="of the printed dots only",
    )
    arrival: FloatArray = column(
        "s", "largest deviation of the arrival", _AXES, more="of the printed dots only"
    )
    lost: FloatArray = column("1", "number of lost dots", _AXES)
    extra: FloatArray = column("1", "number of extra contacts", _AXES)
    multiplier: FloatArray = column(
        "1",
        "multiplier of a small error from dot to dot in a row",
        "strategy driven rate",
        more="the larger multiplier of rows with a dot in every slot and in every second slot; NaN if neither"
        " is a periodic orbit",
    )
    force_deviation: FloatArray = part(
        "relative force deviation of every dot of the cycle at the first rate, for the table's hammer, shape"
        " (strategies, dots)",
        more="NaN for a lost dot",
        repr=False,
    )
    arrival_deviation: FloatArray = part(
        "arrival deviation of every dot of the cycle at the first rate, for "
        "the table's hammer, s, shape (strategies, dots)",
        repr=False,
    )
    seed: int = scalar("1", "seed of the random patterns")
    tolerance: float = part("error tolerance per integration step")
    strategy: tuple[str, ...] = coordinate("", "drive strategy", "strategy", default=STRATEGIES)
    patterns: tuple[str, ...] = coordinate("", "set of patterns", "patterns", default=SETS)

    @property
    def passed(self) -> Any:
        """Whether all dots are within limits: boolean array of shape (strategies, hammers, rates).

        A table with a row in which errors grow from dot to dot does not pass, even if the row is within
        limits: the number of dots after which it exceeds the limits depends on rounding errors.
        """
        held = (self.good == 1.0).all(axis=3)
        held[1] &= ~(np.abs(self.multiplier[1]) > 1.0)
        return held

    @property
    def title(self) -> str:
        """One-line title with the name of the table's hammer."""
        return f"compensation table for {self.hammer.name} beside open loop"

    def summary(self) -> Summary:
        """Tabulate good and lost dots of open loop and table, one row per hammer."""
        rates = self.rates
        span = f"{rates[0]:g} Hz" if rates.size == 1 else f"{rates.min():g} Hz to {rates.max():g} Hz"
        share, lost = 100.0 * self.good.mean(axis=(2, 3)), self.lost.sum(axis=(2, 3))
        growth = np.fmax.reduce(np.abs(self.multiplier[1]), axis=1)
        columns = [
            Cells("hammer driven", self.hammers, left=True),
            Cells("open loop:\ngood dots", [f"{each:.2f} %" for each in share[0]]),
            Cells("lost", lost[0], "", ".0f"),
            Cells("table:\ngood dots", [styled("strong", f"{each:.2f} %") for each in share[1]]),
            Cells("lost", lost[1], "", ".0f"),
            Cells("worst force", [f"{100.0 * each:.1f} %" for each in self.force[1].max(axis=(1, 2))]),
            Cells("worst arrival", self.arrival[1].max(axis=(1, 2)), "s"),
            Cells(
                "multiplier\nof rows",
                [styled("bad", f"{each:.2f}") if each > 1.0 else f"{each:.2f}" for each in growth],
            ),
        ]
        said = f"On patterns it was not tuned on, {span}"
        unstable = (
            "A multiplier above 1 means that an error grows from dot to dot: such rows print fewer dots than"
            " stated here as soon as the hammer or a firing time differs a little."
        )
        return Summary([Grid(columns, said), *(["", unstable] if (growth > 1.0).any() else [])])

    def notes(self) -> dict[str, Any]:
        """Return the limits on the dots, as attributes of the Dataset."""
        return {"force_limit": self.limits.force, "arrival_limit": self.limits.arrival}


@computation
def judge_table(
    hammer: Hammer,
    table: CompensationTable,
    *,
    rates: Sequence[float | str] | None = None,
    perturbations: Sequence[Perturbation] | None = None,
    limits: Limits | None = None,
    seed: int = 1983,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> TableReport:
    """Compare a table with open loop on hammers that differ from the hammer of the table.

    The patterns are the test patterns of `printhammer.safe_rate`, and random patterns. The dots of every
    hammer are compared with the single-pulse dot of the hammer for which the table was tuned.

    Parameters
    ----------
    hammer : Hammer
        The hammer for which the table was tuned.
    table : CompensationTable
        Table to compare with open loop.
    rates : sequence of float or str, optional
        Slot rates [Hz] or text with a unit; by default those of the table or, if the table is long, five
        rates halfway between its rates.
    perturbations : sequence of Perturbation, optional
        Deviations of the driven hammers; by default the `PERTURBATIONS` that apply to the hammer's laws.
    limits
        As for `printhammer.safe_rate`.
    seed : int, optional
        Seed of the random patterns.

    Returns
    -------
    TableReport
        Fractions of good dots, and the worst deviations.

    Raises
    ------
    InputError
        The table was tuned for another hammer or other rates, or a perturbation does not apply to the
        hammer.
    """
    strategies: tuple[Strategy, Strategy] = (open_loop, table.strategy(hammer))
    asked = np.array(
        [read_positive(rate, "Hz", "rate") for rate in rates] if rates is not None else between(table)
    )
    if perturbations is None:
        perturbations = [by for by in PERTURBATIONS if _is_applicable(hammer, by)]
    if not asked.size or not perturbations:
        raise InputError("rates, perturbations: expected at least one of each", key="rates")
    bounds = Limits() if limits is None else limits
    single: Nominal = nominal(hammer, tolerance=effort.tolerance)
    driven = [perturbed(hammer, by) for by in perturbations]
    sets = _sets(seed)
    shape = len(strategies), len(driven), asked.size, len(SETS)
    good, force, arrival, lost, extra = (np.zeros(shape) for _ in range(5))
    growth = np.full(shape[:3], np.nan)
    deviations: list[tuple[FloatArray, FloatArray]] = []
    done = 0
    for s, strategy in enumerate(strategies):
        for r, rate in enumerate(asked.tolist()):
            growth[s, :, r] = _growth(driven, rate, strategy, effort.quiet)
        for p, (name, (patterns, begin)) in enumerate(sets.items()):
            for r, rate in enumerate(asked.tolist()):
                trial = attempt(
                    [Case(other, single, rate) for other in driven],
                    patterns,
                    strategy,
                    limits=bounds,
                    judged_from=begin,
                    effort=effort.quiet,
                )
                judgement = trial.judgement
                for c in range(len(driven)):
                    rows, place = trial.rows(c), (s, c, r, p)
                    good[place] = judgement.good[rows].sum() / judgement.wanted[rows].sum()
                    force[place] = _largest(judgement.force_deviation[rows])
                    arrival[place] = _largest(judgement.arrival_deviation[rows])
                    lost[place] = judgement.lost[rows].sum()
                    extra[place] = judgement.extra_contacts[rows].sum()
                if name == "cycle" and r == 0:
                    wanted = judgement.wanted[0]
                    deviations.append(
                        (judgement.force_deviation[0][wanted], judgement.arrival_deviation[0][wanted])
                    )
                done += 1
                effort.report(done, len(strategies) * len(sets) * asked.size)
    return TableReport(
        table=table,
        hammer=hammer,
        hammers=tuple(by.name for by in perturbations),
        rates=asked,
        limits=bounds,
        good=good,
        force=force,
        arrival=arrival,
        lost=lost,
        extra=extra,
        multiplier=growth,
        force_deviation=np.array([force for force, _arrival in deviations]),
        arrival_deviation=np.array([late for _force, late in deviations]),
        seed=seed,
        tolerance=effort.tolerance,
    )


def _is_applicable(hammer: Hammer, by: Perturbation) -> bool:
    """Whether the hammer has all laws that a perturbation changes."""
    try:
        perturbed(hammer, by)
    except InputError:
        return False
    return True


def _growth(driven: Sequence[Hammer], rate: float, strategy: Strategy, effort: Effort) -> FloatArray:
    """Compute, for each hammer, the dot-to-dot multiplier of rows of dots; see `TableReport.multiplier`."""
    rates = [rate] * len(driven)
    each = np.array([multipliers(driven, rates, strategy, effort, step) for step in (1, 2)])
    largest = np.nan_to_num(np.abs(each), nan=-1.0).argmax(axis=0)
    return np.asarray(each[largest, np.arange(len(driven))])


def _sets(seed: int) -> dict[str, tuple[Sequence[tuple[int, ...]], int | Sequence[int]]]:
    """Return, by name, the patterns of each set, and the index of the first slot that is evaluated."""
    long = {kind: [each for each in long_patterns() if each.kind == kind] for kind in KINDS}
    judged = {
        kind: ([each.slots for each in some], [each.judged_from for each in some])
        for kind, some in long.items()
    }
    every = (from_rest(every=True), 0), *judged.values(), (random_patterns(seed), 0)
    return dict(zip(SETS, every, strict=True))


def _largest(values: FloatArray) -> float:
    known = np.abs(values[~np.isnan(values)])
    return float(known.max()) if known.size else float("nan")


def between(table: CompensationTable) -> list[float]:
    """Return the rates [Hz] at which to validate a table: its own or, if it is long, five between them."""
    rates = table.rates
    if rates.size < _LONG:
        return [float(rate) for rate in rates]
    middle = 0.5 * (rates[:-1] + rates[1:])
    upper = middle[middle.size // 3 :]
    return [float(upper[place]) for place in np.linspace(0, upper.size - 1, 5).astype(np.int64)]


def random_patterns(seed: int) -> list[tuple[int, ...]]:
    """Return `RANDOM` random patterns of `RANDOM_SLOTS` slots, with at least one dot each.

    The fraction of slots with a dot increases from 0.2 in the first pattern to 0.9 in the last.
    """
    rng = np.random.default_rng(seed)
    shares = np.linspace(0.2, 0.9, RANDOM)
    drawn = [slots_of(rng.random(RANDOM_SLOTS) < share) for share in shares.tolist()]
    return [slots or (0,) for slots in drawn]
