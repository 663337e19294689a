"""Fit the constants of a coil circuit to records of its current while a voltage is applied.

  current(t) = solution of the equation of motion and the coil circuit, as seen by the current probe

Data: columns ``time`` and ``current``, optionally ``voltage``; one shot per file. Without a voltage column
the hammer's own driver supplies the voltage. The final current determines the resistance, its rise the
inductance, and the curvature of the rise a shorted turn or saturation; a moving armature adds a back-EMF. The
errors of the current probe are declared or fitted; see `printhammer.identify.current`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.drive.input import read_number, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import quantity_of, unknown
from printhammer.identify.current import (
    NOMINAL,
    SIGNS,
    UNITS,
    ProbeError,
    Trace,
    bounds_of,
    plateaus,
    probe_current,
    read_probe,
    read_trace,
    resolution_of,
)
from printhammer.identify.least_squares import Law, Parameters
from printhammer.identify.noise import robust_scale
from printhammer.identify.result import Fit
from printhammer.identify.static.assemble import Data, assemble, check_rows, judge, solved, term_p_value
from printhammer.support.arrays import FloatArray, IntArray

FREE: Final = ("coil.resistance", "coil.inductance")
"""Constants fitted by default; only the resistance if the magnet's law includes an inductance."""

_STEP: Final = 1e-4
"""Relative step size of the finite differences: well above the integration error; arbitrary."""

_SHORT: Final = 0.05
"""Finite-difference step of a parameter that is a time, in sampling intervals; arbitrary."""

_REACH: Final = 1e3
"""Largest factor between a fitted constant and its initial guess; arbitrary."""

_TOLERANCE: Final = 1e-10  # Arbitrary
"""Relative tolerance of the least-squares iterations: no smaller than the error of the finite differences."""

_SPARE: Final = 4
"""Smallest number of rows in excess of parameters for which standard errors are computed; arbitrary."""

_EXACT: Final = 1e-6  # Arbitrary
"""Relative residual below which the law is not tested, since integration errors dominate the residuals."""

_COARSE: Final = 1.5  # Arbitrary
"""Ratio of resolution to residual standard deviation above which quantisation dominates the residuals."""


def default_constants(hammer: Hammer) -> tuple[str, ...]:
    """Return the names of the constants that are fitted by default; see `FREE`."""
    linked = hammer.magnet is not None and hammer.magnet.has_linkage
    return FREE[:1] if linked and not _stated(hammer, FREE[1]) else FREE


