"""Impact maps: Poincaré sections at the touches of the backstop or of the pack.

At a touch the displacement is that of the surface. What decides all that follows is the velocity and the time
since the last firing; from touch to touch these two are an iterated map, as the strobe is from firing to
firing, only that here the armature tells when to look.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, SupportsIndex, Unpack, get_args

import numpy as np

from printhammer.chaos.strobe.train import Train
from printhammer.drive.input import MOST_PULSES, read_count
from printhammer.errors import InputError
from printhammer.results import Result, column, derived, part, scalar
from printhammer.run.problem import TOLERANCE, Problem, check_tolerance
from printhammer.run.regime import Firing, Regime, regimes_of
from printhammer.run.start import initial_state
from printhammer.run.touches import touches_of
from printhammer.support.threads import Progress, mapped

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.drive.base import Overlap
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray, IntArray

Surface = Literal["pack", "backstop"]
SURFACES: Final = get_args(Surface)

TOUCHES: Final = 1000
"""Number of touches unless told otherwise."""

_FIRINGS_A_TOUCH: Final = 10


class Section(Result):
    """States of a hammer at the touches of a surface."""

    hammer: Hammer = part("the hammer")
    drive: Drive = part("the drive")
    period: float = scalar("s", "time between firings")
    surface: Surface = scalar("", '"pack" or "backstop"')
    first: int = scalar(
        "1",
        "first of the firings between which touches were looked for",
        more="the very first one is number 1",
    )
    last: int = scalar("1", "last of them")
    t: FloatArray = column("s", "time of touch", "touch")
    v: FloatArray = column("m/s", "velocity at touch", "touch")
    firing: IntArray = column(
        "1", "number of the latest firing", "touch", more="at or before the touch", dtype=np.int32
    )
    since: FloatArray = column("s", "time since the last firing", "touch")
    t_out: FloatArray = column(
        "s", "time of leaving", "touch", more="nan where the contact is open at the end of the run"
    )
    v_out: FloatArray = column("m/s", "velocity at leaving", "touch", more="nan likewise")
    wanted: int = scalar(
        "1",
        "number of touches asked for",
        more="fewer where the surface is not touched often enough",
    )
    status: str = part("how the run ended")
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """One line that says what the touches are."""
        return f"touches of the {self.surface} by {self.hammer.name}, fired every {self.period:.9g} s"

    @property
    @derived("1", "number of the touch", "touch", kind="coordinate", dtype=np.int32)
    def touch(self) -> IntArray:
        """Numbers of the touches, from 1 on."""
        return np.arange(1, len(self.t) + 1)

    @property
    def ok(self) -> bool:
        """Whether the run went as asked."""
        return self.status == "ok"

    @property
    def per_firing(self) -> float:
        """Mean number of touches from firing to firing; NaN where there was but one firing."""
        fired = self.last - self.first
        return int((self.firing < self.last).sum()) / fired if fired else float("nan")

    @property
    def remark(self) -> str:
        """What there is to say of a section that has fewer touches than asked for; else empty."""
        if len(self.t) == self.wanted:
            return ""
        why = "" if self.ok else f"; the run ended early: {self.status}"
        return (
            f"{len(self.t)} of {self.wanted} touches of the {self.surface} from firing {self.first} to"
            f" {self.last}{why}"
        )


def section(
    hammer: Hammer | Regime,
    *,
    surface: Surface = "backstop",
    touches: SupportsIndex = TOUCHES,
    transient: SupportsIndex = 0,
    firings: SupportsIndex | None = None,
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
    **firing: Unpack[Firing],
) -> Section:
    """Return the state of a hammer at each touch of its backstop, or of the pack.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer; or the hammer with all that `firing` says of it. Its phase plays no part.
    surface : str, optional
        "backstop" or "pack".
    touches : int, optional
        Number of touches.
    transient : int, optional
        Number of firings left out before the first touch.
    firings : int, optional
        Number of firings after which to give up looking; by default ten for each touch asked for.
    state, tolerance, **firing
        As for `printhammer.strobe`.

    Returns
    -------
    Section
        With a status; a run that could not go on, or has too few touches, is no exception.

    Raises
    ------
    InputError
        An argument is not what is described above; the hammer has no such surface, no waveform or no rest
        state.
    """
    counts = _counts(touches, transient, firings)
    check_tolerance(tolerance)
    train = Train.of(Regime.of(hammer, **firing), counts[1] + counts[2], state)
    return _section(train, surface, counts, tolerance)


def sections(
    hammers: Hammer | Regime | Sequence[Hammer | Regime],
    periods: Sequence[float | str] | npt.ArrayLike | None = None,
    *,
    surface: Surface = "backstop",
    touches: SupportsIndex = TOUCHES,
    transient: SupportsIndex = 0,
    firings: SupportsIndex | None = None,
    waveform: Waveform | None = None,
    overlap: Overlap | None = None,
    tolerance: float = TOLERANCE,
    threads: int | None = None,
    progress: Progress | None = None,
) -> list[Section]:
    """Return the sections of many trains from rest, computed on all cores; see `section`.

    Parameters
    ----------
    hammers, periods, waveform, overlap
        Hammers or regimes and how they are fired, see `printhammer.run.regime.regimes_of`.
    surface, touches, transient, firings, tolerance
        As for `section`, for all trains.
    threads, progress
        As for `printhammer.chaos.strobes`.

    Returns
    -------
    list of Section
        One for each train.

    Raises
    ------
    InputError
        As for `section`, or numbers of hammers and periods that do not fit together.
    """
    counts = _counts(touches, transient, firings)
    check_tolerance(tolerance)
    regimes = regimes_of(hammers, periods, waveform=waveform, overlap=overlap)
    trains = [Train.of(regime, counts[1] + counts[2]) for regime in regimes]
    return mapped(lambda train: _section(train, surface, counts, tolerance), trains, threads, progress)


def _counts(
    touches: SupportsIndex, transient: SupportsIndex, firings: SupportsIndex | None
) -> tuple[int, int, int]:
    """Return the numbers of touches, of firings left out, and of firings after which to give up."""
    wanted, skipped = read_count(touches, "touches"), read_count(transient, "transient", least=0)
    room = MOST_PULSES - skipped - 1
    limit = min(_FIRINGS_A_TOUCH * wanted, room) if firings is None else read_count(firings, "firings")
    if not 1 <= limit <= room:
        raise InputError(
            f"firings = {limit} after a transient of {skipped}, expected at most {MOST_PULSES - 1} together"
        )
    return wanted, skipped, limit


def _section(train: Train, surface: Surface, counts: tuple[int, int, int], tolerance: float) -> Section:
    wanted, skipped, limit = counts
    if surface not in SURFACES:
        raise InputError(f"surface = {surface!r}, expected {' or '.join(SURFACES)}")
    if getattr(train.hammer, surface) is None:
        raise InputError(f"surface = {surface!r}: the hammer {train.hammer.name!r} has no {surface}")
    state = initial_state(train.hammer, train.state)
    problem = Problem(train.hammer, train.drive, state, 0.0, tolerance)
    firing = np.arange(1, skipped + limit + 2)
    times = train.times(firing)
    touches = touches_of(problem, surface, float(times[skipped]), float(times[-1]), wanted)
    t, v, t_out, v_out = touches.rows.T.copy()
    latest = np.searchsorted(times, t, side="right") - 1
    # Touches are looked for up to the last one there is, or as far as the run got.
    until = t[-1] if len(t) == wanted else touches.reached
    return Section(
        hammer=train.hammer,
        drive=train.drive,
        period=train.period,
        surface=surface,
        first=skipped + 1,
        last=max(int(np.searchsorted(times, until, side="right")), skipped + 1),
        t=t,
        v=v,
        firing=firing[latest],
        since=t - times[latest],
        t_out=t_out,
        v_out=v_out,
        wanted=wanted,
        status=touches.status,
        tolerance=tolerance,
    )
