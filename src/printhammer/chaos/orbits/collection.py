"""Result of a search for periodic orbits, with estimates of how many orbits are missing."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from printhammer.chaos.orbits.newton import SINGULAR, STUCK, TOO_LONG
from printhammer.chaos.orbits.orbit import KINDS, STABLE, UNDECIDED, Orbit, orbits_table
from printhammer.chaos.strobe.map import RANGE_LEFT
from printhammer.results import Column, Result, part, scalar
from printhammer.results.result import stacked
from printhammer.results.summary import (
    Cells,
    Grid,
    Style,
    Summary,
    multiplier,
    styled,
)
from printhammer.run.regime import Regime

if TYPE_CHECKING:
    import pandas as pd


_WORDS: Final = {
    STUCK: "Newton iterations stalled",
    TOO_LONG: "hit the iteration limit",
    SINGULAR: "met a singular derivative",
    RANGE_LEFT: "left the allowed range",
}
_STYLES: Final[dict[str, Style]] = {
    "stable": "good",
    "saddle": "cyan",
    "unstable": "magenta",
    "undecided": "poor",
}


def index_sums(orbits: Sequence[tuple[int, npt.NDArray[np.complex128]]], longest: int) -> dict[int, int]:
    """Compute the sums of the fixed-point indices of the strobe map over n firings, for n up to `longest`.

    The index of a fixed point is the sign of det(I - M), with M the derivative of the map over n firings: -1
    for a saddle with a multiplier beyond +1, else +1. If the map is continuous and maps a disc into itself,
    the indices of all fixed points in the disc add up to 1 (S. Lefschetz, Trans. Am. Math. Soc. 28 (1926) 1).
    `orbits` contains the period [firings] and the multipliers of each orbit. The result maps n to the sum.
    """
    sums = {}
    for count in range(1, longest + 1):
        own = [(firings, multipliers) for firings, multipliers in orbits if count % firings == 0]
        signs = [np.sign(np.prod(1.0 - each ** (count // firings)).real) for firings, each in own]
        sums[count] = int(sum(sign * firings for sign, (firings, _each) in zip(signs, own, strict=True)))
    return sums


def fewest_missing(sums: Mapping[int, int]) -> int:
    """Compute a lower bound on the number of missing orbits from the index sums.

    An orbit of d firings adds d or -d to the sum for every multiple of d, so that at least k / n orbits are
    missing if the sum for n firings differs from 1 by k.
    """
    return max((math.ceil(abs(total - 1) / count) for count, total in sums.items()), default=0)


def indices_add_up(regime: Regime) -> bool:
    """Whether a theorem requires the fixed-point indices of the strobe map to sum to 1; see `index_sums`.

    True for a hammer without a pack that has damping or a backstop.
    """
    hammer = regime.hammer
    return hammer.pack is None and (hammer.is_damped or hammer.backstop is not None)


def energies_of(regime: Regime) -> list[str]:
    """Return the names of the energies that a summary of orbits shows.

    They are the work of the drive, and the losses in pack, backstop and, if there is any, damping.
    """
    work = "drive_work" if regime.fired.quantity == "force" else "coil_work"
    damping = ["damping_loss"] if regime.hammer.is_damped else []
    return [work, "pack_loss", "backstop_loss", *damping]


class Orbits(Result):
    """Periodic orbits found by a search, and the outcome of its initial guesses.

    The list may be incomplete: further orbits may exist.
    """

    regime: Regime = part("hammer and periodic drive")
    found: tuple[Orbit, ...] = part("orbits, sorted by number of firings, stable orbits first")
    longest: int = scalar("1", "largest orbit period searched for, in firings")
    starts: int = scalar("1", "number of motions searched for close returns")
    guesses: tuple[int, ...] = scalar("1", "number of guesses for orbits of 1, 2, ... firings")
    repeats: int = scalar(
        "1", "number of guesses that led to an already known orbit, or to an orbit of fewer firings"
    )
    hits: tuple[int, ...] = scalar(
        "1", "number of guesses that led to each orbit, without guesses near known orbits and mirror images"
    )
    failures: Mapping[str, int] = part("number of guesses that failed, by reason")
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """Title of the orbits, with the name of the hammer and the firing period."""
        return f"periodic orbits of {self.regime.hammer.name}, every {self.regime.period:.9g} s"

    def summary(self) -> Summary:
        """Tabulate the orbits, one row per orbit, and the outcome of the search."""
        if not self.found:
            return Summary([self.message])
        columns = [
            Cells("firings", [orbit.firings for orbit in self]),
            Cells("kind", [styled(_STYLES[orbit.kind], orbit.kind) for orbit in self], left=True),
            Cells("multipliers", ["  ".join(map(multiplier, orbit.multipliers)) for orbit in self]),
            Cells("backstop\ncontacts", [orbit.backstop_contacts for orbit in self]),
            Cells("dots", [orbit.printed for orbit in self]),
            Cells("lost", [orbit.lost for orbit in self]),
            *(
                Cells(name.replace("_", " "), [getattr(orbit.energy, name, None) for orbit in self], "J")
                for name in energies_of(self.regime)
            ),
        ]
        return Summary([Grid(columns), "", self.message])

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Iterator[Orbit]:
        return iter(self.found)

    def __getitem__(self, place: int) -> Orbit:
        return self.found[place]

    @property
    def stable(self) -> tuple[Orbit, ...]:
        """Stable orbits, in the order of the list."""
        return tuple(orbit for orbit in self.found if orbit.kind == STABLE)

    @property
    def counts(self) -> dict[str, int]:
        """Number of orbits of each kind that occurs: stable, saddle, unstable, undecided."""
        counts = Counter(orbit.kind for orbit in self.found)
        return {kind: counts[kind] for kind in KINDS if counts[kind]}

    @property
    def coverage(self) -> float:
        """Estimated probability that a further guess, if it converges, leads to a known orbit.

        The estimate is not a bound, since orbits that no guess comes near are not counted. It is NaN if no
        guess has led to an orbit.

        The Good-Turing estimate is 1 minus the fraction of guesses that converge to an orbit reached by no
        other guess (I. J. Good, Biometrika 40 (1953) 237).
        """
        return 1.0 - self.hits.count(1) / sum(self.hits) if sum(self.hits) else math.nan

    @property
    def unseen(self) -> float:
        """Estimated lower bound on the number of orbits that the search missed.

        The result is the larger of two bounds. The first is f1 (f1 - 1) / (2 (f2 + 1)), with f1 and f2 the
        numbers of orbits reached from exactly one and exactly two guesses (A. Chao, Scand. J. Statist. 11
        (1984) 265), minus the number of orbits found only as mirror images or from guesses near known orbits.
        The second is the smallest number of missing orbits that the fixed-point indices imply; see
        `fewest_missing`.
        """
        once, twice = self.hits.count(1), self.hits.count(2)
        bound = 0.5 * once * max(once - 1, 0) / (twice + 1) - self.hits.count(0)
        return max(bound, float(fewest_missing(self.indices)))

    @property
    def indices(self) -> dict[int, int]:
        """Sums of the fixed-point indices of the strobe map over 1, 2, ... firings; see `index_sums`.

        Empty if no theorem gives the expected sum, or if an orbit is undecided.
        """
        if not indices_add_up(self.regime) or any(orbit.kind == UNDECIDED for orbit in self.found):
            return {}
        return index_sums([(orbit.firings, orbit.multipliers) for orbit in self.found], self.longest)

    @property
    def incomplete(self) -> tuple[int, ...]:
        """Numbers of firings whose fixed-point indices do not sum to 1, so that orbits are missing."""
        return tuple(count for count, total in self.indices.items() if total != 1)

    @property
    def message(self) -> str:
        """Summary of the orbits and of the outcome of the initial guesses, in one line."""
        what = ", ".join(f"{number} {kind}" for kind, number in self.counts.items())
        count = len(self.found)
        most = "1 firing" if self.longest == 1 else f"up to {self.longest} firings"
        head = f"{count or 'no'} orbit{'' if count == 1 else 's'} of {most}"
        tried = f"{sum(self.guesses)} initial guesses, from motions that start at {self.starts} states"
        ends = [f"{self.repeats} more converged to these orbits"] if self.repeats else []
        failed = [
            f"{number} {_WORDS.get(reason, reason)}" for reason, number in sorted(self.failures.items())
        ]
        ends += [f"failed: {', '.join(failed)}"] if failed else []
        sure = ""
        if count:
            sure = f"; {100.0 * self.coverage:.1f} % of further guesses that close would lead to these again"
            sure += (
                f", at least {math.ceil(self.unseen)} more orbits are estimated to be missing"
                if self.unseen
                else ""
            )
            sure += "; orbits near no guess are not counted"
        if self.incomplete:
            sums = ", ".join(f"{self.indices[count]} over {count}" for count in self.incomplete)
            sure += (
                f"; orbits are missing: indices of fixed points add up to 1, those listed to {sums} firings"
            )
        return f"{head}{f' ({what})' if what else ''}; {tried}{': ' if ends else ''}{'; '.join(ends)}{sure}"

    def notes(self) -> dict[str, Any]:
        """Return the failures and the message of the search, for the attributes of the Dataset."""
        ends = "; ".join(f"{number}: {reason}" for reason, number in sorted(self.failures.items()))
        return {"failures": ends, "search": self.message}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: properties over `orbit`, `firing` and `multiplier`.

        Values beyond the last firing of an orbit are NaN, and the mode there is -1.
        """
        number = Column("1", "number of the orbit", ("orbit",), "coordinate", name="orbit", dtype=np.int32)
        return {"orbit": (number, np.arange(len(self.found))), **stacked(self.found, "orbit", Orbit)}

    def to_dataframe(self) -> pd.DataFrame:
        """Convert the orbits to a table with one row per firing of each orbit."""
        return orbits_table(self.found, self.attributes)
