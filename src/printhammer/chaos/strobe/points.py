"""Strobe points: the state of the armature once per period, as in the Poincaré plots of Fig. 11.

A pulse train defines an iterated map, the strobe map, in the plane of displacement and velocity: from the
state at one firing to the state at the next. If a firing falls inside a pack contact, the state also includes
the branch of the pack's law and its memory, the latest local maximum.

*The integrators of the 1983 paper.* Strobe points can also be computed by the two integrators of the paper,
with the paper's step sizes.

The panels of Fig. 11 were classified by eye from such points. Integrators with fixed steps that do not locate
contacts do not compute the motion accurately: every touch adds an error, and the result is a different map,
which is discontinuous where a step just reaches or just misses a contact. This map has no derivative, and no
exponent can support a classification. A train is therefore called strange if it has no period up to 64, as a
reader of such a plot would decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, SupportsIndex, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.strobe.train import States, Train, run_trains
from printhammer.chaos.strobe.verdict import FIRST, LAST, Verdict, verdict
from printhammer.drive.base import Overlap
from printhammer.drive.input import read_count
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.result import Entries
from printhammer.results.summary import (
    FactRow,
    Facts,
    Summary,
    interval,
    repeated,
    styled,
)
from printhammer.run.effort import DEFAULT, Effort, Keywords, computation
from printhammer.run.ensemble import MODE_NAMES
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import Firing, Regime, Window, regimes_of, window_of
from printhammer.run.scheme_runs import READINGS, Reading, Scheme, SchemeProblem
from printhammer.run.start import initial_state, read_state
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.threads import Progress

POINTS = 200
"""Default number of strobe points, as in Fig. 11."""

_SETTLED = 1000  # Arbitrary
"""Default number of points of a settled series, and of the firings discarded before the first point."""


class Strobe(Result):
    """Strobe points: states of a hammer under a periodic drive, one per period."""

    hammer: Hammer = part("the hammer")
    drive: Drive = part("the drive")
    period: float = scalar("s", "time between firings")
    phase: float = scalar("1", "time from a firing to its point, as a fraction of the period")
    firing: IntArray = coordinate(
        "1", "number of the firing", "firing", more="the very first firing is number 1", dtype=np.int32
    )
    t: FloatArray = column("s", "time", "firing")
    x: FloatArray = column("m", "displacement", "firing", more="nan after the end of the run")
    v: FloatArray = column("m/s", "velocity", "firing", more="nan after the end of the run")
    branch: IntArray = column(
        "1",
        "mode of motion",
        "firing",
        more="as an index of `printhammer.run.ensemble.MODE_NAMES`, -1 after the end of the run",
        dtype=np.int32,
        codes=MODE_NAMES,
    )
    memory: FloatArray = column(
        "m",
        "latest local maximum inside the pack",
        "firing",
        more="0 except on the unloading branch",
    )
    status: str = part("status of the run")
    tolerance: float = part("tolerance of the integration")
    verdict: Verdict | None = part(
        "classification of the motion, with the evidence", more="None if not requested"
    )
    current: FloatArray | None = column(
        "A", "current in the coil", "firing", more="None unless a voltage drives it", default=None
    )

    @property
    def title(self) -> str:
        """Title of the strobe points, with the name of the hammer and the firing period."""
        return f"strobe points of {self.hammer.name}, every {self.period:.9g} s"

    def summary(self) -> Summary:
        """Summarise the strobe points and the classification of the motion."""
        known = np.isfinite(self.x)
        at = f", {self.phase:g} of a period later" if self.phase else ""
        rows: list[FactRow] = [
            ("points", f"{int(known.sum())}, at the firings {self.firing[0]} to {self.firing[-1]}{at}"),
            ("displacement", interval(self.x[known], "m")),
            ("velocity", interval(self.v[known], "m/s")),
            ("current", None if self.current is None else interval(self.current[known], "A")),
        ]
        if (verdict := self.verdict) is not None:
            named = styled("poor" if verdict.name == "undecided" else "best", verdict.name.replace("-", " "))
            rows += [
                ("verdict", named),
                ("because", verdict.reason or None),
                *repeated("evidence", verdict.phrases),
            ]
        return Summary([Facts(rows)])

    @property
    def ok(self) -> bool:
        """Whether the run was completed."""
        return self.status == "ok"

    @property
    def window(self) -> Window:
        """Window of displacement and velocity in which the points are drawn and scaled."""
        return window_of(self.hammer, self.drive)

    def entries(self) -> Entries:
        """Return the Dataset variables by name, including the current if a voltage drives the coil."""
        return {name: entry for name, entry in super().entries().items() if entry[1] is not None}

    def notes(self) -> dict[str, Any]:
        """Return the classification, for the attributes of the Dataset."""
        judged = {} if self.verdict is None else self.verdict.as_dict()
        return {name: value for name, value in judged.items() if name != "tolerance"}


@checked
def strobe(
    hammer: Hammer | Regime,
    *,
    points: SupportsIndex = POINTS,
    transient: SupportsIndex = 0,
    state: Sequence[float | str] | None = None,
    tolerance: float = TOLERANCE,
    verdict: bool = True,
    **firing: Unpack[Firing],
) -> Strobe:
    """Compute the state of a hammer once per period of its drive, and classify the motion.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer, or a regime; a hammer requires the keywords of `printhammer.Regime.of`.
    points : int, optional
        Number of points; by default 200, as in Fig. 11.
    transient : int, optional
        Number of firings to discard before the first point.
    state : sequence of float or str, optional
        Displacement [m], velocity [m/s] or text with units, and further components of the state at the first
        firing, as for `printhammer.simulate`; by default the rest state.
    tolerance : float, optional
        As for `printhammer.simulate`.
    verdict : bool, optional
        Whether to classify the motion, from firings 1001 to 2000, independent of the points and their
        phase; see `printhammer.chaos.strobe.verdict`.
    **firing
        Firing of the hammer: period or rate, waveform, drive, overlap and phase of the points, as for
        `printhammer.Regime.of`.

    Returns
    -------
    Strobe
        Strobe points with a status; a run that ends early raises no exception.
    """
    (points_of_train,) = strobes(
        Regime.of(hammer, **firing),
        points=points,
        transient=transient,
        states=None if state is None else [read_state(state)],
        tolerance=tolerance,
        verdict=verdict,
        every_exponent=True,
    )
    return points_of_train


@computation
def strobes(
    hammers: Hammer | Regime | Sequence[Hammer | Regime],
    periods: Sequence[float | str] | npt.ArrayLike | None = None,
    *,
    points: SupportsIndex = POINTS,
    transient: SupportsIndex = 0,
    phase: float | None = None,
    waveform: Waveform | None = None,
    drives: Sequence[Drive] | None = None,
    overlap: Overlap | None = None,
    states: Sequence[tuple[float, float]] | npt.ArrayLike | None = None,
    verdict: bool = True,
    firings: tuple[int, int] = (FIRST, LAST),
    every_exponent: bool = False,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[Keywords],
) -> list[Strobe]:
    """Compute the strobe points of many trains in parallel; see `strobe`.

    Parameters
    ----------
    hammers, periods, drives, waveform, overlap, phase
        Regimes, or hammers with firing periods or continuous drives, waveform, overlap and phase; see
        `printhammer.run.regime.regimes_of`.
    points, transient, verdict
        As for `strobe`, for all trains.
    states : sequence, optional
        Displacement [m], velocity [m/s] and further state components at the first firing of each train,
        as for `printhammer.simulate`, the same components for all trains; by default the rest state.
    firings : tuple of int, optional
        First and last firing used for the classification; the very first firing is number 1.
    every_exponent : bool, optional
        Whether to compute the exponents of periodic trains, too; this takes several times as long as the
        points, and does not change the classification.

    Returns
    -------
    list of Strobe
        Strobe points of each train.
    """
    count, skipped = read_count(points, "points"), read_count(transient, "transient", least=0)
    if not 1 <= firings[0] < firings[1]:
        raise InputError.of("firings", firings, "the first and the last firing to classify, ascending")
    fired = max(count + skipped, firings[1] if verdict else 1)
    many = regimes_of(hammers, periods, drives, waveform=waveform, overlap=overlap, phase=phase)
    table = None if states is None else np.asarray(states, dtype=np.float64)
    rows = None if table is None else table.reshape(-1, table.shape[-1] or 2).tolist()
    size = max(len(many), 0 if rows is None else len(rows)) if many and rows != [] else 0
    for name, entries in (("hammers and periods", many), ("states", rows)):
        if entries is not None and len(entries) not in (1, size):
            raise InputError(f"{name}: {len(entries)} entries", key=name, expected=f"1 or {size}")
    begun: list[Any] = [None] if rows is None else [tuple(row) for row in rows]
    trains = [Train.of(many[i % len(many)], fired, begun[i % len(begun)]) for i in range(size)]
    chosen = np.arange(skipped + 1, skipped + count + 1)
    every, verdicts = run_trains(
        trains, chosen, firings if verdict else None, effort, every_exponent=every_exponent
    )
    return [
        strobe_of(train, chosen, states_of_train, effort.tolerance, judged)
        for train, states_of_train, judged in zip(trains, every, verdicts, strict=True)
    ]


def points_of(series: Any, firing: Firing) -> Any:
    """Return `series` unchanged, or compute strobe points if it is a hammer or a regime.

    The strobe points are recorded after a transient of a thousand firings. `firing` contains the keywords
    that describe the firing of a hammer. Raises InputError as `strobe` does, or if such keywords are given
    although nothing is computed.
    """
    if isinstance(series, Hammer | Regime):
        return strobe(series, points=_SETTLED, transient=_SETTLED, verdict=False, **firing)
    if firing:
        raise InputError(
            "points = strobe points", key="points", expected=f"no {' or '.join(firing)} with strobe points"
        )
    return series


def strobe_of(
    train: Train, firing: IntArray, states: States, tolerance: float, judged: Verdict | None
) -> Strobe:
    """Build a `Strobe` from the states of a train at the firings `firing` and its classification `judged`."""
    return Strobe(
        hammer=train.hammer,
        drive=train.drive,
        period=train.period,
        phase=train.regime.phase,
        firing=firing,
        **vars(states),
        tolerance=tolerance,
        verdict=judged,
    )


SCHEMES: Final[tuple[Scheme, ...]] = ("runge-kutta-4", "trapezoid")


def scheme_strobes(
    hammers: Hammer | Sequence[Hammer],
    periods: Sequence[float | str],
    scheme: Scheme,
    *,
    reading: Reading = "firings",
    points: int = POINTS,
    firings: tuple[int, int] = (FIRST, LAST),
    progress: Progress | None = None,
) -> list[Strobe]:
    """Compute the strobe points of trains from rest with an integration scheme of the 1983 paper.

    Parameters
    ----------
    hammers, periods
        Hammers and the times between their firings; see `printhammer.run.regime.regimes_of`.
    scheme : str
        "runge-kutta-4" or "trapezoid".
    reading : str, optional
        Rule that decides when a short integration step is taken; see `printhammer.run.scheme_runs.READINGS`.
    points, firings, progress
        As for `printhammer.chaos.strobes`; the points begin at the first firing.

    Returns
    -------
    list of Strobe
        Strobe points of each train, with a classification: a period, "strange" without a period up to 64, or
        "undecided" if the scheme failed before the last firing.

    Raises
    ------
    InputError
        The scheme or the reading is unknown, or a hammer has no rest state or waveform.
    """
    if scheme not in SCHEMES or reading not in READINGS:
        known = f"{' or '.join(SCHEMES)}, and {', '.join(READINGS)}"
        raise InputError(
            f"scheme = {scheme!r} with reading = {reading!r}", key="scheme", value=scheme, expected=known
        )
    regimes = regimes_of(hammers, periods)
    strobed = []
    for done, regime in enumerate(regimes, 1):
        train = Train.of(regime, max(points, firings[1]))
        count = max(points, firings[1])
        moments = train.times(np.arange(1, count + 1))
        problem = SchemeProblem(
            train.hammer, train.drive, initial_state(train.hammer, None), TOLERANCE, scheme, reading=reading
        )
        states = States(*problem.strobed(moments))
        chosen = np.arange(1, points + 1)
        shown = _part(states, slice(0, points))
        strobed.append(strobe_of(train, chosen, shown, TOLERANCE, _classify(states, train, firings)))
        if progress is not None:
            progress(done, len(regimes))
    return strobed


def _part(states: States, some: slice) -> States:
    names = ("t", "x", "v", "branch", "memory")
    return replace(states, **{name: getattr(states, name)[some] for name in names})


def _classify(states: States, train: Train, firings: tuple[int, int]) -> Verdict:
    first, last = firings
    judged = _part(states, slice(first - 1, last))
    stopped = states.status if np.isnan(states.x[last - 1]) else ""
    result = verdict(judged.distances(train), firings, TOLERANCE, None, stopped)
    if result.period is None and not stopped:
        return replace(result, name="strange", reason="")
    return result
