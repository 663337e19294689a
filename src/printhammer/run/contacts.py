"""Contacts and dots of a run, and tables of the dots of an ensemble."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from printhammer.drive.batch import Ragged
from printhammer.kernel.model import dots as layout
from printhammer.kernel.model.dots import DOT, NO_DOT, contact_number, firing_before
from printhammer.kernel.model.modes import BACKSTOP_SURFACE, PACK_SURFACE
from printhammer.results import Declared, Result, column, part, scalar
from printhammer.run.problem import Problem, Record
from printhammer.support.arrays import BoolArray, FloatArray, IntArray


class Contact(Declared):
    """One contact of the armature with pack or backstop, from touch to departure."""

    surface: Literal["pack", "backstop"] = part("touched surface")
    t_in: float = scalar("s", "time of touch", more="start of the run if the contact was open then")
    v_in: float = scalar("m/s", "velocity at touch", more="likewise")
    t_out: float | None = scalar("s", "time of leaving", more="None while the contact is open")
    v_out: float | None = scalar("m/s", "velocity at leaving", more="None while the contact is open")
    t_peak: float = scalar("s", "time of the largest indentation or compression")
    depth: float = scalar("m", "largest indentation or compression")
    peak_force: float | None = scalar(
        "N", "largest contact force", more="None on a rigid backstop, where it is not finite"
    )
    loss: float = scalar(
        "J",
        "energy of the armature that the contact dissipated",
        more="minus the work of the whole pack force, or of the viscous force of the backstop; of an open"
        " pack contact: so far, what it stores included",
    )
    firing: int | None = part("index of the latest firing at or before the touch")
    extra: bool = part("whether the contact is a pack contact after the first one of its firing")
    initial: bool = part("whether the contact was open at the start of the run")


class Dot(Declared):
    """Dot that one firing makes on the paper.

    The first pack contact after a firing makes its dot, see `printhammer.kernel.model.dots`; a firing without
    one is a lost dot.
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
        "s", "time from touch to leaving", more="None also while the contact is open", default=None
    )
    loading_work: float | None = scalar(
        "J", "work done on the pack up to its largest indentation", default=None
    )
    net_loss: float | None = scalar("J", "energy dissipated in the pack", default=None)
    extra_contacts: int = part("further pack contacts before the next firing", default=0)


class _Numbers:
    """Counter that numbers the pack contacts of each firing."""

    def __init__(self) -> None:
        self._counts: dict[int, int] = {}

    def count(self, surface: int, initial: bool, fired: int) -> int:
        """Return the index of a contact among the pack contacts of its firing, and increment the counter."""
        number = contact_number(surface, initial, fired, self._counts.get(fired, 0))
        if number != NO_DOT:
            self._counts[fired] = number + 1
        return number


def contact_numbers(contacts: Sequence[Contact]) -> list[int]:
    """Return the index of each contact among the pack contacts of its firing; index `DOT` makes the dot."""
    numbers = _Numbers()
    return [
        numbers.count(
            PACK_SURFACE if contact.surface == "pack" else BACKSTOP_SURFACE,
            contact.initial,
            -1 if contact.firing is None else contact.firing,
        )
        for contact in contacts
    ]


def step_range(record: Record, row: int) -> tuple[int, int]:
    """Return the range of integration steps within a contact: the first, and one past the last."""
    first = int(record.contacts[row, 5])
    t_out = record.contacts[row, 3]
    last = len(record.nodes) - 1
    if math.isfinite(t_out):
        last = min(last, int(np.searchsorted(record.nodes[:, 0], t_out, side="left")))
    if record.contacts[row, 3] == record.contacts[row, 1]:
        # An impact on a rigid backstop is a step of zero duration between two nodes.
        last = min(first + 1, len(record.nodes) - 1)
    return first, last


def touches_of(record: Record) -> list[tuple[Literal["pack", "backstop"], float]]:
    """Return surface and time, s, of every touch in a run; contacts open at the start are excluded."""
    return [
        ("pack" if int(row[0]) == PACK_SURFACE else "backstop", float(row[1]))
        for row in record.contacts
        if not row[6]
    ]


