"""Initial-value problem for the kernel: a hammer's laws, packed constants and scales, and its drive.

This module is the only one that converts public objects to arguments of the kernel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from copy import copy
from functools import cached_property
from typing import Any, Final, Literal, TypeVar

import numpy as np

from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.kernel.compile.specialise import Kernel
from printhammer.kernel.model import layout
from printhammer.kernel.model.laws import Laws
from printhammer.kernel.model.layout import CIRCUIT_NODE_WIDTH, NODE_WIDTH
from printhammer.kernel.model.modes import OK, PAUSED, STATUS_NAMES, STEP_LIMIT
from printhammer.kernel.single import carry
from printhammer.results import Declared, part, scalar
from printhammer.run.plain.posing import FAR, allowances, typical_scales
from printhammer.run.start import AT_REST, Beyond
from printhammer.run.supply import take_supply, typical_current
from printhammer.support.arrays import FloatArray

T = TypeVar("T")

TOLERANCE: Final = 2e-11
"""Default tolerance: error of one step, in units of the stroke and of a typical speed; arbitrary."""

LEAST_TOLERANCE: Final = 1e-15  # Smallest accepted tolerance, near the rounding error of doubles
LARGEST_TOLERANCE: Final = 1e-5  # Arbitrary
"""Largest accepted tolerance; at larger tolerances, long steps would make the dense output inaccurate."""

MAX_STEPS: Final = 50_000_000  # Default largest number of steps of a run; arbitrary
_NODES: Final = 2048  # Rows of nodes in the smallest working space; arbitrary
_CONTACTS: Final = 256  # Rows of contacts in the smallest working space; arbitrary
_NODES_A_FLIGHT: Final = 40  # Nodes per flight in the initial guess of the array size; arbitrary
_MOST_FLIGHTS: Final = 1e6  # Largest number of flights of that guess; arbitrary


def live_size(firings: int) -> int:
    """Return the length of the kernel's working array of active pulses, from the number of firings."""
    return 3 + 7 * firings


def node_width(laws: Laws) -> int:
    """Return the number of columns of the node array: more for a hammer with a coil circuit."""
    return CIRCUIT_NODE_WIDTH if laws.circuit else NODE_WIDTH


class Record(Declared):
    """Record of one run by the kernel; see `printhammer.kernel.single.record`."""

    status: int = part("code of the status")
    nodes: FloatArray = part(
        "time, displacement, velocity, mode and memory at the ends of all steps, shape (n, 5)",
        more="with a coil circuit also the electric state and the path of the current, shape (n, 9)",
    )
    contacts: FloatArray = part(
        "surface, time and velocity in and out, first node, whether open at the start, shape (m, 7)"
    )
    steps: int = part("number of steps")

    @property
    def status_name(self) -> str:
        """Name of the status, such as "ok" or "step limit"."""
        return STATUS_NAMES[self.status]


class Stretch(Declared):
    """Consecutive nodes and contacts of a run, up to a pause or the end of the run.

    The next stretch of the run overwrites the arrays.
    """

    status: int = part("code of the status; PAUSED for every stretch except the last")
    nodes: FloatArray = part(
        "as in `Record`", more="the first node repeats the last node of the preceding stretch"
    )
    contacts: FloatArray = part(
        "as in `Record`", more="a contact that is open at a pause is the first contact of the next stretch"
    )
    reached: float = scalar("s", "time that the run has reached")


class _TooLong(Exception):
    """Raised when a stretch of the record does not fit into the allocated arrays."""


def fresh_carry(
    start: float, state: tuple[float, float], pause_after: float = math.inf, beyond: Beyond = AT_REST
) -> FloatArray:
    """Build the initial carry array of the kernel's `run`, which pauses after `pause_after` nodes.

    `state` and `beyond` are the components of the initial state at the time `start` [s].
    """
    array = np.zeros(carry.SIZE)
    array[carry.TIME] = start
    array[carry.POSITION_NOW], array[carry.VELOCITY] = state
    array[carry.PAUSE_AFTER] = pause_after
    if beyond.branch >= 0.0:
        array[carry.STATE] = carry.ON_BRANCH
        array[carry.MODE], array[carry.PEAK] = beyond.branch, beyond.memory
    array[carry.WITH_CURRENT] = 1.0
    array[carry.ELECTRIC : carry.ELECTRIC + 3] = beyond.current, beyond.turn, beyond.reservoir
    return array


