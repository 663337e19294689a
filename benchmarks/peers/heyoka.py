"""heyoka: Taylor series with event detection, one run at a time and in batches of SIMD lanes.

A Taylor method requires analytic right-hand sides, and the powers 1.5 and 2.7 are not analytic where a
contact begins. One system of equations therefore describes all modes, in a variable q of which every force is
an entire function:

    x = c0 + c1 q + c2 q^2 + c3 exp(q),    dq/ds = k v,    dt/ds = k dx/dq

with q = x in free flight and on the unloading branch, q = ln r on the loading branch, entered at r = 1e-5,
and q = sqrt(b - x) in the backstop. Terminal events change mode, variable and parameters in a callback, so
that a run is a single `propagate_until`. In a batch, a callback also
assigns the next member to a lane that has finished.
"""

from __future__ import annotations

import importlib
import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.solvers.entry import Absent, Entry
from benchmarks.solvers.problem import ENDS, FIRST, GRID, PERIOD, checked, ensemble_tasks

from .equations import BACKSTOP, FREE, LENGTH, LOADING, TIME, UNLOADING, hammer_constants, scaled_pieces

if TYPE_CHECKING:
    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

_ENTRY: Final = 1e-5
"""Indentation r at which the loading branch begins; the work up to this r is about 1e-19 of the full work."""
_LONGEST: Final = 5.0
"""Largest step, in units of `TIME`; otherwise the step of a hammer at rest would be unlimited."""

_PARAMETERS = ("c0", "c1", "c2", "c3", "k", "elastic", "viscous", "load", "unload", "r0", "r1")
_EVENTS = ("e10", "e1q", "e1v", "e20", "e2q", "e2v", "edge")
_DRIVE = ("target", "rate")
_NAMES = (*_PARAMETERS, *_EVENTS, *_DRIVE)
_PLACE = {name: i for i, name in enumerate(_NAMES)}
_MODAL = len(_PARAMETERS) + len(_EVENTS) - 1


class Lane:
    """Switching of one run: callbacks that change the integrator's state and parameters."""

    def __init__(self, task: Task, end: float) -> None:
        c = hammer_constants(task)
        self.front, self.thickness, self.position = c[7] / LENGTH, c[8] / LENGTH, c[9] / LENGTH
        self.stiffness = float(c[6] / c[0] * TIME**2 / LENGTH)
        elastic = float(c[10] * LENGTH**1.5 / c[0] * TIME**2 / LENGTH)
        viscous = float(c[11] * LENGTH**1.5 / c[0] * TIME)
        self.modes = {
            FREE: _modal(
                c1=1, k=1, e10=-self.position, e1q=1, e20=self.front + self.thickness * _ENTRY, e2q=-1
            ),
            LOADING: _modal(
                c0=self.front, c3=self.thickness, k=1 / self.thickness, load=self.stiffness, e1v=1, e20=1
            ),
            UNLOADING: _modal(
                c1=1,
                k=1,
                r0=-self.front / self.thickness,
                r1=1 / self.thickness,
                e10=-self.front,
                e1q=1,
                e2v=-1,
            ),
            BACKSTOP: _modal(c0=self.position, c2=-1, k=-2, elastic=elastic, viscous=viscous, e1q=1, e20=1),
        }
        self.task = task
        self.pieces = scaled_pieces(task, end)
        self.mode, self.piece = BACKSTOP, 0

    def begin(self) -> tuple[FloatArray, FloatArray]:
        """Return the state and the parameters of the integrator at time 0."""
        self.mode, self.piece = BACKSTOP, 0
        parameters = np.zeros(len(_NAMES))
        parameters[:_MODAL] = self.modes[BACKSTOP]
        state = np.array([math.sqrt(self.position - self.task.rest / LENGTH), 0.0, 0.0, 0.0])
        self._drive(state, parameters)
        return state, parameters

    def _drive(self, state: FloatArray, parameters: FloatArray) -> None:
        begin, end, a, b, rate = self.pieces[self.piece]
        state[2], state[3] = begin, a + b
        parameters[_MODAL:] = (end, a, rate)

    def switch(self, which: int, state: FloatArray, parameters: FloatArray) -> bool:
        """Change mode (events 0, 1) or drive piece (event 2); return whether the run continues."""
        if which == 2:
            self.piece += 1
            if self.piece == len(self.pieces):
                return False
            self._drive(state, parameters)
            return True
        mode = self.mode
        if mode == FREE:
            self.mode, state[0] = (BACKSTOP, 0.0) if which == 0 else (LOADING, math.log(_ENTRY))
        elif mode == LOADING:
            r = math.exp(state[0])
            self.mode, state[0], state[1] = UNLOADING, self.front + self.thickness * r, 0.0
            self.modes[UNLOADING][_PLACE["unload"]] = self.stiffness * r**-8.3
        elif mode == UNLOADING:
            if which == 0:
                self.mode, state[0] = FREE, self.front
            else:
                self.mode, state[1] = LOADING, 0.0
                state[0] = math.log((state[0] - self.front) / self.thickness)
        else:
            self.mode, state[0] = FREE, self.position
        parameters[:_MODAL] = self.modes[self.mode]
        return True


