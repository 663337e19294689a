"""Strobe: the state of the armature once a period, as the Poincaré plots of Fig. 11 show it.

A train of firings is an iterated map in the plane of displacement and velocity: from the state at one firing
to that at the next. Where a firing falls inside a pack contact, the state also has the branch of the pack's
law and its memory, the latest local maximum.
"""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from printhammer.chaos.train import Train, run_trains
from printhammer.chaos.verdict import FIRST, LAST
from printhammer.chaos.window import window_of
from printhammer.drive.input import MOST_PULSES, read_count, read_number, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.run.ensemble import MODE_NAMES
from printhammer.run.problem import TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.chaos.verdict import Verdict
    from printhammer.chaos.window import Window
    from printhammer.drive.base import Overlap
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.support.arrays import FloatArray
    from printhammer.support.threads import Progress

POINTS = 200
"""Number of points unless told otherwise, as in Fig. 11."""


class Strobe(Result):
    """States of a hammer under a periodic drive, one each period."""

    hammer: Hammer = part("the hammer")
    drive: Drive = part("the drive")
    period: float = scalar("s", "time between firings")
    phase: float = scalar("1", "part of the period between a firing and its point")
    firing: npt.NDArray[np.int64] = coordinate(
        "1", "number of the firing", "firing", more="the very first one is number 1", dtype=np.int32
    )
    t: FloatArray = column("s", "time", "firing")
    x: FloatArray = column("m", "displacement", "firing", more="nan where the run did not get")
    v: FloatArray = column("m/s", "velocity", "firing", more="nan where the run did not get")
    branch: npt.NDArray[np.int64] = column(
        "1",
        "mode of motion",
        "firing",
        more="a place in `printhammer.run.ensemble.MODE_NAMES`, -1 where the run did not get",
        dtype=np.int32,
        codes=MODE_NAMES,
    )
    memory: FloatArray = column(
        "m",
        "latest local maximum inside the pack",
        "firing",
        more="0 but on the unloading branch",
    )
    status: str = part("how the run ended")
    tolerance: float = part("tolerance of the integration")
    verdict: Verdict | None = part(
        "what kind of motion it is, with the evidence", more="None where it was not asked for"
    )

    @property
    def title(self) -> str:
        """One line that says what the points are."""
        return f"strobe points of {self.hammer.name}, every {self.period:.9g} s"

    @property
    def ok(self) -> bool:
        """Whether the run went as asked."""
        return self.status == "ok"

    @property
    def window(self) -> Window:
        """The window in which the points are drawn."""
        return window_of(self.hammer, self.drive)

    def notes(self) -> dict[str, Any]:
        """Return the verdict, for the attributes of the Dataset."""
        judged = {} if self.verdict is None else self.verdict.as_dict()
        return {name: value for name, value in judged.items() if name != "tolerance"}


def strobe(
    hammer: Hammer,
    *,
    period: float | str | None = None,
    rate: float | str | None = None,
    points: SupportsIndex = POINTS,
    transient: SupportsIndex = 0,
    phase: float = 0.0,
    waveform: Waveform | None = None,
    drive: Drive | None = None,
    overlap: Overlap = "add",
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
    verdict: bool = True,
) -> Strobe:
    """Return the state of a hammer once a period of its drive, and what kind of motion that is.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    period, rate : float or str
        Time between firings, s, or firings per second, Hz; one of the two. Text with a unit is taken as well.
    points : int, optional
        Number of points; by default 200, as in Fig. 11.
    transient : int, optional
        Number of firings left out before the first point.
    phase : float, optional
        Part of the period between a firing and its point, from 0 up to but not including 1.
    waveform : Waveform, optional
        What every firing does; by default the waveform of the hammer.
    drive : Drive, optional
        Instead of a waveform, period and rate: an endless force such as `printhammer.SineForce`, whose own
        period counts.
    overlap : str, optional
        "add": overlapping pulses add up; "replace": each firing cuts off the pulse before.
    state : tuple of float, optional
        Displacement, m, and velocity, m/s, at the first firing; by default the rest state.
    tolerance : float, optional
        As for `printhammer.simulate`.
    verdict : bool, optional
        Whether to judge the motion, at the firings 1001 to 2000 whatever the points and their phase; see
        `printhammer.chaos.verdict`.

    Returns
    -------
    Strobe
        With a status; a run that could not go on is no exception.

    Raises
    ------
    InputError
        An argument is not what is described above, or the hammer has no waveform or no rest state.
    """
    periods = None
    if drive is None:
        if (period is None) == (rate is None):
            raise InputError("period and rate: expected one of them, the time between firings or its inverse")
        periods = [
            read_positive(period, "s", "period")
            if period is not None
            else 1.0 / read_positive(rate if rate is not None else 0.0, "Hz", "rate")
        ]
    elif period is not None or rate is not None or waveform is not None:
        raise InputError("drive is given, expected no period, rate or waveform beside it")
    (found,) = strobes(
        hammer,
        periods,
        points=points,
        transient=transient,
        phase=phase,
        waveform=waveform,
        drives=None if drive is None else [drive],
        overlap=overlap,
        states=None if state is None else [state],
        tolerance=tolerance,
        verdict=verdict,
        every_exponent=True,
    )
    return found


