"""Derivatives of the dots with respect to constants, from the tangent columns at contacts and peaks.

The time of a touch changes by dt = -(dx - dg) / v, with dx the change of the displacement at a fixed time and
dg the change of the surface position; the touch speed changes by dv + a dt. Losses are integrals of power;
the tangent columns contain the derivatives of these integrals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from printhammer.derivatives.flow import Flow, flow, pack_push_changes, pack_push_rate, surface_moves
from printhammer.derivatives.parameters import Parameter
from printhammer.hammer.static_force import law_of
from printhammer.parts.friction import DryFriction
from printhammer.results import Declared, part, scalar
from printhammer.run.contacts import Contact
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem, Record
from printhammer.support.arrays import FloatArray

DOT_QUANTITIES: Final = {
    "flight_time": ("s", "time from firing to touch"),
    "impact_speed": ("m/s", "speed at touch"),
    "peak_force": ("N", "largest pack force"),
    "indentation": ("m", "largest indentation"),
    "contact_time": ("s", "time from touch to departure"),
    "loading_work": ("J", "work done on the pack up to its largest indentation"),
    "net_loss": ("J", "energy absorbed by the pack"),
    "return_time": ("s", "time from firing to the first touch of the backstop after the dot"),
    "return_speed": ("m/s", "speed at the first touch of the backstop after the dot"),
}
"""Unit and meaning of each quantity of a dot, by name."""

RUN_QUANTITIES: Final = {
    "coil_work": ("J", "work of the coil"),
    "drive_work": ("J", "work of a force drive"),
    "pack_loss": ("J", "energy absorbed by the pack"),
    "backstop_loss": ("J", "energy absorbed by the backstop"),
    "damping_loss": ("J", "energy dissipated by the armature's damping"),
}
"""Unit and meaning of the energies of a whole run, by name; the last energy only with damping."""

_ENERGY: Final = 3  # First row of the energies in a tangent column
_PACK_LOSS: Final = 5  # Row of the pack loss in a tangent column
_SAMPLES: Final = 65  # Samples of a contact for the bracket of its largest force; arbitrary
# Relative difference below which two times are the same maximum; the accuracy of the minimisation; arbitrary
_NEAR: Final = 1e-6


class Struck(Declared):
    """Printed dot: row indices of its contacts, and times of largest indentation and largest force."""

    index: int = part("number of the firing")
    touch: int = part("row of the contact with the pack")
    back: int | None = part("row of the first touch of the backstop after the dot")
    t_peak: float = scalar("s", "time of the largest indentation")
    t_force: float = scalar("s", "time of the largest force")


def struck_dots(motion: Motion, problem: Problem, record: Record) -> list[Struck]:
    """Locate contacts, largest indentation and largest force of every printed dot."""
    struck: list[Struck] = []
    contacts = motion.contacts
    for row in _touches(contacts):
        contact = contacts[row]
        t_peak = t_force = contact.t_in
        if contact.peak_force is not None:
            t_peak = _peak_time(problem, record, contact)
            t_force = _force_time(problem, record, contact, t_peak)
        struck.append(Struck(contact.firing or 0, row, _back(contacts, row), t_peak, t_force))
    return struck


def dot_values(motion: Motion) -> FloatArray:
    """Return the values of `DOT_QUANTITIES` for each firing, in SI, shape (dots, quantities).

    A value that a dot lacks is NaN.
    """
    values = np.full((len(motion.dots), len(DOT_QUANTITIES)), np.nan)
    names = list(DOT_QUANTITIES)
    for dot in motion.dots:
        for place, name in enumerate(names):
            value = getattr(dot, name, None)
            values[dot.index, place] = math.nan if value is None else value
    for row in _touches(motion.contacts):
        back, firing = _back(motion.contacts, row), motion.contacts[row].firing or 0
        if back is not None:
            contact = motion.contacts[back]
            values[firing, names.index("return_time")] = contact.t_in - motion.dots[firing].fired_at
            values[firing, names.index("return_speed")] = -contact.v_in
    return values


def _touches(contacts: Sequence[Contact]) -> list[int]:
    """Return the indices in `contacts` of the contacts that print the dots, in the order of the firings."""
    return [
        row
        for row, contact in enumerate(contacts)
        if contact.surface == "pack" and contact.firing is not None and not (contact.initial or contact.extra)
    ]


def _back(contacts: Sequence[Contact], row: int) -> int | None:
    """Return the row of the first contact after a dot and its extra contacts; None unless on the backstop.

    `row` is the row of the contact that prints the dot.
    """
    following = next((k for k in range(row + 1, len(contacts)) if not contacts[k].extra), None)
    return following if following is not None and contacts[following].surface == "backstop" else None


def _end(record: Record, contact: Contact) -> float:
    return float(record.nodes[-1, 0]) if contact.t_out is None else contact.t_out


def _peak_time(problem: Problem, record: Record, contact: Contact) -> float:
    """Refine the time [s] of largest indentation in a pack contact by Newton's method on the velocity."""
    t = contact.t_peak
    for _ in range(3):
        row = problem.resample(record, np.array([t]))[0]
        a = _acceleration(problem, row)
        if a == 0.0 or row[1] == 0.0:
            break
        t = min(max(t - row[1] / a, contact.t_in), _end(record, contact))
    return t


