"""Dead time: the time from switching on to impact, as a function of rail voltage and coil temperature.

A warm coil draws less current, and on a low rail the current rises more slowly, so the dot comes later and
softer. Firmware that knows both can fire earlier and longer. For each rail and temperature of a grid, the
hammer's own pulse is simulated from rest; then the pulse width that gives a constant impact speed ("blow") is
computed; by default, the blow is the impact speed of the own pulse at the rail and temperature of the hammer
file. The results can be exported as a C header with tables and an interpolating function.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Unpack

import numpy as np

from printhammer.control.duty import read_temperature
from printhammer.control.pulses import of_width
from printhammer.drive.input import read_positive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.files import ENDINGS
from printhammer.results.summary import (
    Cells,
    Facts,
    Grid,
    Summary,
    quantity,
    styled,
)
from printhammer.run.effort import DEFAULT, Effort, InOneThread, computation
from printhammer.support import c_code
from printhammer.support.arrays import FloatArray, TextArray
from printhammer.support.files import write_file

_NANOSECOND: Final = 1e-9  # Unit of the times in a C header, s


def header_text(
    hammer: str,
    fingerprint: str,
    voltage: FloatArray,
    temperature: FloatArray,
    tables: Mapping[str, FloatArray],
) -> str:
    """Render dead times and pulse widths as a C header (C99); units: mV, 0.1 degC and ns.

    `tables` are times, s, by name, over rails, V, and temperatures, degC; NaN becomes 0.
    """
    prefix = c_code.identifier(hammer)
    upper, guard = prefix.upper(), f"{prefix}_dead_time_h".upper()
    arrays = "\n".join(
        c_code.table("int32_t", f"{prefix}_{name}", np.rint(np.nan_to_num(times) / _NANOSECOND))
        for name, times in tables.items()
    )
    return f"""\
#ifndef {guard}
#define {guard}

/* Dead time of the hammer {c_code.comment(hammer)},
   fingerprint {fingerprint}.
   Tables are indexed [rail][coil temperature]; times are in nanoseconds, 0 if no pulse width gives the
   impact speed. A dot is fired `dead_time` before its impact, with a pulse of `width`. */

#include <stdint.h>

#define {upper}_RAILS {voltage.size}
#define {upper}_TEMPERATURES {temperature.size}

/* Rail voltages, in millivolts. */
static const int32_t {prefix}_rail[{voltage.size}] = {{
{c_code.numbers(np.rint(1e3 * voltage))}
}};

/* Coil temperatures, in tenths of a degree Celsius. */
static const int32_t {prefix}_temperature[{temperature.size}] = {{
{c_code.numbers(np.rint(10.0 * temperature))}
}};

{arrays}
/* Interpolate a table bilinearly, clipped to its edges; 0 if one of the four entries is 0. */
static inline int32_t {prefix}_between(
  const int32_t table[{upper}_RAILS][{upper}_TEMPERATURES], int32_t millivolts, int32_t tenths)
{{
  const int32_t *rail = {prefix}_rail, *warm = {prefix}_temperature;
  unsigned i = 0, j = 0;
  while (i + 2u < {upper}_RAILS && millivolts > rail[i + 1u]) i++;
  while (j + 2u < {upper}_TEMPERATURES && tenths > warm[j + 1u]) j++;
  unsigned k = {upper}_RAILS > 1 ? i + 1u : i, l = {upper}_TEMPERATURES > 1 ? j + 1u : j;
  int64_t a = table[i][j], b = table[k][j], c = table[i][l], d = table[k][l];
  if (a == 0 || b == 0 || c == 0 || d == 0) return 0;
  int64_t p = millivolts < rail[i] ? rail[i] : millivolts > rail[k] ? rail[k] : millivolts;
  int64_t q = tenths < warm[j] ? warm[j] : tenths > warm[l] ? warm[l] : tenths;
  if (k > i) {{
    a += (b - a) * (p - rail[i]) / (rail[k] - rail[i]);
    c += (d - c) * (p - rail[i]) / (rail[k] - rail[i]);
  }}
  return (int32_t)(l > j ? a + (c - a) * (q - warm[j]) / (warm[l] - warm[j]) : a);
}}