def fit_coil(
    paths: Sequence[str | Path],
    hammer: Hammer,
    *,
    free: Sequence[str] | None = None,
    also: Sequence[str] = (),
    locked: float | str | None = None,
    offset: float | str | None = None,
    gain: float | str | None = None,
    delay: float | str | None = None,
    bandwidth: float | str | None = None,
    resolution: float | str | None = None,
    robust: bool = True,
    columns: str | None = None,
) -> Fit:
    """Fit constants of the coil circuit to records of the coil current, each of a single shot.

    A probe error is a number or a text with a unit; a value with its standard deviation, such as "1 +- 0.01",
    which is a prior; or "fit". Errors that are not stated are assumed absent; the fit tests the assumption.

    Parameters
    ----------
    paths : sequence of path
        Tables with the columns ``time``, ``current`` and optionally ``voltage``. A recorded voltage drives
        the coil from the first row on; the time of each voltage edge is fitted, between the two rows of the
        edge. Without a recorded voltage the coil is switched on at time 0.
    hammer : Hammer
        Hammer with the known constants and the initial guesses. A missing resistance or inductance is
        estimated from the first record.
    free : sequence of str, optional
        Constants to fit, by default `default_constants`.
    also : sequence of str, optional
        Additional constants to fit, e.g. "coil.turn_resistance", "magnet.saturation_flux".
    locked : float or str, optional
        Displacement at which the armature was held, m; by default the value in a comment
        ``# locked: 100 um``, else the armature is free.
    offset, gain, delay : float or str, optional
        Offset [A], gain and delay [s] of the probe.
    bandwidth : float or str, optional
        Bandwidth of the probe, Hz; by default the value in a comment ``# bandwidth: 200 kHz``, else
        unlimited.
    resolution : float or str, optional
        Step of the readings, A; by default the largest step of which all readings are multiples.
    robust : bool, optional
        Whether to exclude outliers.
    columns : str, optional
        Contents of the table's columns, such as "time=1, current=2*-10 A/V"; by default as described in a
        file beside the table, else by its heading; see `printhammer.support.tables.columns`.

    Raises
    ------
    InputError
        A record is invalid or too short, current flows before switch-on, a constant is unknown or not stated,
        or the hammer has no coil circuit.
    """
    names = list(dict.fromkeys([*(default_constants(hammer) if free is None else free), *also]))
    if not names:
        raise InputError("no constants to fit", key="free", expected="one or more, such as coil.inductance")
    place = None if locked is None else read_number(locked, "m", "locked")
    traces = [read_trace(path, hammer, place, offset is not None, columns) for path in paths]
    stated = {"offset": offset, "gain": gain, "delay": delay, "bandwidth": bandwidth}
    errors = read_probe(stated, min(trace.step for trace in traces))
    hammer, start = _start(hammer, names, traces[0])
    units = [_unit(hammer, name) for name in names]
    law = CurrentLaw(hammer, names, traces, errors)
    data = _data(traces)
    space = law.space(start)
    check_rows(data, len(space.start) + _SPARE, "the constants of the coil and their errors")
    # Raises for a hammer without a coil circuit; in the iterations invalid constants merely give NaN.
    law.simulated(space.start)
    solution = solved(data, law, space, robust=robust)
    terms = law.missing(solution.p)
    step = resolution_of(data.values) if resolution is None else read_positive(resolution, "A", "resolution")
    final: Law = law
    notes: list[str] = []
    if step > _COARSE * robust_scale(solution.residuals):
        averaged = Averaged(law, plateaus(solution.fitted, data.series, step), solution.fitted, step)
        if averaged.count >= len(space.start) + _SPARE:
            notes.append(
                f"the quantisation step of {step:.3g} A exceeds the noise: {len(data.values)} rows count as"
                f" {averaged.count}, their means over each step"
            )
            data, terms = averaged.data(data), {why: averaged.mean(term) for why, term in terms.items()}
            final = averaged
            solution = solved(data, final, replace(space, start=_within(solution.p, space)), robust=robust)
    p_value, why = math.nan, ""
    if solution.residual_scale > _EXACT * float(np.abs(data.values).max()):
        p_value, why = judge(solution, terms, data.abscissa, data.series)
    if SIGNS["gain"] in terms and math.isnan(term_p_value(solution, terms[SIGNS["gain"]])):
        notes.append("a gain error of the probe cannot be detected: the constants scale with the gain")
    held = sorted({trace.locked for trace in traces if trace.locked is not None})
    known = {"armature locked at": ", ".join(f"{place!r} m" for place in held)} if held else {}
    fitted = [error for error in errors if error.is_fitted]
    found = [(name, unit, True) for name, unit in zip(names, units, strict=True)]
    found += [(error.key, UNITS[error.name], False) for error in fitted]
    found += [("", "s", False)] * sum(trace.edges.size for trace in traces)
    return assemble(
        data,
        final,
        solution,
        found,
        given=known | {error.key: error.text for error in errors if math.isfinite(error.deviation)},
        remedies=dict.fromkeys(names, "a longer record, or one with less noise"),
        rejected=why,
        p_value=p_value,
        notes=notes,
    )