def _force_time(problem: Problem, record: Record, contact: Contact, t_peak: float) -> float:
    """Return the time [s] of the largest pack force in a contact; the time of touch if it is largest there.

    `t_peak` is the time of the largest indentation, s.
    """
    from scipy.optimize import minimize_scalar

    t_in, t_out = contact.t_in, _end(record, contact)
    nodes = record.nodes[:, 0]
    times = np.unique(
        np.concatenate([np.linspace(t_in, t_out, _SAMPLES), nodes[(nodes >= t_in) & (nodes < t_out)]])
    )
    times = times[times < t_out]
    best = int(np.argmin(problem.resample(record, times)[:, 5]))
    if best == 0:
        return t_in
    low, high = float(times[best - 1]), float(times[min(best + 1, len(times) - 1)])
    scale = t_out - t_in
    best_force = minimize_scalar(
        lambda s: float(problem.resample(record, np.array([t_in + s * scale]))[0, 5]),
        bounds=((low - t_in) / scale, (high - t_in) / scale),
        method="bounded",
        options={"xatol": 1e-10},
    )
    t = t_in + float(best_force.x) * scale
    # Without damping the force peaks at the largest indentation, whose time is known more precisely.
    return (
        t_peak
        if abs(t - t_peak) < _NEAR * scale
        else _stationary_time(problem, record, t, 1e-3 * (high - low))
    )


def _stationary_time(problem: Problem, record: Record, t: float, step: float) -> float:
    """Find the time near `t` [s] at which the pack force is stationary, by the secant method.

    The second initial guess lies `step` [s] earlier; the iteration stops at a correction of `step` or more.

    A comparison of forces would locate the time to only half of the digits.
    """
    before, rate_before = t - step, pack_push_rate(problem, record, t - step)
    for _ in range(6):
        rate = pack_push_rate(problem, record, t)
        change = -rate * (t - before) / (rate - rate_before) if rate != rate_before else 0.0
        if not abs(change) < step:
            break
        before, rate_before, t = t, rate, t + change
    return t


def _acceleration(problem: Problem, row: FloatArray, *without: int) -> float:
    """Compute the acceleration [m/s^2] from a row of `Problem.resample`, without some of the forces.

    `without` are the columns of the forces to omit.
    """
    forces = {k: float(row[k]) for k in range(3, 9) if k not in without}
    drive = float(row[2]) if problem.drive.quantity == "force" else 0.0
    return (math.fsum(forces.values()) + drive) / problem.hammer.mass


class Changes(Declared):
    """Derivatives of the dot quantities and of the run's energies with respect to the scaled constants."""

    dots: FloatArray = part(
        "derivatives of `DOT_QUANTITIES`, shape (dots, quantities, n)",
        more="NaN for a lost dot or an unknown derivative",
    )
    run: FloatArray = part("derivatives of `RUN_QUANTITIES`, shape (5, n)")
    smooth: bool = part("whether the motion is differentiable throughout")


def changes_of(
    motion: Motion, problem: Problem, record: Record, wanted: Sequence[Parameter], initial: FloatArray
) -> Changes:
    """Compute the derivatives of dots and energies of a run with respect to the constants in `wanted`.

    `initial` contains the derivatives of the initial state.
    """
    struck = struck_dots(motion, problem, record)
    times = record.nodes[:, 0]
    end = float(times[-1])
    marks = np.unique([0.0, end, *(dot.t_peak for dot in struck), *(dot.t_force for dot in struck)])
    nodes: set[int] = set()
    for dot in struck:
        touch, contact = int(record.contacts[dot.touch, 5]), motion.contacts[dot.touch]
        nodes.add(touch)
        if contact.peak_force is None:
            nodes.add(touch + 1)
        elif contact.t_out is not None:
            nodes.add(int(np.searchsorted(times, contact.t_out, side="left")))
        if dot.back is not None:
            nodes.add(int(record.contacts[dot.back, 5]))
    chosen = sorted(nodes)
    carried = flow(problem, record, wanted, marks, initial, chosen)
    look = _Look(problem, record, wanted, carried, marks, {node: row for row, node in enumerate(chosen)})
    result = np.full((len(motion.dots), len(DOT_QUANTITIES), len(wanted)), np.nan)
    for dot in struck:
        changes = look.dot(dot, motion.contacts)
        for place, name in enumerate(DOT_QUANTITIES):
            if name in changes:
                result[dot.index, place] = changes[name]
    return Changes(result, carried.changes[-1, _ENERGY : _ENERGY + len(RUN_QUANTITIES)], carried.smooth)