def check_tolerance(tolerance: object) -> None:
    """Check that the integrator supports a tolerance."""
    if not (isinstance(tolerance, float | int) and LEAST_TOLERANCE <= tolerance <= LARGEST_TOLERANCE):
        raise InputError.of(
            "tolerance", tolerance, f"a number from {LEAST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}"
        )


def laws_of(hammer: Hammer, drive: Drive | str) -> Laws:
    """Return the laws of a hammer's parts and of its drive, which select the compiled kernel.

    `drive` is the drive, or the quantity that it controls: "current", "force" or "voltage".
    """
    quantity = drive if isinstance(drive, str) else drive.quantity
    return Laws(
        magnet=_module(hammer.magnet),
        spring=_module(hammer.spring),
        pack=_module(hammer.pack),
        backstop=_module(hammer.backstop),
        absent="printhammer.parts.absent",
        damping=_module(hammer.damping),
        force_drive=quantity == "force",
        circuit=quantity == "voltage",
        pack_pulls=bool(getattr(hammer.pack, "pull", True)),
        backstop_pulls=bool(getattr(hammer.backstop, "pull", True)),
        reload_along_unloading=getattr(hammer.pack, "reloading", "") == "unloading-curve",
    )


def _module(part: Any) -> str:
    return "" if part is None else str(part.module)


def constants_of(hammer: Hammer) -> FloatArray:
    """Return the constants of a hammer in the order of `printhammer.kernel.model.layout`."""
    packed = {role: part.packed(hammer.origin) for role, part in hammer.parts.items()}
    array = np.zeros(layout.MAGNET + max(len(packed.get("magnet", ())), 1))
    array[layout.INVERSE_MASS] = 1.0 / hammer.mass
    array[layout.POSITION] = hammer.origin
    array[layout.FRONT] = hammer.front if hammer.front is not None else math.inf
    for role, constants in packed.items():
        room = layout.ROOM.get(role, len(constants))
        if len(constants) > room:
            raise InputError(
                f"{hammer.path}: {role} has {len(constants)} packed constants",
                file=hammer.path,
                key=role,
                expected=f"at most {room}",
            )
        array[layout.PLACES[role] : layout.PLACES[role] + len(constants)] = constants
    return array


def scales_of(
    hammer: Hammer, drive: Drive, state: tuple[float, float], static: StaticForce | None = None
) -> tuple[float, float]:
    """Return a typical displacement [m] and speed [m/s] of a hammer, the units of tolerances.

    The displacement is the distance from backstop to pack. If backstop or pack is missing, the displacement
    is the largest of three: the distance that the forces would move the mass in 1 / (2 pi) of a period of the
    drive or of the hammer, the distance of the initial state from the origin, and the distance covered in
    that time at the initial velocity; the first and the third end at the nearest kink of the spring law. The
    typical speed is that imparted to the mass by the largest force over that displacement. `static` is the
    static force of the hammer, computed if not passed.
    """
    if static is None:
        static = StaticForce(hammer)
    largest = drive.largest_pulse
    current, push = (0.0, largest) if drive.quantity == "force" else (largest, 0.0)
    if drive.quantity == "voltage":
        current = typical_current(hammer, drive)
    return typical_scales(hammer.mass, current, push, drive.period or math.nan, state, static.statics)


def control_of(scales: tuple[float, float], tolerance: float) -> tuple[float, float, float, float]:
    """Return the kernel's step-size control: `scales` (m, m/s), and tolerances of the two error estimates."""
    return (*scales, *allowances(tolerance))


def bounds_of(hammer: Hammer, scales: tuple[float, float]) -> tuple[float, float, float, float]:
    """Return (lowest, highest, origin, farthest) for the kernel's checks of the displacement, all in m.

    The laws of magnet and spring are valid from `lowest` to `highest`. Beyond `farthest` from the origin, the
    position of the backstop or 0, the run ends as a runaway. `scales` are from `scales_of`.
    """
    low, high = hammer.domain
    return (low, high, hammer.origin, FAR * scales[0])


