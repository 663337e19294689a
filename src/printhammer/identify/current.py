"""Coil current under a voltage drive, as read by a current probe: simulation, and reading of records.

A record has the columns ``time`` and ``current``, optionally ``voltage``; one shot per file. The armature is
free or locked. The probe is a first-order low-pass; the current is interpolated linearly between points at
most 0.5 us apart.

The probe has errors, declared or fitted: offset, gain, delay, bandwidth and resolution.

    shown(t) = gain * lowpass(i)(t - delay) + offset,   in steps of the resolution

An error is exact, known with a standard deviation ("1 % +- 0.5 %"), or free ("fit").
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.drive.input import read_number, read_positive
from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.base import Waveform
from printhammer.errors import InputError, located
from printhammer.hammer.hammer import Hammer
from printhammer.identify.lowpass import bandwidth_of, lowpass_lines, time_constant
from printhammer.results import Declared, part
from printhammer.run.simulate import simulate
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.tables.readings import Readings, read_table

_FINEST: Final = 0.5e-6
"""Largest time step of the current before low-pass filtering, s; arbitrary."""

_MOST: Final = 2_000_000
"""Largest number of time steps in a record, to limit the memory use; arbitrary."""

_LOCKED: Final = 1e9
"""Mass that stands for a locked armature, kg; 100 N move the mass by only 0.05 um in 1 s. Arbitrary."""

_STEEP: Final = 0.3  # Arbitrary
"""Smallest voltage change between two rows that is an edge, as a fraction of the voltage range."""

_EDGES: Final = 8
"""Number of edges above which a voltage is treated as continuous and interpolated linearly; arbitrary."""

_FLOWS: Final = 0.05
"""Current at switch-on, as a fraction of the largest, above which the coil was already on; arbitrary."""

_RAMP: Final = 1e-5  # Arbitrary
"""Half the duration of an edge of a recorded voltage, as a fraction of the time between its rows."""


def check_driver(hammer: Hammer) -> None:
    """Raise `InputError` unless the hammer's waveform is a voltage."""
    if hammer.waveform is None or hammer.waveform.unit != "V":
        raise InputError(
            f"{hammer.path}: the hammer has no [waveform] that is a voltage",
            file=hammer.path,
            key="waveform",
            expected="the driver of its coil",
        )


def probe_current(
    hammer: Hammer, waveform: Waveform, t: FloatArray, *, locked: float | None = None, tau: float = 0.0
) -> FloatArray:
    """Simulate the probe current [A] at ascending times `t` [s] for a coil that is switched on at time 0.

    The armature starts at rest or is locked at a displacement [m]; `tau` is the probe's time constant [s].
    Before time 0 the current is zero.

    Raises
    ------
    InputError
        The hammer has no coil circuit, the record is too long, or the simulation fails.
    """
    after = t[t >= 0.0]
    shown = np.zeros(len(t))
    if not len(after) or not after[-1] > 0.0:
        return shown
    knots = np.concatenate([[0.0], after]) if after[0] > 0.0 else after
    each = max(1, math.ceil(float(np.diff(knots).max()) / _FINEST - 1e-9)) if tau else 1
    count = each * (len(knots) - 1)
    if count > _MOST:
        raise InputError(
            f"a record of {after[-1]:.6g} s is too long for the probe",
            key="record",
            expected="a shorter record, or another unit of its times",
        )
    fine = np.interp(np.arange(count + 1) / each, np.arange(len(knots)), knots)
    state = None
    if locked is not None:
        hammer, state = hammer.replace("mass", _LOCKED), (locked, 0.0)
    run = simulate(hammer, PulseTrain(waveform), duration=float(fine[-1]), state=state, points=2)
    if not run.ok:
        raise InputError(
            f"{hammer.path}: the simulation of the current ended early: {run.message}",
            file=hammer.path,
            key="current",
        )
    current = lowpass_lines(fine, run.driven_at(fine), tau)[::each]
    shown[t >= 0.0] = current[len(knots) - len(after) :]
    return shown


