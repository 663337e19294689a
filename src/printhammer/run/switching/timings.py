"""Switching times of contacts: operate, release and bounce times, and contact forces.

The contacts are declared in the list ``[[contact]]``; the terms are defined in IEC 61810-1. A contact on the
front side of the armature is a make contact: it closes when the relay operates, and opens when the relay
releases. A contact on the back side is a break contact: it opens when the relay operates, and closes when the
relay releases. A contact bounces if it switches more than once; the bounce time is the time from the first to
the last of these switchings. Operate and release times end at the first switching: they exclude the bounce
time. A bistable (latching) relay keeps its state after switch-off, and is reset by a pulse of reversed sign;
its reset time begins at the switch-on of this pulse.

All times follow from `Motion.closings`. Weakness: contacts have no mass, so that only the rebound of the
armature makes them bounce, not the vibration of the contact spring.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final, Literal

import numpy as np

from printhammer.drive.trains import Drive, SineForce
from printhammer.drive.waveforms.shapes import Trapezoid, Waveform
from printhammer.parts.spring.terms import LinearContact
from printhammer.results import Declared, part, scalar
from printhammer.results.summary import FactRow, interval, quantity
from printhammer.run.contacts import Closing
from printhammer.run.problem import Problem, Record

_NOT_SEEN: Final = "None if the contact does not switch in the run"


class Timing(Declared):
    """Switching times and forces of a contact from one firing to the next, or to the end of the run."""

    contact: str = part("name of the contact")
    kind: Literal["make", "break"] = part("kind of the contact")
    firing: int = part("index of the firing, from 0")
    switched_on: float = scalar("s", "time of the firing, at which the drive is switched on")
    switched_off: float | None = scalar(
        "s",
        "time at which the drive is switched off",
        more="None if the next firing begins earlier",
    )
    operate_time: float | None = scalar(
        "s", "time from switch-on to the first switching", more=f"excludes the bounce; {_NOT_SEEN}"
    )
    operate_bounce: float | None = scalar("s", "bounce time after switch-on", more=_NOT_SEEN)
    release_time: float | None = scalar(
        "s", "time from switch-off to the first switching back", more=f"excludes the bounce; {_NOT_SEEN}"
    )
    release_bounce: float | None = scalar("s", "bounce time after switch-off", more=_NOT_SEEN)
    reset_time: float | None = scalar(
        "s",
        "time from the switch-on of a reversed pulse to the first switching back",
        more="None unless the pulse returns a latched contact to its state at rest",
    )
    reset_bounce: float | None = scalar("s", "bounce time of a reset", more="None without a reset time")
    largest_force: float = scalar("N", "largest contact force")
    final_force: float = scalar(
        "N", "contact force at switch-off (make contact) or at the end of the firing (break contact)"
    )


def off_after(waveform: Waveform) -> float:
    """Return the time from a firing to the switch-off of its drive, s; infinity for an endless drive.

    Switch-off is at the end of the width of a driver, at the start of the fall of a trapezoid, and at the end
    of a pulse without a width.
    """
    if isinstance(waveform, Trapezoid):
        return waveform.rise + waveform.width
    return float(getattr(waveform, "width", waveform.support))


def is_reversed(waveform: Waveform, first: Waveform) -> bool:
    """Whether two waveforms have opposite signs, each in the middle of its on-time."""
    middles = [0.5 * off_after(each) for each in (waveform, first)]
    if not all(map(math.isfinite, middles)):
        return False
    values = [float(each.value(middle)) for each, middle in zip((waveform, first), middles, strict=True)]
    return values[0] * values[1] < 0.0


def timings_of(problem: Problem, record: Record, closings: Sequence[Closing]) -> list[Timing]:
    """Return the switching times of all contacts, in the order of the hammer file, then of the firings.

    `closings` are all closings of the run, from `printhammer.run.contacts.closings_of`. A sinusoidal force,
    which is never switched, gives no switching times.
    """
    timings: list[Timing] = []
    if isinstance(problem.drive, SineForce):
        return timings
    for key, term in problem.hammer.terms.items():
        if isinstance(term, LinearContact):
            name = key.partition(".")[2]
            own = [each for each in closings if each.contact == name]
            for number, span in _firings(problem.drive, record):
                timings.append(_timing(name, term, number, span, own, problem, record))
    return timings


_Span = tuple[float, float, float, bool]
"""Times of switch-on, switch-off (may be infinite) and end of a firing, s, and whether it is reversed."""


def _firings(drive: Drive, record: Record) -> Iterator[tuple[int, _Span]]:
    """Yield index and span of each firing of a run; a reversed firing has the opposite sign of the first."""
    first, last = float(record.nodes[0, 0]), float(record.nodes[-1, 0])
    times = [float(time) for time in drive.times]
    fired = getattr(drive, "waveforms", None) or (drive.waveform,) * len(times)
    for number, (on, waveform) in enumerate(zip(times, fired, strict=True)):
        following = min(times[number + 1 : number + 2], default=math.inf)
        off = on + off_after(waveform)
        if first <= on < last:
            ends = off if off < following else math.inf
            yield number, (on, ends, min(following, last), is_reversed(waveform, fired[0]))


def _timing(
    name: str,
    contact: LinearContact,
    number: int,
    span: _Span,
    closings: Sequence[Closing],
    problem: Problem,
    record: Record,
) -> Timing:
    """Compute the switching times and forces of one contact after one firing.

    `number` is the index of the firing, and `span` describes the firing, see `_Span`; `closings` are the
    closings of the contact.
    """
    on, off, end, is_reset = span
    makes = contact.side == "front"
    closed = [each.t_in for each in closings if not each.initial]
    opened = [each.t_out for each in closings if each.t_out is not None]
    forth, back = (closed, opened) if makes else (opened, closed)
    forth = [time for time in forth if on <= time < end]
    # A short pulse may be over before the contact switches.
    released = [time for time in back if max(off, min(forth, default=math.inf)) <= time < end]
    operated = [time for time in forth if time < min(released, default=math.inf)]
    reset: list[float] = []
    if is_reset and makes == _is_closed(closings, on) and makes != _is_closed(closings, end):
        reset, operated, released = [time for time in back if on <= time < end], [], []
    x, v = problem.resample(record, np.array([min(off, end) if makes else end]))[0, :2]
    during = [each for each in closings if each.t_in < end and (each.t_out is None or each.t_out > on)]
    return Timing(
        contact=name,
        kind="make" if makes else "break",
        firing=number,
        switched_on=on,
        switched_off=off if math.isfinite(off) else None,
        operate_time=operated[0] - on if operated else None,
        operate_bounce=operated[-1] - operated[0] if operated else None,
        release_time=released[0] - off if released else None,
        release_bounce=released[-1] - released[0] if released else None,
        reset_time=reset[0] - on if reset else None,
        reset_bounce=reset[-1] - reset[0] if reset else None,
        largest_force=max((each.peak_force for each in during), default=0.0),
        final_force=float(contact.force(max(contact.sign * (x - contact.position), 0.0), contact.sign * v)),
    )


def _is_closed(closings: Sequence[Closing], time: float) -> bool:
    """Whether a contact is closed just before the time `time` [s]."""
    return any(
        (each.initial or each.t_in < time) and (each.t_out is None or each.t_out >= time) for each in closings
    )


def timing_facts(timings: Sequence[Timing], closings: Sequence[Closing], end: float) -> list[FactRow]:
    """Return the switching times of each contact, for the summary of a run that ends at `end` [s].

    Without switching times, the rows state the closings of each contact.
    """
    rows: list[FactRow] = []
    if not timings:
        for name in dict.fromkeys(each.contact for each in closings):
            mine = [each for each in closings if each.contact == name]
            count = f"{len(mine)} {'closing' if len(mine) == 1 else 'closings'}"
            most = quantity(max(each.peak_force for each in mine), "N")
            span = f"{count} from {quantity(mine[0].t_in, 's')}"
            rows.append((f"contact {name}", f"{span}, up to {most}{_lost(mine)}"))
    for name in dict.fromkeys(each.contact for each in timings):
        own = [each for each in timings if each.contact == name]
        forth, back = ("closes", "opens") if own[0].kind == "make" else ("opens", "closes")
        told = [_phrase(forth, "switch-on", [(each.operate_time, each.operate_bounce) for each in own])]
        is_latched = any(each.reset_time is not None for each in own)
        if not is_latched or any(each.release_time is not None for each in own):
            release = [(each.release_time, each.release_bounce) for each in own]
            told.append(_phrase(back, "switch-off", release))
        if is_latched:
            reset = [(each.reset_time, each.reset_bounce) for each in own]
            told.append(_phrase(back, "the switch-on of a reversed pulse", reset))
        largest = quantity(max(each.largest_force for each in own), "N")
        lost = _lost([each for each in closings if each.contact == name])
        rows.append((f"contact {name}", ", ".join([*told, f"up to {largest}{lost}"])))
    last = max((each.firing for each in timings), default=-1)
    held = [each for each in timings if each.firing == last and _is_held(each)]
    if held:
        names = " and ".join(each.contact for each in held)
        rows.append(
            ("release", f"not seen: the run ends at {quantity(end, 's')}, before the release of {names}")
        )
    return rows


def _lost(closings: Sequence[Closing]) -> str:
    """Describe the energy that a contact dissipated; return an empty string for an elastic contact."""
    loss = math.fsum(each.loss for each in closings)
    return f", dissipates {quantity(loss, 'J')}" if loss else ""


def _is_held(timing: Timing) -> bool:
    """Whether a contact has operated but not released by the end of a firing with a finite drive."""
    switched = timing.operate_time is not None and timing.release_time is None
    is_pressed = timing.final_force > 0.0
    return timing.switched_off is not None and switched and is_pressed == (timing.kind == "make")


def _phrase(verb: str, event: str, times: Sequence[tuple[float | None, float | None]]) -> str:
    """Describe when a contact first switches after an event, and for how long it bounces.

    `times` lists, for each firing, the time from the event to the first switching, and the bounce time, s.
    """
    known = [(time, bounce) for time, bounce in times if time is not None and bounce is not None]
    if not known:
        return f"never {verb} after {event}"
    first, bounce = np.array(known).T
    extent = quantity(first[0], "s") if first.size == 1 else interval(first, "s")
    more = f", bounces for {quantity(bounce.max(), 's')}" if bounce.any() else ""
    return f"{verb} {extent} after {event}{more}"
