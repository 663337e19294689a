"""Contacts and dots: what the armature touched, and what each firing did."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from printhammer.kernel.model.modes import PACK_SURFACE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.run.problem import Problem, Record
    from printhammer.support.arrays import FloatArray


@dataclass(frozen=True)
class Contact:
    """One touch of the pack or the backstop.

    Attributes
    ----------
    surface : str
        "pack" or "backstop".
    t_in, v_in : float
        Time, s, and velocity, m/s, at touch; of the start of the run where it was open already.
    t_out, v_out : float or None
        Time, s, and velocity, m/s, at leaving; None while it is open.
    t_peak, depth : float
        Time, s, and amount, m, of the largest indentation or compression.
    peak_force : float or None
        Largest contact force, N; None on a rigid backstop, where it is not finite.
    loss : float
        Energy that the contact took from the armature for good, J: minus the work of the whole pack force,
        or of the viscous force of the backstop. Of an open pack contact: so far, what it stores included.
    firing : int or None
        Number of the latest firing at or before the touch.
    extra : bool
        A pack contact that is not the first one after its firing.
    initial : bool
        Whether it was open at the start of the run.
    """

    surface: Literal["pack", "backstop"]
    t_in: float
    v_in: float
    t_out: float | None
    v_out: float | None
    t_peak: float
    depth: float
    peak_force: float | None
    loss: float
    firing: int | None
    extra: bool
    initial: bool


@dataclass(frozen=True)
class Dot:
    """What one firing did on the paper.

    A pack contact belongs to the latest firing at or before its touch. The first one in an interval makes
    the dot, later ones are extra contacts, one already open at a firing belongs to the dot before. A firing
    without a first one is a lost dot.

    Attributes
    ----------
    index : int
        Number of the firing, from 0.
    fired_at : float
        Time of the firing, s.
    struck : bool
        False for a lost dot; all that follows is then None, but for the number of extra contacts, 0.
    flight_time : float or None
        From firing to touch, s.
    impact_speed : float or None
        At touch, m/s.
    peak_force : float or None
        Largest pack force, N.
    indentation : float or None
        Largest indentation, m.
    contact_time : float or None
        From touch to leaving, s; None also while the contact is open.
    loading_work : float or None
        Work done on the pack up to its largest indentation, J.
    net_loss : float or None
        Energy that the pack kept, J.
    extra_contacts : int
        Further pack contacts before the next firing.
    """

    index: int
    fired_at: float
    struck: bool
    flight_time: float | None = None
    impact_speed: float | None = None
    peak_force: float | None = None
    indentation: float | None = None
    contact_time: float | None = None
    loading_work: float | None = None
    net_loss: float | None = None
    extra_contacts: int = 0


def step_range(record: Record, row: int) -> tuple[int, int]:
    """Return the first step of a contact and the one after its last."""
    first = int(record.contacts[row, 5])
    t_out = record.contacts[row, 3]
    last = len(record.nodes) - 1
    if math.isfinite(t_out):
        last = min(last, int(np.searchsorted(record.nodes[:, 0], t_out, side="left")))
    if record.contacts[row, 3] == record.contacts[row, 1]:
        # An impact on a rigid backstop: the step of no duration between its two nodes.
        last = min(first + 1, len(record.nodes) - 1)
    return first, last


def touches_of(record: Record) -> list[tuple[Literal["pack", "backstop"], float]]:
    """Return surface and time, s, of every touch of a run; contacts open at its start have none."""
    return [
        ("pack" if int(row[0]) == PACK_SURFACE else "backstop", float(row[1]))
        for row in record.contacts
        if not row[6]
    ]


def contacts_of(problem: Problem, record: Record, increments: FloatArray, rigid: bool) -> list[Contact]:
    """Put the recorded contacts together with their peaks and losses.

    Parameters
    ----------
    problem, record
        The run.
    increments : array, shape (steps, 4)
        Integrals of power over all steps [J].
    rigid : bool
        Whether the backstop is rigid.
    """
    if len(record.contacts) == 0:
        return []
    peaks = problem.peaks(record)
    times = problem.firings
    contacts: list[Contact] = []
    dotted: set[int] = set()
    for row, (surface, t_in, v_in, t_out, v_out, _node, initial) in enumerate(record.contacts):
        is_pack = int(surface) == PACK_SURFACE
        first, last = step_range(record, row)
        fired = int(np.searchsorted(times, t_in, side="right")) - 1
        extra = False
        if is_pack and not initial and fired >= 0:
            extra = fired in dotted
            dotted.add(fired)
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
                extra=extra,
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
    """Assign pack contacts to firings by the rule of `Dot`; firings after `t_end`, s, are left out."""
    owned: dict[int, list[int]] = {}
    for row, contact in enumerate(contacts):
        if contact.surface == "pack" and not contact.initial and contact.firing is not None:
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