def strobes(
    hammers: Hammer | Sequence[Hammer],
    periods: Sequence[float | str] | npt.ArrayLike | None = None,
    *,
    points: SupportsIndex = POINTS,
    transient: SupportsIndex = 0,
    phase: float = 0.0,
    waveform: Waveform | None = None,
    drives: Sequence[Drive] | None = None,
    overlap: Overlap = "add",
    states: Sequence[tuple[float, float]] | npt.ArrayLike | None = None,
    tolerance: float = TOLERANCE,
    verdict: bool = True,
    firings: tuple[int, int] = (FIRST, LAST),
    every_exponent: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> list[Strobe]:
    """Return the strobe points of many trains, computed on all cores; see `strobe`.

    Parameters
    ----------
    hammers : Hammer or sequence of Hammer
        One for all trains, or one for each.
    periods : sequence
        Times between firings, s or text with a unit, one for each train, or a single one for all hammers.
    points, transient, phase, waveform, overlap, tolerance, verdict
        As for `strobe`, for all trains.
    drives : sequence of Drive, optional
        Instead of periods: endless forces.
    states : sequence, optional
        Displacement, m, and velocity, m/s, at the first firing of each train; by default the rest state.
    firings : tuple of int, optional
        First and last firing that the verdict is about; the very first one is number 1.
    every_exponent : bool, optional
        Whether to compute the exponent of periodic trains too, which takes several times as long as their
        points and does not change the verdict.
    threads : int, optional
        By default as many as there are cores; the points do not depend on it.
    progress : callable, optional
        Called now and then with the amount of work that is done and of all.

    Returns
    -------
    list of Strobe
        One for each train.

    Raises
    ------
    InputError
        As for `strobe`, or numbers of hammers, periods and states that do not fit together.
    """
    count, skipped = read_count(points, "points"), transient_of(transient)
    part = read_number(phase, "1", "phase")
    if not 0.0 <= part < 1.0:
        raise InputError(f"phase = {phase!r}, expected a part of the period from 0 up to but not including 1")
    if not 1 <= firings[0] < firings[1]:
        raise InputError(f"firings = {firings!r}, expected the first and the last firing to judge, ascending")
    fired = max(count + skipped, firings[1] if verdict else 1)
    wanted: list[float | None] = [None] * len(drives) if drives is not None else [*_periods(periods)]
    many = [hammers] if isinstance(hammers, Hammer) else list(hammers)
    rows = None if states is None else np.asarray(states, dtype=np.float64).reshape(-1, 2)
    counts = [len(many), len(wanted), *([] if rows is None else [len(rows)])]
    size = max(counts) if min(counts) else 0
    for name, given in (("hammers", many), ("periods", wanted), ("states", rows)):
        if given is not None and len(given) not in (1, size):
            raise InputError(f"{name}: {len(given)} are given, expected 1 or {size}")
    trains = [
        Train.of(
            many[i % len(many)],
            wanted[i % len(wanted)],
            fired,
            waveform=waveform,
            drive=None if drives is None else drives[i % len(drives)],
            overlap=overlap,
            state=None if rows is None else (float(rows[i % len(rows), 0]), float(rows[i % len(rows), 1])),
        )
        for i in range(size)
    ]
    chosen = np.arange(skipped + 1, skipped + count + 1)
    found, verdicts = run_trains(
        trains,
        chosen,
        part,
        tolerance,
        firings if verdict else None,
        every_exponent=every_exponent,
        threads=threads,
        progress=progress,
    )
    return [
        Strobe(
            hammer=train.hammer,
            drive=train.drive,
            period=train.period,
            phase=part,
            firing=chosen,
            t=states_found.t,
            x=states_found.x,
            v=states_found.v,
            branch=states_found.branch,
            memory=states_found.memory,
            status=states_found.status,
            tolerance=tolerance,
            verdict=judged,
        )
        for train, states_found, judged in zip(trains, found, verdicts, strict=True)
    ]


def transient_of(transient: SupportsIndex) -> int:
    """Read a number of firings to leave out.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        count = -1 if isinstance(transient, bool) else operator.index(transient)
    except TypeError:
        count = -1
    if not 0 <= count <= MOST_PULSES:
        raise InputError(
            f"transient = {transient!r}, expected a whole number of firings from 0 to {MOST_PULSES}"
        )
    return count


def _periods(periods: Sequence[float | str] | npt.ArrayLike | None) -> list[float]:
    if periods is None:
        raise InputError("periods are missing, expected the times between the firings of each train, s")
    given: list[Any] = list(periods) if np.ndim(periods) else [periods]  # type: ignore[arg-type]
    if not given:
        raise InputError("periods: expected at least one time between firings, s")
    return [read_positive(period, "s", "period") for period in given]
