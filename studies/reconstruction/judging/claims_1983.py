"""Claims judged with an integrator of 1983: the same measures, applied to motions computed by a scheme.

The paper read its figures from such computations. Claims that require no motion have the same verdict with
every integrator. Claims about the schemes themselves are omitted, and so are claims whose measure requires
ensembles or a search, which are not implemented for the schemes.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.claims.context import TAIL, Context
from printhammer.claims.judging import JudgedClaim, judge_all

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.scheme_runs import Scheme

COMPUTED: Final = (
    "single_pulse_stroke",
    "settle_out",
    "low_restitution",
    "backstop_force_dominates",
    "quiet_look_loud_force",
    "two_pulses_660us",
    "two_pulses_700us",
    "independent_at_low_rate",
    "order_of_onset",
    "second_dot_lost",
    "poincare_window",
    "low_rate_fixed_point",
    "cloud_grows",
    "successive_points_apart",
    "points_on_single_pulse_orbit",
    "flight_time_spread",
)
"""Claims whose measures use only quantities that a scheme computes."""


class SchemeContext(Context):
    """A hammer with motions computed by a scheme of 1983, on the schedule that the claims use."""

    def dots(self, drives: Sequence[Drive], tail: float = TAIL) -> Any:
        """Run many drives; return `struck`, `peak_force` [N] and `flight_time` [s] of each firing."""
        rows = [self.run(drive, float(drive.times[-1]) + tail).dots for drive in drives]
        return SimpleNamespace(
            struck=np.array([[dot.struck for dot in row] for row in rows]),
            peak_force=np.array([[dot.peak_force or np.nan for dot in row] for row in rows]),
            flight_time=np.array([[dot.flight_time or np.nan for dot in row] for row in rows]),
        )


def judge_as_in_1983(
    hammer: Hammer, scheme: Scheme = "runge-kutta-4", progress: Callable[[str], None] | None = None
) -> list[JudgedClaim]:
    """Judge the claims in `COMPUTED` with a scheme of 1983; `progress` as for `judge_all`."""
    return judge_all(hammer, COMPUTED, progress, SchemeContext(hammer, scheme=scheme))