def _modal(**values: float) -> FloatArray:
    found = np.zeros(_MODAL)
    for name, value in values.items():
        found[_PLACE[name]] = value
    return found


class _Switch:
    """Event callback; heyoka copies callbacks, but all copies must refer to the same run."""

    def __init__(self, owner: Any, which: int) -> None:
        self.owner, self.which = owner, which

    def __deepcopy__(self, memo: Any) -> _Switch:
        return self

    def __call__(self, _integrator: Any, _sign: int, lane: int = -1) -> bool:
        return bool(self.owner.switch(self.which, lane))


def _system(hy: Any, task: Task) -> tuple[list[Any], list[Any]]:
    q, v, t, current = hy.make_vars("q", "v", "t", "i")
    c = hammer_constants(task)
    unit = TIME**2 / LENGTH / c[0]
    p = {name: hy.par[i] for i, name in enumerate(_NAMES)}
    exponential = hy.exp(q)
    x = p["c0"] + p["c1"] * q + p["c2"] * q * q + p["c3"] * exponential
    pace = p["k"] * (p["c1"] + 2.0 * p["c2"] * q + p["c3"] * exponential)
    reduced = math.sqrt(unit * LENGTH**-0.5) * (c[2] - c[3] * current)
    r = p["r0"] + p["r1"] * q
    r2 = r * r
    r4 = r2 * r2
    a = (
        unit * (c[1] + c[4] + c[4] / c[5] * c[9])
        - unit * c[4] / c[5] * LENGTH * x
        - reduced * reduced * x**-0.5
    )
    a += (
        q * q * q * (p["elastic"] - p["viscous"] * v)
        - p["load"] * hy.exp(2.7 * q)
        - p["unload"] * (r4 * r4 * (r2 * r))
    )
    rates = [(q, p["k"] * v), (v, pace * a), (t, pace), (current, pace * p["rate"] * (p["target"] - current))]
    events = [
        p["e10"] + p["e1q"] * q + p["e1v"] * v,
        p["e20"] + p["e2q"] * q + p["e2v"] * v,
        p["edge"] - t,
    ]
    return rates, events


class Single:
    """Integrator for one run at a time."""

    def __init__(self, hy: Any, task: Task, tolerance: float) -> None:
        rates, events = _system(hy, task)
        self.lane = Lane(task, FIRST)
        self.task = task
        switches = [
            hy.t_event(event, callback=_Switch(self, i), direction=hy.event_direction.negative)
            for i, event in enumerate(events)
        ]
        self.integrator = hy.taylor_adaptive(
            rates, [0.0] * 4, pars=[0.0] * len(_NAMES), t_events=switches, tol=tolerance
        )

        # Cached views of the integrator's memory: creating a view costs as much as a switch.
        self.state, self.parameters = self.integrator.state, self.integrator.pars

    def switch(self, which: int, _lane: int) -> bool:
        """Process an event of the run; return whether the run continues."""
        return self.lane.switch(which, self.state, self.parameters)

    def _begin(self, end: float) -> None:
        self.lane = Lane(self.task, end)
        self.integrator.time = 0.0
        self.state[:], self.parameters[:] = self.lane.begin()
        self.integrator.reset_cooldowns()

    def run(self, end: float) -> None:
        """Integrate from rest to time `end` [s]."""
        self._begin(end)
        self.integrator.propagate_until(1e9, max_delta_t=_LONGEST)

    def positions(self) -> FloatArray:
        """Return the displacement [m] on the grid from the Taylor series of all steps."""
        self._begin(FIRST)
        out = np.full(GRID.size, np.nan)
        wanted = GRID / TIME
        done = 0
        integrator = self.integrator
        while self.lane.piece < len(self.lane.pieces):
            began, start = integrator.state[2], integrator.time
            c0, c1, c2, c3 = integrator.pars[:4].copy()
            integrator.step(max_delta_t=_LONGEST, write_tc=True)
            length = integrator.time - start
            q, t = integrator.tc[0][::-1], integrator.tc[2][::-1]
            last = np.polyval(t, length)
            inside = np.flatnonzero((wanted >= began) & (wanted <= last * (1.0 + 1e-15)))
            inside = inside[inside >= done]
            if inside.size:
                s = np.interp(wanted[inside], (began, last), (0.0, length))
                for _ in range(50):
                    slope = np.polyval(np.polyder(t), s)
                    gap = np.polyval(t, s) - wanted[inside]
                    s -= np.where(slope > 0.0, gap / np.where(slope > 0.0, slope, 1.0), 0.0)
                    s = np.clip(s, 0.0, length)
                value = np.polyval(q, s)
                out[inside] = (c0 + c1 * value + c2 * value**2 + c3 * np.exp(value)) * LENGTH
                done = inside[-1] + 1
        return out


