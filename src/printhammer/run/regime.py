"""Regime: a hammer under an endless periodic drive, with all parameters accessible by name.

The k-th firing of a pulse train is at k times its period; a rate is converted to the period 1 / rate.

`Window` is the window of strobe plots; distances between states are measured in its half-widths.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, Self, TypedDict

import numpy as np
import numpy.typing as npt

from printhammer.drive.base import Overlap
from printhammer.drive.input import period_of_rate, read_number, read_positive
from printhammer.drive.trains import Drive, PulseTrain, SineForce
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import (
    DRIVE,
    FORCE,
    PERIOD,
    RATE,
    TIMING,
    WAVEFORM,
    quantities_of,
    unknown,
)
from printhammer.results import Declared, part, scalar
from printhammer.run.effort import AtFixedTolerance, Keywords
from printhammer.run.plain.posing import PAPER_V, PAPER_X, is_the_paper, part_of_window
from printhammer.run.problem import scales_of
from printhammer.support.arrays import BoolArray, FloatArray
from printhammer.support.constants import Quantity, quantities


class Window(Declared):
    """Window of strobe plots: a rectangle in the plane of displacement and velocity."""

    x: tuple[float, float] = scalar("m", "least and largest displacement")
    v: tuple[float, float] = scalar("m/s", "least and largest velocity")

    @property
    def half_widths(self) -> FloatArray:
        """Half-widths of the window, m and m/s, shape (2,)."""
        return 0.5 * np.array([self.x[1] - self.x[0], self.v[1] - self.v[0]])

    def inside(self, x: FloatArray, v: FloatArray) -> BoolArray:
        """Return a mask of the states inside the window, shape (n,)."""
        return (self.x[0] <= x) & (x <= self.x[1]) & (self.v[0] <= v) & (v <= self.v[1])


PAPER_WINDOW: Final = Window(PAPER_X, PAPER_V)
"""Window of the strobe plot in Fig. 11 of Hendriks (1983)."""


def window_of(hammer: Hammer, drive: Drive) -> Window:
    """Return the window of strobe plots for a hammer under a drive.

    The window is that of Fig. 11 if backstop and pack have the positions stated in Hendriks (1983). For other
    hammers the half-widths are a sixth of the distance from backstop to pack, as in Fig. 11, and a sixth of
    the speed that the largest force imparts to the armature over that distance; without a backstop or without
    a pack, the half-widths are the scales of the hammer (`printhammer.run.problem.scales_of`). As in Fig. 11
    the backstop, or the origin, lies a quarter of the width from the left.
    """
    place, front = hammer.position, hammer.front
    place = math.nan if place is None else place
    front = math.nan if front is None else front
    if is_the_paper(place, front):
        return PAPER_WINDOW
    part = part_of_window(place, front)
    way, speed = (part * scale for scale in scales_of(hammer, drive, (hammer.origin, 0.0)))
    return Window((hammer.origin - 0.5 * way, hammer.origin + 1.5 * way), (-speed, speed))


_FORCE: Final = ("amplitude", "phase")


class Firing(TypedDict, total=False):
    """Keyword arguments that specify the firing of a hammer; see `Regime.of`."""

    period: float | str | None
    rate: float | str | None
    waveform: Waveform | None
    drive: Drive | None
    overlap: Overlap | None
    phase: float | None


class Fired(Firing, Keywords):
    """Keyword arguments for the firing of a hammer, and for tolerance, threads and progress."""


class FiredAtFixedTolerance(Firing, AtFixedTolerance):
    """Keyword arguments that specify the firing of a hammer, for functions with fixed tolerances."""


class Regime(Declared):
    """Hammer under a periodic drive: a waveform fired every `period`, or a continuous periodic force."""

    hammer: Hammer = part("the hammer")
    period: float = scalar("s", "time between firings, or period of the force")
    waveform: Waveform | None = part(
        "waveform of every firing",
        more="None for the hammer's own waveform, and under a continuous periodic force",
        default=None,
    )
    drive: Drive | None = part(
        "a continuous periodic force such as `printhammer.SineForce`",
        more="None for a train of pulses",
        default=None,
    )
    overlap: Overlap = part(
        '"add": overlapping pulses add up; "replace": each firing cuts off the pulse before', default="add"
    )
    phase: float = part(
        "fraction of the period from a firing to the section at which states are recorded", default=0.0
    )

    @classmethod
    def of(
        cls,
        hammer: Hammer | Regime,
        *,
        period: float | str | None = None,
        rate: float | str | None = None,
        waveform: Waveform | None = None,
        drive: Drive | None = None,
        overlap: Overlap | None = None,
        phase: float | None = None,
    ) -> Regime:
        """Build a regime from the arguments of a public function.

        Parameters
        ----------
        hammer : Hammer or Regime
            A hammer; or a regime, which is returned unchanged or, if a phase is passed, with this phase.
        period, rate : float or str
            Time between firings, s, or firings per second, Hz; one of the two. Text with a unit is accepted.
        waveform : Waveform, optional
            Waveform of every firing; by default that of the hammer.
        drive : Drive, optional
            Continuous periodic force, instead of waveform, period and rate.
        overlap : str, optional
            "add": overlapping pulses add up; "replace": each firing cuts off the preceding pulse.
        phase : float, optional
            Phase of the section after a firing, as a fraction of the period in [0, 1).

        Raises
        ------
        InputError
            There is no waveform; both or neither of period and rate are set; a value is invalid; the drive is
            not a continuous periodic force; or a regime is passed with other arguments than a phase.
        """
        part = 0.0 if phase is None else read_phase(phase)
        if isinstance(hammer, Regime):
            named = ("period", "rate", "waveform", "drive", "overlap")
            values = (period, rate, waveform, drive, overlap)
            named_beside = [name for name, value in zip(named, values, strict=True) if value is not None]
            if named_beside:
                raise InputError(
                    "hammer = a regime", key="regime", expected=f"no {' or '.join(named_beside)} with it"
                )
            return hammer if phase is None else replace(hammer, phase=part)
        overlap = "add" if overlap is None else overlap
        if drive is not None:
            if period is not None or rate is not None or waveform is not None:
                raise InputError(
                    "drive = a drive", key="drive", expected="no period, rate or waveform with it"
                )
            if drive.period is None or math.isfinite(drive.waveform.support):
                raise InputError.of("drive", drive, "a continuous periodic force")
            return cls(hammer, float(drive.period), None, drive, overlap, part)
        if (period is None) == (rate is None):
            raise InputError(
                "period and rate: expected one of them, the time between firings or its inverse", key="period"
            )
        waveform_of(hammer, waveform)
        time = period_of_rate(rate) if rate is not None else read_positive(period or 0.0, "s", "period")
        regime = cls(hammer, time, waveform, None, overlap, part)
        # The train rejects endless waveforms and unknown overlap rules.
        regime.pulses(1)
        return regime

    @classmethod
    def of_firing(cls, hammer: Hammer | Regime, firing: Firing) -> Regime:
        """Build a regime from a hammer and the keywords `Firing` of a public function; see `of`."""
        return cls.of(hammer, **firing)

    @property
    def fired(self) -> Waveform:
        """Waveform of every firing, or the continuous periodic force."""
        if self.drive is not None:
            return self.drive.waveform
        return waveform_of(self.hammer, self.waveform)

    @property
    def rate(self) -> float:
        """Firings per second, Hz."""
        return 1.0 / self.period

    @property
    def is_planar(self) -> bool:
        """Whether displacement and velocity are the complete state at a section with zero coil current.

        Under a voltage drive, the state has further components if the coil has a shorted turn or the supply
        has a capacitor.
        """
        if self.fired.quantity != "voltage":
            return True
        turn = getattr(self.hammer.coil, "turn_resistance", None)
        return not turn and self.fired.supply().capacitance == 0.0

    def check_planar(self) -> None:
        """Raise InputError if the state has more components than displacement and velocity."""
        if not self.is_planar:
            raise InputError(
                "the state at a section is displacement and velocity: expected no shorted turn and no"
                " capacitor as the supply, whose current and voltage belong to the state as well",
                key="state",
            )

    @property
    def memory(self) -> int:
        """Number of earlier pulses that can still be active at a firing; 0 for a continuous periodic force.

        After `memory` firings, the drive of a pulse train is periodic.
        """
        if self.drive is not None:
            return 0
        if self.overlap == "replace":
            return 1
        return math.ceil(self.fired.support / self.period) + 1

    @property
    def at_firings(self) -> Self:
        """Copy of the regime with the section at the firing, i.e. at phase 0."""
        return self if self.phase == 0.0 else replace(self, phase=0.0)

    def pulses(self, count: int) -> Drive:
        """Return a drive of `count` pulses that begins at time 0, or the continuous periodic force."""
        if self.drive is not None:
            return self.drive
        return PulseTrain(self.fired, period=self.period, pulses=count, overlap=self.overlap)

    def train(self, firings: int) -> tuple[Drive, float]:
        """Return a drive with the same history at each of `firings` firings, and the first firing time, s.

        The drive includes all earlier pulses that are still active at the first firing, and one more pulse at
        the end, so that the states do not depend on the end of the drive.
        """
        if self.drive is not None:
            return self.drive, float(self.drive.times[0])
        before = self.memory
        train = self.pulses(before + firings + 2)
        return train, float(train.times[before])

    def moments(self, train: Drive, firings: int, phase: float | None = None) -> FloatArray:
        """Return the section times [s], shape (firings + 1,), of a drive returned by `train`.

        A section lies `phase` periods after each firing, by default the phase of the regime.
        """
        phase = self.phase if phase is None else phase
        if self.drive is not None:
            return np.asarray(train.times[0] + self.period * (np.arange(firings + 1) + phase))
        first = self.memory
        return np.asarray(train.times[first : first + firings + 1] + phase * self.period)

    @property
    def window(self) -> Window:
        """Window of strobe plots; its half-widths are the unit of distances between states."""
        return window_of(self.hammer, self.train(1)[0])

    def value(self, name: str) -> float:
        """Return a parameter by name, SI; see `with_`."""
        if name == PERIOD:
            return self.period
        if name == RATE:
            return self.rate
        if name not in self.names:
            raise unknown(name, self.names)
        if name.startswith(DRIVE) and self.drive is not None:
            number = getattr(self.drive.waveform, self._of_force(name))
        elif name.startswith(WAVEFORM) and self.waveform is not None:
            number = getattr(self.waveform, self._of_waveform(name))
        else:
            number = self.hammer.constants[name].si
        return float(number)

    def quantity(self, name: str) -> Quantity:
        """Return unit, meaning and symbol of a parameter by name; see `with_`."""
        self.value(name)
        if name == PERIOD and self.drive is not None:
            return replace(TIMING[name], meaning="period of the force")
        if name in TIMING:
            return TIMING[name] if self.drive is None else FORCE["frequency"]
        section, _, field = name.rpartition(".")
        if f"{section}." == DRIVE:
            return FORCE[field]
        if f"{section}." == WAVEFORM and self.waveform is not None:
            return quantities_of(self.waveform)[field]
        constant = self.hammer.constants[name]
        return Quantity(constant.si_unit, constant.symbol, constant.meaning)

    def with_(self, name: str, value: float) -> Self:
        """Return a copy with one parameter replaced.

        Parameters
        ----------
        name : str
            "period", "rate", "waveform.amplitude" and the like, "drive.amplitude" or "drive.phase" under a
            continuous periodic force, or the dotted key of any constant of the hammer, such as
            "backstop.damping".
        value : float
            New value of the parameter, SI.
        """
        if name in (PERIOD, RATE):
            period = period_of_rate(value) if name == RATE else read_positive(value, "s", name)
            if self.drive is not None:
                return self._with_force(frequency=1.0 / period)
            return replace(self, period=period)
        self.value(name)
        if name.startswith(DRIVE):
            return self._with_force(**{self._of_force(name): float(value)})
        if name.startswith(WAVEFORM) and self.waveform is not None:
            fields = {field: getattr(self.waveform, field) for field in type(self.waveform).model_fields} | {
                self._of_waveform(name): float(value)
            }
            return replace(self, waveform=type(self.waveform)(**fields))
        return replace(self, hammer=self.hammer.replace(name, float(value)))

    @property
    def names(self) -> list[str]:
        """Names of all parameters that `with_` accepts."""
        own = self.waveform
        names = [name for name in self.hammer.constants if own is None or not name.startswith(WAVEFORM)]
        if own is not None:
            fields = [name for name in quantities(type(own)) if getattr(own, name) is not None]
            names += [f"{WAVEFORM}{name}" for name in fields]
        if self.drive is not None:
            names = [name for name in names if not name.startswith(WAVEFORM)]
            names += [f"{DRIVE}{name}" for name in _FORCE if isinstance(self.drive, SineForce)]
        fixed = self.drive is not None and not isinstance(self.drive, SineForce)
        return [*([] if fixed else [PERIOD, RATE]), *names]

    def _with_force(self, **changed: float) -> Self:
        if not isinstance(self.drive, SineForce):
            raise InputError.of("drive", self.drive, "a SineForce, whose constants have names")
        sine: Any = self.drive.waveform
        known = {"amplitude": sine.amplitude, "frequency": sine.frequency, "phase": sine.phase} | changed
        drive = SineForce(**known)
        return replace(self, drive=drive, period=1.0 / known["frequency"])

    def _of_force(self, name: str) -> str:
        field = name.removeprefix(DRIVE)
        return field if field in _FORCE and isinstance(self.drive, SineForce) else ""

    def _of_waveform(self, name: str) -> str:
        field = name.removeprefix(WAVEFORM)
        return field if self.waveform is not None and field in quantities(type(self.waveform)) else ""


def waveform_of(hammer: Hammer, waveform: Waveform | None) -> Waveform:
    """Return the waveform to fire, by default the hammer's; raise InputError without a waveform."""
    fired = hammer.waveform if waveform is None else waveform
    if fired is None:
        raise InputError(
            f"the hammer {hammer.name!r} has no waveform to fire", key="waveform", expected="a [waveform]"
        )
    return fired


