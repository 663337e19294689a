"""Errors of impact times estimated from coil samples, versus noise, sampling rate and resolution."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final, SupportsIndex

import numpy as np

from printhammer.control.impact_estimator import PHASES, UNITS, ImpactEstimator, Sampling, Signal
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.drive.input import read_count, read_number, read_positive
from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.rates.variability import Variability
from printhammer.results import Result, column, coordinate, part, scalar
from printhammer.results.result import Entries
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    quantity,
    styled,
)
from printhammer.run.simulate import simulate
from printhammer.support.arguments import checked
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

LEVELS: Final = (0.001, 0.003, 0.01)
"""Default standard deviations of a sample, as fractions of the peak current or of 10 V; arbitrary."""

MOST: Final = 2000
"""Largest number of sampling settings in a study; arbitrary."""

_MOST_MISSED: Final = 0.99  # Largest fraction of missed impacts of a sensor; arbitrary
_MOST_DOTS: Final = 10_000  # Largest number of dots; arbitrary, to refuse typing errors
_CELLS: Final = "noise sampling_rate bits"


class ImpactTime(Result, rows=_CELLS):
    """Errors of impact times estimated from the coil's current or voltage, by sampling setting.

    Bias and standard deviation on the nominal hammer are due to noise, sampling and quantisation; bias and
    standard deviation over units also contain the differences between hammers, which averaging over dots does
    not reduce.
    """

    hammer: Hammer = part("nominal hammer")
    signal: str = part("sampled signal, current or voltage")
    variability: Variability = part("variability of the units")
    flight_time: float = scalar("s", "flight time of the nominal hammer")
    flight_deviation: float = scalar("s", "RMS deviation of the units from this flight time")
    dots: int = part("number of dots per setting")
    noise: FloatArray = coordinate("", "standard deviation of a sample, A or V", "noise")
    sampling_rate: FloatArray = coordinate("Hz", "sampling rate", "sampling_rate")
    bits: IntArray = coordinate("1", "resolution of the converter", "bits")
    bias: FloatArray = column("s", "mean error on the nominal hammer", _CELLS, more="NaN without a detection")
    deviation: FloatArray = column("s", "standard deviation of the error on the nominal hammer", _CELLS)
    missed: FloatArray = column("1", "fraction of the nominal hammer's impacts that are not detected", _CELLS)
    flagged: FloatArray = column(
        "1", "fraction of the nominal hammer's impacts whose estimates are flagged and not used", _CELLS
    )
    unit_bias: FloatArray = column("s", "mean error over units", _CELLS)
    unit_deviation: FloatArray = column("s", "standard deviation of the error over units", _CELLS)
    unit_missed: FloatArray = column("1", "fraction of the units' impacts that are not detected", _CELLS)
    unit_flagged: FloatArray = column(
        "1", "fraction of the units' impacts whose estimates are flagged and not used", _CELLS
    )

    @property
    def title(self) -> str:
        """One-line title with hammer and signal."""
        return f"time of impact of {self.hammer.name} from the {self.signal} of its coil"

    def summary(self) -> Summary:
        """Tabulate the errors of the estimated impact times, one row per sampling setting."""
        noise, rate, bits = np.meshgrid(self.noise, self.sampling_rate, self.bits, indexing="ij")
        columns = [
            Cells("noise", 1e3 * noise.ravel(), f"m{self.unit}", ".3g"),
            Cells("samples", 1e-3 * rate.ravel(), "kHz", "g"),
            Cells("bits", bits.ravel()),
            self.cells("bias", "nominal:\nbias"),
            self.cells("deviation"),
            Cells("missed", [f"{100.0 * missed:.0f} %" for missed in self.missed.ravel()]),
            Cells("flagged", [f"{100.0 * flagged:.0f} %" for flagged in self.flagged.ravel()]),
            self.cells("unit_bias", "units:\nbias"),
            self.cells("unit_deviation", "deviation"),
            Cells("missed", [f"{100.0 * missed:.0f} %" for missed in self.unit_missed.ravel()]),
            Cells("flagged", [f"{100.0 * flagged:.0f} %" for flagged in self.unit_flagged.ravel()]),
        ]
        said = (
            f"nominal flight time {quantity(self.flight_time, 's')}, from which the units deviate by"
            f" {quantity(self.flight_deviation, 's')} (RMS)"
        )
        errors = np.hypot(self.unit_bias, self.unit_deviation)
        if np.isfinite(errors).any() and not (errors < self.flight_deviation).any():
            said += "; " + styled("bad", "estimates of units are no better than that time")
        return Summary([Grid(columns, self.title, most=24), said])

    def entries(self) -> Entries:
        """Return the Dataset variables, with the noise in the unit of the signal."""
        entries = super().entries()
        note, values = entries["noise"]
        return {**entries, "noise": (replace(note, unit=self.unit), values)}

    def sensor(self, seed: int = 0) -> ImpactSensor:
        """Build an impact sensor for `printhammer.learn` with the errors of a study of one setting.

        The noise of the sensor is the standard deviation on the nominal hammer. The additional spread over
        units, which is constant for all dots of a unit, is the offset.
        """
        if self.bias.size != 1:
            raise InputError(
                f"{self.bias.size} sampling settings were studied", key="index", expected="one for a sensor"
            )
        noise, units = float(self.deviation[0, 0, 0]), float(self.unit_deviation[0, 0, 0])
        if not np.isfinite(noise + units):
            raise InputError("no impact was detected in the samples", expected="less noise for a sensor")
        # The study yields the mean error over units, which can be subtracted.
        offset = float(np.sqrt(max(units**2 - noise**2, 0.0)))
        # Flagged estimates count as missed.
        missed = min(float(self.unit_missed[0, 0, 0] + self.unit_flagged[0, 0, 0]), _MOST_MISSED)
        return ImpactSensor(noise=noise, offset=offset, missed=missed, seed=seed)

    @property
    def unit(self) -> str:
        """SI unit of the signal and its noise, "A" or "V"."""
        return UNITS[self.signal]


@checked
def impact_time(
    hammer: Hammer,
    *,
    signal: Signal = "current",
    noise: Sequence[float | str] = (),
    sampling_rate: Sequence[float | str] = (1e6,),
    bits: Sequence[SupportsIndex] = (12,),
    full_scale: float | str | None = None,
    delay: float | str = 0.0,
    bandwidth: float | str | None = None,
    known: bool = True,
    dots: SupportsIndex = 50,
    units: SupportsIndex = 20,
    variability: Variability | None = None,
    seed: SupportsIndex = 0,
    progress: Callable[[int, int], None] | None = None,
) -> ImpactTime:
    """Compute the errors of impact times that are estimated from samples of a hammer's coil.

    The estimator is `printhammer.control.impact_estimator.ImpactEstimator`: it uses the samples of one dot,
    the nominal hammer and the pulse.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer, with a pack and a driver of its coil.
    signal : str, optional
        "current", which shows an impact while current flows, or "voltage", which shows an impact while the
        coil of a permanent magnet is open.
    noise : sequence of float or str, optional
        Standard deviations of a sample, A or V; by default 0.1, 0.3 and 1 % of the largest current of the
        hammer's own pulse, or of 10 V.
    sampling_rate : sequence of float or str, optional
        Sampling rates, Hz.
    bits : sequence of int, optional
        Resolutions of the converter, bits.
    full_scale : float or str, optional
        Upper end of the converter's range, A or V; by default 1.5 times the largest value of the nominal
        signal around the impact.
    delay : float or str, optional
        Delay of the probe, s.
    bandwidth : float or str, optional
        Bandwidth of the probe, Hz; by default unlimited.
    known : bool, optional
        Whether the estimator knows delay and bandwidth of the probe.
    dots : int, optional
        Number of simulated dots per setting: this number for the nominal hammer, and again for all units
        together.
    units : int, optional
        Number of hammers drawn from the variability.
    variability : Variability, optional
        Variability of the units; by default `Variability.of(hammer)`.
    seed : int, optional
        Seed for the units and for the noise.
    progress : callable, optional
        Called with the number of finished settings and the total number.
    """
    volts = signal == "voltage"
    levels = np.unique([read_number(each, UNITS.get(signal, "A"), "noise") for each in noise])
    rates = np.unique([read_positive(each, "Hz", "sampling_rate") for each in sampling_rate])
    widths = np.unique([read_count(each, "bits") for each in bits])
    many, others, first = (
        read_count(dots, "dots"),
        read_count(units, "units"),
        read_count(seed, "seed", least=0),
    )
    span = None if full_scale is None else read_positive(full_scale, UNITS.get(signal, "A"), "full_scale")
    late = read_number(delay, "s", "delay")
    width = None if bandwidth is None else read_positive(bandwidth, "Hz", "bandwidth")
    if not 2 <= many <= _MOST_DOTS or not 2 <= others <= many:
        raise InputError(
            f"dots = {many} and units = {others}",
            key="dots",
            value=many,
            expected=f"2 to {_MOST_DOTS} dots, and 2 or more units, at most one per dot",
        )
    if not levels.size:
        scale = 10.0 if volts else _largest_current(hammer)
        levels = scale * np.array(LEVELS)
        if rates.size and widths.size:
            # A device with a weaker impact signature is sampled with less noise.
            least = float(rates.min()), int(widths.min()), span, late, width
            clear = [_is_clear(hammer, Sampling(signal, level, *least)) for level in levels.tolist()]
            levels = levels[clear] if any(clear) else levels[:1]
    shape = levels.size, rates.size, widths.size
    total = int(np.prod(shape))
    if not 0 < total <= MOST:
        raise InputError(f"{total} sampling settings are requested", key="sampling", expected=f"1 to {MOST}")
    spread = Variability.of(hammer) if variability is None else variability
    drawn = spread.draw(hammer, others, first)
    rng = np.random.default_rng((first, 1))
    names = ("bias", "deviation", "missed", "flagged")
    arrays = {f"{prefix}{name}": np.full(shape, np.nan) for prefix in ("", "unit_") for name in names}
    flight, deviation, done = np.nan, np.nan, 0
    for j, rate in enumerate(rates.tolist()):
        records: list[Any] = []
        for i, k in itertools.product(range(levels.size), range(widths.size)):
            if progress is not None:
                progress(done, total)
            probe = Sampling(signal, float(levels[i]), rate, int(widths[k]), span, late, width)
            assumed = probe if known else replace(probe, delay=0.0, bandwidth=None)
            estimator = ImpactEstimator(hammer, assumed)
            flight = estimator.flight
            if not records:
                records = [unit_record(unit, estimator, probe) for unit in (hammer, *drawn)]
                deviation = flight_deviation(estimator, records[1:])
            own = errors_of(estimator, records[:1], many, rng)
            all_units = errors_of(estimator, records[1:], many, rng)
            for prefix, (errors, believed) in (("", own), ("unit_", all_units)):
                shown = np.isfinite(errors)
                seen = errors[shown & believed]
                arrays[f"{prefix}missed"][i, j, k] = 1.0 - np.mean(shown)
                arrays[f"{prefix}flagged"][i, j, k] = np.mean(shown & ~believed)
                if seen.size:
                    arrays[f"{prefix}bias"][i, j, k] = seen.mean()
                    arrays[f"{prefix}deviation"][i, j, k] = seen.std()
            done += 1
    if progress is not None:
        progress(total, total)
    return ImpactTime(
        hammer=hammer,
        signal=signal,
        variability=spread,
        flight_time=flight,
        flight_deviation=deviation,
        dots=many,
        noise=levels,
        sampling_rate=rates,
        bits=widths,
        **arrays,
    )


def _is_clear(hammer: Hammer, probe: Sampling) -> bool:
    """Whether the estimator can detect the impact of a hammer in samples of a probe."""
    try:
        ImpactEstimator(hammer, probe)
    except InputError:
        return False
    return True


def _largest_current(hammer: Hammer) -> float:
    """Return the largest current of the hammer's own pulse, A."""
    waveform = hammer.waveform
    if waveform is None or waveform.quantity != "voltage":
        return 1.0  # The estimator reports the error.
    motion = simulate(hammer, PulseTrain(waveform), duration=1.1 * waveform.support)
    return float(np.abs(motion.current).max())


