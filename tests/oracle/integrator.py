"""Slow, independent oracle for one run: Taylor series mode by mode; every switch is a polynomial root.

No code is shared with the compiled kernel; no law function of a part is called. Between switches the motion
is analytic and is expanded to degree 30 (module `series`); the step ends where the last coefficients
reach the tolerance, at a pulse edge, or at the first root of a switching function, which is isolated with a
guarantee and polished to rounding. Only a first touch of a contact with a fractional power is not analytic:
there one step is taken without the contact, so short that its impulse is below the tolerance. Distances are
kept from the surface last touched, so that nothing cancels near it.

Each pack contact meets fresh paper: loading branch for v >= 0; at v = 0 from above rmax is set and the
unloading branch followed; at v = 0 from below the wire goes in again on the loading branch if the other
forces exceed it there, and otherwise that point is at once a new local maximum (`reloading =
"loading-branch"`), or it goes in along the unloading curve up to rmax (`"unloading-curve"`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from tests.oracle.drive import ReferenceDrive
from tests.oracle.laws import NO_CONTACT, Contact, ReferenceHammer
from tests.oracle.series import (
    ORDER,
    Array,
    Event,
    ReferenceRun,
    Step,
    first_fall,
    horner,
    motion_series,
    offset,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["Event", "ReferenceRun", "horizon", "reference"]

STICK_HEIGHT = 1e-16
"""Height, m, below which the bounces on a rigid backstop are taken as ended."""

STEP_LIMIT = 1_000_000


class _Run:
    """State of a run: mode, displacement ``ref`` + ``y``, velocity, and ``peak``, the indentation rmax d."""

    def __init__(self, hammer: Any, drive: Any, state: tuple[float, float] | None, tolerance: float) -> None:
        self.parts = ReferenceHammer(hammer)
        self.drive = ReferenceDrive(drive)
        self.series = motion_series()
        self.tolerance = tolerance
        self.t = 0.0
        self.ref, self.y, self.v = 0.0, 0.0, 0.0
        self.mode = "free"
        self.peak = math.nan
        self.zero = ""
        self.cell: tuple[int, int] | None = None
        self.length_scale, self.speed_scale = 0.0, 0.0
        self.events: list[Event] = []
        self.steps: list[Step] = []
        self.status = ""
        self.guess = 1e-5
        self._start(*((self.parts.rest(), 0.0) if state is None else state))

    def _start(self, x: float, v: float) -> None:
        parts = self.parts
        self.ref, self.y, self.v = 0.0, x, v
        if not parts.low < x < parts.high:
            self.status = "range left"
        elif x < parts.position:
            if parts.rigid:
                raise ValueError("the state lies inside a rigid backstop")
            self._enter("stop", parts.position, x - parts.position)
        elif x > parts.front:
            self._enter("load", parts.front, x - parts.front)
            if v < 0.0:
                self._unload()
        elif x == parts.position:
            self.ref, self.y = x, 0.0
            if v < 0.0 or (v == 0.0 and self._net() <= 0.0):
                self._touch_stop()
        elif x == parts.front:
            self.ref, self.y = x, 0.0
            if v > 0.0 or (v == 0.0 and self._net() > 0.0):
                self._enter("load", x, 0.0)

    def _enter(self, mode: str, ref: float, y: float) -> None:
        self.mode, self.ref, self.y = mode, ref, y
        if mode == "load" and self.parts.pack.law == "dashpot":
            self.mode = "dash"
            if y > 0.0 and (cut := self.parts.pack_cut()) and cut[0] * y + cut[1] * self.v < 0.0:
                self.mode = "dash-cut"
        if (
            mode == "stop"
            and y < 0.0
            and (bound := self.parts.stop_cut())
            and bound[0] + bound[1] * y + bound[2] * self.v < 0.0
        ):
            self.mode = "stop-cut"

    def _unload(self) -> None:
        if self.mode == "load":
            self.mode, self.peak = "curve", self.y

    def _contact(self) -> Contact:
        if self.mode in ("load", "dash"):
            return self.parts.loading()
        if self.mode in ("curve", "recurve"):
            return self.parts.unloading(self.peak)
        if self.mode == "stop":
            return self.parts.stop()
        return NO_CONTACT

    def _net(self) -> float:
        """Force without contacts now, N."""
        drive = self.drive.series(self.t, 1.0)
        held = self.parts.held_force(self.ref + self.y, drive, self.drive.is_current)
        return float(held[0]) - self.parts.damping * self.v

    def _expand(self, contact: Contact, h: float) -> tuple[Array, Array]:
        y, v = np.zeros(ORDER + 1), np.zeros(ORDER + 1)
        y[0], v[0] = self.y, self.v
        p = self.parts
        drive = self.drive.series(self.t, h)
        magnet = p.magnet if p.table is None else p.table.packed(self._cell())
        law = (p.mass, p.magnet_kind, magnet, p.spring, p.damping, contact.packed())
        self.series(h, self.ref, drive, self.drive.is_current, *law, y, v)
        return y, v

    def _cell(self) -> tuple[int, int]:
        """Cell of the force table that contains the motion, or that it enters from an edge."""
        table = self.parts.table
        if table is None:
            return 0, 0
        if self.cell is None:
            current = float(self.drive.series(self.t, 1.0)[0]) if self.drive.is_current else 0.0
            self.cell = table.index(self.ref + self.y, current)
        return self.cell

    def _reach(self, c: Array, scale: float) -> float:
        """Step, in units of the expansion's time, at which the last coefficients reach the tolerance."""
        reach = math.inf
        for k in range(ORDER - 2, ORDER + 1):
            last = abs(float(c[k]))
            # Coefficients that underflow set no limit.
            if last > 1e-290:
                reach = min(reach, (self.tolerance * scale / last) ** (1.0 / k))
        return reach

    def _step_series(self, contact: Contact, limit: float) -> tuple[float, float, Array, Array]:
        """Expand with a suitable unit of time h; return h, the step in units of h, and both series."""
        h = min(self.guess, limit)
        for _ in range(50):
            y, v = self._expand(contact, h)
            if not (np.isfinite(y).all() and np.isfinite(v).all()):
                h *= 1e-3
                continue
            length = max(self.length_scale, abs(_first(y[1:])))
            speed = max(self.speed_scale, abs(_first(v)))
            reach = min(self._reach(y, length), self._reach(v, speed))
            if reach > 1e-5 or h * reach >= limit:
                break
            h *= reach
        theta = min(reach, limit / h)
        if theta > 1e5:
            return h * theta, 1.0, *self._expand(contact, h * theta)
        return h, theta, y, v

    def _cell_guards(self, y: Array, h: float) -> list[tuple[str, Array]]:
        table = self.parts.table
        if table is None:
            return []
        current = self.drive.series(self.t, h) if self.drive.is_current else np.zeros(ORDER + 1)
        return table.guards(self._cell(), offset(y, self.ref), current)

    def _guards(self, y: Array, v: Array, h: float) -> list[tuple[str, Array]]:
        """Switching functions of the present mode, positive while it lasts, with the event that ends it."""
        parts, mode = self.parts, self.mode
        guards = self._cell_guards(y, h)
        if mode == "free":
            if parts.pack is not None:
                guards.append(("pack-touch", offset(-y, parts.front - self.ref)))
            if parts.backstop is not None:
                guards.append(("backstop-touch", offset(y, self.ref - parts.position)))
        elif mode in ("load", "recurve"):
            guards.append(("pack-peak", v))
            if mode == "recurve":
                guards.append(("rejoin", offset(-y, self.peak)))
        elif mode == "curve":
            guards += [("pack-leave", y), ("pack-trough", -v)]
        elif mode in ("dash", "dash-cut"):
            guards.append(("pack-leave", y))
            if cut := parts.pack_cut():
                push = cut[0] * y + cut[1] * v
                guards.append(("cut", push) if mode == "dash" else ("uncut", -push))
        elif mode in ("stop", "stop-cut"):
            guards.append(("backstop-leave", -y))
            if bound := parts.stop_cut():
                push = offset(bound[1] * y + bound[2] * v, bound[0])
                guards.append(("cut", push) if mode == "stop" else ("uncut", -push))
        if math.isfinite(parts.low):
            guards.append(("range-left", offset(y, self.ref - parts.low)))
        if math.isfinite(parts.high):
            guards.append(("range-left", offset(-y, parts.high - self.ref)))
        return guards

    def _first(self, guards: list[tuple[str, Array]], theta: float) -> tuple[str, float]:
        """Return the earliest event and its position, or no event and ``theta``."""
        kind, s = "", theta
        for name, guard in guards:
            if name == self.zero:
                guard[0] = 0.0
            root = first_fall(guard, s)
            if root is not None and (root < s or kind == ""):
                kind, s = name, root
        self.zero = ""
        return kind, s

    def advance(self, t_end: float) -> None:
        """Take one step, to the next switch at most."""
        limit = min(t_end, self.drive.next_edge(self.t)) - self.t
        if self.mode in ("stuck", "rest"):
            self._hold(limit, t_end)
            return
        contact = self._contact()
        if contact.singular and self.y == 0.0:
            limit = min(limit, self._blind_step(contact, limit))
            contact = NO_CONTACT
        h, theta, y, v = self._step_series(contact, limit)
        kind, s = self._first(self._guards(y, v, h), theta)
        self._record(h, s, y, v)
        at_limit = kind == "" and h * theta >= limit
        self.t = self._clock(t_end, limit) if at_limit else self.t + h * s
        self.y, self.v = float(horner(y, float(s))), float(horner(v, float(s)))
        self.guess = max(h * s, 1e-3 * h * theta)
        self.length_scale = max(self.length_scale, abs(self.y - y[0]))
        self.speed_scale = max(self.speed_scale, abs(self.v))
        if not (math.isfinite(self.y) and math.isfinite(self.v)):
            self.status = "runaway"
        elif kind:
            self._switch(kind)

    def _clock(self, t_end: float, limit: float) -> float:
        """Time after a step of ``limit``: the edge itself, without rounding, if the edge ended the step."""
        edge = min(t_end, self.drive.next_edge(self.t))
        # A sharp edge of the current may end in another cell of a force table.
        self.cell = None
        return edge if limit == edge - self.t else self.t + limit

    def _record(self, h: float, s: float, y: Array, v: Array) -> None:
        self.steps.append(Step(self.t, h * s, h, self.ref, y, v))

    def _blind_step(self, contact: Contact, limit: float) -> float:
        """Return a step after a first touch within which the contact's impulse is below the tolerance."""
        speed_scale = max(self.speed_scale, abs(self.v))
        pull = abs(self._net()) / self.parts.mass
        h = min(limit, 1e3 * self.guess)
        if speed_scale == 0.0:
            speed_scale = pull * h
        allowed = 0.01 * self.tolerance * speed_scale * self.parts.mass
        while contact.impulse(self.v, pull, h) > allowed:
            h *= 0.7
        return h

    def _hold(self, limit: float, t_end: float) -> None:
        """Stay at rest on a rigid backstop, or in balance inside the pack, until the forces change."""
        h = limit
        still = np.zeros(ORDER + 1)
        still[0] = self.y
        for _ in range(200):
            drive = self.drive.series(self.t, h)
            size = max(np.abs(drive).max(), 1e-300)
            if math.isfinite(h) and np.abs(drive[-3:]).max() <= 1e-16 * size:
                break
            h *= 0.5
        cell = None if self.parts.table is None else self._cell()
        force = self.parts.held_force(self.ref + self.y, drive, self.drive.is_current, cell)
        push, slack = 0.0, 0.0
        if self.mode == "rest":
            push = self.parts.loading().push(self.y, 0.0)
            slack = 1e-12 * abs(push)
        guards = [*self._cell_guards(still, h), ("rise", offset(-force, slack - push))]
        if self.mode == "rest":
            guards.append(("fall", offset(force, slack + push)))
        kind, s = self._first(guards, 1.0)
        if kind in ("rise", "fall"):
            # A trifle late, so that the force has its new sign beyond doubt.
            s = min(1.0, s + 1e-11)
        self._record(h, s, still, np.zeros(ORDER + 1))
        if not kind:
            self.t = self._clock(t_end, h)
            return
        self.t += h * s
        if kind.startswith(("cell", "range")):
            self._switch(kind)
        elif self.mode == "stuck":
            self._log("backstop-release")
            self.mode = "free"
        else:
            self._resume()

    def _log(self, kind: str) -> None:
        self.events.append(Event(float(self.t), kind, float(self.ref + self.y), float(self.v)))

    def _switch(self, kind: str) -> None:
        parts = self.parts
        if kind == "range-left":
            self.status = "range left"
            self._log(kind)
        elif kind.startswith("cell"):
            axis, step = (int(word) for word in kind.split()[1:])
            i, j = self._cell()
            self.cell = (i + step, j) if axis == 0 else (i, j + step)
            self.zero = f"cell {axis} {-step}"
        elif kind in ("pack-touch", "backstop-touch", "pack-leave", "backstop-leave"):
            ref = parts.front if kind.startswith("pack") else parts.position
            self.ref, self.y = ref, 0.0
            self._log(kind)
            if kind == "pack-touch":
                self._enter("load", ref, 0.0)
            elif kind == "backstop-touch":
                self._touch_stop()
            else:
                self.mode = "free"
        elif kind == "pack-peak":
            self.v = 0.0
            self._log(kind)
            if self.mode == "recurve":
                self.mode = "curve"
            elif self.y > 0.0:
                self.mode, self.peak = "curve", self.y
            else:
                self.mode = "free"
        elif kind == "rejoin":
            self.y = self.peak
            self.mode = "load"
        elif kind == "pack-trough":
            self.v = 0.0
            self._log(kind)
            if parts.pack.reloading == "unloading-curve":
                self.mode = "recurve"
            else:
                self._resume()
        else:
            self._log(kind)
            self.mode = self.mode.removesuffix("-cut") + ("-cut" if kind == "cut" else "")
            self.zero = "uncut" if kind == "cut" else "cut"

    def _resume(self) -> None:
        """Continue from v = 0 inside the pack: inward again, outward from a new local maximum, or at rest."""
        self.v = 0.0
        self.mode = "load"
        if _first(self._expand(self._contact(), self.guess)[1]) > 0.0:
            return
        if self.y <= 0.0:
            # A touch without velocity, pulled back at once.
            self.mode = "free"
            return
        self.mode, self.peak = "curve", self.y
        self._log("pack-peak")
        if _first(self._expand(self._contact(), self.guess)[1]) > 0.0:
            self.mode = "rest"

    def _touch_stop(self) -> None:
        parts = self.parts
        if not parts.rigid:
            self._enter("stop", parts.position, 0.0)
            return
        self.v = -float(parts.backstop.restitution) * min(self.v, 0.0)
        pull = -self._net() / parts.mass
        if pull >= 0.0 and self.v * self.v <= 2.0 * pull * STICK_HEIGHT:
            self.v = 0.0
            self.mode = "stuck"
            self._log("backstop-stick")
        else:
            self.mode = "free"
            self._log("backstop-rebound")


