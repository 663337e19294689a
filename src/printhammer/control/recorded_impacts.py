"""Impact times from recorded coil currents or coil voltages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.control.impact_estimator import UNITS, ImpactEstimator, Sampling, Signal
from printhammer.control.impact_time import errors_of, flight_deviation, root_mean_square, unit_record
from printhammer.drive.input import read_number, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.identify.lowpass import bandwidth_of
from printhammer.identify.noise import noise_of_record
from printhammer.printing.rates.variability import Variability
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.summary import Cells, Grid, Summary
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.readings import Readings, read_table

_BITS: Final = 24
"""Resolution assumed for the converter, bits; fine, since the noise of a record already includes rounding."""

_UNITS: Final = 20  # Number of simulated units behind an uncertainty; arbitrary

VAGUE: Final = "vague"
"""Flag of an estimate that is at least as uncertain as the nominal flight time."""

_QUIET: Final = 1e-4
"""Smallest noise of a sample, as a fraction of the record's largest value; arbitrary."""

_UNEVEN: Final = 0.01
"""Largest spread of the time steps of a record, as a fraction of their median; arbitrary."""


class RecordedImpacts(Result, rows="record"):
    """Impact times estimated from records of single shots, one shot per record.

    The uncertainty is the RMS error of the estimator on 20 simulated units of `Variability.of(hammer)` with
    the noise of the record; an estimate that is no better than the nominal flight time has the flag "vague".
    """

    hammer: Hammer = part("nominal hammer")
    signal: str = part("recorded signal, current or voltage")
    flight_time: float = scalar("s", "flight time of the nominal hammer")
    record: tuple[str, ...] = coordinate("", "file of the record", "record")
    time: FloatArray = column("s", "time from firing to impact", "record", more="NaN if no impact shows")
    uncertainty: FloatArray = column(
        "s",
        "RMS error of estimates that are not flagged, over simulated units of the production",
        "record",
    )
    clearness: FloatArray = column(
        "1", "amplitude of the impact's signature over the noise of a sample", "record"
    )
    flag: tuple[str, ...] = column(
        "", "reason to doubt the estimate", "record", more="empty for a trusted estimate"
    )

    @property
    def title(self) -> str:
        """One-line title with hammer and recorded signal."""
        return f"times of impact of {self.hammer.name} in records of the {self.signal} of its coil"

    def summary(self) -> Summary:
        """Tabulate the impact times, one row per record."""
        columns = [
            Cells("record", list(self.record), left=True),
            self.cells("time"),
            self.cells("uncertainty", "±"),
            Cells("size / noise", self.clearness, "", ".3g"),
            Cells("flag", list(self.flag), left=True),
        ]
        return Summary([Grid(columns, self.title, most=24)])


def recorded_impacts(
    hammer: Hammer,
    paths: Sequence[str | Path],
    *,
    signal: Signal = "current",
    delay: float | str = 0.0,
    bandwidth: float | str | None = None,
    columns: str | None = None,
) -> RecordedImpacts:
    """Estimate the impact times in records of single shots from rest, fired at time 0.

    The estimator is `printhammer.control.impact_estimator.ImpactEstimator`; the noise of a sample is
    estimated from the record.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer, with a pack and a driver of its coil.
    paths : sequence of path
        Paths of the records: tables with the columns ``time`` and ``current``, or ``voltage``, in equal time
        steps.
    signal : str, optional
        Recorded signal, "current" or "voltage".
    delay : float or str, optional
        Delay of the probe, s.
    bandwidth : float or str, optional
        Bandwidth of the probe, Hz; by default the value in a comment ``# bandwidth: 200 kHz`` of the record,
        else unlimited.
    columns : str, optional
        Contents of the columns of all tables, such as "time=1, current=2*-10 A/V"; by default as described in
        the file TABLE.toml beside a table, else by the headings of the table; see
        `printhammer.support.tables.columns`.

    Raises
    ------
    InputError
        A record cannot be read, is too short, or shows no sign of an impact.
    """
    if signal not in UNITS:
        raise InputError.of("signal", signal, " or ".join(UNITS))
    late = read_number(delay, "s", "delay")
    width = None if bandwidth is None else read_positive(bandwidth, "Hz", "bandwidth")
    estimates, errors, flight = [], [], math.nan
    units = Variability.of(hammer).draw(hammer, _UNITS, 0)
    for path in paths:
        table = read_table(path, {"time": "s", signal: UNITS[signal]}, columns=columns)
        table.check_times()
        estimator = _estimator(hammer, table, signal, late, bandwidth_of(table) if width is None else width)
        t, values = table.values["time"], table.values[signal]
        last = float(estimator.times[-1])
        if not t[0] <= 0.5 * estimator.step or not t[-1] >= last - estimator.step:
            raise InputError(
                f"{table.path}: a record from {t[0]:.4g} to {t[-1]:.4g} s",
                file=table.path,
                key="time",
                expected=f"a record from the firing at 0 s to {last:.4g} s",
            )
        samples = estimator.sampling.clipped(np.interp(estimator.times, t, values))
        estimate = estimator.estimate(samples)
        error, nominal = _errors_of_units(estimator, units)
        estimates.append(estimate if estimate.flag or error < nominal else replace(estimate, flag=VAGUE))
        errors.append(error)
        flight = estimator.flight
    if not estimates:
        raise InputError("no records", key="records", expected="one or more")
    return RecordedImpacts(
        hammer=hammer,
        signal=signal,
        flight_time=flight,
        record=tuple(Path(path).name for path in paths),
        time=np.array([each.time for each in estimates]),
        uncertainty=np.array(errors),
        clearness=np.array([each.clearness for each in estimates]),
        flag=tuple(each.flag for each in estimates),
    )


def _errors_of_units(estimator: ImpactEstimator, units: Sequence[Hammer]) -> tuple[float, float]:
    """Return two RMS errors over simulated units, s.

    The first is the error of the estimates that are not flagged, the second the error of the nominal flight
    time as an estimate.
    """
    records = [unit_record(unit, estimator, estimator.sampling) for unit in units]
    errors, believed = errors_of(estimator, records, len(records), np.random.default_rng(0))
    return root_mean_square(errors[believed]), flight_deviation(estimator, records)


def _estimator(
    hammer: Hammer, table: Readings, signal: Signal, delay: float, bandwidth: float | None
) -> ImpactEstimator:
    """Build an impact estimator with the time step and the sample noise of a record."""
    steps = np.diff(table.values["time"])
    step = float(np.median(steps))
    if float(np.ptp(steps)) > _UNEVEN * step:
        raise InputError(
            f"{table.path}: time steps from {steps.min():.4g} to {steps.max():.4g} s",
            file=table.path,
            key="time",
            expected="even time steps",
        )
    values = table.values[signal]
    noise = max(noise_of_record(values), _QUIET * float(np.abs(values).max()))
    return ImpactEstimator(
        hammer, Sampling(signal, noise, 1.0 / step, _BITS, delay=delay, bandwidth=bandwidth)
    )
