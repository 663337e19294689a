"""What the drives of an ensemble fire, as arrays: a few forms of pulses, and many firing times."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from printhammer.drive.batch import PulseTrains, firings_of
from printhammer.kernel.lanes import layout as lane_layout
from printhammer.kernel.model.layout import CUBIC_PIECE, END, EXPONENTIAL_PIECE, SINE_PIECE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.base import Supply
    from printhammer.kernel.compile.lanes import LaneKinds
    from printhammer.support.arrays import FloatArray


class Form(NamedTuple):
    """What is left of a drive without its firing times.

    Attributes
    ----------
    table : int
        Number of its segment tables among those of all drives.
    replace, force : bool
        Whether a firing cuts off the pulses before it; whether it is a force.
    peak : float
        Largest absolute value of any one pulse, A, N or V.
    supply : Supply
        Supply of a voltage.
    """

    table: int
    replace: bool
    force: bool
    peak: float
    supply: Supply


class Fired:
    """The drives of all members of an ensemble, in the order of the members.

    Attributes
    ----------
    drives : sequence of Drive
        The drives themselves.
    forms, form_of : list of Form; int array, shape (members,)
        What forms there are, and which one is a member's.
    firings : Ragged
        Firing times of the members, s.
    begins : int array, shape (all firings,)
        Row of the member's tables at which that of each firing begins.
    table_of, peak_of, supply_of : array, shape (members,)
        Table, peak and number of the supply of the form of each member.
    tables, rates, kinds : list
        The segment tables, and what `closed_form` says of each.
    """

    def __init__(self, drives: Sequence[Drive]) -> None:
        self.drives = drives
        self.forms: list[Form] = []
        self.tables: list[FloatArray] = []
        self.rates: list[list[float]] = []
        self.kinds: list[LaneKinds | None] = []
        self._tables: dict[bytes, int] = {}
        self._peaks: dict[int, float] = {}
        self._forms: dict[Form, int] = {}
        self.firings = firings_of(drives)
        if isinstance(drives, PulseTrains):
            places = np.array([self._add(pulse) for pulse in drives.pulses], dtype=np.int64)
            self.form_of = places[drives.pulse_of]
            self.begins = np.zeros(self.firings.values.size, np.int64)
        else:
            # Members are often driven by the same object.
            known = {id(drive): drive for drive in drives}
            added = {key: (self._add(drive), drive.kernel_arrays()[1]) for key, drive in known.items()}
            self.form_of = np.array([added[id(drive)][0] for drive in drives], dtype=np.int64)
            begins = [added[id(drive)][1] for drive in drives]
            self.begins = np.concatenate([np.zeros(0, np.int64), *begins])
        self.table_of = np.array([form.table for form in self.forms], dtype=np.int64)[self.form_of]
        self.peak_of = np.array([form.peak for form in self.forms])[self.form_of]
        supplies = {
            supply: number for number, supply in enumerate({form.supply: None for form in self.forms})
        }
        self.supply_of = np.array([supplies[form.supply] for form in self.forms])[self.form_of]

    def _add(self, drive: Drive) -> int:
        """Return the number of the form of a drive, a new one if need be."""
        _times, _begins, pieces, replace, force = drive.kernel_arrays()
        content = pieces.tobytes()
        if content not in self._tables:
            self._tables[content] = len(self.tables)
            self.tables.append(np.array(pieces, dtype=np.float64))
            rates, kinds = closed_form(pieces)
            self.rates.append(rates)
            self.kinds.append(kinds)
        table = self._tables[content]
        if drive.bounded:
            peak = drive.largest_pulse
        else:
            if table not in self._peaks:
                self._peaks[table] = drive.largest_pulse
            peak = self._peaks[table]
        form = Form(table, bool(replace), bool(force), peak, drive.waveform.supply())
        if form not in self._forms:
            self._forms[form] = len(self.forms)
            self.forms.append(form)
        return self._forms[form]


def closed_form(table: FloatArray) -> tuple[list[float], LaneKinds | None]:
    """Return the rates of the pieces of a set of waveforms, and what kinds of pieces there are, for lanes.

    None instead of the kinds where the waveforms have more rates than lanes provide for.
    """
    pieces = table[table[:, 1] != END]
    kind = pieces[:, 1]
    decays = np.unique(pieces[kind == EXPONENTIAL_PIECE, 4])
    frequencies = np.unique(pieces[kind == SINE_PIECE, 4])
    rates = [0.0] * lane_layout.RATES_WIDTH
    if len(decays) > 2 or len(frequencies) > 1:
        return rates, None
    rates[: len(decays)] = decays
    rates[2 : 2 + len(frequencies)] = frequencies
    return rates, (len(decays), bool(pieces[kind == CUBIC_PIECE, 3:].any()), len(frequencies) > 0)
