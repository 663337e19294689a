"""Plain functions that write and evaluate the segment tables of pulse shapes, and write firing times.

A plain function allocates nothing and raises nothing, so that it can be compiled as an entry point, see
`printhammer.run.plain.entries`. Segment tables are described in `printhammer.drive.segments`; the classes of
`printhammer.drive.waveforms` declare the fields of the shapes.
"""

from __future__ import annotations

import math
from typing import Any, Final

from printhammer.parts.samples import secant_at, slope_at, width_at

POLYNOMIAL: Final = 0.0
EXPONENTIAL: Final = 1.0
SINE: Final = 2.0
END: Final = 3.0
SWITCHED: Final = 4.0
DECAY: Final = 5.0
RESERVOIR: Final = 6.0
"""Code of a segment fed by a reservoir; codes from `POLYNOMIAL` on are defined in
`printhammer.drive.segments`."""

ROWS: Final = 4
"""Number of rows of the longest segment table of a shape, end row included, by definition of the shapes."""

DECAY_TIMES: Final = 27.6310211159
"""Number of time constants after which a decaying current is cut off: -ln 1e-12; arbitrary."""

DIODE: Final = 0.7
"""Forward voltage of a silicon diode, V; the usual textbook value."""

RAIL: Final = 2.0
"""Index of the decay path "rail" among the decay paths of a driver: "diode", "zener", "rail"."""

_VOLTAGE, _WIDTH, _DECAY_VOLTAGE, _DECAY_RESISTANCE, _SOURCE_RESISTANCE, _COILS, _DIODE_VOLTAGE = range(7)
_OWN: Final = 7
"""Index of the first field of a shape, after the fields common to all drivers; the decay path comes last."""


def put(table: Any, row: int, start: float, kind: float, p0: float, p1: float, p2: float, p3: float) -> int:
    """Write one row of a segment table; return the index of the next row."""
    table[row, 0], table[row, 1] = start, kind
    table[row, 2], table[row, 3], table[row, 4], table[row, 5] = p0, p1, p2, p3
    return row + 1


def close(table: Any, rows: int, end: float) -> int:
    """Remove segments that have zero duration due to rounding, and append the end row, at time `end` [s].

    `rows` is the number of segments in the table. Return the new number of rows, end row included.
    """
    kept = 0
    for row in range(rows):
        if table[row, 0] < (table[row + 1, 0] if row + 1 < rows else end):
            for column in range(6):
                table[kept, column] = table[row, column]
            kept += 1
    return put(table, kept, end, POLYNOMIAL, 0.0, 0.0, 0.0, 0.0)


def half_sine(fields: Any, table: Any) -> int:
    """Write the segments of a half-sine pulse with the fields amplitude and width; return the row count."""
    rows = put(table, 0, 0.0, SINE, 0.0, fields[0], math.pi / fields[1], 0.0)
    return close(table, rows, fields[1])


def sine(fields: Any, table: Any) -> int:
    """Write the segment of an endless sine (amplitude, frequency, phase); return the row count."""
    rows = put(table, 0, 0.0, SINE, 0.0, fields[0], 2.0 * math.pi * fields[1], fields[2])
    return close(table, rows, math.inf)


def rate_of(time_constant: float) -> float:
    """Return 1 / time constant; infinite for a time constant that is zero or too small to divide by."""
    return 1.0 / time_constant if time_constant > 1e-300 else math.inf


def rectangle(fields: Any, table: Any) -> int:
    """Write the segments of a rectangular pulse with the fields amplitude, width, rise and decay.

    Return the number of rows. `rise` and `decay` are time constants, s.
    """
    amplitude, width = fields[0], fields[1]
    up, down = rate_of(fields[2]), rate_of(fields[3])
    if math.isinf(up):
        reached = amplitude
        rows = put(table, 0, 0.0, POLYNOMIAL, amplitude, 0.0, 0.0, 0.0)
    else:
        reached = -amplitude * math.expm1(-width * up)
        rows = put(table, 0, 0.0, EXPONENTIAL, amplitude, -amplitude, up, 0.0)
    if math.isinf(down):
        return close(table, rows, width)
    rows = put(table, rows, width, EXPONENTIAL, 0.0, reached, down, 0.0)
    return close(table, rows, width + DECAY_TIMES * fields[3])