def unit_record(unit: Hammer, estimator: ImpactEstimator, probe: Sampling) -> tuple[FloatArray, float]:
    """Simulate one dot of a unit; return the signal after the probe [A or V] and the true impact time, s.

    The impact time is NaN if the unit prints no dot.
    """
    each = PHASES if probe.delay or probe.bandwidth is not None else 1
    times = np.asarray(estimator.step / each * np.arange(each * estimator.count), np.float64)
    motion = simulate(
        unit, PulseTrain(estimator.pulse), duration=float(times[-1]) + estimator.step, times=times
    )
    true = probe.of(motion)
    flight = motion.dots[0].flight_time
    whole = np.concatenate([true, np.full(times.size - true.size, true[-1])])
    return probe.shown(times, whole)[::each], np.nan if flight is None else float(flight)


def errors_of(
    estimator: ImpactEstimator, records: Sequence[Any], dots: int, rng: np.random.Generator
) -> tuple[FloatArray, BoolArray]:
    """Return the errors of estimated impact times [s] and a mask of the estimates that are not flagged.

    Both arrays have one entry per dot. `records` are the signals and impact times from `unit_record`; dot
    number n uses record n modulo the number of records, with new noise.
    """
    errors, believed = [], []
    for number in range(dots):
        true, flight = records[number % len(records)]
        estimate = estimator.estimate(estimator.sampling.read(true, rng))
        errors.append(estimate.time - flight)
        believed.append(not estimate.flag)
    return np.array(errors), np.array(believed)


def flight_deviation(estimator: ImpactEstimator, records: Sequence[Any]) -> float:
    """Return the RMS deviation of the flight times of records from the nominal flight time, s."""
    return root_mean_square(np.array([flight for _true, flight in records]) - estimator.flight)


def root_mean_square(errors: FloatArray) -> float:
    """Return the RMS of the errors that are not NaN; NaN if all errors are NaN."""
    known = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(known**2))) if known.size else np.nan
