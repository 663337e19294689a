"""Ensembles: many runs, integrated together on all cores.

Every member has its own hammer, drive, state, steps and contacts. Only requested results are stored, so that
memory does not grow with the length of the runs. The results of a member do not depend on the other members
or on the number of threads.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import cached_property
from typing import Any, Final, Literal, get_args

import numpy as np
import numpy.typing as npt

from printhammer.drive.batch import PulseTrains, Ragged, firings_of
from printhammer.drive.input import read_array
from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.model.laws import Laws
from printhammer.kernel.model.modes import MODE_NAMES, OK, STATUS_NAMES
from printhammer.results import Result, column, part
from printhammer.results.result import Entries
from printhammer.run.contacts import DotTable, ExtraDots
from printhammer.run.ensemble_group import MOST_COLUMNS, Fired, Group, Job
from printhammer.run.motion import Motion
from printhammer.run.problem import MAX_STEPS, TOLERANCE, check_tolerance, laws_of
from printhammer.run.start import AT_REST, FORMS, check_branch, initial_state
from printhammer.support.arrays import BoolArray, FloatArray, IntArray
from printhammer.support.threads import PIECES_A_THREAD, Progress, in_threads, thread_count

__all__ = [
    "DISPLAY_TOLERANCE",
    "MODE_NAMES",
    "DotTable",
    "Ensemble",
    "EnsembleResult",
    "ExtraDots",
    "Strobes",
]

DISPLAY_TOLERANCE: Final = 5e-7
"""Integration tolerance for plots: displacements are accurate to about 1e-4 of the stroke; arbitrary."""

Engine = Literal["auto", "plain", "lanes"]
ENGINES: Final = get_args(Engine)


_TIMES: Final = "member strobe"


class Strobes(Result):
    """States of all members at their requested times.

    Entries are NaN after the end of a run, and as padding for members with fewer requested times.
    """

    t: FloatArray = column("s", "time", _TIMES)
    x: FloatArray = column("m", "displacement", _TIMES)
    v: FloatArray = column("m/s", "velocity", _TIMES)
    branch: IntArray = column(
        "1", "mode of motion", _TIMES, more="-1 after the end of a run", codes=MODE_NAMES
    )
    memory: FloatArray = column(
        "m", "latest local maximum inside the pack", _TIMES, more="0 except on the unloading branch"
    )
    current: FloatArray | None = column(
        "A",
        "current in the coil",
        _TIMES,
        more="None unless a voltage drives a member; NaN for members without a voltage drive",
        default=None,
    )
    turn: FloatArray | None = column(
        "A", "current in the shorted turn", _TIMES, more="None and NaN as for `current`", default=None
    )
    reservoir: FloatArray | None = column(
        "V", "voltage of the supply's capacitor", _TIMES, more="None and NaN as for `current`", default=None
    )

    def entries(self) -> Entries:
        """Return the state arrays by name; currents and voltage only if a voltage drives a member."""
        return {name: entry for name, entry in super().entries().items() if entry[1] is not None}

    @property
    def electric(self) -> FloatArray | None:
        """Electric state, shape (members, strobes, 3); None unless a voltage drives a member.

        The last axis contains the current in the coil [A], the current in the shorted turn [A], and the
        voltage of the supply's capacitor [V].
        """
        parts = [part for part in (self.current, self.turn, self.reservoir) if part is not None]
        return np.stack(parts, axis=2) if parts else None


class EnsembleResult(Result):
    """Results of an ensemble: status of each run, and the requested dots, states and displacements."""

    status: IntArray = column("1", "status of the run", "member", more="0 is ok", codes=STATUS_NAMES)
    reached: FloatArray = column("s", "time at which the run ended", "member")
    steps: IntArray = column("1", "steps of the integrator", "member")
    dots: DotTable | None = part("dots of the firings", more="if requested", default=None)
    extra: ExtraDots | None = part("extra contacts", more="if requested", default=None)
    strobes: Strobes | None = part("states at the requested times", default=None)
    x: npt.NDArray[np.float32] | None = column(
        "m",
        "displacement at the common times",
        "member time",
        more="NaN after the end of a run",
        default=None,
    )

    @property
    def title(self) -> str:
        """One-line title with the number of runs."""
        return f"{len(self.status)} runs of an ensemble"

    def entries(self) -> Entries:
        """Return the requested results: dots by name, states as `strobe_t` and so on, and extra contacts."""
        entries = super().entries()
        if self.x is None:
            del entries["x"]
        if self.strobes is not None:
            entries |= {f"strobe_{name}": entry for name, entry in self.strobes.entries().items()}
        if self.extra is not None:
            entries |= {f"extra_{name}": entry for name, entry in self.extra.entries().items()}
        return entries if self.dots is None else entries | self.dots.entries()

    @property
    def ok(self) -> BoolArray:
        """Whether each run reached its end."""
        return np.equal(self.status, OK)

    @property
    def status_names(self) -> list[str]:
        """Name of each run's status, such as "ok" or "runaway"."""
        return [STATUS_NAMES[code] for code in self.status]


