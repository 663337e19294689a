"""The circuit of a coil from records of its current under a voltage: resistance, inductance, and what else.

    current(t) = that of the equation of motion with the circuit of the coil

Data: the columns ``time``, from switching on, and ``current``, perhaps ``voltage``; one shot a file. Where
there is no voltage, the hammer's own driver is what switches. The final current tells the resistance, the
rise the inductance, what bends it a shorted turn or the saturation; an armature that moves adds its own.

What a current probe shows of a coil that a voltage drives, with a free armature or a locked one.

The probe is a first-order low-pass. Between moments at most 0.5 us apart the current is taken as straight.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.drive.input import read_number
from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.base import Waveform
from printhammer.errors import InputError, located
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import quantity_of, unknown
from printhammer.identify.least_squares import Parameters
from printhammer.identify.lowpass import bandwidth_of, lowpass_lines, time_constant
from printhammer.identify.result import Fit
from printhammer.identify.static.assemble import Data, assemble, enough, judge, solved
from printhammer.results import Declared, part
from printhammer.run.simulate import simulate
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.readings import Readings, read_table

_FINEST: Final = 0.5e-6
"""Largest step of the current that goes through the probe, s."""

_MOST: Final = 2_000_000
"""Steps of a record, which bound its room in the memory."""

_LOCKED: Final = 1e9
"""Mass of a locked armature, kg: in a second 100 N move it by 0.05 um."""


def check_driver(hammer: Hammer) -> None:
    """Refuse a hammer whose waveform is no voltage."""
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
    """Return what a probe shows at ascending times, s, of a coil switched on at time 0, A, shape of `t`.

    The armature begins at rest, or is locked at a displacement, m; `tau` is the time constant of the
    probe, s. Before time 0 there is no current.

    Raises
    ------
    InputError
        The hammer has no circuit for a voltage, the record is too long, or the run does not reach its end.
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
            f"a record of {after[-1]:.6g} s is too long for the probe", key="record", expected="a shorter one"
        )
    fine = np.interp(np.arange(count + 1) / each, np.arange(len(knots)), knots)
    state = None
    if locked is not None:
        hammer, state = hammer.replace("mass", _LOCKED), (locked, 0.0)
    run = simulate(hammer, PulseTrain(waveform), duration=float(fine[-1]), state=state, points=2)
    if not run.ok:
        raise InputError(
            f"{hammer.path}: the current did not reach its end: {run.message}",
            file=hammer.path,
            key="current",
        )
    current = lowpass_lines(fine, run.driven_at(fine), tau)[::each]
    shown[t >= 0.0] = current[len(knots) - len(after) :]
    return shown


FREE: Final = ("coil.resistance", "coil.inductance")
"""What is fitted unless others are named."""

_STEP: Final = 1e-4
"""Of the differences for the derivatives, relative: well above the errors of the integration."""

_REACH: Final = 1e3
"""Factor by which constants may go away from those that the fit begins with."""

_TOLERANCE: Final = 1e-10
"""Relative tolerance of the descents: derivatives by differences are no better."""

_SPARE: Final = 4
"""Rows more than parameters, for the errors."""

_EXACT: Final = 1e-6
"""Residuals below this part of the current are errors of the integration: they test no law."""


class Trace(Declared, eq=False):
    """One record, and what drove it."""

    table: Readings = part("its columns")
    waveform: Waveform = part("the voltage")
    locked: float | None = part("where the armature is held, m; None where it is free")
    tau: float = part("time constant of the probe, s")


def fit_coil(
    paths: Sequence[str | Path],
    hammer: Hammer,
    *,
    free: Sequence[str] | None = None,
    locked: float | str | None = None,
    bandwidth: float | None = None,
    robust: bool = True,
) -> Fit:
    """Fit constants of the circuit to records of the current, one shot each.

    Parameters
    ----------
    paths : sequence of path
        Tables with the columns ``time``, ``current`` and perhaps ``voltage``, which then drives the coil.
    hammer : Hammer
        All that is known; its values are where the fit begins. A resistance or inductance that it does not
        state is estimated first.
    free : sequence of str, optional
        Constants to find, by default `FREE`; such as "coil.turn_resistance", "magnet.saturation_flux".
    locked : float or str, optional
        Displacement at which the armature was held, m; by default what a comment ``# locked: 100 um`` says,
        and else it is free.
    bandwidth : float, optional
        Of the probe, Hz; by default what a comment ``# bandwidth: 200 kHz`` says, and else unlimited.
    robust : bool, optional
        Whether rows that lie too far off are left out.

    Raises
    ------
    InputError
        A record cannot be used or is too short, a constant is not known or not stated, or the hammer has no
        circuit for a voltage.
    """
    names = list(dict.fromkeys(FREE if free is None else free))
    if not names:
        raise InputError("no constants to find", key="free", expected="one or more, such as coil.inductance")
    place = None if locked is None else read_number(locked, "m", "locked")
    traces = [_read(path, hammer, place, bandwidth) for path in paths]
    hammer, start = _start(hammer, names, traces[0])
    units = [_unit(hammer, name) for name in names]
    law = CurrentLaw(hammer, names, traces)
    data = _data(traces)
    enough(data, len(names) + _SPARE, "the constants of the coil and their errors")
    # What the hammer lacks is said here; on the way constants that make no circuit are only passed over.
    law.simulated(start)
    space = Parameters.of(start, low=start / _REACH, high=start * _REACH, size=0.0, tolerance=_TOLERANCE)
    solution = solved(data, law, space, robust=robust)
    p_value, why = math.nan, ""
    if solution.residual_scale > _EXACT * float(np.abs(data.values).max()):
        p_value, why = judge(solution, {}, data.abscissa, data.series)
    held = sorted({trace.locked for trace in traces if trace.locked is not None})
    return assemble(
        data,
        law,
        solution,
        [(name, unit, True) for name, unit in zip(names, units, strict=True)],
        given={"armature locked at": ", ".join(f"{place!r} m" for place in held)} if held else {},
        remedies=dict.fromkeys(names, "a longer record, or one with less noise"),
        rejected=why,
        p_value=p_value,
    )


