"""Finite-time exponents: how the growth over a few firings is distributed along one train.

The mean growth over n firings is another number wherever one begins. Its mean is the Lyapunov exponent; its
standard deviation falls as n^-1/2 where growth is forgotten fast, and less where a motion stays near regular
orbits for long (A. Prasad and R. Ramaswamy, Phys. Rev. E 60 (1999) 2761). The share of stretches with a
negative exponent tells how often neighbouring motions come together for a while, although the train is
chaotic. Weakness: stretches follow one another on one train; a part of the attractor that it has not visited
has none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, SupportsIndex

import numpy as np

from printhammer.chaos.exponents.lyapunov import PER_FIRING, Lyapunov, lyapunov
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.results import Result, column, coordinate, part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray, IntArray

LENGTHS: Final = (1, 2, 5, 10, 20, 50)
"""Firings of a stretch unless told otherwise."""
FEWEST: Final = 10
"""Stretches below which there is no distribution."""
LEVELS: Final = (0.05, 0.25, 0.5, 0.75, 0.95)


class FiniteTime(Result, rows="length"):
    """The distribution of the largest exponent over stretches of some lengths, one after the other."""

    lengths: IntArray = coordinate("1", "firings of a stretch", "length", name="length", dtype=np.int32)
    level: FloatArray = coordinate("1", "part of the stretches that lie below a quantile", "level")
    stretches: IntArray = column("1", "number of stretches", "length", dtype=np.int32)
    mean: FloatArray = column(PER_FIRING, "mean of the exponents of the stretches", "length")
    deviation: FloatArray = column(PER_FIRING, "their standard deviation", "length")
    negative: FloatArray = column("1", "part of the stretches whose exponent is negative", "length")
    quantiles: FloatArray = column(PER_FIRING, "quantiles of the exponents", "length level", name="quantile")
    values: tuple[FloatArray, ...] = part("exponents of the stretches of each length, 1/firing", repr=False)
    lyapunov: Lyapunov = part("the exponents over the whole train", repr=False)

    @property
    def title(self) -> str:
        """One line that says what this is."""
        return f"finite-time exponents of {self.lyapunov.hammer.name}"


def finite_time(
    train: Lyapunov | Regime, *, lengths: Sequence[SupportsIndex] = LENGTHS, firings: SupportsIndex = 5000
) -> FiniteTime:
    """Return how the largest exponent is distributed over stretches of a train.

    Parameters
    ----------
    train : Lyapunov or Regime
        The exponents of a train, see `printhammer.lyapunov`; or a regime, whose train is followed from rest.
    lengths : sequence of int, optional
        Firings of a stretch, ascending.
    firings : int, optional
        Of a regime: number of firings over which growth counts.

    Returns
    -------
    FiniteTime
        For each length.

    Raises
    ------
    InputError
        The run ended early, lengths do not ascend, or there are fewer than ten stretches of one.
    """
    known = train if isinstance(train, Lyapunov) else lyapunov(train, firings=firings)
    wanted = [read_count(length, "lengths") for length in lengths]
    if not wanted or sorted(set(wanted)) != wanted:
        raise InputError(f"lengths = {lengths!r}, expected numbers of firings, ascending")
    if not known.ok:
        raise InputError(f"the run ended early ({known.status}), expected one that did not")
    growth = known.factors[:, 0]
    if len(growth) < FEWEST * wanted[-1]:
        raise InputError(
            f"lengths: of {len(growth)} firings there are fewer than {FEWEST} stretches of {wanted[-1]},"
            f" expected at most {len(growth) // FEWEST}"
        )
    values = tuple(growth[: len(growth) // n * n].reshape(-1, n).mean(axis=1) for n in wanted)
    return FiniteTime(
        lengths=np.array(wanted),
        level=np.array(LEVELS),
        stretches=np.array([len(row) for row in values]),
        mean=np.array([row.mean() for row in values]),
        deviation=np.array([row.std(ddof=1) for row in values]),
        negative=np.array([(row < 0.0).mean() for row in values]),
        quantiles=np.array([np.quantile(row, LEVELS) for row in values]),
        values=values,
        lyapunov=known,
    )
