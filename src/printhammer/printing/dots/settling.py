"""How a hammer settles after a single pulse: settle-out time, rebounds, and the wear of the backstop."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import pulse_of
from printhammer.printing.dots.pieces import PiecewiseMotion
from printhammer.results import Declared, part, scalar
from printhammer.run.contacts import Contact
from printhammer.run.motion import Motion
from printhammer.run.problem import TOLERANCE
from printhammer.run.simulate import simulate
from printhammer.run.window import wait_of
from printhammer.support.arrays import BoolArray

SETTLED: Final = 0.01
"""Distance from rest, in parts of the stroke, within which the armature counts as settled."""

CYCLE: Final = 20e-3  # Least duration of the run, s

_WINDOWS: Final = 2.0  # The same in windows
_SPACING: Final = 1e-6
_BISECTIONS: Final = 40


class Wear(Declared):
    """What the backstop bears."""

    touches: int = part("number of touches")
    impulse: float = scalar("N s", "sum over the touches of the change of momentum of the armature")
    loss: float = scalar("J", "energy that the backstop takes")
    largest_speed: float = scalar("m/s", "largest speed at touch")
    largest_force: float | None = scalar(
        "N", "largest contact force", more="None on a rigid backstop, where it is not finite"
    )


@dataclass(frozen=True)
class Rebound:
    """An interval above the backstop between two touches: times, s, and height above the backstop, m."""

    start: float
    end: float
    height: float

    @property
    def duration(self) -> float:
        """Duration, s."""
        return self.end - self.start


class Settling(Declared):
    """What follows a single pulse."""

    settle_out: float | None = scalar(
        "s",
        "time from the firing until the armature stays within `SETTLED` of the stroke from its rest",
        more="None where it does not within `CYCLE` or the window of its runs, see `printhammer.run.window`",
    )
    rebounds: int = part("number of rebounds from the backstop higher than `SETTLED` of the stroke")
    highest: float = part("height of the highest rebound, in parts of the stroke; 0 without any")
    restitution: float | None = part(
        "speed after the first touch of the backstop over the speed before; None where it does not leave"
    )
    wear: Wear = part("what the backstop bears until the end of the run")
    coil_work: float = scalar("J", "net work of the coil")
    status: str = part("how the run ended")


def settle(hammer: Hammer, waveform: Waveform | None = None, *, tolerance: float = TOLERANCE) -> Settling:
    """Fire a hammer once from rest, its own waveform or another, and watch it settle."""
    if hammer.position is None:
        raise InputError(
            f"{hammer.path}: the hammer has no backstop",
            file=hammer.path,
            key="backstop",
            expected="one to settle on",
        )
    rest, pulse = rest_state(hammer), pulse_of(hammer, waveform)
    duration = max(CYCLE, _WINDOWS * wait_of(hammer, pulse))
    motion = simulate(hammer, PulseTrain(pulse), duration=duration, points=2, tolerance=tolerance)
    top = motion.peak_after(0)
    stroke = (rest if top is None else top[1]) - hammer.position
    limit = SETTLED * max(stroke, 0.0)
    heights = [
        rebound.height / stroke for rebound in rebounds(motion, hammer.position) if rebound.height > limit
    ]
    first = next(iter(touches(motion)), None)
    left = None if first is None or first.v_out is None or first.v_in == 0.0 else -first.v_out / first.v_in
    return Settling(
        settle_out=_settled(motion, rest, limit) if motion.ok and first is not None else None,
        rebounds=len(heights),
        highest=max(heights, default=0.0),
        restitution=left,
        wear=wear_of(motion),
        coil_work=motion.energy.coil_work,
        status=motion.status,
    )


def touches(motion: Motion | PiecewiseMotion) -> list[Contact]:
    """List the touches of the backstop, the rest at the start excluded."""
    return [contact for contact in motion.contacts if contact.surface == "backstop" and not contact.initial]


def wear_of(motion: Motion | PiecewiseMotion) -> Wear:
    """Return what the backstop bears in a motion."""
    mass, contacts = motion.hammer.mass, touches(motion)
    forces = [contact.peak_force for contact in contacts if contact.peak_force is not None]
    return Wear(
        touches=len(contacts),
        # Of a contact that is still open the armature is at rest in the end.
        impulse=sum(mass * ((contact.v_out or 0.0) - contact.v_in) for contact in contacts),
        loss=sum(contact.loss for contact in motion.contacts if contact.surface == "backstop"),
        largest_speed=max((-contact.v_in for contact in contacts), default=0.0),
        largest_force=max(forces) if forces else None,
    )


def rebounds(motion: Motion, position: float) -> list[Rebound]:
    """List the intervals above a backstop at a position, m, between touches."""
    times, x = motion.maxima
    intervals = []
    for before, after in itertools.pairwise(touches(motion)):
        if before.t_out is not None:
            inside = (times >= before.t_out) & (times <= after.t_in)
            height = float(x[inside].max()) - position if inside.any() else 0.0
            intervals.append(Rebound(before.t_out, after.t_in, height))
    return intervals


def settled_from(away: BoolArray) -> int:
    """Return the number of the first sample from which on none is away; that of all where the last one is."""
    places = np.flatnonzero(away)
    return int(places[-1]) + 1 if places.size else 0


def _settled(motion: Motion, rest: float, limit: float) -> float | None:
    """Return the last time at which the armature is farther from its rest than a limit, s."""
    count = round((motion.end - motion.start) / _SPACING) + 1
    grid = np.union1d(np.linspace(motion.start, motion.end, count), motion.maxima[0])
    place = settled_from(np.abs(motion.at(grid)[0] - rest) > limit)
    if place in (0, grid.size):
        return None
    low, high = float(grid[place - 1]), float(grid[place])
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if abs(float(motion.at(middle)[0][0]) - rest) > limit:
            low = middle
        else:
            high = middle
    return high - float(motion.drive.times[0])