class Trace(Declared, eq=False):
    """Record of a coil current with its driving voltage."""

    table: Readings = part("columns of the record")
    waveform: Waveform = part(
        "voltage of the hammer's driver, or recorded voltage with its edges halfway between rows"
    )
    locked: float | None = part("displacement at which the armature is held, m; None if it is free")
    tau: float = part("time constant of the probe, stated in the table, s")
    times: FloatArray = part("time since switch-on, or since the start of a recorded voltage, s")
    edges: IntArray = part("indices of the rows after which the voltage jumps")

    @property
    def step(self) -> float:
        """Median time between rows, s."""
        return float(np.median(np.diff(self.times)))

    def driven(self, shifts: FloatArray) -> Waveform:
        """Return the recorded voltage as a waveform.

        `shifts` contains the time from the middle between the two rows of each edge to the edge, s.
        """
        if not self.edges.size:
            return self.waveform
        t, volts = self.times, self.table.values["voltage"]
        middle = 0.5 * (t[self.edges] + t[self.edges + 1]) + shifts
        half = _RAMP * (t[self.edges + 1] - t[self.edges])
        times = np.concatenate([t, middle - half, middle + half])
        values = np.concatenate([volts, volts[self.edges], volts[self.edges + 1]])
        order = np.argsort(times, kind="stable")
        return _sampled(self.table, times[order], values[order])


def read_trace(
    path: str | Path, hammer: Hammer, locked: float | None, has_offset: bool, columns: str | None = None
) -> Trace:
    """Read a record of a coil current.

    `locked` is the displacement at which the armature was locked, m; if None, the displacement stated in a
    comment of the record, else the armature was free. `has_offset` states that the probe has an offset; the
    record may then begin with a nonzero current. `columns` is as in `printhammer.identify.coil.fit_coil`.
    """
    table = read_table(path, {"time": "s", "current": "A"}, optional={"voltage": "V"}, columns=columns)
    table.check_times()
    t = table.values["time"]
    recorded = "voltage" in table.values
    if not (t[-1] > 0.0 or recorded) or len(t) < 2:
        raise InputError(
            f"{table.path}: no time after 0 s",
            file=table.path,
            key="time",
            expected="a record that begins at switch-on",
        )
    if locked is None and "locked" in table.comments:
        text = table.comments["locked"]
        try:
            locked = read_number(text, "m", f"{table.path}: the comment 'locked'")
        except InputError as error:
            raise InputError(str(error), file=table.path, key="locked", value=text) from None
    if not has_offset:
        _check_begin(table, recorded)
    tau = time_constant(bandwidth_of(table))
    if not recorded:
        with located(f"{table.path}: the table has no column 'voltage'"):
            check_driver(hammer)
        assert hammer.waveform is not None
        return Trace(table, hammer.waveform, locked, tau, t, np.empty(0, dtype=np.int64))
    volts = table.values["voltage"]
    edges = np.flatnonzero(np.abs(np.diff(volts)) > _STEEP * float(np.ptp(volts)))
    edges = edges if edges.size <= _EDGES else edges[:0]
    times = t - t[0]
    made = Trace(table, _sampled(table, times, volts), locked, tau, times, edges)
    return replace(made, waveform=made.driven(np.zeros(edges.size)))


def _check_begin(table: Readings, recorded: bool) -> None:
    """Raise `InputError` if current flows at switch-on or, with a `recorded` voltage, in the first row."""
    t, current = table.values["time"], np.abs(table.values["current"])
    before = current[:1] if recorded else current[t <= 0.0][-3:]
    if before.size and float(np.median(before)) > _FLOWS * float(current.max()):
        when = "when the record begins" if recorded else "at time 0"
        raise InputError(
            f"{table.path}: a current of {float(before[-1]):.3g} A flows {when}",
            file=table.path,
            key="time",
            expected=(
                "times counted from switch-on, a column 'voltage' that begins earlier, or a probe offset"
            ),
        )


def _sampled(table: Readings, times: FloatArray, volts: FloatArray) -> Waveform:
    from printhammer.drive.waveforms.sampled import Sampled

    with located(str(table.path)):
        return Sampled.from_samples(times, volts, quantity="voltage", interpolation="linear")


FIT: Final = "fit"
"""Value of a probe-error option that requests a fit of the error."""

NOMINAL: Final = {"offset": 0.0, "gain": 1.0, "delay": 0.0, "time constant": 0.0}
"""Offset, gain, delay and time constant of an ideal probe, by definition, SI."""

UNITS: Final = {"offset": "A", "gain": "1", "delay": "s", "time constant": "s"}

