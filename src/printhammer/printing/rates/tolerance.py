"""Tolerance yield: how many hammers of a production still print well, and how fast."""

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
from printhammer.printing.rates.safe_rate import FIRST, LAST, all_pass, grid_notes, rate_grid, safe_rates
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

SPREAD: Final = 0.01  # Relative spread of a constant, to either side, by default

STEP: Final = 25.0  # Step of the grid of rates by default, Hz: coarser than that of one safe rate

MOST: Final = 100_000  # Number of hammers above which a yield is refused

Judged = Literal["own", "design"]
GAP: Final = "pack.front"
"""The constant whose spread is that of its distance from the backstop, since the origin is arbitrary."""

FIXED: Final = ("backstop.position", "platen")
"""Constants that have no spread unless it is stated: the origin, and one that enters no force."""


_SHARES: Final = (0.95, 0.5)
"""Shares of the hammers whose largest common rates a summary tells."""


class ToleranceYield(Result):
    """Random hammers, and which of them print well."""

    hammer: Hammer = part("the design")
    strategy: str = scalar("", "how the hammers are driven, in words")
    limits: Limits = part("how far a dot may be off")
    rate: float = part("rate at which they are tried, Hz", more="NaN where their safe rates were looked for")
    spreads: Mapping[str, float] = part("relative spread of each constant that varies, to either side")
    factors: FloatArray = column(
        "1",
        "constant over that of the design; of the front, its distance",
        "member constant",
        more="in the order of `spreads`; the distance of the front is that from the backstop",
        name="factor",
    )
    judged_by: Judged = scalar("", '"own" or "design"', more="whose single-pulse dot is the measure")
    status: TextArray = column(
        "1",
        "what became of the hammer",
        "member",
        more='"ok", "no hammer" where the constants make none, "does not rest", "makes no dot"',
    )
    single_force: FloatArray = column(
        "N", "force of the single-pulse dot", "member", more="NaN where there is none"
    )
    single_flight_time: FloatArray = column(
        "s", "flight time of the single-pulse dot", "member", more="NaN where there is none"
    )
    passed: BoolArray = column(
        "1",
        "whether every pattern is within limits",
        "member",
        more="at `rate`, or where there is none at the first rate of the grid",
        dtype=np.int8,
    )
    safe_rates: FloatArray = column(
        "Hz",
        "safe rate",
        "member",
        more="NaN where not even the first rate passes, or where it was not looked for",
        name="safe_rate",
    )
    grid: FloatArray = part("rates that were tried, Hz", repr=False)
    seed: int = scalar("1", "seed of the draw")
    tolerance: float = part("error allowed in one step of the integration")

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return f"tolerance yield of {self.hammer.name}"

    def summary(self) -> Summary:
        """Return the yield, or how safe rates are spread."""
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
            rows.append((f"{100.0 * part_of_all:g} % print well", reached))
        known = self.safe_rates[~np.isnan(self.safe_rates)]
        if known.size:
            rows.append(("safe rates", f"{known.min():g} to {known.max():g} Hz"))
        return Summary([Facts(rows)])

    def notes(self) -> dict[str, Any]:
        """Return limits, spreads and the grid of rates, and the rate where there is one."""
        return {
            "limits": self.limits.text,
            "spreads": dict(self.spreads),
            "rate": None if math.isnan(self.rate) else self.rate,
            **grid_notes(self.grid),
        }

    @property
    @derived("", "what varies", "constant", kind="coordinate")
    def constant(self) -> list[str]:
        """Names of the constants that vary."""
        return list(self.spreads)

    @property
    @derived("1", "part of the hammers that pass")
    def share(self) -> float:
        """Part of the hammers that pass; those that are none or make no dot do not."""
        return float(self.passed.mean())

    @property
    def share_error(self) -> float:
        """Standard error of the share as of a plain random draw; a Sobol sequence does better."""
        count = len(self.passed)
        # Of a share of 0 or 1 the plain formula would say that it is exact.
        share = (self.passed.sum() + 0.5) / (count + 1.0)
        return float(math.sqrt(share * (1.0 - share) / count))

    def share_at(self, rate: float) -> float:
        """Return the part of the hammers whose safe rate is a rate, Hz, or more."""
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
    first: float | str = FIRST,
    last: float | str = LAST,
    step: float | str = STEP,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> ToleranceYield:
    """Draw hammers whose constants are spread about those of a design, and see which print well.

    Every constant is drawn evenly within its spread, by a scrambled Sobol sequence.

    Parameters
    ----------
    hammer : Hammer
        The design.
    rate : float or str, optional
        Slots per second, Hz, or text with a unit, at which all patterns from rest and the cycle are to be
        within limits. Without it the safe rate of each hammer is looked for.
    number : int, optional
        Number of hammers.
    spreads : float or mapping, optional
        Relative spread to either side of every constant, or by key, such as {"magnet.Am": 0.02}; constants
        that are not named then stay as they are.
    seed : int, optional
        Of the draw.
    judged_by : str, optional
        "own": the dots of a hammer are judged by its own single pulse, as if each were adjusted; "design": by
        that of the design.
    strategy, limits, first, last, step
        As for `printhammer.safe_rate`.

    Returns
    -------
    ToleranceYield
        With a status for each hammer.
    """
    count = read_count(number, "number")
    if count > MOST:
        raise InputError.of("number", count, f"at most {MOST} hammers", written=str(count))
    if judged_by not in get_args(Judged):
        raise InputError.of("judged_by", judged_by, f"one of {', '.join(get_args(Judged))}")
    grid = rate_grid(first, last, step) if rate is None else np.array([read_positive(rate, "Hz", "rate")])
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
    """Return the spread of each constant of a hammer that varies.

    Raises
    ------
    InputError
        A spread is not from 0 to below 1, a constant is not known or zero, or none varies.
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
            raise InputError.of(f"spread of {key}", value, "from 0 to below 1", said=" is expected to be")
    varying = {key: float(value) for key, value in wanted.items() if value > 0.0}
    if not varying:
        raise InputError("spreads: expected at least one constant that varies", key="spreads")
    return varying


def draw(spreads: Mapping[str, float], number: int, seed: int) -> FloatArray:
    """Draw factors on constants, (number, constants), evenly within their spreads to either side.

    They come from a scrambled Sobol sequence (A. B. Owen, J. Complexity 14 (1998) 466).
    """
    from scipy.stats import qmc

    if seed < 0:
        raise InputError.of("seed", seed, "0 or more", written=str(seed))
    sequence = qmc.Sobol(len(spreads), scramble=True, rng=np.random.default_rng(seed))
    points = sequence.random_base2(math.ceil(math.log2(number)) if number > 1 else 0)[:number]
    return np.asarray(1.0 + (2.0 * points - 1.0) * np.array(list(spreads.values())))


def _changes(hammer: Hammer, spreads: Iterable[str], factors: FloatArray) -> list[dict[str, float]]:
    """Return the constants of the hammers, SI, by the factors on those of the design."""
    zero = {key: hammer.origin if key == GAP else 0.0 for key in spreads}
    values = {key: hammer.constants[key].si for key in zero}
    return [
        {key: zero[key] + (values[key] - zero[key]) * factor for key, factor in zip(zero, row, strict=True)}
        for row in factors.tolist()
    ]
