"""Evaluation of dots: deviations of force and arrival from the single-pulse dot, compared with limits."""

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
"""Faults of a requested dot, in the order of precedence; "not run": the simulation ended before the dot."""


class Judgement(Declared):
    """Deviations of dots from the single-pulse dot, compared with the limits."""

    wanted: BoolArray = column(
        "1",
        "mask of the dots that are evaluated; elsewhere the other columns are False or NaN",
        "member firing",
    )
    run: BoolArray = column("1", "whether the simulation reached the dot", "member firing")
    lost: BoolArray = column("1", "whether the firing made no dot", "member firing")
    force_deviation: FloatArray = column(
        "1", "relative deviation of the peak force from the single pulse; NaN for a lost dot", "member firing"
    )
    arrival_deviation: FloatArray = column(
        "s", "touch minus slot time and single-pulse flight time", "member firing", more="NaN for a lost dot"
    )
    extra_contacts: IntArray = column(
        "1", "extra pack contacts beyond those of the single pulse", "member firing", more="at least 0"
    )
    limits: Limits = part("limits on the deviations of the dots")

    @property
    def faults(self) -> IntArray:
        """Index in `FAULTS` of each dot's first fault; -1 for a good dot, and where no dot is evaluated."""
        first = np.full(self.wanted.shape, -1)
        # The comparisons are negated so that NaN counts as a fault.
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
        """Mask of the requested dots whose force and arrival are within limits."""
        return np.asarray(self.wanted & (self.faults < 0))

    @property
    def passed(self) -> BoolArray:
        """Mask of the ensemble members whose requested dots are all within limits, shape (members,)."""
        return np.asarray((self.faults < 0).all(axis=1))


def judge(
    dots: DotTable,
    wanted: BoolArray,
    slot_times: FloatArray,
    nominal: SinglePulse | Sequence[SinglePulse],
    limits: Limits,
    ok: BoolArray | None = None,
) -> Judgement:
    """Compare the dots of an ensemble with the limits; every firing belongs to one requested dot.

    `wanted`, shape (members, firings), is the mask of dots to evaluate; the dots of a lead-in, for instance,
    are excluded. `slot_times` [s], of the same shape, may differ from the firing times, and are ignored where
    no dot is evaluated. `nominal` is the single-pulse dot: one for all members, or one for each. `ok`, shape
    (members,), is the mask of simulations that reached their ends; the last dot of an incomplete simulation
    counts as "not run", since its contact may still be open.
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
    bounces = np.array([pulse.extra_contacts for pulse in single])[:, np.newaxis]
    force = np.where(struck, dots.peak_force / single_force - 1.0, np.nan)
    arrival = dots.fired_at + dots.flight_time - (slot_times + single_flight)
    return Judgement(
        wanted=asked,
        run=run & asked,
        lost=run & asked & ~dots.struck,
        force_deviation=force,
        arrival_deviation=np.where(struck, arrival, np.nan),
        extra_contacts=np.where(struck, np.maximum(dots.extra_contacts - bounces, 0), 0),
        limits=limits,
    )


class Limits(Declared):
    """Limits on the deviation of a dot from the single-pulse dot. A lost dot is never within limits."""

    force: float = part(
        "largest absolute deviation of the peak force, relative to the single-pulse force", default=0.1
    )
    arrival: float = part(
        "largest absolute deviation of the touch from slot time plus single-pulse flight time, s",
        default=50e-6,
    )
    extra_contacts: int = part(
        "largest number of extra pack contacts beyond those of the single pulse", default=0
    )

    def __post_init__(self) -> None:
        for name, unit in (("force", ""), ("arrival", " s"), ("extra_contacts", "")):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0.0:
                raise InputError(
                    f"limits: {name} = {value!r}{unit}",
                    expected="a number not below 0",
                    key=f"limits.{name}",
                    value=value,
                )

    @property
    def text(self) -> str:
        """Limits in plain text, with times in microseconds."""
        return (
            f"force within {100.0 * self.force:g} %, arrival within {1e6 * self.arrival:g} us,"
            f" {self.extra_contacts} extra contacts"
        )

    @property
    def said(self) -> str:
        """Limits in words, for summaries, with a suitable unit of time."""
        return (
            f"force within {100.0 * self.force:g} %, arrival within {quantity(self.arrival, 's')},"
            f" {self.extra_contacts} extra contacts"
        )


DOT_MATRIX_SPREAD: Final = 200e-6
"""Peak-to-peak flight-time variation that is "commonly accepted in the industry as long as the impact forces
are adequate" in dot matrix printing; F. Hendriks, IBM J. Res. Develop. 27 (1983), introduction; s."""

ENGRAVED_SPREAD: Final = 30e-6
"""Peak-to-peak flight-time variation that an engraved-character line printer tolerates, s. The paper
(introduction): "severe print quality degradation [...] occurs when the flight time varies more than a few
tens of microseconds"."""

PRESETS: Final = {
    "slots": Limits(),
    "dot-matrix": Limits(arrival=0.5 * DOT_MATRIX_SPREAD),
    "engraved": Limits(arrival=0.5 * ENGRAVED_SPREAD),
}
"""Presets of the limits, by name. The paper's spreads are peak to peak: the limit is half of each spread, on
either side. "slots" is the default of all comparisons of drives."""


def limits_named(name: str) -> Limits:
    """Return the preset limits with a name from `PRESETS`."""
    if name not in PRESETS:
        raise InputError.of("limits", name, f"one of {', '.join(PRESETS)}")
    return PRESETS[name]