class CurrentLaw:
    """Law of the current fit: predicted currents of all records, A, shape (m,).

    The parameters p are the named constants, the fitted probe errors, and the time offset of each edge of a
    recorded voltage from the middle between its two rows, SI.
    """

    def __init__(
        self, hammer: Hammer, names: list[str], traces: list[Trace], errors: list[ProbeError]
    ) -> None:
        self.hammer, self.names, self.traces, self.errors = hammer, names, traces, errors
        self.fitted = [error for error in errors if error.is_fitted]
        self.gaps = np.concatenate([np.diff(trace.times)[trace.edges] for trace in traces])
        self.step = min(trace.step for trace in traces)
        self._values: dict[bytes, FloatArray] = {}
        self._slopes: dict[bytes, FloatArray] = {}

    def space(self, start: FloatArray) -> Parameters:
        """Build initial guess, bounds, prior and scales of all parameters.

        `start` contains the initial guesses of the named constants, SI.
        """
        longest = max(float(trace.times[-1]) for trace in self.traces)
        peak = max(float(np.abs(trace.table.values["current"]).max()) for trace in self.traces)
        ends = [bounds_of(error, longest) for error in self.fitted]
        sizes = {"offset": peak, "delay": longest, "gain": 0.0, "time constant": 0.0}
        edge = (0.5 - 2e-5) * self.gaps
        return Parameters.of(
            np.concatenate([start, [error.value for error in self.fitted], 0.0 * edge]),
            low=np.concatenate([start / _REACH, [low for low, _high in ends], -edge]),
            high=np.concatenate([start * _REACH, [high for _low, high in ends], edge]),
            # The time of an edge is uniformly distributed between two rows.
            deviation=np.concatenate(
                [
                    0.0 * start + math.inf,
                    [error.deviation for error in self.fitted],
                    self.gaps / math.sqrt(12.0),
                ]
            ),
            size=np.concatenate([0.0 * start, [sizes[error.name] for error in self.fitted], self.gaps]),
            tolerance=_TOLERANCE,
        )

    def simulated(self, p: FloatArray, **added: float) -> FloatArray:
        """Simulate the currents of all records as seen by the probe, at parameters `p`.

        The values in `added`, SI, are added to the probe errors of these names.
        """
        count = len(self.names)
        hammer = self.hammer.replace(dict(zip(self.names, p[:count].tolist(), strict=True)))
        probe = {error.name: error.value for error in self.errors}
        probe |= {error.name: float(p[count + k]) for k, error in enumerate(self.fitted)}
        shifts = np.split(
            p[count + len(self.fitted) :], np.cumsum([trace.edges.size for trace in self.traces])[:-1]
        )
        shown = []
        for trace, moved in zip(self.traces, shifts, strict=True):
            of = NOMINAL | {"time constant": trace.tau} | probe
            of = {name: value + added.get(name.replace(" ", "_"), 0.0) for name, value in of.items()}
            current = probe_current(
                hammer,
                trace.driven(moved),
                trace.times - of["delay"],
                locked=trace.locked,
                tau=of["time constant"],
            )
            shown.append(of["gain"] * current + of["offset"])
        return np.concatenate(shown)

    def missing(self, p: FloatArray) -> dict[str, FloatArray]:
        """Return the derivatives of the currents with respect to undeclared probe errors.

        The keys of the result are the texts of `SIGNS`, which suggest stating or fitting the error.
        """
        short = _SHORT * self.step
        steps = {"offset": 1.0, "gain": 1.0, "delay": short, "time constant": short}
        unstated = [name for name in steps if name not in [error.name for error in self.errors]]
        terms = {}
        for name in unstated:
            ahead = self.simulated(p, **{name.replace(" ", "_"): steps[name]})
            # A time constant cannot be negative, so its difference is one-sided.
            both = name == "delay"
            behind = self.simulated(p, **({name: -steps[name]} if both else {}))
            terms[SIGNS[name]] = (ahead - behind) / steps[name]
        return terms

    def value(self, p: FloatArray) -> FloatArray:
        """Compute the currents of all records, A; NaN for invalid constants."""

        def made() -> FloatArray:
            try:
                return self.simulated(p)
            except InputError:
                return np.full(sum(len(trace.table) for trace in self.traces), math.nan)

        return _kept(self._values, p, made)

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Compute the derivatives of the currents with respect to the parameters by central differences."""

        def made() -> FloatArray:
            sizes = {"offset": 1e-3, "gain": 1e-3, "delay": _SHORT * self.step, "time constant": 0.0}
            steps = np.concatenate([0.0 * p[: len(self.names)], [sizes[e.name] for e in self.fitted]])
            steps = np.concatenate([steps, 1e-3 * self.gaps])
            steps = np.where(steps > 0.0, steps, _STEP * p)
            columns = [
                (self.value(p + step) - self.value(p - step)) / (2.0 * size)
                for size, step in zip(steps, np.diag(steps), strict=True)
            ]
            return np.column_stack(columns)

        return _kept(self._slopes, p, made)

    def variance_columns(self, p: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the variance coefficients: rows of one record share one noise variance."""
        count = len(self.traces)
        return np.repeat(np.eye(count), [len(trace.table) for trace in self.traces], axis=0)