def contacts_of(problem: Problem, record: Record, increments: FloatArray, rigid: bool) -> list[Contact]:
    """Build the contacts of a run from the kernel's record, with peak forces and energy losses.

    `increments` is the result of `printhammer.run.energy.increments_of`; `rigid` states whether the backstop
    is rigid.
    """
    if len(record.contacts) == 0:
        return []
    peaks = problem.peaks(record)
    times = problem.firings
    contacts: list[Contact] = []
    numbers = _Numbers()
    for row, (surface, t_in, v_in, t_out, v_out, _node, initial) in enumerate(record.contacts):
        is_pack = int(surface) == PACK_SURFACE
        first, last = step_range(record, row)
        fired = firing_before(t_in, times)
        number = numbers.count(int(surface), bool(initial), fired)
        hard = rigid and not is_pack
        contacts.append(
            Contact(
                surface="pack" if is_pack else "backstop",
                t_in=float(t_in),
                v_in=float(v_in),
                t_out=None if math.isnan(t_out) else float(t_out),
                v_out=None if math.isnan(t_out) else float(v_out),
                t_peak=float(t_in if hard else peaks[row, 0]),
                depth=0.0 if hard else float(peaks[row, 1]),
                peak_force=None if hard else float(peaks[row, 2]),
                loss=float(increments[first:last, 2 if is_pack else 3].sum()),
                firing=fired if fired >= 0 else None,
                extra=number > DOT,
                initial=bool(initial),
            )
        )
    return contacts


def loading_works(
    problem: Problem, record: Record, contacts: Sequence[Contact], increments: FloatArray
) -> FloatArray:
    """Return the work done on the pack up to the peak of each contact, J; 0 for the backstop."""
    result = np.zeros(len(contacts))
    rows, steps, starts, ends = [], [], [], []
    for row, contact in enumerate(contacts):
        if contact.surface != "pack":
            continue
        first, last = step_range(record, row)
        step = int(np.searchsorted(record.nodes[:, 0], contact.t_peak, side="right")) - 1
        step = min(max(step, first), last)
        result[row] = increments[first:step, 2].sum()
        if step < last and contact.t_peak > record.nodes[step, 0]:
            rows.append(row)
            steps.append(step)
            starts.append(record.nodes[step, 0])
            ends.append(contact.t_peak)
    if rows:
        rest = problem.quadratures(record, np.array(steps), np.array(starts), np.array(ends))
        for row, work in zip(rows, rest[:, 2], strict=True):
            result[row] += work
    return result


def dots_of(times: FloatArray, contacts: Sequence[Contact], works: FloatArray, t_end: float) -> list[Dot]:
    """Return the dots of all firings up to `t_end`, s, lost dots included."""
    owned: dict[int, list[int]] = {}
    for row, (contact, number) in enumerate(zip(contacts, contact_numbers(contacts), strict=True)):
        if number != NO_DOT and contact.firing is not None:
            owned.setdefault(contact.firing, []).append(row)
    dots: list[Dot] = []
    for index, fired_at in enumerate(times):
        if fired_at > t_end:
            break
        rows = owned.get(index, [])
        if not rows:
            dots.append(Dot(index, float(fired_at), struck=False))
            continue
        contact = contacts[rows[0]]
        dots.append(
            Dot(
                index=index,
                fired_at=float(fired_at),
                struck=True,
                flight_time=contact.t_in - float(fired_at),
                impact_speed=contact.v_in,
                peak_force=contact.peak_force,
                indentation=contact.depth,
                contact_time=None if contact.t_out is None else contact.t_out - contact.t_in,
                loading_work=float(works[rows[0]]),
                net_loss=contact.loss,
                extra_contacts=len(rows) - 1,
            )
        )
    return dots


_FIRINGS: Final = "member firing"


class DotTable(Result):
    """Dots of all ensemble members, one row per member, padded with NaN to the largest number of firings."""

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
        "s", "time from touch to leaving", _FIRINGS, more="NaN also while the contact is open"
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