def trapezoid(fields: Any, table: Any) -> int:
    """Write the segments of a trapezoidal pulse with the fields amplitude, rise, width and fall.

    Return the number of rows. `rise` and `fall` are durations, s.
    """
    amplitude, width = fields[0], fields[2]
    up, down = rate_of(fields[1]), rate_of(fields[3])
    rows = 0
    top = 0.0 if math.isinf(up) else fields[1]
    if top > 0.0:
        rows = put(table, rows, 0.0, POLYNOMIAL, 0.0, amplitude * up, 0.0, 0.0)
    rows = put(table, rows, top, POLYNOMIAL, amplitude, 0.0, 0.0, 0.0)
    end = top + width
    if not math.isinf(down):
        rows = put(table, rows, end, POLYNOMIAL, amplitude, -amplitude * down, 0.0, 0.0)
        end += fields[3]
    return close(table, rows, end)


def sampled(fields: Any, table: Any) -> int:
    """Write the segments of a sampled waveform, shape-preserving cubics; return the row count.

    `fields` contains the n times and then the n values; the table has room for n + 1 rows. The slopes are
    those of `scipy.interpolate.PchipInterpolator`.
    """
    n = len(fields) // 2
    rows = put(table, 0, 0.0, POLYNOMIAL, 0.0, 0.0, 0.0, 0.0) if fields[0] > 0.0 else 0
    right = slope_at(fields, 0, n, 0)
    for k in range(n - 1):
        h, m = width_at(fields, 0, k), secant_at(fields, 0, n, k)
        left, right = right, slope_at(fields, 0, n, k + 1)
        turn = (left + right - 2.0 * m) / h
        cubic = turn / h
        rows = put(table, rows, fields[k], POLYNOMIAL, fields[n + k], left, (m - left) / h - turn, cubic)
    return close(table, rows, fields[n - 1])


def series_of(fields: Any) -> float:
    """Return the resistance of the supply as seen by the current of one coil, ohm."""
    return float(fields[_SOURCE_RESISTANCE] * fields[_COILS])


def put_on(fields: Any, table: Any, row: int, at: float, upper: float, lower: float) -> int:
    """Write the segment of a driver with the supply on; return the index of the next row.

    The segment begins at time `at` [s] after the firing. `upper` and `lower` are the coil currents [A] at
    which the chopper turns off and on again; a negative `lower` is minus the off-time [s]. An infinite
    `upper` stands for a supply without a chopper.
    """
    return put(table, row, at, SWITCHED, fields[_VOLTAGE], series_of(fields), upper, lower)


def put_off(fields: Any, table: Any, row: int, at: float) -> int:
    """Write the segment of a driver with the supply off, and the end row; return the number of rows.

    The segment begins at time `at` [s] after the firing.
    """
    decay = fields[len(fields) - 1]
    against = fields[_DECAY_VOLTAGE]
    if math.isnan(against):
        against = fields[_VOLTAGE] if decay == RAIL else DIODE
    series, returned = fields[_DECAY_RESISTANCE], 0.0
    if decay == RAIL:
        series, returned = series + series_of(fields), 1.0
    return close(table, put(table, row, at, DECAY, against, series, returned, 0.0), math.inf)


def rail(fields: Any, table: Any) -> int:
    """Write the segments of a pulse from a voltage rail: supply on, supply off; return the row count."""
    return put_off(fields, table, put_on(fields, table, 0, 0.0, math.inf, 0.0), fields[_WIDTH])


def chopper(fields: Any, table: Any) -> int:
    """Write the segments of a pulse chopped by two thresholds or a fixed off-time; return the row count."""
    upper, lower, off_time = fields[_OWN], fields[_OWN + 1], fields[_OWN + 2]
    if math.isnan(lower):
        lower = -off_time
    return put_off(fields, table, put_on(fields, table, 0, 0.0, upper, lower), fields[_WIDTH])


def peak_and_hold(fields: Any, table: Any) -> int:
    """Write the segments of a peak-and-hold pulse: supply on, chopping, supply off; return the row count."""
    rows = put_on(fields, table, 0, 0.0, math.inf, 0.0)
    rows = put_on(fields, table, rows, fields[_OWN], fields[_OWN + 1], fields[_OWN + 2])
    return put_off(fields, table, rows, fields[_WIDTH])


def capacitor(fields: Any, table: Any) -> int:
    """Write the segments of a capacitor pulse: capacitor connected, supply off; return the row count."""
    rows = put(table, 0, 0.0, RESERVOIR, fields[_VOLTAGE], series_of(fields), 0.0, 0.0)
    return put_off(fields, table, rows, fields[_WIDTH])


