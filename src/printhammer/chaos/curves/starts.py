"""Start of a bifurcation curve: an event of a branch in memory or in a file, or a point of a saved curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from printhammer.chaos.continuation.arclength import Stop
from printhammer.chaos.continuation.branch import KINDS as EVENTS
from printhammer.chaos.continuation.branch import Branch, BranchEvent
from printhammer.chaos.curves.systems import KINDS
from printhammer.errors import InputError
from printhammer.results import Reopened, reopen
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

FIRST: Final = "first"
LAST: Final = "last"
_ENDS: Final = {FIRST: 0, LAST: -1}  # Index of the end of a branch, by name of the end
_LIST: Final = ", ".join(KINDS)


@dataclass(frozen=True)
class Start:
    """Start of a curve: initial guess of a bifurcation, for Newton's method."""

    kind: str
    regime: Regime
    """Regime, with the phase of the section at which the state was computed."""
    first: str
    """Name of the parameter along which the bifurcation was found."""
    bounds: tuple[float, float]
    firings: int
    tolerance: float
    state: FloatArray
    value: float
    other: float | None = None
    """Value of the second parameter; None for the value of the regime."""


def start_of(
    source: Branch | Reopened | str | Path, event: BranchEvent | int | str | None, regime: Regime | None
) -> Start:
    """Determine the start of a bifurcation curve from a branch or a saved result.

    Parameters
    ----------
    source : Branch, Reopened or path
        A branch, or a file with a branch, branches or a curve.
    event : BranchEvent, int or str, optional
        An event object of the branch; the index of an event in the table, from 0; "first" or "last", for the
        grazing at that end of the branch; or a kind, for the first event of that kind. By default the first
        event that can be followed. For a curve: the index of a point, "first" or "last"; by default the first
        point.
    regime : Regime, optional
        For a file: the regime (hammer and periodic drive), which the file does not contain.

    Raises
    ------
    InputError
        The event does not exist, the file contains another kind of result, or the result belongs to another
        hammer.
    """
    if isinstance(source, Branch):
        if regime is not None:
            raise InputError("source = a branch", key="regime", expected="no regime in addition")
        return _of_branch(source, event)
    if not isinstance(source, Reopened | str | Path):
        raise InputError.of("source", source, "a branch of orbits, or a file with a branch or a curve")
    opened = source if isinstance(source, Reopened) else reopen(source)
    if regime is None:
        raise InputError(
            f"{opened.path}: expected a regime (hammer and drive) in addition to the file",
            file=opened.path,
            key="regime",
        )
    if isinstance(event, BranchEvent):
        raise InputError(
            f"{opened.path}: expected the index or kind of an event in addition to a file",
            file=opened.path,
            key="event",
        )
    return _of_file(opened, event, regime)


def _of_branch(branch: Branch, event: BranchEvent | int | str | None) -> Start:
    at = (branch.parameter, branch.bounds, branch.firings, branch.tolerance)
    if isinstance(event, str) and event in _ENDS:
        stop: Stop = branch.stops[_ENDS[event]]
        if stop.reason != "grazing":
            raise InputError(
                f"event = {event!r}: the branch does not end in a grazing there, {stop.sentence}",
                key="event",
                value=event,
            )
        regime = replace(branch.regime, phase=float(branch.phases[_ENDS[event]]))
        return Start("grazing", regime, *at, np.array(stop.state), stop.parameter)
    if isinstance(event, BranchEvent):
        if not any(event is own for own in branch.events):
            raise InputError.of("event", event.kind, "one of the events of the branch")
        chosen = event
    else:
        kinds = [own.kind for own in branch.events]
        chosen = branch.events[_number(kinds, [own.sharp for own in branch.events], event, "the branch")]
    regime = replace(branch.regime, phase=chosen.phase)
    return Start(chosen.kind, regime, *at, np.array(chosen.state), chosen.value)


