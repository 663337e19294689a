"""Members of an ensemble whose parts have the same laws, as the arrays of the kernel, and their results."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.kernel.lanes import layout as lane_layout
from printhammer.kernel.model.layout import CUBIC_PIECE, END, EXPONENTIAL_PIECE, MAGNET, PLACES, SINE_PIECE
from printhammer.kernel.single import carry
from printhammer.run.problem import MAX_STEPS, Problem, scales_of

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    import numpy.typing as npt

    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.kernel.compile.lanes import LaneKinds
    from printhammer.kernel.compile.specialise import Kernel
    from printhammer.support.arrays import FloatArray, IntArray

_NODES: Final = 2048
_CONTACTS: Final = 256
MOST_COLUMNS: Final = 6
_DOT_WIDTH: Final = 6
_STROBE_WIDTH: Final = 4
_PIECE: Final = 4 * lane_layout.LANES
"""Members in one piece of work for lanes."""


def starts_of(arrays: Sequence[npt.NDArray[Any]]) -> IntArray:
    """Return where each of some arrays begins when they are put one after the other, and the end of all."""
    return np.concatenate([[0], np.cumsum([len(array) for array in arrays])]).astype(np.int64)


def kernel_of(drive: Drive, known: dict[bytes, LaneKinds | None]) -> Hashable:
    """Return what of a drive decides on the kernel: the overlap rule, and the kinds of its pieces."""
    _times, _begins, pieces, replace, _force = drive.kernel_arrays()
    form = pieces.tobytes()
    if form not in known:
        known[form] = closed_form(pieces)[1]
    return bool(replace), known[form]


class Group:
    """Members with the same laws, overlap rule and kinds of pieces in their waveforms, started alike.

    All this is decided for each member, so that one kernel serves it in whatever company. `members` are their
    numbers in the ensemble; there is a hammer, a drive, a row of `states` (time, displacement, velocity, mode
    and memory at the start) and an end, s, for each of them.
    """

    def __init__(
        self,
        members: IntArray,
        hammers: Sequence[Hammer],
        drives: Sequence[Drive],
        states: FloatArray,
        ends: FloatArray,
        tolerance: float,
    ) -> None:
        self.members = members
        rows: dict[tuple[Any, ...], int] = {}
        waves: dict[bytes, int] = {}
        peaks: dict[bytes, float] = {}
        problems: list[Problem] = []
        tables: list[FloatArray] = []
        hammer_of, waveform_of = np.zeros((2, len(members)), np.int64)
        forms_of: dict[int, tuple[int, float]] = {}
        typical: dict[tuple[Any, ...], float] = {}
        for i, (hammer, drive) in enumerate(zip(hammers, drives, strict=True)):
            if id(drive) not in forms_of:
                pieces = np.asarray(drive.kernel_arrays()[2], dtype=np.float64)
                form = pieces.tobytes()
                if form not in waves:
                    waves[form] = len(tables)
                    tables.append(pieces)
                if drive.bounded:
                    forms_of[id(drive)] = waves[form], drive.largest_pulse
                else:
                    if form not in peaks:
                        peaks[form] = drive.largest_pulse
                    forms_of[id(drive)] = waves[form], peaks[form]
            waveform_of[i], peak = forms_of[id(drive)]
            x, v = float(states[i, 1]), float(states[i, 2])
            key: tuple[Any, ...] = (id(hammer), peak, drive.quantity)
            if key not in typical:
                free = hammer.position is None or hammer.front is None
                typical[key] = math.nan if free else scales_of(hammer, drive, (x, 0.0))[1]
            # Only what is faster than the typical speed has scales of its own.
            key = (
                (*key, x, v, drive.period) if math.isnan(typical[key]) else (*key, max(abs(v), typical[key]))
            )
            if key not in rows:
                rows[key] = len(problems)
                problems.append(Problem(hammer, drive, (x, v), 0.0, tolerance))
            hammer_of[i] = rows[key]
        firings = [np.asarray(drive.times, dtype=np.float64) for drive in drives]
        begins = [np.asarray(drive.kernel_arrays()[1], dtype=np.int64) for drive in drives]
        self.kernel: Kernel = problems[0].kernel
        self.laws = problems[0].laws
        constants = np.zeros((len(problems), max(problem.constants.size for problem in problems)))
        for row, problem in enumerate(problems):
            constants[row, : problem.constants.size] = problem.constants
        forms = [closed_form(table) for table in tables]
        self.lane_kinds = forms[0][1]
        self.uniform = len(problems) == 1 and len(tables) == 1
        self.most_firings = max(len(times) for times in firings)
        # Imported late, since it takes numba.
        from printhammer.kernel.lanes.batch import Batch

        self.batch = Batch(
            hammer_of=hammer_of,
            hammers=constants,
            controls=np.array([problem.control for problem in problems]),
            bounds=np.array([problem.bounds for problem in problems]),
            waveform_of=waveform_of,
            piece_starts=starts_of(tables),
            pieces=np.concatenate(tables),
            rates=np.array([rates for rates, _kinds in forms]),
            firing_starts=starts_of(firings),
            firings=np.concatenate(firings),
            begins=np.concatenate(begins),
            replace=bool(drives[0].kernel_arrays()[3]),
            states=states,
            ends=ends,
        )

    def fits_lanes(self) -> bool:
        """Tell whether there is a kernel for lanes for these members."""
        from printhammer.kernel.compile.lanes import suits

        if self.lane_kinds is None or not suits(self.laws):
            return False
        hammers = self.batch.hammers
        used = {role: hammers[:, place : place + 16] for role, place in PLACES.items()}
        used["magnet"] = hammers[:, MAGNET:]
        return all(
            not used[role][:, count:].any() for role, (_place, count) in lane_layout.PLACES.items()
        ) and bool((self.batch.states[:, 3] < 0.0).all())

    @property
    def lane_kernel(self) -> Kernel:
        """The compiled kernel for lanes."""
        from printhammer.kernel.compile.lanes import specialise_lanes

        if self.lane_kinds is None:
            raise ValueError("no closed form of the drive")
        return specialise_lanes(self.laws, self.lane_kinds)


def closed_form(table: FloatArray) -> tuple[list[float], LaneKinds | None]:
    """Return the rates of the pieces of a set of waveforms, and what kinds of pieces there are, for lanes.

    None instead of the kinds where the waveforms have more rates than lanes provide for.
    """
    pieces = table[table[:, 1] != END]
    kind = pieces[:, 1]
    decays = np.unique(pieces[kind == EXPONENTIAL_PIECE, 4])
    frequencies = np.unique(pieces[kind == SINE_PIECE, 4])
    rates = [0.0] * lane_layout.RATES_WIDTH
    if len(decays) > 2 or len(frequencies) > 1:
        return rates, None
    rates[: len(decays)] = decays
    rates[2 : 2 + len(frequencies)] = frequencies
    return rates, (len(decays), bool(pieces[kind == CUBIC_PIECE, 3:].any()), len(frequencies) > 0)


class Job:
    """One integration of a group: what to keep, and the arrays that it goes to.

    Kept are what each firing did, if wanted; the states at the `moments`, times in s for each member of the
    ensemble; and the displacements at the times of the `grid`, s, in `x`, which is that of the whole ensemble
    and used as it is where the group is the whole.
    """

    def __init__(
        self,
        group: Group,
        want_dots: bool,
        moments: Sequence[FloatArray],
        grid: FloatArray,
        x: npt.NDArray[np.float32],
    ) -> None:
        self.group = group
        count = len(group.members)
        self.order = np.arange(count)
        own = [moments[member] for member in group.members]
        strobe_times = np.concatenate(own)
        from printhammer.kernel.lanes.batch import Kept

        self.kept = Kept(
            strobe_starts=starts_of(own),
            strobe_times=strobe_times,
            grid=grid,
            want_dots=want_dots,
            status=np.zeros(count, np.int64),
            reached=np.zeros(count),
            steps=np.zeros(count, np.int64),
            dots=np.empty((group.batch.firings.size if want_dots else 0, _DOT_WIDTH)),
            strobes=np.empty((strobe_times.size, _STROBE_WIDTH)),
            x=x if count == len(x) else np.empty((count, grid.size), np.float32),
        )

    def finish(self, x: npt.NDArray[np.float32]) -> None:
        """Put the displacements of a group that is not the whole where they belong."""
        if self.kept.x is not x:
            x[self.group.members] = self.kept.x

    def share_out(self, threads: int) -> int:
        """Spread the members over pieces so that neighbours do not come together; return their length.

        Neighbours take about the same time, and a piece is done when its longest member is.
        """
        count = self.order.size
        pieces = threads * max(1, round(count / (_PIECE * threads)))
        self.order = np.concatenate([np.arange(piece, count, pieces) for piece in range(pieces)])
        return -(-count // pieces)

    def prepare(self, lanes: bool) -> None:
        """Have the machine code ready, in this thread, before others need it."""
        if lanes:
            self.lane_piece(0, 0)
        else:
            self._one_by_one(self.order[:0], prepare=True)

    def piece(self, first: int, last: int) -> None:
        """Integrate some members of the group one by one, in this thread."""
        self._one_by_one(self.order[first:last])

    def lane_piece(self, first: int, last: int) -> None:
        """Integrate some members of the group side by side, in this thread."""
        group = self.group
        which = self.order[first:last]
        left_over = np.empty(which.size, np.int64)
        left = group.lane_kernel.lanes(
            which,
            group.batch,
            self.kept,
            group.uniform,
            np.zeros(group.most_firings, np.int64),
            np.zeros(1 + 7 * group.most_firings),
            np.zeros((lane_layout.POOLS + 1, lane_layout.POOL_SIZE)),
            np.zeros(lane_layout.POOLS, np.int64),
            np.zeros((lane_layout.POOLS, lane_layout.LANES), np.int64),
            np.zeros((lane_layout.LANES, lane_layout.SLOT_WIDTH)),
            np.zeros(lane_layout.LANES, np.int64),
            left_over,
        )
        self._one_by_one(left_over[:left])

    def _one_by_one(self, which: IntArray, prepare: bool = False) -> None:
        group = self.group
        nodes, contacts = _NODES, _CONTACTS
        under_way = np.zeros((2, group.most_firings), np.int64)
        live = np.zeros((2, 1 + 7 * group.most_firings))
        while which.size or prepare:
            prepare = False
            done = group.kernel.members(
                which,
                group.batch,
                self.kept,
                MAX_STEPS,
                under_way,
                live,
                np.empty((nodes, 5)),
                np.empty((contacts, 7)),
                np.zeros(carry.SIZE),
            )
            which = which[done:]
            nodes, contacts = 4 * nodes, 4 * contacts
