"""Paper that varies along the line: pack stiffness and pack front are random functions of position.

Pack stiffness and the position of the pack front are independent normal processes, each with the correlation
exp(-d / length) between two positions d apart: a first-order autoregressive process. Draws are clipped at
three standard deviations.

A paper file is TOML with the keys ``stiffness``, ``front``, ``length`` and ``seed``, each of them optional::

    stiffness = "5 %"
    front = "3 um"
    length = "2 mm"
    seed = 1

On such paper the pack of a hammer changes from firing to firing. The motion is integrated segment by segment.
A segment ends at the next firing; if the armature is then inside the pack of this segment or of the next
segment, the segment is extended until the armature is outside both packs, so that a contact meets a single
pack.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from printhammer.drive.input import read_number
from printhammer.drive.trains import Drive
from printhammer.errors import InputError, located
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, part, scalar
from printhammer.run.contacts import Contact, Dot
from printhammer.run.energy import Ledger
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem
from printhammer.run.start import initial_state
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import shown
from printhammer.support.files import read_text

_WIDEST: Final = 3.0  # Standard deviations at which a draw is clipped; arbitrary
_UNITS: Final = {"stiffness": "1", "front": "m", "length": "m"}


class Paper(Declared):
    """Random variation of pack stiffness and pack front along a print line, about the hammer's values."""

    stiffness: float = part("relative standard deviation of the pack stiffness", default=0.05)
    front: float = scalar("m", "standard deviation of the position of the pack front", default=3e-6)
    length: float = scalar("m", "correlation length, over which the correlation falls to 1/e", default=2e-3)
    seed: int = part("seed of the random number generator", default=0)

    def __post_init__(self) -> None:
        for name in _UNITS:
            value = getattr(self, name)
            most = 1.0 / _WIDEST if name == "stiffness" else math.inf
            if not (math.isfinite(value) and 0.0 <= value < most):
                limit = " and below 1/3" if name == "stiffness" else ""
                raise InputError.of(name, value, f"a number not below 0{limit}", file="paper")
        if type(self.seed) is not int or self.seed < 0:
            raise InputError.of("seed", self.seed, "a whole number not below 0", file="paper")

    @classmethod
    def load(cls, path: str | Path) -> Paper:
        """Read a paper file.

        Raises
        ------
        InputError
            The file cannot be read, or it has an unknown key or an invalid value.
        """
        text = read_text(Path(path), "the paper file")
        known = [field.name for field in fields(cls)]
        with located(str(path)):
            try:
                keys = tomllib.loads(text)
            except (ValueError, RecursionError) as error:
                raise InputError(f"expected TOML ({' '.join(str(error).split())})") from None
            for key in keys:
                if key not in known:
                    odd = key if key.isprintable() else shown(key)
                    raise InputError(f"{odd} is not known", key=odd, expected=f"{', '.join(known)}")
            values: dict[str, Any] = {
                key: read_number(value, _UNITS[key], key) if key in _UNITS else value
                for key, value in keys.items()
            }
            return cls(**values)

    @property
    def text(self) -> str:
        """Standard deviations and correlation length in words, for a report."""
        return (
            f"stiffness {100.0 * self.stiffness:g} %, front {1e6 * self.front:g} µm, correlated over"
            f" {1e3 * self.length:g} mm"
        )

    def deviations(self, slots: int, pitch: float) -> FloatArray:
        """Draw deviations of pack stiffness and pack front, in standard deviations, shape (2, slots).

        `pitch` is the distance between neighbouring slots, m.
        """
        rng = np.random.default_rng(self.seed)
        white = rng.standard_normal((2, slots))
        kept = math.exp(-pitch / self.length) if self.length else 0.0
        off = white.copy()
        for slot in range(1, slots):
            off[:, slot] = kept * off[:, slot - 1] + math.sqrt(1.0 - kept**2) * white[:, slot]
        return np.asarray(np.clip(off, -_WIDEST, _WIDEST))

    def hammers(self, hammer: Hammer, slots: int, pitch: float) -> tuple[Hammer, ...]:
        """Return one hammer for each of `slots` slots, with the pack stiffness and front at that slot.

        `pitch` is the distance between neighbouring slots, m.
        """
        spread = {"pack.stiffness": self.stiffness, "pack.front": self.front}
        for key, value in spread.items():
            if value and key not in hammer.constants:
                raise InputError(
                    f"{hammer.path}: paper that varies",
                    file=hammer.path,
                    key=key,
                    expected=f"a hammer with {key}",
                )
        if not any(spread.values()):
            return (hammer,) * slots
        own = {key: hammer.constants[key].si for key, value in spread.items() if value}
        places = []
        for stiffness, front in self.deviations(slots, pitch).T.tolist():
            off = {
                "pack.stiffness": own.get("pack.stiffness", 0.0) * (1.0 + self.stiffness * stiffness),
                "pack.front": own.get("pack.front", 0.0) + self.front * front,
            }
            change: dict[str, Any] = {key: off[key] for key in own}
            places.append(hammer.replace(change, source="paper that varies along the line"))
        return tuple(places)


_LATER: Final = 5e-6  # Step by which a segment is extended while the armature is inside a pack, s; arbitrary


class PiecewiseMotion:
    """Motion simulated in segments, with the contacts, dots and energy of a `Motion`."""

    def __init__(self, hammer: Hammer, drive: Drive, pieces: Sequence[Motion]) -> None:
        self.hammer = hammer
        self.drive = drive
        self._pieces = pieces

    @property
    def status(self) -> str:
        """Simulation status of the last segment."""
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
    """Simulate, from rest, a drive on a hammer whose pack changes at each firing.

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
    """Merge the two records of a contact that extends over two segments of a simulation."""
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
