"""Drives: a waveform fired as a train, in bursts or at given times; or a sinusoidal force.

A drive is a current through the coil or, for textbook hammers, a force on the armature. Pulses may overlap:
with ``overlap="add"`` their values add up, with ``overlap="replace"`` each firing ends the preceding pulse.
Numbers are SI; strings with a unit ("1.2 kHz") are accepted as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from copy import copy
from typing import Any, Self, SupportsIndex

import numpy as np
import numpy.typing as npt

from printhammer.drive.base import Drive, Overlap
from printhammer.drive.input import (
    MOST_PULSES,
    PULSES,
    SPACING_UNITS,
    even_times,
    read_count,
    read_number,
    read_positive,
    read_start,
    read_times,
)
from printhammer.drive.text import quantity_text, waveform_text
from printhammer.drive.waveforms.shapes import Sine, Waveform
from printhammer.errors import InputError
from printhammer.support.arrays import FloatArray

__all__ = ["Burst", "Drive", "Overlap", "PulseTrain", "SineForce"]


class _Pulsed(Drive):
    """Base class of drives that fire pulses of finite duration."""

    def __init__(
        self, waveform: Waveform, times: npt.ArrayLike, overlap: Overlap, period: float | None
    ) -> None:
        super().__init__(waveform, times, overlap, period)
        self._refuse_endless(waveform)

    @staticmethod
    def _refuse_endless(waveform: Waveform) -> None:
        if not math.isfinite(waveform.support):
            raise InputError(
                f"a {waveform.shape} waveform in a train of pulses", key="waveform", expected="one that ends"
            )

    def with_waveform(self, waveform: Waveform) -> Self:
        """Return a drive that fires `waveform` at the same times."""
        if not isinstance(waveform, Waveform):
            raise InputError.of("waveform", waveform, "a waveform")
        self._refuse_endless(waveform)
        return self._with_waveform(waveform)

    def with_times(self, times: Iterable[float | str]) -> PulseTrain:
        """Return a drive that fires the same waveform, under the same overlap rule, at new times, s."""
        return PulseTrain(self._waveform, at=times, overlap=self._overlap)


class PulseTrain(_Pulsed):
    """Pulses at a constant rate, at given times, or a single pulse.

    Parameters
    ----------
    waveform
        Waveform of every firing; None, as from a hammer without a waveform, raises `InputError`.
    rate, period
        Firing rate, Hz, or time between firings, s; only one of the two may be passed.
    at
        Firing times [s], ascending, instead of a rate or period.
    pulses
        Number of firings; by default nine, as in the bursts of the paper, or one if neither rate nor period
        is passed.
    overlap
        "add": overlapping pulses add up; "replace": each firing cuts off the preceding pulse.
    start
        Time of the first firing, s; for firing times `at`, the time by which all of them are shifted.

    Raises
    ------
    InputError
        A rate or period is not positive, there are fewer than 1 pulses, a time is negative, not finite,
        duplicate or descending, a quantity has the wrong dimension, or arguments contradict each other.
    """

    def __init__(
        self,
        waveform: Waveform | None,
        *,
        rate: float | str | None = None,
        period: float | str | None = None,
        at: Iterable[float | str] | None = None,
        pulses: SupportsIndex | None = None,
        overlap: Overlap = "add",
        start: float | str = 0.0,
    ) -> None:
        if waveform is None:
            raise InputError.of("waveform", None, "a waveform")
        ways = [name for name, value in (("rate", rate), ("period", period), ("at", at)) if value is not None]
        if len(ways) > 1:
            raise InputError(f"{ways[0]} and {ways[1]}", key=ways[1], expected="one of rate, period and at")
        first = read_start(start)
        self._spacing: tuple[str, float] | None = None
        if at is not None:
            if pulses is not None:
                raise InputError.of("pulses", pulses, "no number of pulses together with firing times")
            super().__init__(waveform, read_times(at) + first, overlap, None)
            return
        count = read_count((PULSES if ways else 1) if pulses is None else pulses, "pulses")
        if not ways and count > 1:
            raise InputError(
                f"pulses = {count}",
                key="pulses",
                value=count,
                expected="a rate, a period or firing times in addition",
            )
        steps, self._spacing, spacing = even_times(rate, period, count) if ways else (np.zeros(1), None, None)
        super().__init__(waveform, first + steps, overlap, spacing)

    def _with_checked_times(self, times: FloatArray, rate: float | None) -> PulseTrain:
        """Return a train with the same waveform at new, already validated firing times, s.

        `rate` is the rate of these times, Hz, or None.
        """
        result = copy(self)
        result._times = times
        result._spacing = None if rate is None else ("rate", rate)
        result._period = None if rate is None else 1.0 / rate
        return result

    def _table(self) -> tuple[str, dict[str, Any]]:
        if self._spacing is None:
            return super()._table()
        spacing = {self._spacing[0]: quantity_text(self._spacing[1], SPACING_UNITS[self._spacing[0]])}
        start = quantity_text(self._times[0], "s")
        return "train", {**spacing, "pulses": len(self._times), "start": start}


class Burst(_Pulsed):
    """Bursts of pulses at a constant rate, with a pause between the bursts.

    Parameters
    ----------
    waveform
        Waveform of every firing.
    rate, period
        Firing rate within a burst, Hz, or time between firings, s; one of the two.
    pulses
        Number of firings of one burst.
    bursts
        Number of bursts.
    gap
        Time from the last firing of a burst to the first firing of the next burst, s.
    overlap, start
        As for `PulseTrain`.
    """

    def __init__(
        self,
        waveform: Waveform,
        rate: float | str | None = None,
        pulses: SupportsIndex | None = None,
        bursts: SupportsIndex = 1,
        gap: float | str | None = None,
        *,
        period: float | str | None = None,
        overlap: Overlap = "add",
        start: float | str = 0.0,
    ) -> None:
        if (rate is None) == (period is None):
            raise InputError("a burst", key="rate", expected="either a rate or a period")
        count, repeats = read_count(pulses, "pulses"), read_count(bursts, "bursts")
        if count * repeats > MOST_PULSES:
            raise InputError(
                f"{repeats} bursts of {count} pulses",
                expected=f"at most {MOST_PULSES} firings",
                key="pulses",
            )
        steps, self._spacing, spacing = even_times(rate, period, count)
        if gap is None and repeats > 1:
            raise InputError(
                f"bursts = {repeats}", key="bursts", value=repeats, expected="a gap between them"
            )
        self._gap = None if gap is None else read_positive(gap, "s", "gap")
        self._counts = (count, repeats)
        begin = read_start(start) + np.arange(repeats) * (steps[-1] + (self._gap or 0.0))
        times = (begin[:, np.newaxis] + steps).ravel()
        super().__init__(waveform, times, overlap, spacing if repeats == 1 else None)

    def _table(self) -> tuple[str, dict[str, Any]]:
        name, value = self._spacing
        table: dict[str, Any] = {name: quantity_text(value, SPACING_UNITS[name])}
        table["pulses"], table["bursts"] = self._counts
        if self._gap is not None:
            table["gap"] = quantity_text(self._gap, "s")
        return "burst", {**table, "start": quantity_text(self._times[0], "s")}


class SineForce(Drive):
    """A sinusoidal force on the armature for t >= 0, amplitude sin(2 pi frequency t + phase).

    Parameters
    ----------
    amplitude
        Amplitude of the force, N.
    frequency
        Frequency of the force, Hz.
    phase
        Phase of the force at t = 0, rad.

    Raises
    ------
    InputError
        A number is not finite, the frequency is not positive, or a quantity has the wrong dimension.
    """

    def __init__(self, amplitude: float | str, frequency: float | str, phase: float | str = 0.0) -> None:
        often = read_positive(frequency, "Hz", "frequency")
        sine = Sine(
            amplitude=read_number(amplitude, "N", "amplitude"),
            frequency=often,
            phase=read_number(phase, "rad", "phase"),
            quantity="force",
        )
        super().__init__(sine, [0.0], "add", 1.0 / often)

    def _table(self) -> tuple[str, dict[str, Any]]:
        table = waveform_text(self._waveform)
        del table["shape"]
        return "sine", table
