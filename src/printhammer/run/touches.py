"""Touches of a surface in a long run: only they are kept, so that memory does not grow with its length."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from printhammer.kernel.model.modes import BACKSTOP_SURFACE, PACK_SURFACE, PAUSED, STATUS_NAMES
from printhammer.results import Declared, part, scalar

if TYPE_CHECKING:
    from collections.abc import Iterator

    from printhammer.run.problem import Problem, Stretch
    from printhammer.support.arrays import FloatArray

Surface = Literal["pack", "backstop"]
CODES: Final = {"pack": PACK_SURFACE, "backstop": BACKSTOP_SURFACE}

_STRETCH: Final = 4096
_SURFACE, _IN, _OUT, _INITIAL = 0, 1, 3, 6
"""Columns of a contact."""


class Touches(Declared):
    """Touches of one surface."""

    rows: FloatArray = part(
        "time, s, and velocity, m/s, at touch and at leaving, shape (n, 4)",
        more="NaN for a contact that is open at the end",
    )
    status: str = part("how the run ended", more='"ok" also where it was ended because of touches enough')
    reached: float = scalar("s", "time that the run got to")


def touches_of(problem: Problem, surface: Surface, after: float, end: float, most: int) -> Touches:
    """Return the first touches of a surface in a run, `most` at most, after which it ends.

    They count from the time `after`, s, up to the `end` of the run, s; a contact open at its start is none.
    """

    def take(stretches: Iterator[Stretch]) -> Touches:
        kept: list[FloatArray] = []
        count = 0
        for stretch in stretches:
            goes_on = stretch.status == PAUSED and len(stretch.contacts) > 0
            goes_on = goes_on and bool(np.isnan(stretch.contacts[-1, _OUT]))
            done = stretch.contacts[:-1] if goes_on else stretch.contacts
            counts = (done[:, _SURFACE] == CODES[surface]) & (done[:, _IN] >= after)
            kept.append(done[counts & (done[:, _INITIAL] == 0.0), _IN : _OUT + 2].copy())
            count += len(kept[-1])
            if count >= most:
                break
        ended = "ok" if stretch.status == PAUSED else STATUS_NAMES[stretch.status]
        return Touches(np.concatenate(kept)[:most], ended, stretch.reached)

    return problem.in_stretches(end, _STRETCH, take)