class Averaged:
    """Law averaged over quantisation plateaus, for readings whose quantisation step exceeds the noise.

    Rows on one plateau have correlated rounding errors. The rounding errors average out where the law varies
    by a whole quantisation step across the plateau; where the law is nearly constant, the error of the mean
    is up to half a quantisation step.
    """

    def __init__(self, law: CurrentLaw, plateau: IntArray, fitted: FloatArray, step: float) -> None:
        self.law, self.plateau = law, plateau
        self.rows = np.bincount(plateau)
        self.count = len(self.rows)
        begins = np.flatnonzero(np.diff(plateau, prepend=-1))
        self.begins = begins
        span = np.maximum.reduceat(fitted, begins) - np.minimum.reduceat(fitted, begins)
        self.share = np.minimum(np.maximum(1.0 - span / step, 0.0) ** 2 + 1.0 / self.rows**2, 1.0)

    def mean(self, values: FloatArray) -> FloatArray:
        """Return the mean of `values` over each quantisation plateau, shape (plateaus,)."""
        return np.asarray(np.add.reduceat(values, self.begins, axis=0) / self.rows)

    def data(self, data: Data) -> Data:
        """Average the data over plateaus; each mean has the line number of its first row."""
        return replace(
            data,
            abscissa=self.mean(data.abscissa),
            values=self.mean(data.values),
            series=data.series[self.begins],
            lines=data.lines[self.begins],
        )

    def value(self, p: FloatArray) -> FloatArray:
        """Compute the currents averaged over plateaus, A."""
        return self.mean(self.law.value(p))

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Compute the derivatives of the averaged currents with respect to the parameters."""
        slopes = self.law.jacobian(p)
        return np.column_stack([self.mean(column) for column in slopes.T])

    def variance_columns(self, p: FloatArray) -> FloatArray:
        """Return the variance coefficients of the means: rows of one record share one noise variance."""
        return np.asarray(self.law.variance_columns(p)[self.begins] * self.share[:, np.newaxis])


def _within(p: FloatArray, space: Parameters) -> FloatArray:
    """Return the initial guess of a second fit from the estimates `p` of the first fit.

    A parameter with a prior begins at the mean of its prior, any other parameter at its estimate.
    """
    return np.where(np.isfinite(space.deviation), space.start, np.clip(p, space.low, space.high))


def _kept(known: dict[bytes, FloatArray], p: FloatArray, made: Callable[[], FloatArray]) -> FloatArray:
    """Return the value of `made` at parameters `p`; a known value is taken from the cache `known`.

    The cache saves time, since a fit evaluates the same point repeatedly.
    """
    key = p.tobytes()
    if key not in known:
        known[key] = made()
    return known[key]


def _start(hammer: Hammer, names: list[str], trace: Trace) -> tuple[Hammer, FloatArray]:
    """Estimate a missing resistance or inductance from a record.

    Return the hammer with these estimates, and the initial guesses of the constants `names`, SI.
    """
    t, current = trace.table.values["time"], np.abs(trace.table.values["current"])
    top = int(np.argmax(current))
    if not (current[top] > 0.0 and trace.waveform.peak > 0.0):
        raise InputError(
            f"{trace.table.path}: the record lacks a current or a voltage",
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
                f"{hammer.path}: {name} is missing or not above 0",
                file=hammer.path,
                key=name,
                expected="a positive initial guess",
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