def _number(kinds: Sequence[str], located: list[bool], event: int | str | None, whose: str) -> int:
    """Return the index of the event selected by `event`: an index, a kind, or None for the default.

    `kinds` are the kinds of all events of a branch; `located` tells which were located; `whose` names the
    branch in error messages. Raises InputError if no event matches.
    """
    known = ", ".join(dict.fromkeys(kinds)) or "none"
    if isinstance(event, int | np.integer):
        if not 0 <= event < len(kinds):
            raise InputError.of(
                "event", event, f"the number of one of {len(kinds)} events of {whose}", written=str(event)
            )
        if kinds[event] not in KINDS or not located[event]:
            why = "" if located[event] else " that was not located"
            raise InputError(
                f"event = {event} is a {kinds[event]}{why}",
                key="event",
                value=event,
                expected=f"a located one of {_LIST}",
            )
        return int(event)
    if event is not None and event not in KINDS:
        raise InputError.of("event", event, f"a number, first, last, or one of {_LIST}")
    for number, kind in enumerate(kinds):
        if located[number] and (kind == event or (event is None and kind in KINDS)):
            return number
    raise InputError(
        f"event = {event or _LIST}: no such event; the events of {whose} are: {known}",
        key="event",
        value=event or _LIST,
    )


def _of_file(opened: Reopened, event: int | str | None, regime: Regime) -> Start:
    dataset, notes = opened.dataset, opened.attributes
    known = notes.get("hammer_fingerprint")
    if known is not None and known != regime.hammer.fingerprint:
        raise InputError.of(
            "hammer_fingerprint",
            known[:12],
            f"that of {regime.hammer.name}, {regime.hammer.fingerprint[:12]}",
            file=opened.path,
            written=str(known[:12]),
        )
    if "names" in notes and "first" in dataset:
        return _of_curve(opened, event, regime)
    needed = ("event_kind", "event_value", "event_x", "event_v", "event_phase", "firings")
    if any(name not in dataset for name in needed) or "parameter" not in notes:
        raise InputError(
            f"{opened.path}: expected a branch or branches with their events, or a curve",
            file=opened.path,
            key="branch",
        )
    if "branch" in dataset["event_kind"].dims:
        # If the file has several branches, events are selected from the first branch only.
        dataset = dataset.isel(branch=0)
    kinds = [EVENTS[code] if code >= 0 else "" for code in dataset["event_kind"].values]
    located = [bool(value == 1) for value in dataset["event_located"].values]
    common = (
        str(notes["parameter"]),
        _pair(notes["bounds"]),
        int(dataset["firings"]),
        _tolerance(notes),
    )
    if isinstance(event, str) and event in _ENDS:
        if "graz" not in str(notes.get(f"{event}_end", "")):
            raise InputError.of("event", event, "an end in a grazing of a single branch", file=opened.path)
        row = dataset.isel(orbit=_ENDS[event], firing=0)
        there = replace(regime, phase=float(row["orbit_phase"]))
        state = np.array([row["x"], row["v"]], dtype=np.float64)
        return Start("grazing", there, *common, state, float(row["value"]))
    number = _number(kinds, located, event, str(opened.path))
    row = dataset.isel(event=number)
    state = np.array([row["event_x"], row["event_v"]], dtype=np.float64)
    there = replace(regime, phase=float(row["event_phase"]))
    return Start(kinds[number], there, *common, state, float(row["event_value"]))


def _of_curve(opened: Reopened, point: int | str | None, regime: Regime) -> Start:
    dataset, notes = opened.dataset, opened.attributes
    # In a table each row is a point.
    (along,) = dataset["first"].dims
    count = dataset.sizes[along]
    number: Any = _ENDS.get(point, point) if isinstance(point, str) else point or 0
    if not isinstance(number, int | np.integer) or not -1 <= number < count:
        raise InputError.of("event", point, f"a point of the curve from 0 to {count - 1}", file=opened.path)
    row = dataset.isel({along: int(number)})
    names, bounds = notes["names"], notes["bounds"]
    return Start(
        str(notes["kind"]),
        replace(regime, phase=float(row["phase"])),
        str(names[0]),
        _pair(bounds[0]),
        int(notes["firings"]),
        _tolerance(notes),
        np.array([row["x"], row["v"]], dtype=np.float64),
        float(row["first"]),
        float(row["second"]),
    )


def _pair(bounds: Any) -> tuple[float, float]:
    low, high = bounds
    return float(low), float(high)


def _tolerance(notes: dict[str, Any]) -> float:
    return float(notes["tolerance"])
