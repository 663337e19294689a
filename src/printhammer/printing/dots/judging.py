"""Whether dots are within limits, and how far each is off.

How far a dot may be off: limits on force, arrival and extra contacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.results import Declared, column, part
from printhammer.results.summary import quantity
from printhammer.run.ensemble import DotTable
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

FAULTS: Final = ("not run", "lost", "extra contacts", "force", "arrival")
"""What may be wrong with a wanted dot, in the order of the search; "not run": the run ended before."""


class Judgement(Declared):
    """How far dots are off."""

    wanted: BoolArray = column(
        "1", "where a dot is judged; the others are False and NaN in all that follows", "member firing"
    )
    run: BoolArray = column("1", "whether the run came so far", "member firing")
    lost: BoolArray = column("1", "whether the firing made no dot", "member firing")
    force_deviation: FloatArray = column(
        "1", "peak force less that of the single pulse, in parts of it; NaN for a lost dot", "member firing"
    )
    arrival_deviation: FloatArray = column(
        "s", "touch less slot time and single-pulse flight time", "member firing", more="NaN for a lost dot"
    )
    extra_contacts: IntArray = column("1", "further pack contacts", "member firing")
    limits: Limits = part("by which it is judged")

    @property
    def faults(self) -> IntArray:
        """Number of the first fault of each wanted dot in `FAULTS`; -1 for a good one and an unwanted one."""
        first = np.full(self.wanted.shape, -1)
        # Compared the other way round, a NaN would pass.
        with np.errstate(invalid="ignore"):
            wrong = (
                ~self.run,
                self.lost,
                self.extra_contacts > self.limits.extra_contacts,
                ~(np.abs(self.force_deviation) <= self.limits.force),
                ~(np.abs(self.arrival_deviation) <= self.limits.arrival),
            )
        for number in range(len(wrong) - 1, -1, -1):
            first[self.wanted & wrong[number]] = number
        return first

    @property
    def good(self) -> BoolArray:
        """Which wanted dots are within limits."""
        return np.asarray(self.wanted & (self.faults < 0))

    @property
    def passed(self) -> BoolArray:
        """Which members have all wanted dots within limits, shape (members,)."""
        return np.asarray((self.faults < 0).all(axis=1))


def judge(
    dots: DotTable,
    wanted: BoolArray,
    slot_times: FloatArray,
    nominal: SinglePulse | Sequence[SinglePulse],
    limits: Limits,
    ok: BoolArray | None = None,
) -> Judgement:
    """Judge dots by what their firings did, one firing for each dot.

    `wanted` (members, firings) says which dots to judge; those of a lead-in, for instance, are not.
    `slot_times` (members, firings), s, need not be those of the firings, and are of no matter where no dot is
    judged. The `nominal` dot, of the single pulse, is one for all members, or one for each. `ok` (members,)
    says which runs reached their ends: the last dot of one that did not is not run, its contact may be open.
    """
    shape = dots.fired.shape
    for name, values in (("wanted", wanted), ("slot_times", slot_times)):
        if np.shape(values) != shape:
            raise InputError(f"{name}: an array of shape {np.shape(values)}", key=name, expected=shape)
    asked = np.asarray(wanted, dtype=np.bool_)
    run = dots.fired.copy()
    if ok is not None:
        last = run.sum(axis=1) - 1
        early = np.flatnonzero(~np.asarray(ok) & (last >= 0))
        run[early, last[early]] = False
    struck = dots.struck & run & asked
    single = [nominal] if isinstance(nominal, SinglePulse) else nominal
    single_force = np.array([pulse.force for pulse in single])[:, np.newaxis]
    single_flight = np.array([pulse.flight_time for pulse in single])[:, np.newaxis]
    force = np.where(struck, dots.peak_force / single_force - 1.0, np.nan)
    arrival = dots.fired_at + dots.flight_time - (slot_times + single_flight)
    return Judgement(
        wanted=asked,
        run=run & asked,
        lost=run & asked & ~dots.struck,
        force_deviation=force,
        arrival_deviation=np.where(struck, arrival, np.nan),
        extra_contacts=np.where(struck, dots.extra_contacts, 0),
        limits=limits,
    )


class Limits(Declared):
    """How far a dot may differ from that of the single pulse. A lost dot is never within limits."""

    force: float = part(
        "largest deviation of the peak force to either side, in parts of the single-pulse force", default=0.1
    )
    arrival: float = part(
        "largest deviation of the touch from slot time plus single-pulse flight time, to either side, s",
        default=50e-6,
    )
    extra_contacts: int = part("largest number of further pack contacts", default=0)

    def __post_init__(self) -> None:
        for name, unit in (("force", ""), ("arrival", " s"), ("extra_contacts", "")):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0.0:
                raise InputError(
                    f"limits: {name} = {value!r}{unit} is expected to be a number not below 0",
                    key=f"limits.{name}",
                    value=value,
                )

    @property
    def text(self) -> str:
        """In words."""
        return (
            f"force within {100.0 * self.force:g} %, arrival within {1e6 * self.arrival:g} us,"
            f" {self.extra_contacts} extra contacts"
        )

    @property
    def said(self) -> str:
        """In words, as a summary shows them."""
        return (
            f"force within {100.0 * self.force:g} %, arrival within {quantity(self.arrival, 's')},"
            f" {self.extra_contacts} extra contacts"
        )


DOT_MATRIX_SPREAD: Final = 200e-6
"""Peak-to-peak flight-time variation that is "commonly accepted in the industry as long as the impact forces
are adequate" in dot matrix printing; F. Hendriks, IBM J. Res. Develop. 27 (1983), introduction; s."""

ENGRAVED_SPREAD: Final = 30e-6
"""Flight-time variation that an engraved-character line printer bears, s. The paper (introduction): "severe
print quality degradation [...] occurs when the flight time varies more than a few tens of microseconds"."""

PRESETS: Final = {
    "slots": Limits(),
    "dot-matrix": Limits(arrival=0.5 * DOT_MATRIX_SPREAD),
    "engraved": Limits(arrival=0.5 * ENGRAVED_SPREAD),
}
"""Limits by name. The spreads of the paper are peak to peak, so that half of each is allowed to either side;
"slots" are the limits by which drives are compared."""


def limits_named(name: str) -> Limits:
    """Return the limits of a name."""
    if name not in PRESETS:
        raise InputError.of("limits", name, f"one of {', '.join(PRESETS)}")
    return PRESETS[name]