def bridge(fields: Any, table: Any) -> int:
    """Write the segments of an H-bridge pulse: supply on, reversed, then off; return the row count."""
    rows = put_on(fields, table, 0, 0.0, math.inf, 0.0)
    rows = put(table, rows, fields[_WIDTH], SWITCHED, -fields[_VOLTAGE], series_of(fields), math.inf, 0.0)
    return put_off(fields, table, rows, fields[_WIDTH] + fields[_OWN])


def fill_supply(fields: Any, reservoir: bool, supply: Any, at: int) -> None:
    """Write the supply of a driver (a `Supply`) to the array `supply`, starting at index `at`.

    `fields` are the fields of the waveform; `reservoir` is true if a capacitor supplies the coil.
    """
    supply[at], supply[at + 1] = fields[_DIODE_VOLTAGE], 0.0
    supply[at + 2] = fields[_OWN] if reservoir else 0.0
    supply[at + 3] = fields[_OWN + 1] if reservoir else 0.0
    supply[at + 4] = fields[_VOLTAGE] if reservoir else 0.0
    supply[at + 5] = fields[_COILS]


def segment_value(kind: float, p0: float, p1: float, p2: float, p3: float, s: float) -> float:
    """Return the value of a segment, A, N or V, `s` seconds after its start."""
    if kind == EXPONENTIAL:
        return p0 + p1 * math.exp(-p2 * s)
    if kind == SINE:
        return p0 + p1 * math.sin(p2 * s + p3)
    if kind == DECAY:
        return 0.0
    if kind >= SWITCHED:
        return p0
    return p0 + s * (p1 + s * (p2 + s * p3))


def fill_values(table: Any, times: Any, values: Any) -> None:
    """Evaluate a segment table, shape (rows, 6), at ascending times since the firing, s; write the values.

    Values are right-continuous; the value is 0 before time 0, at the end of the table and after it.
    """
    row = 0
    last = len(table) - 1
    for k in range(len(times)):
        while row < last and table[row + 1, 0] <= times[k]:
            row += 1
        values[k] = 0.0
        if row < last and times[k] >= 0.0:
            s = times[k] - table[row, 0]
            values[k] = segment_value(
                table[row, 1], table[row, 2], table[row, 3], table[row, 4], table[row, 5], s
            )


def largest_inside(kind: float, p0: float, p1: float, p2: float, p3: float, length: float) -> float:
    """Return the largest absolute value of a segment of duration `length` [s].

    The ends of the segment and the extrema inside the segment are compared.
    """
    best = abs(segment_value(kind, p0, p1, p2, p3, 0.0))
    if not math.isinf(length):
        best = max(best, abs(segment_value(kind, p0, p1, p2, p3, length)))
    elif kind == EXPONENTIAL:
        best = max(best, abs(p0))
    if kind == SINE and p2 != 0.0:
        span = 4.0 * math.pi / abs(p2) if math.isinf(length) else length
        first, last = min(p3, p3 + p2 * span), max(p3, p3 + p2 * span)
        begin, end = math.ceil(first / math.pi - 0.5), math.floor(last / math.pi - 0.5)
        # Three turning points include both the maximum and the minimum.
        for turn in range(begin, min(end, begin + 2) + 1):
            s = ((turn + 0.5) * math.pi - p3) / p2
            if 0.0 < s < length:
                best = max(best, abs(segment_value(kind, p0, p1, p2, p3, s)))
    if kind == POLYNOMIAL:
        # Roots of the derivative a s^2 + b s + c.
        a, b = 3.0 * p3, 2.0 * p2
        one = other = math.nan
        if a == 0.0:
            one = -p1 / b if b != 0.0 else math.nan
        elif b * b - 4.0 * a * p1 >= 0.0:
            q = -0.5 * (b + math.copysign(math.sqrt(b * b - 4.0 * a * p1), b))
            one = q / a
            other = p1 / q if q != 0.0 else math.nan
        if 0.0 < one < length:
            best = max(best, abs(segment_value(kind, p0, p1, p2, p3, one)))
        if 0.0 < other < length:
            best = max(best, abs(segment_value(kind, p0, p1, p2, p3, other)))
    return best


def largest_value(table: Any) -> float:
    """Return the largest absolute value that a segment table takes or approaches."""
    best = 0.0
    for row in range(len(table) - 1):
        # Python's numbers are faster than NumPy's.
        kind, p0, p1 = float(table[row, 1]), float(table[row, 2]), float(table[row, 3])
        p2, p3 = float(table[row, 4]), float(table[row, 5])
        if kind >= SWITCHED:
            best = max(best, abs(p0) if kind != DECAY else 0.0)
        else:
            length = float(table[row + 1, 0]) - float(table[row, 0])
            best = max(best, largest_inside(kind, p0, p1, p2, p3, length))
    return best


