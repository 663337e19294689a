"""A compensation table beside open loop, on patterns, rates and hammers that it was not tuned on."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.printing.dots.limits import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.slots import LEAD_IN, cycle_with_lead_in, slots_of
from printhammer.printing.dots.strategy import open_loop
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.rates.perturbation import Perturbation, perturbed
from printhammer.printing.rates.safe_rate import from_rest
from printhammer.run.ensemble import DISPLAY_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import xarray as xr

    from printhammer.control.table.compensation import CompensationTable
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal
    from printhammer.printing.dots.strategy import Strategy
    from printhammer.support.arrays import FloatArray

PERTURBATIONS: Final = (
    Perturbation(),
    Perturbation(current=0.03),
    Perturbation(current=-0.03),
    Perturbation(current=0.1),
    Perturbation(current=-0.1),
    Perturbation(travel=10e-6),
    Perturbation(travel=-10e-6),
    Perturbation(forms=0.1),
    Perturbation(forms=-0.1),
    Perturbation(magnet=0.01),
    Perturbation(magnet=-0.01),
    Perturbation(damping=0.2),
    Perturbation(damping=-0.2),
)
"""Hammers on which a table is judged: supply, wire travel, number of forms, drift of magnet and damping."""

STRATEGIES: Final = ("open loop", "table")

SETS: Final = ("eight slots", "cycle", "random")
"""Patterns: all 255 of eight slots from rest; the de Bruijn cycle of order 8; long random ones."""

_LONG: Final = 12

RANDOM: Final = 8
"""Number of random patterns."""

RANDOM_SLOTS: Final = 128
"""Length of a random pattern, slots."""


@dataclass(frozen=True)
class TableReport:
    """How a table does beside open loop: arrays of shape (strategies, hammers, rates, sets of patterns).

    Attributes
    ----------
    table : CompensationTable
        The table.
    hammer : Hammer
        The hammer it is made for, whose single pulse is what every dot should be like.
    hammers : tuple of str
        In words, how the hammers that are driven differ from it.
    rates : array
        Slots per second, Hz.
    limits : Limits
        How far a dot may be off.
    good : array
        Share of dots within the limits.
    force, arrival : array
        Largest deviation of force, in parts of that of the single pulse, and of arrival, s, of printed dots.
    lost, extra : int array
        Number of lost dots and of extra contacts.
    force_deviation, arrival_deviation : array, shape (strategies, dots)
        Of every dot of the cycle at the first rate, of the hammer that the table is made for; NaN for a lost
        one.
    seed : int
        Of the random patterns.
    tolerance : float
        Of the integration.
    """

    table: CompensationTable = field(repr=False)
    hammer: Hammer
    hammers: tuple[str, ...]
    rates: FloatArray
    limits: Limits
    good: FloatArray = field(repr=False)
    force: FloatArray = field(repr=False)
    arrival: FloatArray = field(repr=False)
    lost: FloatArray = field(repr=False)
    extra: FloatArray = field(repr=False)
    force_deviation: FloatArray = field(repr=False)
    arrival_deviation: FloatArray = field(repr=False)
    seed: int
    tolerance: float

    @property
    def passed(self) -> Any:
        """Whether all dots are within limits, bool array of shape (strategies, hammers, rates)."""
        return (self.good == 1.0).all(axis=3)

    def to_dataset(self) -> xr.Dataset:
        """Return the report as a Dataset over `strategy`, `hammer`, `rate` and `patterns`."""
        import xarray as xr

        from printhammer import __version__

        axes = ("strategy", "driven", "rate", "patterns")
        told = {
            "good": ("1", "share of dots within the limits"),
            "force": ("1", "largest deviation of the force, in parts of that of the single pulse"),
            "arrival": ("s", "largest deviation of the arrival"),
            "lost": ("1", "lost dots"),
            "extra": ("1", "extra contacts"),
        }
        return xr.Dataset(
            {
                name: (axes, getattr(self, name), {"units": unit, "long_name": meaning})
                for name, (unit, meaning) in told.items()
            },
            coords={
                "strategy": np.array(STRATEGIES),
                "driven": np.array(self.hammers),
                "rate": ("rate", self.rates, {"units": "Hz", "long_name": "slots per second"}),
                "patterns": np.array(SETS),
            },
            attrs={
                "title": f"compensation table for {self.hammer.name} beside open loop",
                "hammer": self.hammer.name,
                "hammer_fingerprint": self.hammer.fingerprint,
                "force_limit": self.limits.force,
                "arrival_limit": self.limits.arrival,
                "seed": self.seed,
                "tolerance": repr(self.tolerance),
                "printhammer": __version__,
            },
        )

    def plot(self, **options: Any) -> Any:
        """Draw gain and loss; returns a matplotlib figure, see `printhammer.figures.control.compensation`."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.control.compensation").plot_report(self, **options)