@dataclass(frozen=True)
class _Look:
    """Data from which the derivatives of dots are computed: problem, record, tangent flow and constants."""

    problem: Problem
    record: Record
    wanted: Sequence[Parameter]
    flow: Flow
    marks: FloatArray
    rows: dict[int, int]

    def columns(self, t: float) -> tuple[FloatArray, FloatArray]:
        """Return the state at one of the `marks` [s], and its derivatives with respect to the constants."""
        row = int(np.searchsorted(self.marks, t))
        return self.flow.states[row], self.flow.changes[row]

    def later(self, columns: FloatArray, surface: str, v: float) -> FloatArray:
        """Return the derivatives of the time [s] at which the armature passes a surface at speed `v` [m/s].

        `columns` are the derivatives of the state at a fixed time, just before the passage.
        """
        return np.asarray(-(columns[0] - surface_moves(self.wanted)[surface]) / v)

    def dot(self, dot: Struck, contacts: Sequence[Contact]) -> dict[str, FloatArray]:
        """Compute the derivatives, shape (n,), of each quantity of a dot with respect to n constants."""
        contact = contacts[dot.touch]
        fired = np.array([parameter.firings[dot.index] for parameter in self.wanted])
        touch = self.flow.passed[self.rows[int(self.record.contacts[dot.touch, 5])], 0]
        later = self.later(touch, "pack", contact.v_in)
        changes: dict[str, Any] = {
            "flight_time": later - fired,
            "impact_speed": touch[1] + self._approach(contact, 5) * later,
        }
        if contact.peak_force is None:
            # At a rigid front the dot has no depth and no force; the impact lies between two nodes.
            after = self.flow.passed[self.rows[int(self.record.contacts[dot.touch, 5]) + 1], 1]
            changes["net_loss"] = changes["loading_work"] = after[_PACK_LOSS] - touch[_PACK_LOSS]
        else:
            changes |= self._in_pack(dot, contact, changes["impact_speed"], later, touch)
        if dot.back is not None:
            back = contacts[dot.back]
            touch = self.flow.passed[self.rows[int(self.record.contacts[dot.back, 5])], 0]
            later = self.later(touch, "backstop", back.v_in)
            changes["return_time"] = later - fired
            changes["return_speed"] = -(touch[1] + self._approach(back, 6, 7) * later)
        return changes

    def _approach(self, contact: Contact, *without: int) -> float:
        """Compute the acceleration [m/s^2] at a touch, without the forces in the columns `without`.

        If the surface is rigid, the acceleration is that just before the impact.
        """
        row = self.problem.resample(self.record, np.array([contact.t_in]))[0]
        if contact.peak_force is None:
            hammer = self.problem.hammer
            damping, constants = law_of(hammer, hammer.damping, "damping_force")
            viscous, rows = law_of(hammer, hammer.spring, "spring_viscous")
            row[8] = damping(constants, contact.v_in) + viscous(rows, row[0], contact.v_in)
            if isinstance(hammer.damping, DryFriction):
                row[8] -= math.copysign(hammer.damping.kinetic, contact.v_in)
        return _acceleration(self.problem, row, *without)

    def _in_pack(
        self, dot: Struck, contact: Contact, speed: FloatArray, later: FloatArray, touch: FloatArray
    ) -> dict[str, FloatArray]:
        """Compute the derivatives of depth, force, work, loss and contact time of a dot on a pack.

        `speed` and `later` are the derivatives of touch speed [m/s] and touch time [s]; `touch` holds the
        tangent columns just before the touch.
        """
        changes: dict[str, FloatArray] = {}
        state, at_peak = self.columns(dot.t_peak)
        changes["indentation"] = at_peak[0] - surface_moves(self.wanted)["pack"]
        changes["loading_work"] = at_peak[_PACK_LOSS] - touch[_PACK_LOSS]
        state, at_force = self.columns(dot.t_force)
        total = at_force[:3].copy()
        if dot.t_force == contact.t_in:
            # The largest force occurs at the touch.
            total[0] = surface_moves(self.wanted)["pack"]
            total[1] = speed
        changes["peak_force"] = pack_push_changes(self.problem, self.wanted, state, total)
        if contact.t_out is None:
            gone = self.columns(float(self.record.nodes[-1, 0]))[1]
        else:
            node = int(np.searchsorted(self.record.nodes[:, 0], contact.t_out, side="left"))
            leave, gone = self.flow.passed[self.rows[node]]
            changes["contact_time"] = self.later(leave, "pack", contact.v_out or math.nan) - later
        changes["net_loss"] = gone[_PACK_LOSS] - touch[_PACK_LOSS]
        return changes
