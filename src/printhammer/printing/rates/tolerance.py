"""Tolerance yield: fraction of the units of a production that print within limits, and safe rates."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Final, Literal, SupportsIndex, Unpack, get_args

import numpy as np

from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import unknown
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal, single_pulses
from printhammer.printing.dots.strategy import Strategy, name_of, open_loop
from printhammer.printing.dots.trial import Case
from printhammer.printing.rates.safe_rate import all_pass, grid_notes, grid_of, safe_rates
from printhammer.printing.rates.variability import changed
from printhammer.results import Result, column, derived, part, scalar
from printhammer.results.summary import (
    FactRow,
    Facts,
    Summary,
    styled,
)
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import BoolArray, FloatArray, TextArray

SPREAD: Final = 0.01  # Default relative spread of a constant, to either side; arbitrary

STEP: Final = 25.0  # Default step of the rate grid, Hz: coarser than for a single safe rate; arbitrary

MOST: Final = 100_000  # Largest number of hammers in a yield; arbitrary

Judged = Literal["own", "design"]
GAP: Final = "pack.front"
"""Key of the position whose spread is relative to its distance from the backstop, since x = 0 is
arbitrary."""

FIXED: Final = ("backstop.position", "platen")
"""Keys of the constants without a default spread, since no force depends on the origin of x and the
platen."""


_SHARES: Final = (0.95, 0.5)
"""Fractions of the hammers for which a summary states the largest common safe rate; arbitrary."""


class ToleranceYield(Result):
    """Yield of randomly drawn hammers: constants, single-pulse dots and verdicts."""

    hammer: Hammer = part("design hammer")
    strategy: str = scalar("", "name of the drive strategy")
    limits: Limits = part("limits on the dots")
    rate: float = part("slot rate of the test, Hz", more="NaN if safe rates were computed instead")
    spreads: Mapping[str, float] = part("relative spread of each varying constant, to either side")
    factors: FloatArray = column(
        "1",
        "constant over that of the design; for the front, its distance from the backstop",
        "member constant",
        more="in the order of `spreads`",
        name="factor",
    )
    judged_by: Judged = scalar(
        "", 'reference of the dots: "own" or "design"', more="hammer whose single-pulse dot is the reference"
    )
    status: TextArray = column(
        "1",
        "status of the hammer",
        "member",
        more='"ok", "no hammer" if the constants are invalid, "does not rest", "makes no dot"',
    )
    single_force: FloatArray = column(
        "N", "force of the single-pulse dot", "member", more="NaN if the hammer makes no dot"
    )
    single_flight_time: FloatArray = column(
        "s", "flight time of the single-pulse dot", "member", more="NaN if the hammer makes no dot"
    )
    passed: BoolArray = column(
        "1",
        "whether every pattern is within limits",
        "member",
        more="at `rate`, or at the first rate of the grid if `rate` is NaN",
        dtype=np.int8,
    )
    safe_rates: FloatArray = column(
        "Hz",
        "safe rate",
        "member",
        more="NaN if not even the first rate passes, or if safe rates were not computed",
        name="safe_rate",
    )
    grid: FloatArray = part("grid of rates, Hz", repr=False)
    seed: int = scalar("1", "seed of the random number generator")
    tolerance: float = part("error tolerance per integration step")

    @property
    def title(self) -> str:
        """One-line title with the name of the design hammer."""
        return f"tolerance yield of {self.hammer.name}"

    def summary(self) -> Summary:
        """Summarise the yield, or the spread of the safe rates."""
        spreads = sorted(set(self.spreads.values()))
        within = f"{100.0 * spreads[0]:g} %" + (f" to {100.0 * spreads[-1]:g} %" if len(spreads) > 1 else "")
        odd = self.status[self.status != "ok"]
        rows: list[FactRow] = [
            ("limits", f"{self.limits.said}, judged by {self.judged_by} single pulse"),
            (
                "draw",
                (
                    f"{len(self.status)} hammers, {len(self.spreads)} constants within {within},"
                    f" seed {self.seed}"
                ),
            ),
            *(
                ("", styled("poor", f"{int((odd == name).sum())} {name}"))
                for name in sorted(set(odd.tolist()))
            ),
        ]
        if not math.isnan(self.rate):
            share = f"{100.0 * self.share:.1f} ± {100.0 * self.share_error:.1f} %"
            return Summary([Facts([*rows, ("pass", f"{styled('strong', share)} at {self.rate:g} Hz")])])
        for part_of_all in _SHARES:
            rates = [rate for rate in self.grid.tolist() if self.share_at(rate) >= part_of_all]
            reached = f"up to {rates[-1]:g} Hz" if rates else "at no rate tried"
            rows.append((f"{100.0 * part_of_all:g} % keep to the limits", reached))
        known = self.safe_rates[~np.isnan(self.safe_rates)]
        if known.size:
            rows.append(("safe rates", f"{known.min():g} to {known.max():g} Hz"))
        return Summary([Facts(rows)])

    def notes(self) -> dict[str, Any]:
        """Return limits, spreads, rate grid and test rate (if any), as attributes of the Dataset."""
        return {
            "limits": self.limits.text,
            "spreads": dict(self.spreads),
            "rate": None if math.isnan(self.rate) else self.rate,
            **grid_notes(self.grid),
        }

    @property
    @derived("", "varying constant", "constant", kind="coordinate")
    def constant(self) -> list[str]:
        """Names of the varying constants."""
        return list(self.spreads)

    @property
    @derived("1", "fraction of hammers that pass")
    def share(self) -> float:
        """Fraction of hammers that pass; invalid hammers and hammers without a dot are failures."""
        return float(self.passed.mean())

    @property
    def share_error(self) -> float:
        """Standard error of `share` for independent draws; an upper estimate for the Sobol sequence."""
        count = len(self.passed)
        # At 0 or 1 the plain binomial formula would give a standard error of 0.
        share = (self.passed.sum() + 0.5) / (count + 1.0)
        return float(math.sqrt(share * (1.0 - share) / count))

    def share_at(self, rate: float) -> float:
        """Return the fraction of hammers whose safe rate is at least `rate` [Hz]."""
        return float((self.safe_rates >= rate).mean())


@computation
def tolerance_yield(
    hammer: Hammer,
    rate: float | str | None = None,
    *,
    number: SupportsIndex = 64,
    spreads: float | Mapping[str, float] = SPREAD,
    seed: SupportsIndex = 0,
    judged_by: Judged = "own",
    strategy: Strategy = open_loop,
    limits: Limits | None = None,
    first: float | str | None = None,
    last: float | str | None = None,
    step: float | str | None = None,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> ToleranceYield:
    """Draw hammers about a design, and determine which hammers print within limits.

    Every constant is distributed uniformly within its spread, and drawn by a scrambled Sobol sequence.

    Parameters
    ----------
    hammer : Hammer
        The design hammer.
    rate : float or str, optional
        Slot rate [Hz] or text with a unit, at which all patterns from rest and the long patterns must be
        within limits. Without a rate, the safe rate of each hammer is computed.
    number : int, optional
        Number of hammers.
    spreads : float or mapping, optional
        Relative spread to either side: one number for every constant, or a mapping by key, such as
        {"magnet.Am": 0.02}, in which unnamed constants do not vary.
    seed : int, optional
        Seed of the random draw.
    judged_by : str, optional
        "own": dots are compared with the single-pulse dot of the same hammer, as if each printer were
        adjusted; "design": with the single-pulse dot of the design.
    strategy, limits, first, last, step
        As for `printhammer.safe_rate`.

    Returns
    -------
    ToleranceYield
        The yield, with a status for each hammer.
    """
    count = read_count(number, "number")
    if count > MOST:
        raise InputError.of("number", count, f"at most {MOST} hammers", written=str(count))
    if judged_by not in get_args(Judged):
        raise InputError.of("judged_by", judged_by, f"one of {', '.join(get_args(Judged))}")
    grid = (
        grid_of(hammer, first, last, step, STEP)[0]
        if rate is None
        else np.array([read_positive(rate, "Hz", "rate")])
    )
    bounds = Limits() if limits is None else limits
    spread = spreads_of(hammer, spreads)
    design = nominal(hammer, tolerance=effort.tolerance)
    factors = draw(spread, count, int(seed))
    made, fate = changed(
        hammer, [(row, "drawn within its spread") for row in _changes(hammer, spread, factors)]
    )
    status = np.array(fate, "U16")
    resting = np.flatnonzero(status == "ok")
    force, flight = np.full(count, np.nan), np.full(count, np.nan)
    alone = single_pulses([made[k] for k in resting], effort=effort.quiet)
    for k, dot in zip(resting.tolist(), alone, strict=True):
        if dot is None:
            status[k] = "makes no dot"
        else:
            force[k], flight[k] = dot.force, dot.flight_time
    singles = [dot for dot in alone if dot is not None]
    left = np.flatnonzero(status == "ok")
    hammers = [made[k] for k in left]
    judges = [design] * len(left) if judged_by == "design" else singles
    passed, rates = np.zeros(count, dtype=np.bool_), np.full(count, np.nan)
    if rate is None:
        rates[left] = safe_rates(hammers, judges, grid, strategy, limits=bounds, effort=effort)
        passed = ~np.isnan(rates)
    elif left.size:
        cases = [Case(other, judge, float(grid[0])) for other, judge in zip(hammers, judges, strict=True)]
        passed[left] = all_pass(cases, strategy, limits=bounds, effort=effort.quiet)
        effort.report(count, count)
    return ToleranceYield(
        hammer=hammer,
        strategy=name_of(strategy),
        limits=bounds,
        rate=math.nan if rate is None else float(grid[0]),
        spreads=spread,
        factors=factors,
        judged_by=judged_by,
        status=status,
        single_force=force,
        single_flight_time=flight,
        passed=passed,
        safe_rates=rates,
        grid=grid,
        seed=int(seed),
        tolerance=effort.tolerance,
    )


def spreads_of(hammer: Hammer, asked: float | Mapping[str, float]) -> dict[str, float]:
    """Return the relative spread, to either side, of each varying constant of a hammer, by key.

    Raises
    ------
    InputError
        A spread is negative or at least 1, a constant is unknown or zero, or no constant varies.
    """
    constants = hammer.constants
    wanted: dict[str, Any]
    if isinstance(asked, Mapping):
        wanted = dict(asked)
    else:
        wanted = {
            key: asked for key, constant in constants.items() if key not in FIXED and constant.si != 0.0
        }
    for key, value in wanted.items():
        if key not in constants:
            raise unknown(key, constants, f"{hammer.path}: spread")
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < 1.0:
            raise InputError.of(f"spread of {key}", value, "from 0 to below 1")
    varying = {key: float(value) for key, value in wanted.items() if value > 0.0}
    if not varying:
        raise InputError("spreads: expected at least one constant that varies", key="spreads")
    return varying


def draw(spreads: Mapping[str, float], number: int, seed: int) -> FloatArray:
    """Draw factors on the constants, uniform within relative spreads, shape (number, constants).

    The points are a scrambled Sobol sequence (A. B. Owen, J. Complexity 14 (1998) 466).
    """
    from scipy.stats import qmc

    if seed < 0:
        raise InputError.of("seed", seed, "0 or more", written=str(seed))
    sequence = qmc.Sobol(len(spreads), scramble=True, rng=np.random.default_rng(seed))
    points = sequence.random_base2(math.ceil(math.log2(number)) if number > 1 else 0)[:number]
    return np.asarray(1.0 + (2.0 * points - 1.0) * np.array(list(spreads.values())))


def _changes(hammer: Hammer, spreads: Iterable[str], factors: FloatArray) -> list[dict[str, float]]:
    """Multiply the constants of the design by drawn factors; return the constants of each hammer, SI."""
    zero = {key: hammer.origin if key == GAP else 0.0 for key in spreads}
    values = {key: hammer.constants[key].si for key in zero}
    return [
        {key: zero[key] + (values[key] - zero[key]) * factor for key, factor in zip(zero, row, strict=True)}
        for row in factors.tolist()
    ]
