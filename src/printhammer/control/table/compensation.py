"""Compensation tables: how to fire a dot that follows others before the hammer has come to rest."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.histories import (
    MOST_GAPS,
    MOST_REACH,
    checked_size,
    entries_of,
    histories,
    number_of,
    shared_numbers,
)
from printhammer.drive.input import read_positive
from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import numpy.typing as npt
    import xarray as xr

    from printhammer.control.table.drive import TableStrategy
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

COLUMNS: Final = ("advance", "width", "brake_delay", "brake_width")
"""What a table says of a dot."""

_NEAR: Final = 1e-9

JUMP: Final = 8e-6
"""Difference of neighbouring advances from which on they belong to different ways to fire a dot, s."""


@dataclass(frozen=True)
class Settings:
    """What a table says at one rate: arrays of shape (entries,), over the numbers of the histories.

    Attributes
    ----------
    advance : array
        How long before its slot a dot is fired, s; negative: after it.
    width : array
        Width of its pulse, s.
    brake_delay : array
        From the slot of the dot before to the brake pulse in the gap before this dot, s; 0 without one.
    brake_width : array
        Width of that brake pulse, s; 0 for none.
    """

    advance: FloatArray
    width: FloatArray
    brake_delay: FloatArray
    brake_width: FloatArray


@dataclass(frozen=True)
class CompensationTable:
    """Pulse width and advance as a function of the last gaps between dots: a row a rate, a column a history.

    A dot of history h at a slot is fired `advance` before the slot, with a pulse of `width`. In the gap
    before it, `brake_delay` after the slot of the dot before it, a brake pulse of `brake_width` catches the
    armature on its way back, so that it does not rebound. What follows the last dot for long is the brake
    pulse of a dot from rest. The numbers of histories are those of `printhammer.control.table.histories`.

    Attributes
    ----------
    hammer : str
        Name of the hammer it is made for.
    fingerprint : str
        Of this hammer.
    rates : array, shape (R,)
        Slots per second, Hz, ascending.
    gaps : int
        Number n of gaps in a history.
    reach : int
        Longest gap that counts, slots; a longer one is rest.
    advance, width, brake_delay, brake_width : array, shape (R, (reach + 1)**n)
        As in `Settings`, s.
    deviation : array, shape (R, (reach + 1)**n)
        Worst deviation of force or arrival, in parts of the limits, of the dots of this history in the
        patterns that the table was tuned on; NaN where it is not known. 1 is on the limit.
    largest_current : float
        Bound on the current that was kept to, A.

    Raises
    ------
    InputError
        Values that make no table: a width not positive, a rate that does not ascend, a firing that would come
        before the one before has ended.
    """

    hammer: str
    fingerprint: str
    rates: FloatArray
    gaps: int
    reach: int
    advance: FloatArray = field(repr=False)
    width: FloatArray = field(repr=False)
    brake_delay: FloatArray = field(repr=False)
    brake_width: FloatArray = field(repr=False)
    deviation: FloatArray = field(repr=False)
    largest_current: float

    def __post_init__(self) -> None:
        checked_size(self.gaps, self.reach)
        rates = np.asarray(self.rates)
        if rates.ndim != 1 or not rates.size or not np.isfinite(rates).all() or rates[0] <= 0.0:
            raise InputError("rates: expected positive numbers, at least one")
        if (np.diff(rates) <= 0.0).any():
            raise InputError("rates: expected ascending numbers")
        shape = rates.size, entries_of(self.gaps, self.reach)
        for name in (*COLUMNS, "deviation"):
            if np.shape(getattr(self, name)) != shape:
                raise InputError(
                    f"{name}: an array of shape {np.shape(getattr(self, name))}, expected {shape}"
                )
        for row, rate in enumerate(rates.tolist()):
            for history in histories(self.gaps, self.reach):
                self._check(row, rate, history)

    def _check(self, row: int, rate: float, history: Sequence[int]) -> None:
        """Refuse an entry that cannot be fired."""
        column = number_of(history, self.reach)
        values = {name: float(getattr(self, name)[row, column]) for name in COLUMNS}
        where = f"rate {rate:g} Hz, history {'-'.join(map(str, history))}"
        for name, value in values.items():
            if not np.isfinite(value):
                raise InputError(f"{where}: {name} = {value!r} s, expected a number")
        if values["width"] <= 0.0:
            raise InputError(f"{where}: width = {values['width']!r} s, expected a positive number")
        for name in ("brake_delay", "brake_width"):
            if values[name] < 0.0:
                raise InputError(f"{where}: {name} = {values[name]!r} s, expected a number not below 0")
        before = [
            number_of((*history[1:], gap) if history[0] else history, self.reach)
            for gap in range(self.reach + 1)
        ]
        # The dot before may have been fired late; its pulse is over when the next one is due.
        over = float((self.width[row, before] - self.advance[row, before]).max())
        if values["brake_width"] > 0.0:
            if values["brake_delay"] < over - _NEAR:
                raise InputError(
                    f"{where}: brake_delay = {values['brake_delay']!r} s, expected a brake pulse after that"
                    f" of the dot before, which ends at {over:.6g} s"
                )
            over = values["brake_delay"] + values["brake_width"]
        begun = history[0] / rate - values["advance"]
        if history[0] and begun < over - _NEAR:
            raise InputError(
                f"{where}: advance = {values['advance']!r} s fires {begun:.6g} s after the slot of the dot"
                f" before, expected a firing after its pulses have ended, at {over:.6g} s"
            )

    @property
    def shared(self) -> npt.NDArray[np.int64]:
        """For every number of a history, that of the history it stands for."""
        return shared_numbers(self.gaps, self.reach)

    @property
    def worst(self) -> FloatArray:
        """Largest deviation at each rate, in parts of the limits, shape (R,); NaN where it is not known."""
        return np.asarray(self.deviation.max(axis=1))

    def at(self, rate: float | str) -> Settings:
        """Return what the table says at a rate, Hz, or text with a unit.

        Between two rates of the table it is interpolated in the period, entry by entry. Where the two do not
        belong together, since their brake pulses differ or one fires before a rebound and the other after it,
        the nearer one holds.

        Raises
        ------
        InputError
            The table does not reach to this rate.
        """
        asked = read_positive(rate, "Hz", "rate")
        low, high = float(self.rates[0]), float(self.rates[-1])
        if not low * (1.0 - _NEAR) <= asked <= high * (1.0 + _NEAR):
            span = f"{low:g} Hz" if low == high else f"{low:g} Hz to {high:g} Hz"
            raise InputError(f"rate = {asked:g} Hz: the table for {self.hammer!r} is made for {span}")
        after = int(np.clip(np.searchsorted(self.rates, asked), 1, max(1, self.rates.size - 1)))
        first, second = after - 1, min(after, self.rates.size - 1)
        periods = 1.0 / self.rates[[first, second]]
        share = 0.0 if first == second else float((periods[0] - 1.0 / asked) / (periods[0] - periods[1]))
        share = min(max(share, 0.0), 1.0)
        mixed = np.abs(self.advance[first] - self.advance[second]) > JUMP
        for values in (self.brake_delay, self.brake_width):
            mixed |= values[first] != values[second]
        part = np.where(mixed, float(share > 0.5), share)
        found = {}
        for name in COLUMNS:
            values = getattr(self, name)
            # Exactly the values of the table at its own rates.
            between = (1.0 - part) * values[first] + part * values[second]
            found[name] = np.where(part == 0.0, values[first], np.where(part == 1.0, values[second], between))
        return Settings(**found)

    def check_hammer(self, hammer: Hammer) -> None:
        """Make sure that a hammer is the one the table is made for.

        Raises
        ------
        InputError
            It is another one: its fingerprint differs.
        """
        if hammer.fingerprint != self.fingerprint:
            raise InputError(
                f"{hammer.path}: the table is made for another hammer, {self.hammer!r} of fingerprint"
                f" {self.fingerprint[:12]}, expected {hammer.fingerprint[:12]}"
            )

    def strategy(self, hammer: Hammer) -> TableStrategy:
        """Return the table as a way to drive a hammer, see `printhammer.printing.dots.strategy.Strategy`.

        Parameters
        ----------
        hammer : Hammer
            The hammer the table is made for. The strategy may then be tried on others that differ from it.

        Raises
        ------
        InputError
            The table is made for another one, or its pulses would need more than `largest_current`.
        """
        from printhammer.control.table.drive import TableStrategy

        self.check_hammer(hammer)
        return TableStrategy(self, hammer)

    def drive(self, hammer: Hammer, slots: Sequence[int], rate: float | str) -> Drive:
        """Return the drive that prints dots at some slots.

        Parameters
        ----------
        hammer : Hammer
            The hammer the table is made for.
        slots : sequence of int
            Numbers of the slots, ascending; slot 0 is at `printhammer.printing.dots.slots.FIRST_SLOT`.
        rate : float or str
            Slots per second, Hz, or text with a unit.

        Raises
        ------
        InputError
            As for `strategy` and `at`; or the slots do not ascend.
        """
        return self.strategy(hammer)(hammer, [tuple(slots)], read_positive(rate, "Hz", "rate"))[0]

    def to_dataset(self) -> xr.Dataset:
        """Return the table as a Dataset over `rate` and `history`, with units and provenance."""
        from printhammer.control.table.files import table_dataset

        return table_dataset(self)

    def save(self, path: str | Path) -> None:
        """Write the table as CSV (.csv), JSON (.json), C header (.h) or NetCDF (.nc), whole or not at all.

        Raises
        ------
        InputError
            The name ends in none of these, or the file cannot be written.
        """
        from printhammer.control.table.files import save_table

        save_table(self, path)

    def plot(self, **options: Any) -> Any:
        """Draw the table; returns a matplotlib figure, see `printhammer.figures.control.compensation`."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.control.compensation").plot(self, **options)


__all__ = ["COLUMNS", "MOST_GAPS", "MOST_REACH", "CompensationTable", "Settings"]
