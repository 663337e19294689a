"""Regime: what is repeated, a hammer and its periodic drive, with every constant in reach by name."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.drive.trains import PulseTrain, SineForce
from printhammer.errors import InputError
from printhammer.run.window import window_of
from printhammer.support.constants import quantities

if TYPE_CHECKING:
    from printhammer.drive.base import Overlap
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.window import Window
    from printhammer.support.arrays import FloatArray

PERIOD: Final = "period"
RATE: Final = "rate"
_WAVEFORM: Final = "waveform."
_DRIVE: Final = "drive."
_FORCE: Final = ("amplitude", "phase")


@dataclass(frozen=True)
class Regime:
    """A hammer and its periodic drive: a waveform fired every `period`, or an endless force.

    Attributes
    ----------
    hammer : Hammer
        The hammer.
    period : float
        Time between firings, or period of the force, s.
    waveform : Waveform or None
        What every firing does; None for the hammer's own, and under an endless force.
    drive : Drive or None
        An endless force such as `printhammer.SineForce`; None for a train of pulses.
    overlap : str
        "add": overlapping pulses add up; "replace": each firing cuts off the pulse before.
    """

    hammer: Hammer
    period: float
    waveform: Waveform | None = None
    drive: Drive | None = None
    overlap: Overlap = "add"

    @classmethod
    def of(
        cls,
        hammer: Hammer,
        *,
        period: float | str | None = None,
        rate: float | str | None = None,
        waveform: Waveform | None = None,
        drive: Drive | None = None,
        overlap: Overlap = "add",
    ) -> Self:
        """Make a regime.

        Parameters
        ----------
        hammer : Hammer
            The hammer.
        period, rate : float or str
            Time between firings, s, or firings per second, Hz; one of the two. Text with a unit is taken as
            well.
        waveform : Waveform, optional
            What every firing does; by default the waveform of the hammer.
        drive : Drive, optional
            Instead of a waveform, period and rate: an endless force, whose own period counts.
        overlap : str, optional
            "add" or "replace".

        Raises
        ------
        InputError
            There is nothing to fire, a period or rate is not positive or not the only one of the two, or the
            drive is no endless force with a period.
        """
        if drive is not None:
            if period is not None or rate is not None or waveform is not None:
                raise InputError("drive is given, expected no period, rate or waveform beside it")
            if drive.period is None or math.isfinite(drive.waveform.support):
                raise InputError(f"drive = {drive!r}, expected an endless force with a period")
            return cls(hammer, float(drive.period), None, drive, overlap)
        if (period is None) == (rate is None):
            raise InputError("period and rate: expected one of them, the time between firings or its inverse")
        if waveform is None and hammer.waveform is None:
            raise InputError(f"the hammer {hammer.name!r} has no waveform to fire, expected a [waveform]")
        time = (
            read_positive(period, "s", "period")
            if period is not None
            else 1.0 / read_positive(rate if rate is not None else 0.0, "Hz", "rate")
        )
        found = cls(hammer, time, waveform, None, overlap)
        # Refuses what no train can fire: an endless waveform, an unknown rule for overlapping pulses.
        found.train(1)
        return found

    @property
    def fired(self) -> Waveform:
        """What every firing does, or the endless force."""
        if self.drive is not None:
            return self.drive.waveform
        found = self.waveform if self.waveform is not None else self.hammer.waveform
        if found is None:
            raise InputError(
                f"the hammer {self.hammer.name!r} has no waveform to fire, expected a [waveform]"
            )
        return found

    @property
    def rate(self) -> float:
        """Firings per second, Hz."""
        return 1.0 / self.period

    @property
    def memory(self) -> int:
        """Number of pulses fired before one that can still be under way with it; 0 for an endless force.

        A train that has fired so many looks the same at every firing that follows.
        """
        if self.drive is not None:
            return 0
        if self.overlap == "replace":
            return 1
        return math.ceil(self.fired.support / self.period) + 1

    def train(self, firings: int) -> tuple[Drive, float]:
        """Return a drive that looks the same at so many firings and after them, and the time of the first, s.

        Everything that was fired before is under way then; one more pulse is fired at the end, so that no
        state depends on where that is.
        """
        if self.drive is not None:
            return self.drive, float(self.drive.times[0])
        before = self.memory
        train = PulseTrain(self.fired, period=self.period, pulses=before + firings + 2, overlap=self.overlap)
        return train, float(train.times[before])

    def moments(self, train: Drive, firings: int, phase: float) -> FloatArray:
        """Return the times of the sections, s, shape (firings + 1,), in a train made by `train`.

        A section lies `phase` periods after each firing.
        """
        if self.drive is not None:
            return np.asarray(train.times[0] + self.period * (np.arange(firings + 1) + phase))
        first = self.memory
        return np.asarray(train.times[first : first + firings + 1] + phase * self.period)

    @property
    def window(self) -> Window:
        """The window in which strobe points are drawn, and in whose half-widths distances are measured."""
        return window_of(self.hammer, self.train(1)[0])

    def value(self, name: str) -> float:
        """Return a constant by name, SI; see `with_`.

        Raises
        ------
        InputError
            There is no number of that name.
        """
        if name == PERIOD:
            return self.period
        if name == RATE:
            return self.rate
        if name not in self.names:
            raise InputError(f"{name} is not known, expected one of {', '.join(self.names)}")
        if name.startswith(_DRIVE) and self.drive is not None:
            found = getattr(self.drive.waveform, self._of_force(name))
        elif name.startswith(_WAVEFORM) and self.waveform is not None:
            found = getattr(self.waveform, self._of_waveform(name))
        else:
            found = self.hammer.constants[name].si
        return float(found)

    def with_(self, name: str, value: float) -> Self:
        """Return a regime with one constant replaced.

        Parameters
        ----------
        name : str
            "period", "rate", "waveform.amplitude" and the like, "drive.amplitude" or "drive.phase" under an
            endless force, or the dotted key of any constant of the hammer, such as "backstop.damping".
        value : float
            SI.

        Raises
        ------
        InputError
            There is no number of that name, or the value is not possible.
        """
        if name in (PERIOD, RATE):
            number = read_positive(value, "s" if name == PERIOD else "Hz", name)
            return self._with_period(number if name == PERIOD else 1.0 / number)
        self.value(name)
        if name.startswith(_DRIVE):
            return self._with_force(**{self._of_force(name): float(value)})
        if name.startswith(_WAVEFORM) and self.waveform is not None:
            fields = {field: getattr(self.waveform, field) for field in type(self.waveform).model_fields} | {
                self._of_waveform(name): float(value)
            }
            return replace(self, waveform=type(self.waveform)(**fields))
        return replace(self, hammer=self.hammer.replace(name, float(value)))

    @property
    def names(self) -> list[str]:
        """Names of all constants that `with_` takes."""
        own = self.waveform
        found = [name for name in self.hammer.constants if own is None or not name.startswith(_WAVEFORM)]
        if own is not None:
            given = [name for name in quantities(type(own)) if getattr(own, name) is not None]
            found += [f"{_WAVEFORM}{name}" for name in given]
        if self.drive is not None:
            found = [name for name in found if not name.startswith(_WAVEFORM)]
            found += [f"{_DRIVE}{name}" for name in _FORCE if isinstance(self.drive, SineForce)]
        fixed = self.drive is not None and not isinstance(self.drive, SineForce)
        return [*([] if fixed else [PERIOD, RATE]), *found]

    def _with_period(self, period: float) -> Self:
        if self.drive is not None:
            return self._with_force(frequency=1.0 / period)
        return replace(self, period=period)

    def _with_force(self, **changed: float) -> Self:
        if not isinstance(self.drive, SineForce):
            raise InputError(f"drive = {self.drive!r}, expected a SineForce, whose constants have names")
        sine: Any = self.drive.waveform
        known = {"amplitude": sine.amplitude, "frequency": sine.frequency, "phase": sine.phase} | changed
        drive = SineForce(**known)
        return replace(self, drive=drive, period=1.0 / known["frequency"])

    def _of_force(self, name: str) -> str:
        field = name.removeprefix(_DRIVE)
        return field if field in _FORCE and isinstance(self.drive, SineForce) else ""

    def _of_waveform(self, name: str) -> str:
        field = name.removeprefix(_WAVEFORM)
        return field if self.waveform is not None and field in quantities(type(self.waveform)) else ""
