"""Dots and extra contacts of all members of an ensemble, read from the rows that the kernel fills."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from printhammer.drive.batch import Ragged
from printhammer.kernel.model import dots as layout
from printhammer.results import Result, column
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

_FIRINGS: Final = "member firing"


class DotTable(Result):
    """What the firings did, up to the most firings of any member; nan where there is nothing to tell."""

    fired: BoolArray = column("1", "whether there was such a firing, and the run came so far", _FIRINGS)
    fired_at: FloatArray = column("s", "time of the firing", _FIRINGS)
    struck: BoolArray = column("1", "whether it made a dot", _FIRINGS)
    flight_time: FloatArray = column("s", "time from firing to touch", _FIRINGS)
    impact_speed: FloatArray = column("m/s", "velocity at touch", _FIRINGS)
    peak_force: FloatArray = column("N", "largest pack force", _FIRINGS)
    indentation: FloatArray = column("m", "largest indentation", _FIRINGS)
    contact_time: FloatArray = column(
        "s", "time from touch to leaving", _FIRINGS, more="nan also while the contact is open"
    )
    extra_contacts: IntArray = column("1", "further pack contacts before the next firing", _FIRINGS)

    @classmethod
    def from_rows(cls, rows: FloatArray, fired_at: FloatArray, reached: FloatArray) -> DotTable:
        """Make the table of rows of the kernel, shape (members, firings, columns).

        Parameters
        ----------
        rows : array
            See `printhammer.kernel.model.dots`; NaN where a member has no such firing.
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
    """Extra contacts of all members, in the order of members, firings and times."""

    member: IntArray = column("1", "index of the member", "extra")
    firing: IntArray = column("1", "index of the firing of that member", "extra")
    touch: FloatArray = column("s", "time of touch", "extra")
    peak_force: FloatArray = column("N", "largest pack force", "extra")

    @classmethod
    def from_rows(cls, groups: Sequence[tuple[IntArray, Ragged]]) -> ExtraDots:
        """Join the rows of extra contacts of several groups, each given with the indices of its members."""
        member = np.concatenate(
            [np.zeros(0, np.int64), *(np.repeat(own, rows.counts) for own, rows in groups)]
        )
        every = np.concatenate([np.zeros((0, layout.DOT_WIDTH)), *(rows.values for _own, rows in groups)])
        # The rows of a member are in order of time, and so in order of firings.
        order = np.argsort(member, kind="stable")
        every = every[order]
        return cls(
            member=member[order],
            firing=every[:, layout.FIRING].astype(np.int64),
            touch=every[:, layout.TIME_IN],
            peak_force=every[:, layout.FORCE],
        )