def read_phase(phase: float) -> float:
    """Check that a phase is a fraction of the period in [0, 1), and return the phase."""
    part = read_number(phase, "1", "phase")
    if not 0.0 <= part < 1.0:
        raise InputError.of("phase", phase, "a fraction of the period from 0 up to but not including 1")
    return part


def regimes_of(
    hammers: Hammer | Regime | Sequence[Hammer | Regime],
    periods: Sequence[float | str] | npt.ArrayLike | None = None,
    drives: Sequence[Drive] | None = None,
    *,
    waveform: Waveform | None = None,
    overlap: Overlap | None = None,
    phase: float | None = None,
) -> list[Regime]:
    """Return the regimes of many pulse trains, one per hammer, period or drive.

    Parameters
    ----------
    hammers : Hammer or Regime, or sequence of them
        One hammer for all trains, or one for each; with regimes, only `phase` may be passed.
    periods : sequence, optional
        Times between firings, s or text with a unit: one time for each train, or one time for all hammers.
    drives : sequence of Drive, optional
        Continuous periodic forces, instead of periods.
    waveform, overlap, phase
        As for `Regime.of`, for all trains.
    """
    many = [hammers] if isinstance(hammers, Hammer | Regime) else list(hammers)
    fired: list[tuple[Any, Drive | None]] = [(None, drive) for drive in drives or ()]
    if drives is None and periods is None and many and all(isinstance(hammer, Regime) for hammer in many):
        fired = [(None, None)]
    elif drives is None:
        if periods is None:
            raise InputError(
                "periods are missing",
                key="periods",
                expected="the times between the firings of each train, s",
            )
        fired = [(period, None) for period in (periods if np.ndim(periods) else [periods])]  # type: ignore[union-attr]
        if not fired:
            raise InputError("periods: expected at least one time between firings, s", key="periods")
    count = max(len(many), len(fired)) if many and fired else 0
    for name, number in (("hammers", len(many)), ("periods" if drives is None else "drives", len(fired))):
        if number not in (1, count):
            raise InputError(f"{name}: {number} entries", key=name, expected=f"1 or {count}")
    return [
        Regime.of(
            many[i % len(many)],
            period=fired[i % len(fired)][0],
            drive=fired[i % len(fired)][1],
            waveform=waveform,
            overlap=overlap,
            phase=phase,
        )
        for i in range(count)
    ]
