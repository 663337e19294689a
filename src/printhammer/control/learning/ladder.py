"""The ladder: pulses from rest that show what a line does not, and how its rungs are chosen.

A rung is one pulse, or two. From the times of single pulses of different widths the strength of the coil and
the distance of the pack can be told apart. The stiffness of the paper does not show in them: the armature
touches before it is felt. It shows in the time of a second impact, where a second pulse catches the armature
on its way back and returns it to the paper: pump and probe. Which rungs tell most depends on the hammer. They
are chosen one after the other, each for what it adds to the knowledge of the force of the single pulse (in
the language of experimental design, greedy and optimal in the sense of A, averaged over the production).

Readings as quadratic functions of the constants of a hammer: to start a search, and to plan with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from printhammer.control.pulses import of_width
from printhammer.control.table.task import Task
from printhammer.drive.trains import PulseTrain
from printhammer.run.simulate import simulate
from printhammer.support.arrays import FloatArray

_RIDGE: Final = 1e-3  # Of the regression: mean square of a coefficient that is nothing but noise


@dataclass(frozen=True)
class Surrogate:
    """A reading as a quadratic function of constants, in standard deviations, and what that leaves over."""

    constant: float
    slope: FloatArray  # (constants,)
    curvature: FloatArray  # (constants, constants), symmetric
    rest: float  # Root of the mean square of what is not quadratic

    @classmethod
    def of(cls, rows: FloatArray, values: FloatArray) -> Surrogate:
        """Return the regression of values (members,) on constants (members, constants); NaN left out."""
        known = np.isfinite(values)
        size = rows.shape[1]
        upper = np.triu_indices(size)
        own = rows[known]
        terms = np.concatenate([np.ones((len(own), 1)), own, own[:, upper[0]] * own[:, upper[1]]], axis=1)
        normal = terms.T @ terms + _RIDGE * np.eye(terms.shape[1])
        factors = np.linalg.solve(normal, terms.T @ values[known])
        rest = values[known] - terms @ factors
        curvature = np.zeros((size, size))
        curvature[upper] = factors[size + 1 :]
        freedom = max(len(own) - terms.shape[1], 1)
        return cls(
            float(factors[0]),
            factors[1 : size + 1],
            curvature + curvature.T,
            float(np.sqrt(rest @ rest / freedom)),
        )

    def value(self, rows: FloatArray) -> FloatArray:
        """Return the reading for constants (M, constants)."""
        bent = 0.5 * np.einsum("mi,ij,mj->m", rows, self.curvature, rows)
        return np.asarray(self.constant + rows @ self.slope + bent)

    def gradient(self, rows: FloatArray) -> FloatArray:
        """Return its derivatives by the constants, (M, constants)."""
        return np.asarray(self.slope + rows @ self.curvature)


DOTS: Final = 9
"""Number of dots of a ladder."""

# Widths of single pulses and of both pulses of a pair, in parts of that of the hammer
_SINGLE: Final = (0.7, 0.85, 1.0, 1.15, 1.3, 1.45)
_FIRST: Final = (0.8, 1.0, 1.3)
_SECOND: Final = (1.0, 1.3, 1.5)
# When the second pulse comes after the armature has left the pack, in parts of the flight time
_LATER: Final = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.2, 1.6, 2.0, 2.4)
_CLEAR: Final = 20e-6  # How much later than the nominal hammer a unit may leave the pack, s
_SEEN: Final = 0.97  # Least share of the simulated hammers that print all dots of a rung
_RUNS: Final = 8.0  # Number of runs after which knowledge is to be largest
_POINTS: Final = 24  # Number of simulated hammers about which it is looked at


class Rung(NamedTuple):
    """A pulse from rest, and perhaps a second one some time, s, later; widths in parts of the hammer's."""

    first: float
    later: float = 0.0
    second: float = 1.0

    @property
    def dots(self) -> int:
        """Number of dots."""
        return 2 if self.later else 1


def candidates(task: Task) -> list[Rung]:
    """Return the rungs to choose from; in none a pulse is fired while the armature is in the pack."""
    hammer, widest = task.hammers[0], task.widest / task.width
    rungs = [Rung(part) for part in _SINGLE if part <= widest]
    for first in _FIRST:
        if first > widest:
            continue
        drive = PulseTrain(of_width(task.pulse, first * task.width))
        contacts = simulate(hammer, drive, duration=task.single.settled, tolerance=task.tolerance).contacts
        dot = next((contact for contact in contacts if contact.surface == "pack"), None)
        if dot is None or dot.t_out is None:
            continue
        clear = max(float(dot.t_out), first * task.width + task.faded) + _CLEAR
        rungs += [
            Rung(first, clear + part * task.single.nominal.flight_time, second)
            for second in _SECOND
            if second <= widest
            for part in _LATER
        ]
    return rungs


def choose(
    times: Mapping[Rung, FloatArray],
    line: Sequence[Surrogate],
    force: Surrogate,
    rows: FloatArray,
    noise: float,
) -> list[Rung]:
    """Return the rungs of a ladder, `DOTS` dots in all.

    Parameters
    ----------
    times
        Rungs to choose from, and the times of impact of their dots, in parts of the limit, (members, dots).
    line
        How the times of a line in an open loop depend on the constants.
    force
        How the force of the single pulse does.
    rows
        The constants of the members, in standard deviations, (members, constants).
    noise
        Standard deviation of one reading of a time, in parts of the limit.
    """
    points, variance = rows[:_POINTS], noise**2 / _RUNS
    wanted = force.gradient(points)

    def information(readings: Sequence[Surrogate]) -> FloatArray:
        # What is not smooth in the constants counts as noise: it cannot be followed far.
        slopes = [each.gradient(points) / np.sqrt(variance + each.rest**2) for each in readings]
        return np.asarray(np.einsum("rpi,rpj->pij", slopes, slopes)) if slopes else np.zeros(())

    def unknown(known: FloatArray) -> float:
        solved = np.linalg.solve(known, wanted[:, :, None])[:, :, 0]
        return float(np.log(np.einsum("pi,pi->p", wanted, solved)).mean())

    offered = {}
    for rung, shown in times.items():
        if rung == Rung(1.0) or np.isfinite(shown).all(axis=1).mean() >= _SEEN:
            offered[rung] = information([Surrogate.of(rows, column) for column in shown.T])
    known = np.eye(rows.shape[1]) + information(line)
    chosen: list[Rung] = []
    left = DOTS
    while left:
        worth = {
            rung: (unknown(known) - unknown(known + gain)) / rung.dots
            for rung, gain in offered.items()
            if rung.dots <= left
        }
        best = max(worth, key=lambda rung: worth[rung])
        known = known + offered[best]
        chosen.append(best)
        left -= best.dots
    return sorted(chosen)
