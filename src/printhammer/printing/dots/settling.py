"""Settling of a hammer after a single pulse: settle-out time, rebounds, and backstop wear."""

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
from printhammer.printing.dots.paper import PiecewiseMotion
from printhammer.results import Declared, part, scalar
from printhammer.run.contacts import Contact
from printhammer.run.motion import Motion
from printhammer.run.problem import TOLERANCE
from printhammer.run.simulate import simulate
from printhammer.run.window import wait_of
from printhammer.support.arrays import BoolArray

SETTLED: Final = 0.01
"""Distance from rest, as a fraction of the stroke, within which the armature has settled; arbitrary."""

CYCLE: Final = 20e-3  # Shortest duration of the simulation, s; arbitrary

_WINDOWS: Final = 2.0  # Shortest duration of the simulation, in windows (`printhammer.run.window`); arbitrary
_SPACING: Final = 1e-6  # Spacing of the samples, s; arbitrary
_BISECTIONS: Final = 40  # Bisections of the settling time, down to rounding error
_SAMPLES: Final = 4001  # Number of samples of a motion from which the time of exact rest is found; arbitrary
_MARGIN: Final = 0.99  # Safety factor on the rate, since integration errors shift the time of rest; arbitrary


class Wear(Declared):
    """Load on the backstop: touches, impulse, energy, largest speed and force."""

    touches: int = part("number of backstop touches")
    impulse: float = scalar("N s", "change of momentum of the armature, summed over the backstop touches")
    loss: float = scalar("J", "energy dissipated in the backstop")
    largest_speed: float = scalar("m/s", "largest impact speed on the backstop")
    largest_force: float | None = scalar(
        "N", "largest backstop force", more="None for a rigid backstop, whose force is not finite"
    )


@dataclass(frozen=True)
class Rebound:
    """Rebound between two backstop touches: start and end [s], and largest height [m]."""

    start: float
    end: float
    height: float

    @property
    def duration(self) -> float:
        """Duration of the rebound, s."""
        return self.end - self.start


class Settling(Declared):
    """Settling after a single pulse: settle-out time, rebounds, load on the backstop, coil work."""

    settle_out: float | None = scalar(
        "s",
        "time from the firing until the armature stays within `SETTLED` of the stroke from its rest position",
        more="None if not settled within `CYCLE` or two windows, see `printhammer.run.window`",
    )
    rebounds: int = part("number of rebounds from the backstop higher than `SETTLED` of the stroke")
    highest: float = part("height of the highest rebound, as a fraction of the stroke; 0 without a rebound")
    restitution: float | None = part(
        "speed after the first backstop touch over the speed before; None if the armature does not leave"
    )
    wear: Wear = part("load on the backstop until the end of the simulation")
    coil_work: float = scalar("J", "net work of the coil")
    status: str = part("status of the simulation")


def settle(hammer: Hammer, waveform: Waveform | None = None, *, tolerance: float = TOLERANCE) -> Settling:
    """Simulate one pulse from rest, by default the hammer's; compute settling and backstop wear."""
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
        settle_out=_settle_time(motion, rest, limit) if motion.ok and first is not None else None,
        rebounds=len(heights),
        highest=max(heights, default=0.0),
        restitution=left,
        wear=wear_of(motion),
        coil_work=motion.energy.coil_work,
        status=motion.status,
    )


def undisturbed_rate(hammer: Hammer) -> float:
    """Return a rate [Hz] up to which the armature is exactly at rest at each pulse; 0 without such a rate.

    With a rigid backstop, and a driver that brings the current to zero, the device is at rest to the last bit
    some time after a pulse. Pulses further apart than that time give equal dots.
    """
    pulse = pulse_of(hammer, None)
    motion = simulate(hammer, PulseTrain(pulse), duration=2.0 * wait_of(hammer, pulse), points=_SAMPLES)
    x, _v, *_others = rest = motion.state_at(motion.start)
    place = settled_from((motion.x != x) | (motion.v != 0.0) | (motion.current != 0.0))
    if place == motion.t.size or motion.state_at(float(motion.t[place])) != rest:
        return 0.0
    return _MARGIN / float(motion.t[place])


def touches(motion: Motion | PiecewiseMotion) -> list[Contact]:
    """List the backstop touches; the contact at rest before the first firing is excluded."""
    return [contact for contact in motion.contacts if contact.surface == "backstop" and not contact.initial]


def wear_of(motion: Motion | PiecewiseMotion) -> Wear:
    """Compute the load on the backstop in a motion: touches, impulse, loss, largest speed and force."""
    mass, contacts = motion.hammer.mass, touches(motion)
    forces = [contact.peak_force for contact in contacts if contact.peak_force is not None]
    return Wear(
        touches=len(contacts),
        # A contact that is still open ends with the armature at rest on the backstop.
        impulse=sum(mass * ((contact.v_out or 0.0) - contact.v_in) for contact in contacts),
        loss=sum(contact.loss for contact in motion.contacts if contact.surface == "backstop"),
        largest_speed=max((-contact.v_in for contact in contacts), default=0.0),
        largest_force=max(forces) if forces else None,
    )


def rebounds(motion: Motion, position: float) -> list[Rebound]:
    """List the intervals between consecutive touches of a backstop at `position` [m]."""
    times, x = motion.maxima
    intervals = []
    for before, after in itertools.pairwise(touches(motion)):
        if before.t_out is not None:
            inside = (times >= before.t_out) & (times <= after.t_in)
            height = float(x[inside].max()) - position if inside.any() else 0.0
            intervals.append(Rebound(before.t_out, after.t_in, height))
    return intervals


def settled_from(away: BoolArray) -> int:
    """Return the index of the first sample from which the armature remains at rest.

    `away` is the mask of the samples away from rest. If the last sample is away from rest, the index is the
    number of samples.
    """
    places = np.flatnonzero(away)
    return int(places[-1]) + 1 if places.size else 0


def _settle_time(motion: Motion, rest: float, limit: float) -> float | None:
    """Bisect for the time [s] after which the armature stays within `limit` [m] of its rest position.

    The time is measured from the firing. The result is None if the distance from rest never exceeds the
    limit, or exceeds the limit at the end of the motion.
    """
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
