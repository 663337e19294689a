"""Simulation of a hammer whose pack changes from firing to firing, as on paper that varies along the line.

The motion is integrated segment by segment. A segment ends at the next firing; if the armature is then inside
the pack of this segment or of the next one, the segment is extended until the armature is inside neither, so
that a contact meets a single pack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Final

import numpy as np

from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.run.contacts import Contact, Dot
from printhammer.run.energy import Ledger
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem
from printhammer.run.start import initial_state

_LATER: Final = 5e-6  # Step by which a segment is extended while the armature is inside a pack, s; arbitrary


class PiecewiseMotion:
    """Piecewise simulation with the contacts, dots and energy of a `printhammer.run.motion.Motion`."""

    def __init__(self, hammer: Hammer, drive: Drive, pieces: Sequence[Motion]) -> None:
        self.hammer = hammer
        self.drive = drive
        self._pieces = pieces

    @property
    def status(self) -> str:
        """Status of the last segment."""
        return self._pieces[-1].status

    @property
    def ok(self) -> bool:
        """Whether the simulation reached its end."""
        return self._pieces[-1].ok

    @property
    def end(self) -> float:
        """Time of the last state, s."""
        return self._pieces[-1].end

    @property
    def contacts(self) -> list[Contact]:
        """All contacts, in order of touch time; a contact split between two segments is merged."""
        contacts: list[Contact] = []
        for motion in self._pieces:
            for contact in motion.contacts:
                before = contacts[-1] if contacts else None
                if contact.initial and before is not None and before.t_out is None:
                    contacts[-1] = _merge(before, contact)
                else:
                    contacts.append(contact)
        return contacts

    @property
    def dots(self) -> list[Dot]:
        """Dots of all firings up to the end of the simulation, in order."""
        dots: dict[int, Dot] = {}
        for motion in self._pieces:
            for dot in motion.dots:
                known = dots.setdefault(dot.index, dot)
                if known is not dot and dot.struck:
                    more = 1 + dot.extra_contacts
                    dots[dot.index] = (
                        replace(known, extra_contacts=known.extra_contacts + more) if known.struck else dot
                    )
        return list(dots.values())

    @property
    def energy(self) -> Ledger:
        """Energy ledger of the whole run: each term is the sum over the segments."""
        ledgers = [motion.energy for motion in self._pieces]
        names = [field.name for field in fields(Ledger)]
        return Ledger(**{name: sum(getattr(ledger, name) for ledger in ledgers) for name in names})


def simulate_pieces(
    hammers: Sequence[Hammer], drive: Drive, duration: float, tolerance: float
) -> PiecewiseMotion:
    """Simulate a drive on a hammer that changes at each firing, from the rest state of the first hammer.

    Parameters
    ----------
    hammers : sequence of Hammer
        One hammer for each firing; they may differ only in their packs.
    drive : Drive
        The drive: a current or a force.
    duration : float
        End of the simulation, s; after the last firing.
    tolerance : float
        Error tolerance per integration step.

    Raises
    ------
    InputError
        The number of hammers is not the number of firings; or the drive is a voltage, under which a run
        cannot be resumed from displacement and velocity alone.
    """
    times = drive.times
    if len(hammers) != len(times):
        raise InputError(
            f"{len(hammers)} hammers", key="hammers", expected=f"one for each of {len(times)} firings"
        )
    if drive.quantity == "voltage":
        raise InputError(
            f"{hammers[0].path}: a voltage drives the coil",
            file=hammers[0].path,
            key="waveform",
            expected="a current or a force where paper varies",
        )
    fronts = [np.inf if hammer.front is None else hammer.front for hammer in hammers]
    ends = [*times[1:].tolist(), duration]
    state, start = initial_state(hammers[0], None), 0.0
    pieces: list[Motion] = []
    for number, hammer in enumerate(hammers):
        end = ends[number]
        if end <= start:
            continue
        problem = Problem(hammer, drive, state, start, tolerance)
        nearest = min(fronts[number : number + 2])
        while True:
            record = problem.run(end)
            x, v = (float(value) for value in record.nodes[-1, 1:3])
            if record.status or x <= nearest or end >= duration:
                break
            end = min(end + _LATER, duration)
        pieces.append(Motion(problem, record, end, np.array([start, end]), "default"))
        if record.status:
            break
        state, start = (x, v), end
    return PiecewiseMotion(hammers[0], drive, pieces)


def _merge(first: Contact, then: Contact) -> Contact:
    """Merge the two parts of a contact that was split between segments."""
    higher = then if then.depth > first.depth else first
    return replace(
        first,
        t_out=then.t_out,
        v_out=then.v_out,
        t_peak=higher.t_peak,
        depth=higher.depth,
        peak_force=higher.peak_force,
        loss=first.loss + then.loss,
    )
