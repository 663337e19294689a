"""Groups of ensemble members with the same laws: the arrays that the kernel reads and fills.

The drives of an ensemble are stored as arrays: a few forms of pulses, and many firing times.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from printhammer.drive.batch import PulseTrains, Ragged, firings_of, starts_of
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.base import Supply
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.kernel.compile.lanes import LaneKinds
from printhammer.kernel.compile.specialise import Kernel
from printhammer.kernel.lanes import layout as lane_layout
from printhammer.kernel.model.dots import DOT_WIDTH
from printhammer.kernel.model.layout import (
    CUBIC_PIECE,
    END,
    EXPONENTIAL_PIECE,
    MAGNET,
    PLACES,
    ROOM,
    SINE_PIECE,
)
from printhammer.kernel.single import carry
from printhammer.run.problem import (
    bounds_of,
    constants_of,
    control_of,
    laws_of,
    live_size,
    node_width,
    scales_of,
)
from printhammer.run.supply import take_supply
from printhammer.support.arrays import FloatArray, IntArray

_NODES: Final = 2048  # Initial number of rows for nodes; arbitrary, enlarged on demand
_CONTACTS: Final = 256  # Initial number of rows for contacts; arbitrary, enlarged on demand
MOST_COLUMNS: Final = 6  # Number of columns of an ensemble result without rows; arbitrary
_EXTRA: Final = 4
"""Initial number of rows for extra contacts of a member, in addition to one per firing; arbitrary."""
_STROBE_WIDTH: Final = 4  # Number of columns of a strobe row, as in `printhammer.kernel.single.stretch`
_ELECTRIC_WIDTH: Final = 3  # Number of additional columns of a strobe row if the laws contain a circuit
_PIECE: Final = 4 * lane_layout.LANES
"""Number of members in one unit of work for vector lanes."""


class Group:
    """Ensemble members with the same laws, overlap rule, kinds of waveform pieces and kind of start.

    A start is inside or outside the pack. The group of a member depends on that member only, so that its
    kernel does not depend on other members. `members` lists the indices of the group's members in the
    ensemble; `hammers` and `hammer_of` are the distinct hammers and the index for each member, and `fired`
    contains the drives of all members. Each member of the ensemble has a row of `states` (time, displacement,
    velocity and further components at the start) and an end time, s. No run takes more than `max_steps`.
    """

    def __init__(
        self,
        members: IntArray,
        hammers: Sequence[Hammer],
        hammer_of: IntArray,
        fired: Fired,
        states: FloatArray,
        ends: FloatArray,
        tolerance: float,
        max_steps: int,
    ) -> None:
        # Imported here, since the module imports numba.
        from printhammer.kernel.compile.specialise import specialise
        from printhammer.kernel.lanes.batch import Batch

        self.members = members
        self.laws = laws_of(hammers[hammer_of[members[0]]], fired.drives[members[0]])
        posed = _posed(members, hammers, hammer_of, fired, states, tolerance, self.laws.circuit)
        own_tables, waveform_of = np.unique(fired.table_of[members], return_inverse=True)
        tables = [fired.tables[number] for number in own_tables.tolist()]
        self.kernel: Kernel = specialise(self.laws)
        self.lane_kinds = fired.kinds[own_tables[0]]
        self.uniform = len(posed.bounds) == 1 and len(tables) == 1
        self.firings = fired.firings.take(members)
        self.most_firings = self.firings.longest
        self.batch = Batch(
            hammer_of=posed.by,
            hammers=posed.constants,
            controls=posed.controls,
            bounds=posed.bounds,
            waveform_of=waveform_of.astype(np.int64),
            piece_starts=starts_of(np.array([len(table) for table in tables], dtype=np.int64)),
            pieces=np.concatenate(tables),
            rates=np.array([fired.rates[number] for number in own_tables.tolist()]),
            firing_starts=self.firings.starts,
            firings=self.firings.values,
            begins=fired.begins[fired.firings.places(members)],
            replace=fired.forms[fired.form_of[members[0]]].replace,
            states=states[members],
            ends=ends[members],
            max_steps=max_steps,
        )

    def fits_lanes(self) -> bool:
        """Whether the vector-lane kernel supports these members."""
        from printhammer.kernel.compile.lanes import suits

        if self.lane_kinds is None or self.laws.circuit or not suits(self.laws):
            return False
        hammers = self.batch.hammers
        used = {role: hammers[:, PLACES[role] : PLACES[role] + room] for role, room in ROOM.items()}
        used["magnet"] = hammers[:, MAGNET:]
        return all(
            not used[role][:, count:].any() for role, (_place, count) in lane_layout.PLACES.items()
        ) and bool((self.batch.states[:, 3] < 0.0).all())

    @property
    def lane_kernel(self) -> Kernel:
        """Compiled vector-lane kernel for the laws of the group."""
        from printhammer.kernel.compile.lanes import specialise_lanes

        if self.lane_kinds is None:
            raise ValueError("no closed form of the drive")
        return specialise_lanes(self.laws, self.lane_kinds)


class _Posed(NamedTuple):
    """Distinct initial-value problems, one per row; `by` is, for each member, the row of its problem."""

    constants: FloatArray
    controls: FloatArray
    bounds: FloatArray
    by: IntArray


def _posed(
    members: IntArray,
    hammers: Sequence[Hammer],
    hammer_of: IntArray,
    fired: Fired,
    states: FloatArray,
    tolerance: float,
    circuit: bool,
) -> _Posed:
    constants: list[FloatArray] = []
    controls: list[tuple[float, ...]] = []
    bounds: list[tuple[float, ...]] = []
    by = np.zeros(len(members), np.int64)
    peaks, peak_of = np.unique(fired.peak_of[members], return_inverse=True)
    # Capacitor and diode belong to the drive, but are stored with the constants of the hammer.
    supplies = fired.supply_of.max(initial=0) + 1
    alike = Ragged.sorted_by(
        (hammer_of[members] * len(peaks) + peak_of) * supplies + fired.supply_of[members]
    )
    hammer: Hammer | None = None
    static: StaticForce | None = None
    packed = np.zeros(0)
    for places in map(alike.__getitem__, range(len(alike))):
        own = members[places]
        drive = fired.drives[own[0]]
        # Rows are sorted by hammer first.
        if hammer is not hammers[hammer_of[own[0]]]:
            hammer = hammers[hammer_of[own[0]]]
            static, packed = StaticForce(hammer), constants_of(hammer)
        full = packed
        if circuit:
            full = packed.copy()
            take_supply(full, hammer, drive)
        scales_of_own, which = _scales(hammer, static, own, fired, drive, states)
        by[places] = len(bounds) + which
        for scales in scales_of_own:
            constants.append(full)
            controls.append(control_of(scales, tolerance))
            bounds.append(bounds_of(hammer, scales))
    table = np.zeros((len(bounds), max(row.size for row in constants)))
    for row, values in zip(table, constants, strict=True):
        row[: values.size] = values
    return _Posed(table, np.array(controls), np.array(bounds), by)


def _scales(
    hammer: Hammer,
    static: StaticForce | None,
    own: IntArray,
    fired: Fired,
    first_drive: Drive,
    states: FloatArray,
) -> tuple[list[tuple[float, float]], IntArray]:
    """Return the distinct scales of members with one hammer, and for each member the index of its scales.

    The scales are a typical displacement [m] and speed [m/s]. `own` are the indices of these members in the
    ensemble; `fired` and `states` contain the drives and initial states of all members of the ensemble.
    `static` is the static force of the hammer, and `first_drive` the drive of the first of these members.
    """
    x, v = states[own, 1], states[own, 2]
    if hammer.position is None or hammer.front is None:
        periods = [math.nan if (period := fired.drives[i].period) is None else period for i in own]
        keys = np.column_stack([x, v, periods])
        _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        posed = [((float(x[k]), float(v[k])), fired.drives[own[k]]) for k in first.tolist()]
        return [scales_of(hammer, drive, state, static) for state, drive in posed], which
    way, typical = scales_of(hammer, first_drive, (float(x[0]), 0.0), static)
    if len(own) == 1:
        return [(way, max(typical, abs(float(v[0]))))], np.zeros(1, np.int64)
    # Only displacements or speeds beyond the typical scales have separate scales.
    speeds, which = np.unique(np.maximum(np.abs(v), typical), return_inverse=True)
    return [(way, speed) for speed in speeds.tolist()], which


class Job:
    """Integration of a group of members: requested results, and their arrays.

    The results are the dots and extra contacts, if requested; the states at the `moments`, times in s for
    each member of the ensemble; and the displacements at the times of the `grid` [s] in `x`, the array of the
    whole ensemble, which is used directly if the group is the whole ensemble.
    """

    def __init__(
        self,
        group: Group,
        want_dots: bool,
        want_extra: bool,
        moments: Ragged,
        grid: FloatArray,
        x: npt.NDArray[np.float32],
    ) -> None:
        self.group = group
        self._want_extra = want_dots and want_extra
        count = len(group.members)
        rows = group.firings.counts if want_dots else np.zeros(count, np.int64)
        dot_starts = starts_of(2 * rows + _EXTRA if self._want_extra else rows)
        self.order = np.arange(count)
        own = moments.take(group.members)
        from printhammer.kernel.lanes.batch import Kept

        self.kept = Kept(
            strobe_starts=own.starts,
            strobe_times=own.values,
            grid=grid,
            want_dots=want_dots,
            status=np.zeros(count, np.int64),
            reached=np.zeros(count),
            steps=np.zeros(count, np.int64),
            extra=np.zeros(count, np.int64),
            dot_starts=dot_starts,
            dots=np.empty((dot_starts[-1], DOT_WIDTH)),
            strobes=np.empty(
                (own.values.size, _STROBE_WIDTH + (_ELECTRIC_WIDTH if group.laws.circuit else 0))
            ),
            x=x if count == len(x) else np.empty((count, grid.size), np.float32),
        )

    def finish(self, x: npt.NDArray[np.float32]) -> None:
        """Copy the displacements of the group to the rows of its members in the array `x` of the ensemble."""
        if self.kept.x is not x:
            x[self.group.members] = self.kept.x

    def rows_of_dots(self) -> Ragged:
        """Return the recorded dots of each member, one row per firing."""
        if not self._want_extra:
            return Ragged(self.kept.dots, self.kept.dot_starts)
        return self._rows(self.kept.dot_starts[:-1], self.group.firings.counts)

    def rows_of_extra(self) -> Ragged:
        """Return the recorded extra contacts of each member, one row per contact."""
        return self._rows(self.kept.dot_starts[:-1] + self.group.firings.counts, self.kept.extra)

    def _rows(self, begins: IntArray, counts: IntArray) -> Ragged:
        """Return recorded rows: for each member, `counts` rows from the index `begins` onward."""
        starts = starts_of(counts)
        places = np.arange(starts[-1]) + np.repeat(begins - starts[:-1], counts)
        return Ragged(self.kept.dots[places], starts)

    def make_room(self) -> bool:
        """Allocate rows for members with more extra contacts than rows; return whether any were allocated.

        The next integration covers these members only, and fills their rows again.
        """
        kept = self.kept
        needed = self.group.firings.counts + kept.extra
        short = needed > np.diff(kept.dot_starts)
        if not self._want_extra or not short.any():
            return False
        self.order = np.flatnonzero(short)
        starts = starts_of(needed)
        dots = np.empty((starts[-1], DOT_WIDTH))
        places = np.arange(starts[-1]) + np.repeat(kept.dot_starts[:-1] - starts[:-1], needed)
        whole = np.repeat(~short, needed)
        dots[whole] = kept.dots[places[whole]]
        self.kept = kept._replace(dot_starts=starts, dots=dots)
        return True

    def share_out(self, threads: int) -> int:
        """Reorder the members so that neighbours are in different units of work; return the unit size.

        Neighbouring members have similar computation times, so the units need about the same time. The size
        is the number of members per unit.
        """
        count = self.order.size
        pieces = threads * max(1, round(count / (_PIECE * threads)))
        self.order = np.concatenate([self.order[piece::pieces] for piece in range(pieces)])
        return -(-count // pieces)

    def prepare(self, lanes: bool) -> None:
        """Load the machine code of the kernel in this thread, before worker threads call the kernel.

        The kernel is the vector-lane kernel if `lanes`, else the kernel for single members.
        """
        if lanes:
            self.lane_piece(0, 0)
        else:
            self._one_by_one(self.order[:0], prepare=True)

    def piece(self, first: int, last: int) -> None:
        """Integrate members `first` to `last` - 1 of the order of work one by one, in this thread."""
        self._one_by_one(self.order[first:last])

    def lane_piece(self, first: int, last: int) -> None:
        """Integrate members `first` to `last` - 1 of the order of work in vector lanes, in this thread."""
        group = self.group
        which = self.order[first:last]
        left_over = np.empty(which.size, np.int64)
        left = group.lane_kernel.lanes(
            which,
            group.batch,
            self.kept,
            group.uniform,
            np.zeros(group.most_firings, np.int64),
            np.zeros(live_size(group.most_firings)),
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
        live = np.zeros((2, live_size(group.most_firings)))
        while which.size or prepare:
            prepare = False
            done = group.kernel.members(
                which,
                group.batch,
                self.kept,
                under_way,
                live,
                np.empty((nodes, node_width(group.laws))),
                np.empty((contacts, 7)),
                np.zeros(carry.SIZE),
            )
            which = which[done:]
            nodes, contacts = 4 * nodes, 4 * contacts


class Form(NamedTuple):
    """Form of a drive: all of its properties except the firing times.

    Attributes
    ----------
    table : int
        Index of the drive's segment table among the tables of all drives.
    replace, force : bool
        Whether a firing cuts off the pulses before it; whether the drive is a force.
    peak : float
        Largest absolute value of any one pulse, A, N or V.
    supply : Supply
        Supply of a voltage drive.
    """

    table: int
    replace: bool
    force: bool
    peak: float
    supply: Supply


class Fired:
    """Drives of all members of an ensemble, in the order of the members.

    Attributes
    ----------
    drives : sequence of Drive
        Drives of all members.
    forms, form_of : list of Form; int array, shape (members,)
        Distinct forms, and for each member the index of the form of its drive.
    firings : Ragged
        Firing times of the members, s.
    begins : int array, shape (all firings,)
        First row of each firing's segment table within the table of the member's form.
    table_of, peak_of, supply_of : array, shape (members,)
        Segment table index, peak value and supply index of each member's form.
    tables, rates, kinds : list
        Segment tables, and the result of `closed_form` for each.
    """

    def __init__(self, drives: Sequence[Drive]) -> None:
        self.drives = drives
        self.forms: list[Form] = []
        self.tables: list[FloatArray] = []
        self.rates: list[list[float]] = []
        self.kinds: list[LaneKinds | None] = []
        self._tables: dict[bytes, int] = {}
        self._peaks: dict[int, float] = {}
        self._forms: dict[Form, int] = {}
        self.firings = firings_of(drives)
        if isinstance(drives, PulseTrains):
            places = np.array([self._add(pulse) for pulse in drives.pulses], dtype=np.int64)
            self.form_of = places[drives.pulse_of]
            self.begins = np.zeros(self.firings.values.size, np.int64)
        else:
            # A cache by identity, since many members often share one drive object.
            known = {id(drive): drive for drive in drives}
            added = {key: (self._add(drive), drive.kernel_arrays()[1]) for key, drive in known.items()}
            self.form_of = np.array([added[id(drive)][0] for drive in drives], dtype=np.int64)
            begins = [added[id(drive)][1] for drive in drives]
            self.begins = np.concatenate([np.zeros(0, np.int64), *begins])
        self.table_of = np.array([form.table for form in self.forms], dtype=np.int64)[self.form_of]
        self.peak_of = np.array([form.peak for form in self.forms])[self.form_of]
        supplies = {
            supply: number for number, supply in enumerate({form.supply: None for form in self.forms})
        }
        self.supply_of = np.array([supplies[form.supply] for form in self.forms])[self.form_of]

    def _add(self, drive: Drive) -> int:
        """Return the index of the form of a drive, appending a new form if necessary."""
        _times, _begins, pieces, replace, force = drive.kernel_arrays()
        content = pieces.tobytes()
        if content not in self._tables:
            self._tables[content] = len(self.tables)
            self.tables.append(np.array(pieces, dtype=np.float64))
            rates, kinds = closed_form(pieces)
            self.rates.append(rates)
            self.kinds.append(kinds)
        table = self._tables[content]
        if drive.bounded:
            peak = drive.largest_pulse
        else:
            if table not in self._peaks:
                self._peaks[table] = drive.largest_pulse
            peak = self._peaks[table]
        form = Form(table, bool(replace), bool(force), peak, drive.waveform.supply())
        if form not in self._forms:
            self._forms[form] = len(self.forms)
            self.forms.append(form)
        return self._forms[form]


def closed_form(table: FloatArray) -> tuple[list[float], LaneKinds | None]:
    """Return the decay rates and frequencies, 1/s, and the kinds of the segments in a segment table.

    The kinds are None if the waveforms have more rates than the vector lanes support.
    """
    pieces = table[table[:, 1] != END]
    kind = pieces[:, 1]
    # Sets are faster than `np.unique` for the few rows of a table.
    decays = sorted(set(pieces[kind == EXPONENTIAL_PIECE, 4].tolist()))
    frequencies = sorted(set(pieces[kind == SINE_PIECE, 4].tolist()))
    rates = [0.0] * lane_layout.RATES_WIDTH
    if len(decays) > 2 or len(frequencies) > 1:
        return rates, None
    rates[: len(decays)] = decays
    rates[2 : 2 + len(frequencies)] = frequencies
    return rates, (len(decays), bool(pieces[kind == CUBIC_PIECE, 3:].any()), len(frequencies) > 0)
