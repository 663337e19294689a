"""The plant, as control engineering calls it: the nominal hammer, its driver, and what drives do to it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from printhammer.printing.rates.perturbation import Perturbation, perturbed
from printhammer.run.ensemble import DISPLAY_TOLERANCE, DotTable, Ensemble, Strobes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.feedback.driver import Driver
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal
    from printhammer.support.arrays import BoolArray
    from printhammer.support.threads import Progress


@dataclass(frozen=True)
class Plant:
    """A hammer, the driver of its coil, its single-pulse dot, and the number of threads for its runs."""

    hammer: Hammer
    driver: Driver
    single: Nominal
    threads: int | None = None

    @cached_property
    def front(self) -> float:
        """Front of the pack, m."""
        assert self.hammer.front is not None
        return self.hammer.front

    @cached_property
    def stroke(self) -> float:
        """Way from backstop to pack, m."""
        return self.front - self.hammer.origin

    def moved(self, offset: float) -> Plant:
        """Return the same with its pack farther away, by a part of the stroke."""
        travel = Perturbation(travel=offset * self.stroke)
        return replace(self, hammer=perturbed(self.hammer, travel)) if offset else self

    def run(
        self,
        drives: Sequence[Drive],
        end: Any,
        states: Any = None,
        strobes: Any = None,
        progress: Progress | None = None,
    ) -> tuple[BoolArray, DotTable, Strobes]:
        """Run drives from rest, or from states (drives, 2), m and m/s, up to an end, s.

        Returns whether each run came to its end, what its firings did, and states at the instants asked for.
        """
        begun = None if states is None else np.array(states)
        result = Ensemble(self.hammer, list(drives), end, states=begun, tolerance=DISPLAY_TOLERANCE).run(
            dots=True, strobes=strobes, threads=self.threads, progress=progress
        )
        return result.ok, cast("DotTable", result.dots), cast("Strobes", result.strobes)