def _first(c: Array) -> float:
    """Return the first nonzero coefficient, or zero."""
    return next((float(value) for value in c if value != 0.0), 0.0)


def reference(
    hammer: Any,
    drive: Any,
    t_end: float,
    *,
    state: tuple[float, float] | None = None,
    tolerance: float = 1e-12,
    times: ArrayLike | None = None,
) -> ReferenceRun:
    """Integrate one run slowly and independently of the compiled kernel.

    Parameters
    ----------
    hammer, drive
        As for `printhammer.simulate`; only their constants and fields are read.
    t_end : float
        Duration, s.
    state : (x, v), optional
        Start, m and m/s; by default at rest at the backstop.
    tolerance : float
        Size of the last terms of a step, relative to the largest displacement within a step and the largest
        speed so far. 1e-12 leaves some 1e-11 of the stroke after a single pulse, 1e-14 some 1e-13.
    times : array_like, optional
        Times, s, for ``t``, ``x``, ``v`` of the result; by default the ends of the steps.

    Returns
    -------
    ReferenceRun
        With ``status`` "ok", "range left", "runaway" or "step limit".

    Raises
    ------
    ValueError
        The hammer has a law, or the drive a shape, that the reference does not know, or there is no rest
        state to start from.
    """
    run = _Run(hammer, drive, state, tolerance)
    while not run.status:
        if run.t >= t_end:
            run.status = "ok"
        elif len(run.steps) >= STEP_LIMIT:
            run.status = "step limit"
        else:
            run.advance(t_end)
    result = ReferenceRun(run.status, run.events, run.steps)
    starts = [step.t for step in run.steps]
    result.t = np.array([*starts, result.end]) if times is None else np.array(times, dtype=float, ndmin=1)
    result.x, result.v = result.at(result.t)
    return result


def horizon(
    hammer: Any,
    drive: Any,
    t_end: float,
    times: ArrayLike,
    *,
    state: tuple[float, float] | None = None,
    stroke: float | None = None,
) -> float:
    """Return the first of ``times`` at which two references differ by 1e-10 of the stroke, or ``t_end``.

    Their tolerances are 1e-12 and 1e-13. ``stroke``, m, is by default the span of the displacement at
    ``times`` in the finer run; ``state`` as for `reference`. Beyond the horizon no comparison of runs means
    anything.
    """
    wanted = np.asarray(times, dtype=float)
    coarse = reference(hammer, drive, t_end, state=state, tolerance=1e-12, times=wanted)
    fine = reference(hammer, drive, t_end, state=state, tolerance=1e-13, times=wanted)
    span = float(np.nanmax(fine.x) - np.nanmin(fine.x)) if stroke is None else stroke
    apart = ~(np.abs(coarse.x - fine.x) <= 1e-10 * span)
    return float(wanted[np.argmax(apart)]) if apart.any() else t_end