SUPPORT, TABLE_END, LARGEST, REPLACES, SERIES_OF_PULSE, HOLD_UPPER, UPPER = range(7)
SUPPLY_OF_PULSE: Final = 7
SHOWN: Final = 13
"""Indices of the numbers in `about` that describe a pulse; see `pulse`."""

(
    HALF_SINE,
    RECTANGLE,
    TRAPEZOID,
    SAMPLED,
    RAIL_SHAPE,
    CHOPPER,
    PEAK_AND_HOLD,
    CAPACITOR,
    BRIDGE,
    SINE_SHAPE,
) = range(10)
"""Codes of the shapes in `printhammer.drive.waveforms.shapes.SHAPES`, in order, and of the endless sine."""


def fill_table(shape: int, fields: Any, table: Any) -> int:
    """Write the segment table of a shape; return its number of rows, or -1 for an unknown shape."""
    if shape == HALF_SINE:
        return half_sine(fields, table)
    if shape == RECTANGLE:
        return rectangle(fields, table)
    if shape == TRAPEZOID:
        return trapezoid(fields, table)
    if shape == SAMPLED:
        return sampled(fields, table)
    if shape == RAIL_SHAPE:
        return rail(fields, table)
    if shape == CHOPPER:
        return chopper(fields, table)
    if shape == PEAK_AND_HOLD:
        return peak_and_hold(fields, table)
    if shape == CAPACITOR:
        return capacitor(fields, table)
    if shape == BRIDGE:
        return bridge(fields, table)
    if shape == SINE_SHAPE:
        return sine(fields, table)
    return -1


def pulse(shape: int, fields: Any, table: Any, about: Any) -> int:
    """Write the segment table of a pulse to `table`, and numbers that describe the pulse to `about`.

    Parameters
    ----------
    shape : int
        Code of the shape.
    fields : float64 array
        Fields of the shape in order of declaration, NaN for a missing field; the fields of a driver are
        followed by the index of the decay path. For a record, the times and then the values.
    table : float64 array, shape (rows, 6), at least 4 rows, for a record one row more than samples
        Segment table, in the form for the kernel: the last row has the kind `END`.
    about : float64 array, shape (14,)
        In this order: support of the pulse, s; end of the table, s; largest absolute value; 1 if the latest
        firing replaces earlier firings, else 0; resistance of the supply in series with one coil, ohm; upper
        current of the hold phase, A, NaN without such a phase; upper current of the chopper, A, NaN without a
        chopper; the six numbers of the supply, in the order of `Supply`; end of the time axis of a plot of
        the pulse, s.

    Returns
    -------
    int
        Number of rows written to `table`; -1 for an unknown shape.
    """
    rows = fill_table(shape, fields, table)
    if rows < 0:
        return rows
    driver = RAIL_SHAPE <= shape <= BRIDGE
    end = table[rows - 1, 0]
    about[SUPPORT] = table[rows - 2, 0] if driver else end
    about[TABLE_END] = end
    about[LARGEST] = largest_value(table[:rows])
    about[REPLACES] = 1.0 if driver else 0.0
    about[SERIES_OF_PULSE] = series_of(fields) if driver else 0.0
    about[HOLD_UPPER] = fields[_OWN + 1] if shape == PEAK_AND_HOLD else math.nan
    about[UPPER] = fields[_OWN] if shape == CHOPPER else math.nan
    for k in range(SUPPLY_OF_PULSE, SHOWN):
        about[k] = 0.0
    about[SHOWN - 1] = 1.0
    if driver:
        fill_supply(fields, shape == CAPACITOR, about, SUPPLY_OF_PULSE)
    about[SHOWN] = about[SUPPORT]
    if shape == RECTANGLE:
        # An exponential decay extends beyond the visible range.
        about[SHOWN] = min(end, fields[1] + 5.0 * fields[3])
    table[rows - 1, 1] = END
    return rows


def fill_firings(rate: float, marks: Any, pattern: bool, times: Any) -> int:
    """Write the firing times of a train to `times` [s], ascending; return their number.

    Slot k is fired if ``marks[k]`` is not 0. The time of slot k is k / `rate` [Hz] for a `pattern`, otherwise
    k times the period 1 / `rate`; the two times may differ by rounding.
    """
    count = 0
    period = 1.0 / rate
    for k in range(len(marks)):
        if marks[k] != 0:
            times[count] = k / rate if pattern else k * period
            count += 1
    return count
