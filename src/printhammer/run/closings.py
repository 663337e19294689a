"""Closings of the further contacts of a hammer: the intervals in which a ``[[contact]]`` is closed."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from printhammer.parts.spring.forces import LinearContact
from printhammer.results import Declared, part, scalar
from printhammer.run.problem import Problem, Record
from printhammer.support.arrays import BoolArray, FloatArray

_BISECTIONS: Final = 52  # Bisections that exhaust the bits of a float


class Closing(Declared):
    """Interval in which a further contact is closed, from touch to opening."""

    contact: str = part("name of the contact")
    t_in: float = scalar("s", "time of closing", more="start of the run if the contact was closed then")
    v_in: float = scalar("m/s", "velocity at closing", more="likewise")
    t_out: float | None = scalar("s", "time of opening", more="None while the contact is closed")
    v_out: float | None = scalar("m/s", "velocity at opening", more="None while the contact is closed")
    depth: float = scalar("m", "largest indentation")
    peak_force: float = scalar("N", "largest contact force")
    initial: bool = part("whether the contact was closed at the start of the run")


def extrema(problem: Problem, record: Record, sign: float) -> tuple[FloatArray, FloatArray]:
    """Locate all local maxima of `sign` times the displacement; return times, s, and displacements, m."""
    nodes = record.nodes
    before, after = sign * nodes[:-1, 2], sign * nodes[1:, 2]
    rows = np.flatnonzero((before > 0.0) & (after <= 0.0) & (nodes[1:, 0] > nodes[:-1, 0]))
    low, high = nodes[rows, 0].copy(), nodes[rows + 1, 0].copy()
    for _ in range(_BISECTIONS if len(rows) else 0):
        middle = 0.5 * (low + high)
        rising = sign * problem.resample(record, middle)[:, 1] > 0.0
        low = np.where(rising, middle, low)
        high = np.where(rising, high, middle)
    times = np.where(after[rows] == 0.0, nodes[rows + 1, 0], high)
    return times, problem.resample(record, times)[:, 0] if len(rows) else times


def closings_of(problem: Problem, record: Record) -> list[Closing]:
    """Return the closings of all further contacts of a hammer, in order of time."""
    closings: list[Closing] = []
    for key, term in problem.hammer.terms.items():
        if isinstance(term, LinearContact):
            closings += _closings(key.partition(".")[2], term, problem, record)
    return sorted(closings, key=lambda closing: closing.t_in)


def _closings(name: str, contact: LinearContact, problem: Problem, record: Record) -> list[Closing]:
    nodes = record.nodes
    sign = 1.0 if contact.side == "front" else -1.0
    inside = sign * (nodes[:, 1] - contact.position)
    closed = _closed_steps(inside, sign * nodes[:, 2])
    changes = np.flatnonzero(np.diff(closed)) + 1
    edges = [0, *changes.tolist(), len(closed)]
    times, places = extrema(problem, record, sign)
    closings = []
    for first, last in pairwise(edges):
        if first == last or not closed[first]:
            continue
        t_in, t_out = nodes[first, 0], nodes[last, 0]
        depths = sign * (places[(times >= t_in) & (times <= t_out)] - contact.position)
        depth = float(max([inside[first], inside[last], *depths.tolist()]))
        is_open = last < len(closed)
        closings.append(
            Closing(
                contact=name,
                t_in=float(t_in),
                v_in=float(nodes[first, 2]),
                t_out=float(t_out) if is_open else None,
                v_out=float(nodes[last, 2]) if is_open else None,
                depth=depth,
                peak_force=contact.force(depth),
                initial=first == 0,
            )
        )
    return closings


def _closed_steps(inside: FloatArray, inward: FloatArray) -> BoolArray:
    """Return whether a contact is closed in each step, from indentation and inward velocity at the nodes.

    A step does not cross the position of the contact. One that begins and ends there lies on the side to
    which its initial velocity points.
    """
    first, last = inside[:-1], inside[1:]
    there = (first == 0.0) & (last == 0.0)
    return np.asarray((first > 0.0) | (last > 0.0) | (there & (inward[:-1] > 0.0)))