def judge_table(
    hammer: Hammer,
    table: CompensationTable,
    *,
    rates: Sequence[float | str] | None = None,
    perturbations: Sequence[Perturbation] = PERTURBATIONS,
    limits: Limits | None = None,
    seed: int = 1983,
    tolerance: float = DISPLAY_TOLERANCE,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> TableReport:
    """Judge a table beside open loop.

    The patterns are those of the safe rate, and long random ones. The table is that of the hammer it is made
    for; it drives others that differ from it, and their dots are judged by the single pulse of the hammer it
    is made for.

    Parameters
    ----------
    hammer : Hammer
        The hammer the table is made for.
    table : CompensationTable
        The table.
    rates : sequence of float or str, optional
        Slots per second, Hz, or text with a unit; by default those of the table, or if these are many, five
        that lie between them.
    perturbations : sequence of Perturbation, optional
        How the hammers differ; by default `PERTURBATIONS`.
    limits : Limits, optional
        How far a dot may be off.
    seed : int, optional
        Of the random patterns.
    tolerance : float, optional
        As for `printhammer.simulate`; by default that for pictures.
    threads : int, optional
        By default as many as there are cores.
    progress : callable, optional
        Called now and then with the number of trials done and of all.

    Returns
    -------
    TableReport
        With shares of good dots and worst deviations.

    Raises
    ------
    InputError
        The table is made for another hammer, or not for these rates; a hammer without what a perturbation
        changes.
    """
    strategies: tuple[Strategy, Strategy] = (open_loop, table.strategy(hammer))
    asked = np.array(
        [read_positive(rate, "Hz", "rate") for rate in rates] if rates is not None else between(table)
    )
    if not asked.size or not perturbations:
        raise InputError("rates, perturbations: expected at least one of each")
    bounds = Limits() if limits is None else limits
    single: Nominal = nominal(hammer, tolerance=tolerance)
    driven = [perturbed(hammer, by) for by in perturbations]
    sets = [from_rest(every=True), [slots_of(cycle_with_lead_in())], random_patterns(seed)]
    shape = len(strategies), len(driven), asked.size, len(sets)
    good, force, arrival, lost, extra = (np.zeros(shape) for _ in range(5))
    deviations: list[tuple[FloatArray, FloatArray]] = []
    done = 0
    for s, strategy in enumerate(strategies):
        for p, patterns in enumerate(sets):
            for r, rate in enumerate(asked.tolist()):
                cases = [Case(one, single, rate) for one in driven]
                trial = attempt(
                    cases,
                    patterns,
                    strategy,
                    limits=bounds,
                    judged_from=LEAD_IN if p == 1 else 0,
                    tolerance=tolerance,
                    threads=threads,
                )
                found, count = trial.judgement, len(patterns)
                for c in range(len(driven)):
                    rows = slice(c * count, (c + 1) * count)
                    place = s, c, r, p
                    good[place] = found.good[rows].sum() / found.wanted[rows].sum()
                    force[place] = _largest(found.force_deviation[rows])
                    arrival[place] = _largest(found.arrival_deviation[rows])
                    lost[place] = found.lost[rows].sum()
                    extra[place] = found.extra_contacts[rows].sum()
                if p == 1 and r == 0:
                    wanted = found.wanted[0]
                    deviations.append((found.force_deviation[0][wanted], found.arrival_deviation[0][wanted]))
                done += 1
                if progress is not None:
                    progress(done, len(strategies) * len(sets) * asked.size)
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
        force_deviation=np.array([one[0] for one in deviations]),
        arrival_deviation=np.array([one[1] for one in deviations]),
        seed=seed,
        tolerance=tolerance,
    )


def _largest(values: FloatArray) -> float:
    known = np.abs(values[~np.isnan(values)])
    return float(known.max()) if known.size else float("nan")


def between(table: CompensationTable) -> list[float]:
    """Return rates at which to judge a table: its own, or of a long one five in the middle between two."""
    rates = table.rates
    if rates.size < _LONG:
        return [float(rate) for rate in rates]
    middle = 0.5 * (rates[:-1] + rates[1:])
    upper = middle[middle.size // 3 :]
    return [float(upper[place]) for place in np.linspace(0, upper.size - 1, 5).astype(np.int64)]


def random_patterns(seed: int) -> list[tuple[int, ...]]:
    """Return long random patterns, some sparse and some dense; at least one dot each."""
    rng = np.random.default_rng(seed)
    shares = np.linspace(0.2, 0.9, RANDOM)
    drawn = [slots_of(rng.random(RANDOM_SLOTS) < share) for share in shares.tolist()]
    return [slots or (0,) for slots in drawn]