class Batch:
    """Many runs in the lanes of a batch integrator; a lane that has finished integrates the next member."""

    def __init__(self, hy: Any, tasks: list[Task], end: float, tolerance: float) -> None:
        rates, events = _system(hy, tasks[0])
        self.members = [Lane(task, end) for task in tasks]
        self.width = min(hy.recommended_simd_size(), len(tasks))
        switches = [
            hy.t_event_batch(event, callback=_Switch(self, i), direction=hy.event_direction.negative)
            for i, event in enumerate(events)
        ]
        self.integrator = hy.taylor_adaptive_batch(
            rates,
            np.zeros((4, self.width)),
            pars=np.zeros((len(_NAMES), self.width)),
            t_events=switches,
            tol=tolerance,
        )
        state, parameters = self.integrator.state, self.integrator.pars
        self.views = [(state[:, lane], parameters[:, lane]) for lane in range(self.width)]
        self.at = list(range(self.width))
        self.next = self.running = self.width
        self.ends = np.full((len(tasks), 2), np.nan)

    def switch(self, which: int, lane: int) -> bool:
        """Process an event of the run in a lane; return whether any lane still runs."""
        state, parameters = self.views[lane]
        member = self.members[self.at[lane]]
        if member.switch(which, state, parameters):
            return True
        q = state[0]
        c0, c1, c2, c3 = parameters[:4]
        x = c0 + c1 * q + c2 * q * q + (c3 * math.exp(q) if c3 else 0.0)
        self.ends[self.at[lane]] = x * LENGTH, state[1] * LENGTH / TIME
        following = self.next
        if following < len(self.members):
            self.at[lane] = following
            state[:], parameters[:] = self.members[following].begin()
            self.next += 1
            return True
        # Zero derivatives keep an idle lane at rest.
        parameters[:] = 0.0
        parameters[[_PLACE["c0"], _PLACE["e10"], _PLACE["e20"], _PLACE["edge"]]] = 1.0, 1.0, 1.0, 1e30
        self.running -= 1
        return bool(self.running)

    def run(self) -> FloatArray:
        """Integrate all members; return displacement [m] and velocity [m/s] at their ends."""
        self.at = list(range(self.width))
        self.next = self.running = self.width
        integrator = self.integrator
        integrator.set_time(0.0)
        for (state, parameters), member in zip(self.views, self.members, strict=False):
            state[:], parameters[:] = member.begin()
        integrator.reset_cooldowns()
        integrator.propagate_until(1e9, max_delta_t=_LONGEST)
        return self.ends


def entries(task: Task, quick: bool) -> list[Entry]:
    """Return the benchmark entries of heyoka for single runs.

    Raises
    ------
    Absent
        heyoka is not installed.
    """
    hy = _heyoka()
    pulses = 2 if quick else 50

    def entry(tolerance: float) -> Entry:
        found: list[Single] = []

        def single() -> Single:
            # Build the integrator at first use, since the construction compiles code.
            if not found:
                found.append(Single(hy, task, tolerance))
            return found[0]

        return Entry(
            f"heyoka {hy.__version__}, its events, {tolerance:.0e}",
            lambda: single().positions(),
            lambda: single().run(pulses * PERIOD),
            pulses * PERIOD,
        )

    return [entry(tolerance) for tolerance in ((1e-8,) if quick else (1e-6, 1e-8, 1e-12))]


def ensembles(task: Task, quick: bool, members: int) -> list[Entry]:
    """Return the benchmark entries of heyoka: ensembles of `members` members.

    Raises
    ------
    Absent
        heyoka is not installed.
    """
    hy = _heyoka()
    tasks = ensemble_tasks(task, members)
    some = [tasks[i] for i in checked(members)]
    end = FIRST if quick else 10 * PERIOD

    def positions(tolerance: float) -> FloatArray:
        return np.array([Batch(hy, some, float(moment), tolerance).run()[:, 0] for moment in ENDS])

    def entry(tolerance: float) -> Entry:
        found: list[Batch] = []

        def run() -> FloatArray:
            if not found:
                found.append(Batch(hy, tasks, end, tolerance))
            return found[0].run()

        def first() -> FloatArray:
            run()
            return positions(tolerance)

        lanes = hy.recommended_simd_size()
        name = f"heyoka {hy.__version__}, its events, {lanes} lanes, {tolerance:.0e}"
        return Entry(name, first, run, end * members, members=members)

    return [entry(tolerance) for tolerance in ((1e-8,) if quick else (1e-6, 1e-8))]


def _heyoka() -> Any:
    try:
        return importlib.import_module("heyoka")
    except ImportError as error:
        raise Absent("not installed") from error