#endif
"""


MOST: Final = 10_000
"""Largest number of pairs of rail voltage and coil temperature in a grid; arbitrary."""

LONGEST: Final = 8.0
"""Width of the longest pulse, and length of a simulation, in flight times at the nominal rail."""

SHORTEST: Final = 1.0 / 64.0
"""Width of the shortest pulse, as a fraction of the flight time with the longest pulse."""

_DOUBLINGS: Final = 6  # Iteration limit of the doublings that bracket the width; arbitrary
_WIDTH_ERROR: Final = 1e-9  # Tolerance of the width, in flight times
_SAME: Final = 1e-9  # Relative tolerance of the impact speed


class DeadTime(Result, rows="voltage temperature", endings=(*ENDINGS, ".h")):
    """Table of the time from switch-on to impact, by rail voltage and coil temperature."""

    hammer: Hammer = part("driven hammer")
    blow: float = scalar("m/s", "impact speed that the solved widths give")
    own_width: float = scalar("s", "width of the hammer's own pulse")
    own_time: float = scalar(
        "s", "time from switching on to impact with the own pulse at nominal rail and temperature"
    )
    voltage: FloatArray = coordinate("V", "rail voltage", "voltage")
    temperature: FloatArray = coordinate("degC", "temperature of the coil", "temperature")
    time: FloatArray = column(
        "s",
        "time from switching on to impact with the hammer's own pulse",
        "voltage temperature",
        more="NaN, as the next three columns, if the hammer does not reach the pack",
    )
    speed: FloatArray = column("m/s", "impact speed with the own pulse", "voltage temperature")
    current: FloatArray = column("A", "largest current with the own pulse", "voltage temperature")
    heat: FloatArray = column("J", "coil heat with the own pulse", "voltage temperature")
    status: TextArray = column(
        "", "status of the simulation with the own pulse", "voltage temperature", more="as for a motion"
    )
    strongest: FloatArray = column(
        "m/s", "impact speed with a pulse that lasts until impact", "voltage temperature"
    )
    width: FloatArray = column(
        "s",
        "pulse width that gives the impact speed `blow`",
        "voltage temperature",
        more="NaN, as the next two columns, if no width gives that impact speed",
    )
    width_time: FloatArray = column(
        "s", "time from switching on to impact with that width", "voltage temperature"
    )
    width_heat: FloatArray = column("J", "coil heat with that width", "voltage temperature")

    @property
    def title(self) -> str:
        """One-line title with the name of the hammer."""
        return f"dead time of {self.hammer.name}"

    def summary(self) -> Summary:
        """Tabulate times and pulse widths by rail voltage and temperature; list points without a solution."""
        own = f"{quantity(self.own_width, 's')}, impact after {quantity(self.own_time, 's')}"
        rail, coil = np.meshgrid(self.voltage, self.temperature, indexing="ij")
        columns = [
            Cells("rail", rail.ravel(), "V", ".4g"),
            Cells("coil", coil.ravel(), "°C", "g"),
            self.cells("time", "own pulse:\nimpact after"),
            self.cells("speed"),
            self.cells("heat"),
            self.cells("width", "same blow:\nwidth"),
            self.cells("width_time", "impact after"),
            self.cells("width_heat", "heat"),
        ]
        facts = Facts([("own pulse", own), ("blow", quantity(self.blow, "m/s"))])
        none = np.isnan(self.width)
        strong = none & (self.strongest >= self.blow * (1.0 - _SAME))
        pairs = f"of {none.size} pairs of rail and temperature"
        lacking = []
        if (weak := none & ~strong).any():
            lacking.append(
                f"No width gives the blow at {int(weak.sum())} {pairs};"
                f" {quantity(self.reached, 'm/s')} is the strongest blow that all of them reach."
            )
        if strong.any():
            lacking.append(
                f"At {int(strong.sum())} {pairs} the shortest pulse that the driver can give strikes"
                " harder than the blow."
            )
        return Summary(
            [facts, "", Grid(columns, most=24), *(styled("poor", f"\n{each}") for each in lacking)]
        )

    @property
    def reached(self) -> float:
        """Largest impact speed, m/s, attainable at all grid points with an impact; 0 without an impact."""
        known = self.strongest[np.isfinite(self.strongest)]
        return float(known.min()) if known.size else 0.0

    def to_header(self) -> str:
        """Render a C header (C99): widths and dead times in nanoseconds, and an interpolating function."""
        tables = {"width": self.width, "dead_time": self.width_time}
        return header_text(self.hammer.name, self.hammer.fingerprint, self.voltage, self.temperature, tables)

    def save(self, path: str | Path) -> None:
        """Write the table in the format of the file suffix, a C header (.h) among others, atomically.

        Raises
        ------
        InputError
            The suffix is not one of `ENDINGS`, or the file cannot be written.
        """
        if Path(path).suffix.lower() == ".h":
            write_file(Path(path), self.to_header())
        else:
            super().save(path)


@dataclass(frozen=True)
class _Fired:
    """Firing from rest: impact time, s, and speed, m/s, peak current, A, coil heat, J; NaN without impact."""

    time: float = np.nan
    speed: float = np.nan
    current: float = np.nan
    heat: float = np.nan
    status: str = "ok"


@computation
def dead_time(
    hammer: Hammer,
    *,
    voltage: Sequence[float | str] = (),
    temperature: Sequence[float | str] = (),
    blow: float | str | None = None,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[InOneThread],
) -> DeadTime:
    """Compute time to impact and pulse width at equal impact speed, by rail voltage and coil temperature.

    Parameters
    ----------
    hammer : Hammer
        The hammer, whose waveform must be a driver on a rail.
    voltage : sequence of float or str, optional
        Rail voltages, V, in any order; by default that of the waveform, and 10 % below and above.
    temperature : sequence of float or str, optional
        Coil temperatures, degC; by default 20, 60 and 100 degC.
    blow : float or str, optional
        Impact speed, m/s, for which widths are computed; by default the impact speed of the own pulse at
        nominal rail and temperature, which a lower rail or a warmer coil may not reach.

    Raises
    ------
    InputError
        The hammer has no driver with a width, does not strike at its nominal rail, or the grid is too large.
    """
    waveform = hammer.waveform
    own: Any = waveform
    if waveform is None or not hasattr(waveform, "voltage"):
        raise InputError(
            f"{hammer.path}: expected a [waveform] that is a driver on a rail, such as 'rail'",
            file=hammer.path,
            key="waveform",
        )
    rails = np.unique([read_positive(each, "V", "voltage") for each in voltage])
    warm = np.unique([read_temperature(each, "temperature") for each in temperature])
    rails = rails if rails.size else own.voltage * np.array([0.9, 1.0, 1.1])
    warm = warm if warm.size else np.array([20.0, 60.0, 100.0])
    if rails.size * warm.size > MOST:
        raise InputError(
            f"{rails.size} rails and {warm.size} temperatures", key="rails", expected=f"at most {MOST} pairs"
        )
    reference, reach = _reference(hammer, waveform, effort.tolerance)
    wanted = reference.speed if blow is None else read_positive(blow, "m/s", "blow")
    shape = rails.size, warm.size
    names = ("time", "speed", "current", "heat", "strongest", "width", "width_time", "width_heat")
    arrays = {name: np.full(shape, np.nan) for name in names}
    status = np.full(shape, "ok", dtype=object)
    for j, degrees in enumerate(warm.tolist()):
        coil = hammer.replace("coil.temperature", degrees)
        for i, volts in enumerate(rails.tolist()):
            effort.report(j * rails.size + i, rails.size * warm.size)
            pulse = waveform.scaled(volts / own.voltage)
            fired = _fire(coil, pulse, reach, effort.tolerance)
            status[i, j] = fired.status
            longest = _fire(coil, of_width(pulse, reach), reach, effort.tolerance)
            width = _same_blow(coil, pulse, wanted, longest, effort.tolerance)
            again = (
                _Fired() if width is None else _fire(coil, of_width(pulse, width), reach, effort.tolerance)
            )
            own_pulse = (fired.time, fired.speed, fired.current, fired.heat, longest.speed)
            values = (*own_pulse, np.nan if width is None else width, again.time, again.heat)
            for name, value in zip(names, values, strict=True):
                arrays[name][i, j] = value
    effort.report(rails.size * warm.size, rails.size * warm.size)
    return DeadTime(
        hammer=hammer,
        blow=wanted,
        own_width=own.width,
        own_time=reference.time,
        voltage=rails,
        temperature=warm,
        status=status.astype(np.str_),
        **arrays,
    )


def _reference(hammer: Hammer, waveform: Waveform, tolerance: float) -> tuple[_Fired, float]:
    """Simulate a firing at the nominal rail; return its outcome and the time span for other firings, s."""
    span = 4.0 * float(waveform.width)  # type: ignore[attr-defined]
    for _ in range(_DOUBLINGS):
        fired = _fire(hammer, waveform, span, tolerance)
        if fired.speed > 0.0:
            return fired, LONGEST * fired.time
        span *= 2.0
    raise InputError(
        f"{hammer.path}: expected a hammer whose own pulse reaches the pack",
        file=hammer.path,
        key="waveform",
    )


def _fire(hammer: Hammer, pulse: Waveform, span: float, tolerance: float) -> _Fired:
    """Simulate one firing from rest for `span`, s; the outcome is NaN without an impact."""
    from printhammer.drive.trains import PulseTrain
    from printhammer.run.simulate import simulate

    drive = PulseTrain(pulse, at=[0.0])
    motion = simulate(hammer, drive, duration=span, tolerance=tolerance, ledger=True)
    dot = motion.dots[0]
    if not dot.struck or dot.flight_time is None or dot.impact_speed is None:
        return _Fired(status=motion.status)
    peak = float(motion.current.max())
    return _Fired(dot.flight_time, dot.impact_speed, peak, motion.energy.copper_loss, motion.status)


def _same_blow(
    hammer: Hammer, pulse: Waveform, wanted: float, longest: _Fired, tolerance: float
) -> float | None:
    """Solve for the pulse width, s, that gives an impact speed, m/s; None without a solution.

    The search ends at the flight time of the longest pulse, since current after the impact has no effect.
    """
    from scipy.optimize import brentq

    def off(width: float) -> float:
        speed = _fire(hammer, of_width(pulse, width), LONGEST * longest.time, tolerance).speed
        return -1.0 if np.isnan(speed) else speed / wanted - 1.0

    if not longest.speed >= wanted * (1.0 - _SAME):
        return None
    shortest = _shortest(pulse, SHORTEST * longest.time)
    if not shortest < longest.time or off(shortest) > 0.0:
        return None
    if off(longest.time) <= 0.0:
        return longest.time
    return float(brentq(off, shortest, longest.time, xtol=_WIDTH_ERROR * longest.time, rtol=1e-12))


def _shortest(pulse: Waveform, width: float) -> float:
    """Return the smallest valid pulse width, s, in the sequence `width`, 2 `width`, 4 `width`, ..."""
    for doubling in range(2 * _DOUBLINGS):
        with suppress(InputError):
            of_width(pulse, width * 2.0**doubling)
            return width * 2.0**doubling
    return width
