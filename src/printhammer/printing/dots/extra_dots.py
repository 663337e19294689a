"""Extra contacts in full: when each of them touches, and how hard.

The table of dots only counts them. An extra contact is the first one of a run that begins where the contact
before it ends, so it is had by starting there: once for all first extra contacts of a page, once for all
second ones, and so on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Final, NamedTuple

import numpy as np

from printhammer.drive.trains import Drive
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, column
from printhammer.run.ensemble import DotTable, Ensemble
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

MOST: Final = 20
"""Extra contacts of one firing that are looked at; what a hammer that chatters on the pack adds is next to
nothing."""

_AFTER: Final = 1e-9
"""Time after the end of a contact, s, at which the next run begins: outside the pack, and before all else."""


class ExtraDots(Declared):
    """Extra contacts."""

    member: IntArray = column("1", "to which member they belong", "extra")
    firing: IntArray = column("1", "to which firing of it", "extra")
    touch: FloatArray = column("s", "time of touch", "extra")
    peak_force: FloatArray = column("N", "largest pack force", "extra")


def extra_dots(
    hammer: Hammer,
    drives: Sequence[Drive],
    ends: FloatArray,
    dots: DotTable,
    *,
    tolerance: float,
    threads: int | None = None,
) -> ExtraDots:
    """Find the extra contacts of an ensemble that started from rest, by what its firings did.

    There are at most `MOST` of a firing, in the order of members, firings and times; `ends` are in s.
    """
    assert hammer.front is not None
    member, firing = np.nonzero(dots.extra_contacts > 0)
    begin = _leaving(dots, member, firing)
    known = np.isfinite(begin)
    member, firing, begin = member[known], firing[known], begin[known]
    rounds: list[ExtraDots] = []
    if not member.size:
        return _joined(rounds)
    involved, row = np.unique(member, return_inverse=True)
    whole = Ensemble(hammer, [drives[k] for k in involved.tolist()], ends[involved], tolerance=tolerance)
    state = _states(whole, [begin[row == number] for number in range(involved.size)], threads)
    # Up to the next firing, or the end of the run.
    end = [
        float(drives[k].times[shot + 1] if shot + 1 < drives[k].times.size else ends[k])
        for k, shot in zip(member.tolist(), firing.tolist(), strict=True)
    ]
    some = _Windows(member, firing, begin, np.array(end), state)

    def run(windows: _Windows) -> Ensemble:
        return Ensemble(
            hammer,
            [drives[member] for member in windows.member.tolist()],
            windows.end,
            states=windows.state,
            starts=windows.begin,
            tolerance=tolerance,
        )

    for _ in range(MOST):
        # A pack that does not pull lets go of an armature that is still in it, where no run can begin.
        some = some.where((some.begin < some.end) & (some.state[:, 0] <= hammer.front))
        if not some.member.size:
            break
        table = run(some).run(dots=True, threads=threads).dots
        assert table is not None
        here = np.arange(some.member.size), some.firing
        struck = table.struck[here]
        rounds.append(
            ExtraDots(
                some.member[struck],
                some.firing[struck],
                (table.fired_at + table.flight_time)[here][struck],
                table.peak_force[here][struck],
            )
        )
        after = _leaving(table, *here)
        more = struck & (table.extra_contacts[here] > 0) & np.isfinite(after)
        some, after = some.where(more), after[more]
        if some.member.size:
            state = _states(run(some), [np.array([moment]) for moment in after], threads)
            some = some._replace(begin=after, state=state)
    return _joined(rounds)


class _Windows(NamedTuple):
    """Runs from the end of a contact to the next firing, each in the member and after the firing given."""

    member: IntArray
    firing: IntArray
    begin: FloatArray
    end: FloatArray
    state: FloatArray

    def where(self, kept: BoolArray) -> _Windows:
        """Return some of the windows."""
        member, firing, begin, end, state = self
        return _Windows(member[kept], firing[kept], begin[kept], end[kept], state[kept])


def _joined(parts: Sequence[ExtraDots]) -> ExtraDots:
    """Return contacts found round by round, in the order of members, firings and times."""
    none = np.zeros(0, np.int64)
    rounds = [ExtraDots(none, none, np.zeros(0), np.zeros(0)), *parts]
    member, firing, touch, force = (
        np.concatenate([getattr(part, entry.name) for part in rounds]) for entry in fields(ExtraDots)
    )
    order = np.lexsort((touch, firing, member))
    return ExtraDots(member[order], firing[order], touch[order], force[order])


def _leaving(dots: DotTable, member: IntArray, firing: IntArray) -> FloatArray:
    """Return when the dots of some firings are over, and a little more."""
    whole = dots.fired_at + dots.flight_time + dots.contact_time
    return np.asarray(whole[member, firing] + _AFTER)


def _states(ensemble: Ensemble, moments: Sequence[FloatArray], threads: int | None) -> FloatArray:
    """Return displacement and velocity at some moments of each member, one after the other."""
    kept = ensemble.run(strobes=moments, threads=threads).strobes
    assert kept is not None
    asked = np.isfinite(kept.t)
    return np.column_stack([kept.x[asked], kept.v[asked]])