class CurrentLaw:
    """Currents of all records, A, shape (m,); p are the values of the constants named, SI."""

    def __init__(self, hammer: Hammer, names: list[str], traces: list[Trace]) -> None:
        self.hammer, self.names, self.traces = hammer, names, traces
        self._values: dict[bytes, FloatArray] = {}
        self._slopes: dict[bytes, FloatArray] = {}

    def simulated(self, p: FloatArray) -> FloatArray:
        """Return the currents."""
        hammer = self.hammer.replace(dict(zip(self.names, p.tolist(), strict=True)))
        return np.concatenate(
            [
                probe_current(
                    hammer, trace.waveform, trace.table.values["time"], locked=trace.locked, tau=trace.tau
                )
                for trace in self.traces
            ]
        )

    def value(self, p: FloatArray) -> FloatArray:
        """Return the currents; NaN where the constants make no circuit."""

        def made() -> FloatArray:
            try:
                return self.simulated(p)
            except InputError:
                return np.full(sum(len(trace.table) for trace in self.traces), math.nan)

        return _kept(self._values, p, made)

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Return the derivatives by the parameters, by central differences."""

        def made() -> FloatArray:
            steps = _STEP * p
            columns = [
                (self.value(p + step) - self.value(p - step)) / (2.0 * size)
                for size, step in zip(steps, np.diag(steps), strict=True)
            ]
            return np.column_stack(columns)

        return _kept(self._slopes, p, made)

    def spread(self, p: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the components of the variance: one error of the probe for each record."""
        count = len(self.traces)
        return np.repeat(np.eye(count), [len(trace.table) for trace in self.traces], axis=0)


def _kept(known: dict[bytes, FloatArray], p: FloatArray, made: Callable[[], FloatArray]) -> FloatArray:
    """Return what was computed at parameters before, or compute it: a fit asks for the same ones often."""
    key = p.tobytes()
    if key not in known:
        known[key] = made()
    return known[key]


def _read(path: str | Path, hammer: Hammer, locked: float | None, bandwidth: float | None) -> Trace:
    table = read_table(path, {"time": "s", "current": "A"}, optional={"voltage": "V"})
    table.check_times()
    t = table.values["time"]
    if not t[-1] > 0.0:
        raise InputError(
            f"{table.path}: no time after 0 s",
            file=table.path,
            key="time",
            expected="a record from switching on",
        )
    if locked is None and "locked" in table.comments:
        text = table.comments["locked"]
        try:
            locked = read_number(text, "m", f"{table.path}: the comment 'locked'")
        except InputError as error:
            raise InputError(str(error), file=table.path, key="locked", value=text) from None
    width = bandwidth_of(table) if bandwidth is None else bandwidth
    if "voltage" in table.values:
        from printhammer.drive.waveforms.sampled import Sampled

        after = t >= 0.0
        with located(str(table.path)):
            waveform: Waveform = Sampled.from_samples(
                t[after], table.values["voltage"][after], quantity="voltage", interpolation="linear"
            )
    else:
        with located(f"{table.path}: the table has no column 'voltage'"):
            check_driver(hammer)
        assert hammer.waveform is not None
        waveform = hammer.waveform
    return Trace(table, waveform, locked, time_constant(width))


def _start(hammer: Hammer, names: list[str], trace: Trace) -> tuple[Hammer, FloatArray]:
    """Return the hammer with a coil that has a resistance, and the values with which the fit begins."""
    t, current = trace.table.values["time"], np.abs(trace.table.values["current"])
    top = int(np.argmax(current))
    if not (current[top] > 0.0 and trace.waveform.peak > 0.0):
        raise InputError(
            f"{trace.table.path}: there is no current or no voltage",
            file=trace.table.path,
            key="current",
            expected="a record of both",
        )
    resistance = trace.waveform.peak / float(current[top])
    rise = float(t[int(np.argmax(current > 0.5 * current[top]))])
    inductance = resistance * max(rise, float(np.diff(t).min())) / math.log(2.0)
    guesses = zip(FREE, (resistance, inductance), strict=True)
    changes = {name: guess for name, guess in guesses if name in names and not _stated(hammer, name)}
    if changes:
        hammer = hammer.replace(changes)
    for name in names:
        _unit(hammer, name)
        if not _stated(hammer, name):
            raise InputError(
                f"{hammer.path}: {name} is not more than 0",
                file=hammer.path,
                key=name,
                expected="a value with which the fit begins",
            )
    return hammer, np.array([hammer.constants[name].si for name in names])


def _stated(hammer: Hammer, name: str) -> bool:
    return name in hammer.constants and hammer.constants[name].si > 0.0


def _unit(hammer: Hammer, name: str) -> str:
    note = quantity_of(hammer, name)
    if note is None or name.startswith("waveform."):
        known = [key for key in hammer.constants if not key.startswith("waveform.")]
        raise unknown(name, known, f"{hammer.path}: constant")
    return note.si


def _data(traces: list[Trace]) -> Data:
    tables = [trace.table for trace in traces]
    return Data(
        tuple(table.path for table in tables),
        "coil",
        np.concatenate([table.values["time"] for table in tables]),
        np.concatenate([table.values["current"] for table in tables]),
        (("time", "s"), ("current", "A")),
        np.repeat(np.arange(len(tables)), [len(table) for table in tables]),
        tuple(table.path.name for table in tables),
        np.concatenate([table.lines for table in tables]),
    )