SIGNS: Final = {
    "offset": "the current has a constant error, like that of a probe offset: state or fit the offset",
    "gain": "the current has a scale error, like that of a probe gain: state or fit the gain",
    "delay": "the current is shifted in time, as by a probe delay: state or fit the delay",
    "time constant": "the current is too smooth, as by a limited probe bandwidth: state or fit the bandwidth",
}
"""Advice for each undeclared probe error that a record reveals, by name of the error."""

_WIDEST: Final = 0.2
"""Upper bound of a fitted time constant, as a fraction of the duration of the longest record; arbitrary."""


class ProbeError(Declared):
    """Probe error with its standard deviation."""

    name: str = part("offset, gain, delay or time constant")
    value: float = part("value, SI")
    deviation: float = part("standard deviation, SI; 0 if exact, infinite if free")

    @property
    def is_fitted(self) -> bool:
        """Whether the probe error is a parameter of the fit, not an exact constant."""
        return self.deviation > 0.0

    @property
    def key(self) -> str:
        """Key of the probe error in a fit result, such as "probe.gain"."""
        return f"probe.{self.name.replace(' ', '_')}"

    @property
    def text(self) -> str:
        """Value with its unit, and with its standard deviation unless exact."""
        unit = UNITS[self.name]
        return f"{self.value!r} {unit}" + (f" +- {self.deviation:.3g} {unit}" if self.deviation else "")


def read_probe(settings: Mapping[str, float | str | None], step: float) -> list[ProbeError]:
    """Parse the declared errors of a probe; `step` is the sampling interval, s.

    The settings are "offset" [A], "gain" [1], "delay" [s] and "bandwidth" [Hz]. Each is a number or a text
    with a unit, a value with its standard deviation such as "0 us +- 5 us", or "fit"; None stands for an
    undeclared error.
    """
    errors = []
    for name, written in settings.items():
        if written is None:
            continue
        if name not in _SI:
            raise InputError.of("probe", name, f"one of {', '.join(_SI)}")
        value, deviation = _read(name, written)
        if name == "bandwidth":
            if math.isinf(deviation):
                errors.append(ProbeError("time constant", step, deviation))
                continue
            tau = time_constant(value)
            errors.append(ProbeError("time constant", tau, tau * deviation / value))
        else:
            errors.append(ProbeError(name, value, deviation))
    return errors


_SI: Final = {"offset": "A", "gain": "1", "delay": "s", "bandwidth": "Hz"}


def _read(name: str, written: float | str) -> tuple[float, float]:
    if isinstance(written, str) and written.strip() == FIT:
        return NOMINAL.get(name, math.nan), math.inf
    deviation = 0.0
    if isinstance(written, str):
        written, mark, error = (each.strip() for each in written.replace("±", "+-").partition("+-"))
        if mark:
            deviation = abs(read_number(error, _SI[name], f"the standard deviation of {name}"))
    read = read_positive if name in ("bandwidth", "gain") else read_number
    return read(written, _SI[name], name), deviation


def bounds_of(error: ProbeError, longest: float) -> tuple[float, float]:
    """Return the bounds of a fitted probe error, SI; `longest` is the duration of the longest record, s."""
    if error.name == "gain":
        return 0.1 * error.value, 10.0 * error.value
    if error.name == "time constant":
        return 1e-3 * error.value, _WIDEST * longest
    reach = 0.5 * longest if error.name == "delay" else math.inf
    return error.value - reach, error.value + reach


def resolution_of(values: FloatArray) -> float:
    """Return the quantisation step of readings; 0 without quantisation, or if too few values repeat."""
    levels = np.unique(values)
    if len(levels) < 3 or len(levels) == len(values):
        return 0.0
    step = float(np.diff(levels).min())
    counts = (levels - levels[0]) / step
    return step if float(np.abs(counts - np.rint(counts)).max()) < _WHOLE else 0.0


_WHOLE: Final = 0.02  # Arbitrary
"""Largest deviation of readings from whole steps, as a fraction of the step; allows for rounding in files."""


def plateaus(fitted: FloatArray, series: IntArray, step: float) -> IntArray:
    """Return the index of the quantisation plateau of each row.

    A plateau is a run of consecutive rows of one series whose fitted values round to the same multiple of the
    quantisation step `step`.
    """
    code = np.rint(fitted / step)
    begins = (np.diff(code) != 0.0) | (np.diff(series) != 0)
    return np.concatenate([[0], np.cumsum(begins)]).astype(np.int64)
