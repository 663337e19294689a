"""Steps, events and outcome of a motion under lists of forces, and roots of guards; part of the oracle."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from scipy.integrate import DOP853
from tests.oracle.list_laws import System

Array = np.ndarray[Any, np.dtype[np.float64]]
Rates = Callable[[float, Any], Any]

TOLERANCE = 1e-13
"""Relative tolerance of a step."""

NODES = np.cos(np.pi * (np.arange(16) + 0.5) / 16)
"""Chebyshev nodes in (-1, 1), the last one nearest the start of a step."""

FIT = np.linalg.inv(chebyshev.chebvander(NODES, NODES.size - 1))
"""Matrix from values at the nodes to Chebyshev coefficients."""


@dataclass(frozen=True)
class Event:
    """Event of a kind: touch, leave, cut, uncut of a contact; impact, rest of a stop; stick; release.

    A contact is cut where its force before clipping becomes negative. ``v`` is the velocity just after.
    """

    time: float
    kind: str
    name: str
    x: float
    v: float


@dataclass(frozen=True)
class Step:
    """Step from state ``z`` (distance from ``ref``, velocity, works) at ``t``; no ``rates`` while held.

    ``rates`` count the time from the last event or knot, ``since`` before ``t``.
    """

    t: float
    end: float
    ref: float
    z: Array
    rates: Rates | None
    since: float = 0.0


@dataclass
class Run:
    """Outcome: events, works by name of force or contact, energy lost by name of contact or stop, J."""

    system: System
    events: list[Event] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list, repr=False)
    work: dict[str, float] = field(default_factory=dict)
    lost: dict[str, float] = field(default_factory=dict)

    def times(self, kind: str, name: str | None = None) -> list[float]:
        """Times of the events of a kind, of all contacts or of one, s."""
        return [event.time for event in self.events if event.kind == kind and name in (None, event.name)]

    def at(self, times: Sequence[float] | Array) -> tuple[Array, Array]:
        """Displacements [m], and velocities [m/s] at times of the run, each by a step of order 8."""
        starts = [step.t for step in self.steps]
        states = []
        for t in times:
            step = self.steps[max(int(np.searchsorted(starts, t, side="right")) - 1, 0)]
            if not step.t <= t <= step.end + 4.0 * math.ulp(step.end):
                raise ValueError(f"t = {t} s lies outside the run")
            z, since = step.z, step.since
            if step.rates is not None:
                z = flow(self.system, step.rates, since, z, since + float(t) - step.t)
            states.append((step.ref + z[0], z[1]))
        x, v = np.array(states).reshape(-1, 2).T
        return x, v


def solver(
    system: System, rates: Rates, t: float, z: Array, end: float, first_step: float | None = None
) -> DOP853:
    """DOP853 from state ``z`` at ``t`` to ``end``, with errors measured by the scales of the system."""
    scales: Any = np.full(z.size, system.mass * system.speed**2)
    scales[:2] = system.length, system.speed
    # The force of a damped contact grows with depth times speed: a trial step far too long would overflow.
    times = (
        math.sqrt(system.mass / (contact.stiffness * system.length ** (contact.exponent - 1.0)))
        for contact in system.contacts
        if contact.loss
    )
    longest = min(times, default=math.inf)
    return DOP853(
        rates,
        t,
        z,
        end,
        rtol=TOLERANCE,
        atol=TOLERANCE * scales,
        first_step=None if first_step is None else min(first_step, longest),
        max_step=longest,
    )


def flow(system: System, rates: Rates, t: float, z: Array, end: float) -> Array:
    """State at ``end``, by one step unless its error is too large."""
    if end <= t:
        return z
    steps = solver(system, rates, t, z, end, end - t)
    while steps.status == "running":
        steps.step()
    return np.asarray(steps.y)


def first_fall(values: Array, at_start: float, order: int) -> tuple[float, float] | None:
    """Fraction of a step at which a guard first falls below zero, and its slope per step there.

    A zero of known order at the start is divided out.
    """
    s = 0.5 * (NODES + 1.0)
    c = FIT @ ((values - at_start) / s**order if order else values)
    if c[0] > np.abs(c[1:]).sum():
        return None
    size = float(np.abs(c).max())
    first = float(chebyshev.chebval(-1.0, c)) if order else at_start
    if first < (-1e-9 * size if order else 0.0):
        return 0.0, 0.0
    c = chebyshev.chebtrim(c, 1e-15 * size)
    if c.size < 2:
        return None
    roots = chebyshev.chebroots(c)
    for root in np.sort(roots.real[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) <= 1.0)]).tolist():
        slope = 2.0 * float(chebyshev.chebval(root, chebyshev.chebder(c)))
        if slope < 0.0:
            fraction = 0.5 * (root + 1.0)
            return fraction, slope * fraction**order
    return None
