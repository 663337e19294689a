"""Contacts, closings, sticking phases and dots of a run, and tables of the dots of an ensemble."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np

from printhammer.drive.batch import Ragged
from printhammer.kernel.model import dots as layout
from printhammer.kernel.model.dots import DOT
from printhammer.kernel.model.modes import HELD, HELD_FREE, PACK_SURFACE
from printhammer.kernel.readout import contacts as readout
from printhammer.kernel.readout.sums import PARTIALS
from printhammer.parts.spring.terms import LinearContact
from printhammer.results import Declared, Result, column, part, scalar
from printhammer.results.declare import columns_of
from printhammer.run.problem import Problem, Record
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

_BISECTIONS: Final = 52  # Number of bisections: the bits of a double's mantissa
_POINTS: Final = 8  # Points per step, for the quadrature as in the energy ledger
_ZOOMS: Final = 12  # Refinements of the time of the largest force, each by a factor of 3.5; arbitrary


class Contact(Declared):
    """One contact of the armature with pack or backstop, from touch to departure."""

    surface: Literal["pack", "backstop"] = part("touched surface")
    t_in: float = scalar("s", "time of touch", more="start of the run if the contact was open then")
    v_in: float = scalar(
        "m/s", "velocity at touch", more="at the start of the run if the contact was open then"
    )
    t_out: float | None = scalar("s", "time of departure", more="None while the contact is open")
    v_out: float | None = scalar("m/s", "velocity at departure", more="None while the contact is open")
    t_peak: float = scalar("s", "time of the largest indentation or compression")
    depth: float = scalar("m", "largest indentation or compression")
    peak_force: float | None = scalar(
        "N", "largest contact force", more="None on a rigid backstop, where it is not finite"
    )
    loss: float = scalar(
        "J",
        "energy of the armature that the contact dissipated",
        more="minus the work of the whole pack force, or of the viscous force of the backstop; for a"
        " pack contact still open at the end of the run, up to then, stored energy included",
    )
    firing: int | None = part("index of the latest firing at or before the touch")
    extra: bool = part("whether the contact is a pack contact after the first pack contact of its firing")
    initial: bool = part("whether the contact was open at the start of the run")


class Dot(Declared):
    """Dot of one firing: its first pack contact; see `printhammer.kernel.model.dots`.

    A firing without a pack contact is a lost dot.
    """

    index: int = part("index of the firing, from 0")
    fired_at: float = scalar("s", "time of the firing")
    struck: bool = part(
        "whether the firing made a dot",
        more="for a lost dot the fields that follow are None, and `extra_contacts` is 0",
    )
    flight_time: float | None = scalar("s", "time from firing to touch", default=None)
    impact_speed: float | None = scalar("m/s", "velocity at touch", default=None)
    peak_force: float | None = scalar("N", "largest pack force", default=None)
    indentation: float | None = scalar("m", "largest indentation", default=None)
    contact_time: float | None = scalar(
        "s", "time from touch to departure", more="None also while the contact is open", default=None
    )
    loading_work: float | None = scalar(
        "J", "work done on the pack up to its largest indentation", default=None
    )
    net_loss: float | None = scalar("J", "energy dissipated in the pack", default=None)
    extra_contacts: int = part("further pack contacts before the next firing", default=0)


def touches_of(record: Record) -> list[tuple[Literal["pack", "backstop"], float]]:
    """Return surface and time [s] of every touch in a run; contacts open at the start are excluded."""
    return [
        ("pack" if int(row[0]) == PACK_SURFACE else "backstop", float(row[1]))
        for row in record.contacts
        if not row[6]
    ]


def contact_rows(problem: Problem, record: Record, increments: FloatArray, rigid: bool) -> FloatArray:
    """Compute the contacts of a run, one row each; see `printhammer.kernel.readout.contacts`.

    `increments` is the result of `printhammer.run.energy.increments_of`; `rigid` states whether the backstop
    is rigid.
    """
    rows = np.empty((len(record.contacts), readout.CONTACT_WIDTH))
    if len(rows):
        readout.write_contacts(
            record.contacts,
            record.nodes,
            problem.peaks(record),
            increments,
            problem.firings,
            rigid,
            np.empty(PARTIALS),
            rows,
        )
    return rows


def contacts_of(rows: FloatArray) -> list[Contact]:
    """Build the contacts of a run from the rows of `contact_rows`."""
    contacts: list[Contact] = []
    for row in rows.tolist():
        t_out, peak_force, firing = row[readout.TIME_OUT], row[readout.FORCE], int(row[readout.FIRING])
        is_open = math.isnan(t_out)
        contacts.append(
            Contact(
                surface="pack" if row[readout.SURFACE] == PACK_SURFACE else "backstop",
                t_in=row[readout.TIME_IN],
                v_in=row[readout.SPEED_IN],
                t_out=None if is_open else t_out,
                v_out=None if is_open else row[readout.SPEED_OUT],
                t_peak=row[readout.PEAK_TIME],
                depth=row[readout.DEPTH],
                peak_force=None if math.isnan(peak_force) else peak_force,
                loss=row[readout.LOSS],
                firing=firing if firing >= 0 else None,
                extra=row[readout.NUMBER] > DOT,
                initial=row[readout.INITIAL] != 0.0,
            )
        )
    return contacts


def dots_of(problem: Problem, record: Record, rows: FloatArray, increments: FloatArray) -> list[Dot]:
    """Build the dots of all firings of a run, lost dots included, from the rows of `contact_rows`.

    `increments` is the result of `printhammer.run.energy.increments_of`.
    """
    count = len(rows)
    works, starts, ends = np.zeros((3, count))
    steps = np.zeros(count, np.int64)
    readout.write_loading(rows, record.nodes, increments, np.empty(PARTIALS), works, steps, starts, ends)
    rests = problem.quadratures(record, steps, starts, ends)
    table = np.empty((problem.firings.size, readout.DOT_WIDTH))
    end = float(record.nodes[-1, 0])
    fired = readout.write_dots(problem.firings, end, rows, works, rests, table)
    return [_dot_of(index, row) for index, row in enumerate(table[:fired].tolist())]


_KNOWN: Final = (
    "flight_time",
    "impact_speed",
    "peak_force",
    "indentation",
    "contact_time",
    "loading_work",
    "net_loss",
)
"""Fields of a printed dot, in the order of the columns of `printhammer.kernel.readout.contacts`."""


def _dot_of(index: int, row: list[float]) -> Dot:
    if not row[readout.STRUCK]:
        return Dot(index, row[readout.FIRED_AT], struck=False)
    columns = range(readout.FLIGHT_TIME, readout.EXTRA_CONTACTS)
    known = (None if math.isnan(row[column]) else row[column] for column in columns)
    values: dict[str, Any] = dict(zip(_KNOWN, known, strict=True))
    extra = int(row[readout.EXTRA_CONTACTS])
    return Dot(index, row[readout.FIRED_AT], struck=True, **values, extra_contacts=extra)


_FIRINGS: Final = "member firing"


class DotTable(Result):
    """Dots of all ensemble members, one row per member, padded with NaN to equal length."""

    fired: BoolArray = column(
        "1", "whether the member has this firing, and the run reached its time", _FIRINGS
    )
    fired_at: FloatArray = column("s", "time of the firing", _FIRINGS)
    struck: BoolArray = column("1", "whether the firing made a dot", _FIRINGS)
    flight_time: FloatArray = column("s", "time from firing to touch", _FIRINGS)
    impact_speed: FloatArray = column("m/s", "velocity at touch", _FIRINGS)
    peak_force: FloatArray = column("N", "largest pack force", _FIRINGS)
    indentation: FloatArray = column("m", "largest indentation", _FIRINGS)
    contact_time: FloatArray = column(
        "s", "time from touch to departure", _FIRINGS, more="NaN also while the contact is open"
    )
    extra_contacts: IntArray = column("1", "further pack contacts before the next firing", _FIRINGS)

    @classmethod
    def from_rows(cls, rows: FloatArray, fired_at: FloatArray, reached: FloatArray) -> DotTable:
        """Build the table from the dot rows of the kernel, shape (members, firings, columns).

        Parameters
        ----------
        rows : array
            Rows of `printhammer.kernel.model.dots`; NaN for missing firings.
        fired_at : array, shape (members, firings)
            Times of the firings, s.
        reached : array, shape (members,)
            Times at which the runs ended, s.
        """
        contacts = np.nan_to_num(rows[:, :, layout.CONTACTS]).astype(np.int64)
        touch = rows[:, :, layout.TIME_IN]
        return cls(
            fired=fired_at <= reached[:, np.newaxis],
            fired_at=fired_at,
            struck=contacts > 0,
            flight_time=touch - fired_at,
            impact_speed=rows[:, :, layout.SPEED_IN],
            peak_force=rows[:, :, layout.FORCE],
            indentation=rows[:, :, layout.DEPTH],
            contact_time=rows[:, :, layout.TIME_OUT] - touch,
            extra_contacts=np.maximum(contacts - 1, 0),
        )


class ExtraDots(Result):
    """Extra pack contacts of all ensemble members, ordered by member, firing and time."""

    member: IntArray = column("1", "index of the member", "extra")
    firing: IntArray = column("1", "index of the firing of that member", "extra")
    touch: FloatArray = column("s", "time of touch", "extra")
    peak_force: FloatArray = column("N", "largest pack force", "extra")

    @classmethod
    def from_rows(cls, groups: Sequence[tuple[IntArray, Ragged]]) -> ExtraDots:
        """Concatenate the extra pack contacts of groups of ensemble members.

        A group is a pair: indices of its members, and the kernel's dot rows of each member.
        """
        member = np.concatenate(
            [np.zeros(0, np.int64), *(np.repeat(own, rows.counts) for own, rows in groups)]
        )
        every = np.concatenate([np.zeros((0, layout.DOT_WIDTH)), *(rows.values for _own, rows in groups)])
        # The rows of a member are ordered by time, hence by firing.
        order = np.argsort(member, kind="stable")
        every = every[order]
        return cls(
            member=member[order],
            firing=every[:, layout.FIRING].astype(np.int64),
            touch=every[:, layout.TIME_IN],
            peak_force=every[:, layout.FORCE],
        )


class Closing(Declared):
    """Interval during which a contact of the list ``[[contact]]`` is closed."""

    contact: str = part("name of the contact")
    t_in: float = scalar("s", "time of closing", more="start of the run if the contact was closed then")
    v_in: float = scalar(
        "m/s", "velocity at closing", more="at the start of the run if the contact was closed then"
    )
    t_out: float | None = scalar("s", "time of opening", more="None while the contact is closed")
    v_out: float | None = scalar("m/s", "velocity at opening", more="None while the contact is closed")
    depth: float = scalar("m", "largest indentation")
    peak_force: float = scalar("N", "largest contact force")
    loss: float = scalar("J", "energy of the armature that the contact dissipated")
    initial: bool = part("whether the contact was closed at the start of the run")


class Stick(Declared):
    """Interval during which dry friction holds the armature at rest."""

    t_in: float = scalar("s", "time of the stop", more="start of the run if the armature was held then")
    t_out: float | None = scalar("s", "time of release", more="None while the armature is held")
    x: float = scalar("m", "displacement")
    initial: bool = part("whether the armature was held at the start of the run")


def sticks_of(record: Record) -> list[Stick]:
    """Return the sticking phases of a run under dry friction, in order of time."""
    nodes = record.nodes
    held = (nodes[:, 3] > HELD) & (nodes[:, 3] <= HELD_FREE)
    # The last node has no step; it ends a phase only if the armature is released there.
    held[-1] = len(held) > 1 and held[-2]
    changes = np.flatnonzero(np.diff(held)) + 1
    sticks = []
    for first, last in pairwise([0, *changes.tolist(), len(held)]):
        if held[first]:
            t_out = float(nodes[last, 0]) if last < len(held) else None
            sticks.append(
                Stick(t_in=float(nodes[first, 0]), t_out=t_out, x=float(nodes[first, 1]), initial=first == 0)
            )
    return sticks


def extrema(problem: Problem, record: Record, sign: float) -> tuple[FloatArray, FloatArray]:
    """Locate all local maxima of `sign` * displacement; return their times [s] and displacements [m]."""
    nodes = record.nodes
    before, after = sign * nodes[:-1, 2], sign * nodes[1:, 2]
    # The two nodes of an impact on a rigid surface, at the same time, are an extremum, too.
    rows = np.flatnonzero((before > 0.0) & (after <= 0.0))
    low, high = nodes[rows, 0].copy(), nodes[rows + 1, 0].copy()
    for _ in range(_BISECTIONS if len(rows) else 0):
        middle = 0.5 * (low + high)
        rising = sign * problem.resample(record, middle)[:, 1] > 0.0
        low = np.where(rising, middle, low)
        high = np.where(rising, high, middle)
    times = np.where(after[rows] == 0.0, nodes[rows + 1, 0], high)
    return times, problem.resample(record, times)[:, 0] if len(rows) else times


def closings_of(problem: Problem, record: Record) -> list[Closing]:
    """Return the closings of all contacts of the list ``[[contact]]``, in order of time."""
    closings: list[Closing] = []
    for key, term in problem.hammer.terms.items():
        if isinstance(term, LinearContact):
            closings += _closings(key.partition(".")[2], term, problem, record)
    return sorted(closings, key=lambda closing: closing.t_in)


def _closings(name: str, contact: LinearContact, problem: Problem, record: Record) -> list[Closing]:
    """Return the closings of one contact, in order of time."""
    nodes = record.nodes
    sign = contact.sign
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
        # At an impact on a rigid surface, the displacement has its maximum at a node, without v = 0.
        depth = float(max([inside[first : last + 1].max(), *depths.tolist()]))
        is_open = last < len(closed)
        force, loss = contact.force(depth), 0.0
        if contact.damping is not None:
            force, loss = _force_and_loss(contact, problem, record, nodes[first : last + 1, 0])
        closings.append(
            Closing(
                contact=name,
                t_in=float(t_in),
                v_in=float(nodes[first, 2]),
                t_out=float(t_out) if is_open else None,
                v_out=float(nodes[last, 2]) if is_open else None,
                depth=depth,
                peak_force=float(force),
                loss=loss,
                initial=first == 0,
            )
        )
    return closings


def _force_and_loss(
    contact: LinearContact, problem: Problem, record: Record, times: FloatArray
) -> tuple[float, float]:
    """Return the largest contact force [N] and the dissipated energy [J] of a closing.

    `times` are the times [s] of the integration nodes from the start to the end of the closing.
    """
    starts, lengths = times[:-1, np.newaxis], np.diff(times)[:, np.newaxis]
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    places, shares = np.tile(0.5 * (points + 1.0), (len(starts), 1)), np.tile(0.5 * weights, (len(starts), 1))
    # At the touch and at the opening, the power is a fractional power of the time: integrate over its root.
    shares[0], places[0] = 2.0 * places[0] * shares[0], places[0] ** 2
    if len(starts) > 1:
        shares[-1], places[-1] = 2.0 * places[-1] * shares[-1], 1.0 - places[-1] ** 2

    def motion(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the indentation [m] of the contact and its time derivative [m/s] at given times [s]."""
        states = problem.resample(record, at)
        return np.maximum(contact.sign * (states[:, 0] - contact.position), 0.0), contact.sign * states[:, 1]

    depths, rates = motion((starts + lengths * places).ravel())
    powers = ((contact.force(depths, rates) - contact.force(depths)) * rates).reshape(-1, _POINTS)
    grid = np.append((starts + lengths * np.linspace(0.0, 1.0, _POINTS, endpoint=False)).ravel(), times[-1])
    for _ in range(_ZOOMS):
        sampled = contact.force(*motion(grid))
        best = int(np.argmax(sampled))
        grid = np.linspace(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)], _POINTS)
    return float(sampled[best]), float(np.sum(powers * shares * lengths))


def _closed_steps(inside: FloatArray, inward: FloatArray) -> BoolArray:
    """Return a mask of the integration steps during which a contact is closed.

    `inside` is the indentation [m] and `inward` the velocity [m/s] into the contact at the nodes. No step
    crosses the position of the contact. In a step that begins and ends at this position, the contact is
    closed if the initial velocity points inward.
    """
    first, last = inside[:-1], inside[1:]
    there = (first == 0.0) & (last == 0.0)
    return np.asarray((first > 0.0) | (last > 0.0) | (there & (inward[:-1] > 0.0)))


def named(row: Dot | Contact) -> dict[str, Any]:
    """Return a dot or contact as a dictionary whose keys contain the units, such as "flight_time_s"."""
    units = {name: note.unit for name, note in columns_of(type(row)).items()}
    return {
        f"{key}_{units[key].replace('/', '_per_')}" if units[key] else key: value
        for key, value in asdict(row).items()
    }