class Problem:
    """Hammer under a drive, ready for integration.

    `state` is displacement [m] and velocity [m/s] at the time `start` [s]. The tolerance is the error of
    one step, in units of the stroke and of a typical speed. In the pack, and under a voltage drive, the state
    has further components, `beyond`.
    """

    max_steps: int | None = None
    """Largest number of steps of the run; None for `MAX_STEPS`."""

    def __init__(
        self,
        hammer: Hammer,
        drive: Drive,
        state: tuple[float, float],
        start: float,
        tolerance: float,
        beyond: Beyond = AT_REST,
    ) -> None:
        self.hammer = hammer
        self.drive = drive
        self.state = state
        self.beyond = beyond
        self.start = start
        self.tolerance = tolerance
        self.laws = laws_of(hammer, drive)
        self.constants = constants_of(hammer)
        if self.laws.circuit:
            take_supply(self.constants, hammer, drive)
        firings, begins, pieces, self.replace, _force = drive.kernel_arrays()
        # A copy, since the kernel is compiled for writable arrays.
        self.firings = np.array(firings, dtype=np.float64)
        self.begins = np.array(begins, dtype=np.int64)
        self.pieces = np.array(pieces, dtype=np.float64)
        self._static = StaticForce(hammer)
        self._set_scales()

    def _set_scales(self) -> None:
        """Set the typical displacement and speed, the step-size control and the displacement bounds."""
        self.scales = scales_of(self.hammer, self.drive, self.state, self._static)
        self.control = control_of(self.scales, self.tolerance)
        self.bounds = bounds_of(self.hammer, self.scales)

    def started(self, state: tuple[float, float], start: float) -> Problem:
        """Return a problem of the same hammer and drive that starts at another state and time.

        `state` is the displacement [m], which must be outside the pack, and the velocity [m/s] at the time
        `start` [s]; the coil current is zero at this time.
        """
        made = copy(self)
        made.state, made.start, made.beyond = state, start, AT_REST
        # A copy, since `leave_out` changes the constants.
        made.constants = self.constants.copy()
        made._set_scales()
        return made

    @cached_property
    def kernel(self) -> Kernel:
        """Compiled kernel for the laws of this hammer."""
        from printhammer.kernel.compile.specialise import specialise

        return specialise(self.laws)

    def leave_out(self, surface: Literal["pack", "backstop"]) -> None:
        """Move a surface out of reach of the armature, leaving all other forces unchanged."""
        away = FAR * self.scales[0]
        if surface == "pack":
            self.constants[layout.FRONT] += away
        else:
            self.constants[layout.POSITION] -= away

    def drive_arrays(self) -> tuple[Any, ...]:
        """Return the drive as the kernel's tuple `Train`, including working arrays."""
        count = self.firings.size
        under_way, live = np.zeros(count, np.int64), np.zeros(live_size(count))
        return (self.firings, self.begins, self.pieces, self.replace, under_way, live)

    @property
    def columns(self) -> int:
        """Number of columns of the table that `resample` returns."""
        return 15 if self.laws.circuit else 10

    @property
    def state_size(self) -> int:
        """Number of state components: displacement, velocity, memory, and the electric state of a circuit."""
        return 6 if self.laws.circuit else 3

    @property
    def linkage_scale(self) -> float:
        """Flux linkage of the coil at a typical current, Wb: unit of the threshold for "no current"."""
        return float(self.constants[layout.LINKAGE_SCALE])

    def room(self, count: int) -> FloatArray:
        """Allocate an array for `count` nodes of the record."""
        return np.empty((count, node_width(self.laws)))

    def run(self, end: float) -> Record:
        """Integrate from the initial state to time `end` [s]; return the record of the run."""
        # A generous size: unused memory costs nothing, but a repeated run does.
        flights = min(max(end - self.start, 0.0) * self.scales[1] / self.scales[0], _MOST_FLIGHTS)
        capacity = _NODES + int(_NODES_A_FLIGHT * flights)
        contact_capacity = _CONTACTS + int(flights)
        while True:
            nodes, contacts = self.room(capacity), np.empty((contact_capacity, 7))
            carried = fresh_carry(self.start, self.state, beyond=self.beyond)
            status, used, touched, steps = self._advance(
                end, self.max_steps or MAX_STEPS, self.drive_arrays(), nodes, contacts, carried
            )
            if used <= capacity and touched <= contact_capacity:
                return Record(status, nodes[:used].copy(), contacts[:touched].copy(), steps)
            capacity = max(capacity, used)
            contact_capacity = max(contact_capacity, touched)

    def _advance(
        self,
        end: float,
        max_steps: int,
        drive: tuple[Any, ...],
        nodes: FloatArray,
        contacts: FloatArray,
        state: FloatArray,
    ) -> tuple[int, int, int, int]:
        """Integrate to time `end` [s] or to a pause, from the kernel's carry array `state`.

        The arrays `nodes`, `contacts` and `state` are overwritten. Return the status, the numbers of nodes
        and contacts of the record, and the number of steps.
        """
        status, used, touched, steps = self.kernel.run(
            (drive, self.constants, self.control, self.bounds, max_steps),
            float(end),
            nodes,
            contacts,
            state,
        )
        return status, used, touched, steps

    def in_stretches(self, end: float, capacity: int, take: Callable[[Iterator[Stretch]], T]) -> T:
        """Integrate to time `end` [s] and process the record in stretches, so that memory does not grow.

        `take` receives an iterator of stretches of at most `capacity` nodes, and need not exhaust it; if a
        contact alone has more nodes, `take` is called again with longer stretches. The result of `take` is
        returned.
        """
        while True:
            try:
                return take(self._stretches(end, capacity))
            except _TooLong:
                capacity *= 4

    def _stretches(self, end: float, capacity: int) -> Iterator[Stretch]:
        drive, nodes, contacts = self.drive_arrays(), self.room(capacity), np.empty((capacity, 7))
        state = fresh_carry(self.start, self.state, max(capacity // 2, 2), self.beyond)
        status = PAUSED
        while status == PAUSED:
            status, used, touched, _steps = self._advance(end, MAX_STEPS, drive, nodes, contacts, state)
            # A contact begins with a node: if the nodes fit, the contacts fit.
            if used > capacity:
                raise _TooLong
            yield Stretch(status, nodes[:used], contacts[:touched], float(state[carry.TIME]))
            if touched:
                # A contact open at a pause is the first contact of the next stretch.
                contacts[0] = contacts[touched - 1]

    def resample(self, record: Record, times: FloatArray) -> FloatArray:
        """Evaluate states and forces at ascending times [s] with the kernel; shape (times, `columns`)."""
        out = np.empty((times.size, self.columns))
        self.kernel.resample(times, record.nodes, self.drive_arrays(), self.constants, out)
        return out

    def peaks(self, record: Record) -> FloatArray:
        """Return time [s], depth [m] and force [N] at the peak of each contact, shape (m, 3)."""
        out = np.empty((len(record.contacts), 3))
        self.kernel.peaks(record.contacts, record.nodes, self.drive_arrays(), self.constants, out)
        return out

    def quadratures(self, record: Record, steps: Any, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Integrate powers over intervals; return the energies [J], shape (n, 5).

        Each interval, from `starts` to `ends` [s], lies in the integration step with the index in `steps`.
        For the columns, and four more under a voltage drive, see `printhammer.run.energy.increments_of`.
        """
        out = np.empty((len(steps), 9 if self.laws.circuit else 5))
        self.kernel.quadratures(
            np.ascontiguousarray(steps, np.int64),
            np.ascontiguousarray(starts, np.float64),
            np.ascontiguousarray(ends, np.float64),
            record.nodes,
            self.drive_arrays(),
            self.constants,
            out,
        )
        return out


def message_of(record: Record, hammer: Hammer) -> str:
    """Describe the early end of a run in one sentence; empty if the run reached its end."""
    if record.status == OK:
        return ""
    time, x = record.nodes[-1, 0], record.nodes[-1, 1]
    what = {
        "range left": "left the range in which its force law holds",
        "runaway": "ran away",
        "step limit": f"needed more than {record.steps - 1} steps",
        "step underflow": "needed steps shorter than the arithmetic resolves",
    }[STATUS_NAMES[record.status]]
    advice = "; a longer run can be split" if record.status == STEP_LIMIT else ""
    return f"{hammer.name} {what} at t = {time:.9g} s, x = {x:.9g} m{advice}"