class Ensemble:
    """Many runs, integrated together on all cores.

    Parameters
    ----------
    hammers : Hammer or sequence of Hammer
        One hammer for all members, or one for each.
    drives : Drive or sequence of Drive
        One drive for all members, or one for each; `printhammer.PulseTrains` is the most efficient form of
        many trains.
    ends : float or array
        End times of the runs, s: one time for all members, or one for each member.
    states : tuple or array, optional
        Displacement [m] and velocity [m/s] at the start: one for all or one row for each member; by default
        the rest state of the member's hammer. Rows of four also hold the mode and the memory, as in
        `Strobes`, for a start inside the pack. Under a voltage three more columns may follow: the currents in
        the coil and in its shorted turn, A, and the voltage of the supply's capacitor, V; by default there is
        no current, and the capacitor is charged.
    starts : float or array, optional
        Start times of the runs, s, not negative: one time for all members, or one for each member; by default
        0. Pulses fired before the start are still active.
    tolerance : float, optional
        Error tolerance of one step, in units of the distance from backstop to pack and of a typical speed.
    max_steps : int, optional
        Largest number of steps of a run, which otherwise ends with the status "step limit"; by default 5e7.

    Raises
    ------
    InputError
        The numbers of hammers, drives, ends, states and starts differ; an end is not positive or not after
        its start; a state is not finite; `max_steps` is not positive; or a hammer has no rest state and no
        states are passed.
    """

    def __init__(
        self,
        hammers: Hammer | Sequence[Hammer],
        drives: Drive | Sequence[Drive],
        ends: float | npt.ArrayLike,
        *,
        states: npt.ArrayLike | None = None,
        starts: float | npt.ArrayLike = 0.0,
        tolerance: float = TOLERANCE,
        max_steps: int = MAX_STEPS,
    ) -> None:
        check_tolerance(tolerance)
        self.tolerance = tolerance
        if not max_steps > 0:
            raise InputError.of("max_steps", max_steps, "a positive number")
        self.max_steps = max_steps
        many_hammers = [hammers] if isinstance(hammers, Hammer) else list(hammers)
        many_drives: Sequence[Drive]
        if isinstance(drives, list | tuple):
            many_drives = list(drives)
        else:
            many_drives = drives if isinstance(drives, PulseTrains) else [drives]  # type: ignore[list-item]
        _check_kind("hammers", many_hammers, Hammer, "hammers, as load('hendriks-1983') gives one")
        if not isinstance(many_drives, PulseTrains):
            _check_kind("drives", many_drives, Drive, "drives, such as PulseTrain(hammer.waveform)")
        moments, begun = _each(ends, "ends"), _each(starts, "starts")
        rows = None if states is None else read_array(states, "states")
        counts = {
            "hammers": len(many_hammers),
            "drives": len(many_drives),
            "ends": len(moments) if np.ndim(ends) else 1,
            "states": 1 if rows is None or rows.ndim < 2 else len(rows),
            "starts": len(begun) if np.ndim(starts) else 1,
        }
        self.size = max(counts.values()) if min(counts.values()) > 0 else 0
        for name, count in counts.items():
            if count not in (1, self.size):
                raise InputError(f"{name}: {count} entries", key=name, expected=f"1 or {self.size}")
        wrong = ~(np.isfinite(moments) & (moments > 0.0))
        if wrong.any():
            raise InputError.of("ends", float(moments[wrong][0]), "positive numbers", unit="s")
        self.hammers: list[Hammer] = many_hammers * (self.size if len(many_hammers) == 1 else 1)
        one_for_all = len(many_drives) == 1 and self.size != 1
        self.drives: Sequence[Drive] = [many_drives[0]] * self.size if one_for_all else many_drives
        self.ends = np.broadcast_to(moments, (self.size,)).astype(np.float64)
        self.states = self._states(rows)
        self.states[:, 0] = self._checked_starts(begun)

    def _states(self, rows: FloatArray | None) -> FloatArray:
        full = np.zeros((self.size, 3 + len(AT_REST)))
        full[:, 3:] = AT_REST
        if rows is None:
            hammers, hammer_of = self._own_hammers
            full[:, 1] = np.array([hammer.rest for hammer in hammers])[hammer_of]
            return full
        places = FORMS.get(rows.shape[-1]) if rows.ndim in (1, 2) else None
        fired = self.drives.pulses if isinstance(self.drives, PulseTrains) else self.drives
        if places is None or (
            max(places, default=0) > 1 and any(drive.quantity != "voltage" for drive in fired)
        ):
            raise InputError(
                f"states: an array of shape {rows.shape}",
                key="states",
                expected=(
                    "rows of displacement and velocity, or of these with branch and memory; under a"
                    " voltage then with the current, or with currents and the voltage of the capacitor"
                ),
            )
        full[:, [1, 2, *(3 + place for place in places)]] = rows
        hammers, hammer_of = self._own_hammers
        different = np.unique(np.column_stack([hammer_of, full[:, 1:5]]), axis=0, return_index=True)[1]
        for i in np.sort(different):
            hammer, row = hammers[hammer_of[i]], full[i, 1:].tolist()
            initial_state(hammer, row[:2])
            if row[2] >= 0.0:
                check_branch(hammer, row)
        if not np.isfinite(full[:, 5:7]).all():
            raise InputError("states: a current that is not a finite number, A", key="states")
        return full

    def _checked_starts(self, begun: FloatArray) -> FloatArray:
        starts = np.broadcast_to(begun, (self.size,))
        wrong = ~(np.isfinite(starts) & (starts >= 0.0) & (starts < self.ends))
        if wrong.any():
            start, end = float(starts[wrong][0]), float(self.ends[wrong][0])
            raise InputError.of("starts", start, f"a number from 0 to before the end at {end!r} s", unit="s")
        return starts

    @cached_property
    def groups(self) -> list[Group]:
        """Members of the ensemble, grouped by the laws of their hammers' parts."""
        fired = Fired(self.drives)
        hammers, hammer_of = self._own_hammers
        # The kernel of a member depends on its hammer and on the form of its drive.
        pairs, first, pair_of = np.unique(
            hammer_of * len(fired.forms) + fired.form_of, return_index=True, return_inverse=True
        )
        laws: dict[tuple[int, bool], Laws] = {}
        kernels: dict[Hashable, int] = {}
        kernel_of = np.zeros(len(pairs), np.int64)
        for pair, i in enumerate(first.tolist()):
            form = fired.forms[fired.form_of[i]]
            key = int(hammer_of[i]), form.force
            if key not in laws:
                laws[key] = laws_of(self.hammers[i], self.drives[i])
            kernel = laws[key], form.replace, fired.kinds[form.table]
            kernel_of[pair] = kernels.setdefault(kernel, len(kernels))
        begun_inside = self.states[:, 3] >= 0.0
        alike = Ragged.sorted_by(2 * kernel_of[pair_of] + begun_inside)
        return [
            Group(
                alike[row], hammers, hammer_of, fired, self.states, self.ends, self.tolerance, self.max_steps
            )
            for row in range(len(alike))
        ]

    @cached_property
    def _own_hammers(self) -> tuple[list[Hammer], IntArray]:
        """Distinct hammer objects, and for each member the index of its hammer among them."""
        known = {id(hammer): hammer for hammer in self.hammers}
        places = {key: place for place, key in enumerate(known)}
        which = [places[id(hammer)] for hammer in self.hammers]
        return list(known.values()), np.array(which, dtype=np.int64)

    def motion(self, member: int) -> Motion:
        """Return the full motion of the member with the index `member`."""
        from printhammer.run.simulate import simulate

        if self.states[member, 0] > 0.0:
            raise InputError(
                f"member {member} starts after time 0, which a single motion does not support", key="start"
            )
        drive, state = self.drives[member], self.states[member, 1:].tolist()
        return simulate(
            self.hammers[member],
            drive,
            duration=float(self.ends[member]),
            state=state if drive.quantity == "voltage" else state[:4],
            tolerance=self.tolerance,
        )

    def run(
        self,
        *,
        dots: bool = False,
        extra: bool = False,
        strobes: Literal["firings"] | Sequence[npt.ArrayLike] | None = None,
        times: npt.ArrayLike | None = None,
        x: npt.NDArray[np.float32] | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
        engine: Engine = "auto",
    ) -> EnsembleResult:
        """Integrate all members; return the status of each run and the requested results.

        Parameters
        ----------
        dots : bool, optional
            Whether to store the dots.
        extra : bool, optional
            Whether to store every extra contact; only with `dots`.
        strobes : str or sequence of arrays, optional
            Times of stored states: every firing ("firings"), or ascending times [s], one array for each
            member.
        times : array, optional
            Ascending times [s] at which the displacement is stored.
        x : float32 array, shape (M, T), optional
            Array for the displacements; by default a new array.
        threads : int, optional
            Number of threads; by default the number of cores.
        progress : callable, optional
            Called from time to time with the number of members done and in total.
        engine : str, optional
            "plain": one member at a time; "lanes": in vector lanes (`printhammer.kernel.lanes`); "auto":
            in lanes if the laws of the members allow it. The two engines agree within the tolerance.

        Returns
        -------
        EnsembleResult
            Results with a status for each member; a run that ends early raises no exception.
        """
        if engine not in ENGINES:
            raise InputError.of("engine", engine, f"one of {', '.join(ENGINES)}")
        workers = thread_count(threads)
        grid = np.zeros(0) if times is None else _ascending(times, "times")
        if x is None:
            x = np.empty((self.size, grid.size), np.float32)
        elif x.shape != (self.size, grid.size) or x.dtype != np.float32 or not x.flags.c_contiguous:
            raise InputError(
                f"x: an array of shape {x.shape} and type {x.dtype}",
                key="x",
                expected=f"{(self.size, grid.size)} and float32, without gaps",
            )
        moments = self._moments(strobes)
        jobs = [Job(group, bool(dots), bool(extra), moments, grid, x) for group in self.groups]
        _integrate(jobs, engine, workers, progress)
        # Members with more extra contacts than rows are integrated again with more rows.
        _integrate([job for job in jobs if job.make_room()], engine, workers, None)
        for job in jobs:
            job.finish(x)
        return EnsembleResult(
            status=self._gathered([job.kept.status for job in jobs]),
            reached=self._gathered([job.kept.reached for job in jobs]),
            steps=self._gathered([job.kept.steps for job in jobs]),
            dots=self._dot_table(jobs) if dots else None,
            extra=ExtraDots.from_rows([(job.group.members, job.rows_of_extra()) for job in jobs])
            if dots and extra
            else None,
            strobes=None if strobes is None else self._strobes(jobs, moments),
            x=None if times is None else x,
        )

    def _gathered(self, parts: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
        whole = np.empty(self.size, parts[0].dtype if parts else np.int64)
        for group, gathered in zip(self.groups, parts, strict=True):
            whole[group.members] = gathered
        return whole

    def _spread(self, rows: Sequence[Ragged]) -> FloatArray:
        """Scatter the rows of the groups into one array, shape (members, rows, columns), padded with NaN."""
        most = max((own.longest for own in rows), default=0)
        width = max((own.values.shape[1] for own in rows), default=MOST_COLUMNS)
        whole = np.full((self.size, most, width), np.nan)
        for group, own in zip(self.groups, rows, strict=True):
            whole[group.members, :, : own.values.shape[1]] = own.filled(most)
        return whole

    def _dot_table(self, jobs: Sequence[Job]) -> DotTable:
        rows = self._spread([job.rows_of_dots() for job in jobs])
        reached = self._gathered([job.kept.reached for job in jobs])
        return DotTable.from_rows(rows, firings_of(self.drives).filled().copy(), reached)

    def _strobes(self, jobs: Sequence[Job], moments: Ragged) -> Strobes:
        states = self._spread([Ragged(job.kept.strobes, job.kept.strobe_starts) for job in jobs])
        mode = states[:, :, 2]
        return Strobes(
            t=moments.filled().copy(),
            x=states[:, :, 0],
            v=states[:, :, 1],
            branch=np.where(np.isnan(mode), -1, np.nan_to_num(mode)).astype(np.int64),
            memory=states[:, :, 3],
            **dict(zip(("current", "turn", "reservoir"), np.moveaxis(states[:, :, 4:], 2, 0), strict=False)),
        )

    def _moments(self, strobes: Literal["firings"] | Sequence[npt.ArrayLike] | None) -> Ragged:
        if strobes is None:
            return Ragged.empty(self.size)
        if isinstance(strobes, str):
            if strobes != "firings":
                raise InputError.of("strobes", strobes, '"firings" or an array for each member')
            return firings_of(self.drives)
        if not isinstance(strobes, Sequence | np.ndarray):
            raise InputError.of("strobes", strobes, '"firings" or an array for each member')
        if len(strobes) != self.size:
            raise InputError(f"strobes: {len(strobes)} arrays", key="strobes", expected=f"{self.size}")
        return Ragged.of([_ascending(moment, "strobes") for moment in strobes])


def _integrate(jobs: Sequence[Job], engine: Engine, threads: int, progress: Progress | None) -> None:
    works, lengths = [], []
    sizes = [job.order.size for job in jobs]
    for job, size in zip(jobs, sizes, strict=True):
        in_lanes = engine != "plain" and job.group.fits_lanes()
        if engine == "lanes" and not in_lanes:
            raise InputError(
                'engine = "lanes"',
                key="engine",
                value="lanes",
                expected='"plain" or "auto": the parts do not allow lanes',
            )
        job.prepare(in_lanes)
        if in_lanes:
            works.append(job.lane_piece)
            lengths.append(job.share_out(threads))
        else:
            works.append(job.piece)
            lengths.append(max(1, size // (PIECES_A_THREAD * threads)))
    in_threads(works, sizes, threads, progress, lengths)


def _check_kind(name: str, members: Sequence[Any], kind: type, expected: str) -> None:
    """Raise InputError for the first element of `members` that is not an instance of `kind`.

    `name` is the argument and `expected` the expectation in the error message.
    """
    for member in members:
        if not isinstance(member, kind):
            raise InputError.of(name, member, expected)


def _each(values: npt.ArrayLike, name: str) -> FloatArray:
    values_of = read_array(values, name)
    if values_of.ndim > 1:
        raise InputError(
            f"{name}: an array of shape {values_of.shape}", key=name, expected="one number for each member"
        )
    return np.atleast_1d(values_of)


def _ascending(times: npt.ArrayLike, name: str) -> FloatArray:
    moments = read_array(times, name).reshape(-1)
    if not np.isfinite(moments).all() or (np.diff(moments) < 0.0).any() or (moments < 0.0).any():
        raise InputError(f"{name}: expected ascending numbers, not negative", key=name)
    return moments
