"""Impact time from samples of coil current or voltage, by a matched filter with nuisance parameters.

The moving armature induces a voltage in its coil, which changes at the impact: the falling current rises
again, or the open-circuit voltage of a coil with a permanent magnet falls. The samples y are modelled as

  a s(t - shift) + r(t) + b0 + b1 t + noise

in a window around the touch, and the estimate is the shift with the least residual. For each shift, a, b0 and
b1 are a linear least-squares fit, so the score is a filter with fixed weights (a matched filter, the
generalised likelihood ratio; S. M. Kay, *Fundamentals of Statistical Signal Processing: Detection Theory*,
1998, ch. 7). The straight line absorbs slow differences between a unit and the nominal hammer: resistance,
temperature, rail voltage. The signature s and the reference r come from simulations of the nominal hammer:

- where the driver holds its voltage throughout the search, the signal depends on the motion alone and moves
  with the impact: s is the signal, r is 0;
- where the driver switches, its edges do not move with the impact: r is the signal of the hammer without its
  pack, and s is the difference that the pack makes, which is zero up to the touch.

The estimator knows the samples, the fired pulse and the nominal hammer, but nothing of the unit. Delay and
bandwidth of the probe, if known, are part of the template. An estimate is flagged if the samples do not
resemble an impact, for instance because an unstated probe delay leaves an edge of the driver in the samples,
or if the estimate lies at the end of the search range. `Sampling` describes the converter: noise,
rate, resolution and range.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.base import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.identify.lowpass import lowpass_lines, time_constant
from printhammer.printing.dots.nominal import pulse_of
from printhammer.results import Declared, part, scalar
from printhammer.run.motion import Motion
from printhammer.run.simulate import simulate
from printhammer.support.arrays import BoolArray, FloatArray

PHASES: Final = 8  # Number of trial shifts per sampling interval; arbitrary
BEFORE: Final = 1.0  # Length of the window before the touch, in contact times; arbitrary
AFTER: Final = 0.6  # Length of the window after the touch, in contact times; arbitrary
REACH: Final = 0.15  # Half-width of the search range about the nominal impact, in flight times; arbitrary
FAINTEST: Final = 5.0  # Detection threshold, in standard deviations of a sample; arbitrary
_DEGREE: Final = 1  # Degree of the nuisance polynomial; arbitrary
_LEAST: Final = 8  # Smallest number of samples in the window; arbitrary
_MOST: Final = 200_000  # Largest number of samples in a record; arbitrary
_SPAN: Final = 1.5  # Range of the converter, relative to the largest value around the touch; arbitrary
_FLOWING: Final = 0.02  # Current at the touch, over the largest current, that counts as decayed; arbitrary
_MOST_BEFORE: Final = 0.5
"""Upper bound on the length of the window before the touch, in flight times; arbitrary."""
_AROUND: Final = 0.2  # Largest trial shift of the touch within a window, in contact times; arbitrary
_STEADY: Final = 1e-9  # Relative change of the coil voltage below which no driver switches; arbitrary
_FINEST: Final = 400  # Largest number of trial shifts per contact time; arbitrary
_MOVES: Final = 3  # Iteration limit: the window is re-centred on the estimate; arbitrary
_FIRM: Final = ("pack.stiffness", "pack.damping")
_SOFT: Final = 1e-9  # Factor on the pack's constants that makes its force negligible; arbitrary


_UNLIKE: Final = 0.5
"""Ratio of unexplained to explained signal energy above which an estimate is flagged.

Tuned: units of the hammer `impact-wire` reach a ratio of 0.4, with impact-time errors of 2 us; an unstated
probe delay of 5 us gives 1.5, with errors of 30 us.
"""

_TOO_LARGE: Final = 2.5  # Arbitrary
"""Amplitude, relative to nominal, above which an estimate is flagged; units of `impact-wire` reach 1.3."""

UNSEEN, EDGE, UNLIKE, END = "unseen", "edge", "unlike", "end"
"""Flags of an estimate: no impact detected; samples unlike an impact, near an edge of the driver or
elsewhere; an estimate at the end of the search range."""


class ImpactEstimate(Declared):
    """Estimated impact time, with a flag if the estimate is doubtful."""

    time: float = part("time from firing to impact, s; NaN if no impact is detected")
    flag: str = part(
        '"unseen", "edge", "unlike" or "end", as the module describes; empty for a trusted estimate'
    )
    clearness: float = part("amplitude of the impact in the signal, in standard deviations of a sample")


class ImpactEstimator:
    """Estimator of the impact time of one pulse from samples of the coil's current or voltage.

    Parameters
    ----------
    hammer : Hammer
        The nominal hammer, with a pack and a voltage-driven coil.
    sampling : Sampling
        Sampling of the coil's current or voltage.
    pulse : Waveform, optional
        The fired pulse; by default that of the hammer.

    Raises
    ------
    InputError
        The pulse is not a voltage or prints no dot, too few samples fall on the contact, or the expected
        signature is below the noise.
    """

    def __init__(self, hammer: Hammer, sampling: Sampling, pulse: Waveform | None = None) -> None:
        self.hammer, self.pulse = hammer, pulse_of(hammer, pulse)
        if self.pulse.quantity != "voltage":
            raise InputError(
                f"{hammer.path}: the waveform is a {self.pulse.quantity}",
                file=hammer.path,
                key="waveform",
                expected="the voltage of a driver on a coil, whose current and voltage an impact changes",
            )
        if hammer.front is None:
            raise InputError(
                f"{hammer.path}: the hammer has no pack",
                file=hammer.path,
                key="pack",
                expected="one that it strikes",
            )
        self.step = 1.0 / sampling.sampling_rate
        self.flight, self.contact = self._dot()
        self._shown_at = self.flight + sampling.delay
        parts = min(BEFORE * self.contact, _MOST_BEFORE * self.flight), AFTER * self.contact
        before, after = (max(math.ceil(part / self.step), 1) for part in parts)
        self._before, self._size = before, before + after + 1
        if self._size < _LEAST:
            raise InputError(
                (
                    f"sampling_rate = {sampling.sampling_rate:g} Hz: {self._size} samples fall on the"
                    f" contact of {1e6 * self.contact:.3g} us"
                ),
                key="sampling_rate",
                value=sampling.sampling_rate,
                expected=f"{_LEAST} at least",
            )
        self.count = math.ceil(((1.0 + REACH) * self.flight + sampling.delay) / self.step) + after + 2
        if self.count > _MOST:
            raise InputError(
                f"sampling_rate = {sampling.sampling_rate:g} Hz: {self.count} samples a dot",
                key="sampling_rate",
                value=sampling.sampling_rate,
                expected=f"at most {_MOST}",
            )
        fine = np.asarray(self.step / PHASES * np.arange(PHASES * self.count), np.float64)
        run = simulate(hammer, PulseTrain(self.pulse), duration=float(fine[-1]) + self.step, times=fine)
        true = sampling.shown(fine, sampling.of(run))
        touch = round(self._shown_at / self.step * PHASES)
        reach = math.ceil(REACH * self.flight / self.step)
        search = slice(max(touch - PHASES * (before + reach), 0), touch + PHASES * (after + reach))
        # The end of clipping resembles an impact, so the range covers the current of the whole search.
        # The open-circuit voltage before the touch may exceed the signature of the impact by far.
        first = search.start if sampling.signal == "current" else touch
        around = slice(first, touch + PHASES * after)
        self.sampling = sampling.scaled_to(_SPAN * max(float(true[around].max()), 0.0) or 1.0)
        supply = run.voltage[search]
        held = supply.size > 0 and float(np.ptp(supply)) <= _STEADY * float(np.abs(supply).max())
        free = np.zeros(fine.size) if held else self._without_pack(fine)
        self._free = free[::PHASES]
        self._template = self.sampling.clipped(true) - free
        beside = slice(max(touch - PHASES * before, 0), touch + PHASES * after)
        self._unclipped = not self._is_clipped(true[beside])
        self._currents = float(np.abs(run.current).max()), float(run.current[touch])
        self._check_signal()

    @property
    def times(self) -> FloatArray:
        """Times of the samples since the firing, s, shape (count,)."""
        return np.asarray(self.step * np.arange(self.count), np.float64)

    @property
    def clearness(self) -> float:
        """Signal-to-noise ratio: amplitude of the nominal impact's signature over the noise of a sample."""
        return float(self._filters[2][len(self._filters[2]) // 2]) / self.sampling.deviation

    def __call__(self, samples: FloatArray) -> float:
        """Return the estimated time from firing to impact, s; NaN if no impact is detected."""
        return self.estimate(samples).time

    def estimate(self, samples: FloatArray) -> ImpactEstimate:
        """Estimate the time from firing to impact, and flag a doubtful estimate.

        `samples` [A or V] begin at the firing; samples beyond the first `count` are ignored.
        """
        samples = np.asarray(samples, np.float64)
        left = samples[: self.count] - self._free
        windows = sliding_window_view(left, self._size)
        touches = self.step * (self._before + np.arange(len(windows)))
        near = np.flatnonzero(np.abs(touches - self._shown_at) <= REACH * self.flight)
        if self._unclipped:
            near = near[~self._is_clipped(sliding_window_view(samples[: self.count], self._size)[near])]
        if not near.size:
            return ImpactEstimate(math.nan, UNSEEN, 0.0)
        place = int(near[np.argmax(self._likeness(windows[near]))])
        shifts, weights, sizes = self._filters
        for _ in range(_MOVES):
            found = weights @ windows[place] / sizes
            best = int(np.argmax(found))
            if 0 < best < shifts.size - 1:
                break
            place = int(np.clip(place + round(float(shifts[best]) / self.step), near[0], near[-1]))
        clearness = float(found[best]) / self.sampling.deviation
        if not clearness >= FAINTEST:
            return ImpactEstimate(math.nan, UNSEEN, clearness)
        bend = _vertex(np.maximum(found, 0.0) ** 2, best)
        shown = float(touches[place] + shifts[best] + bend * (shifts[1] - shifts[0]))
        flag = END if place in (near[0], near[-1]) or not 0 < best < shifts.size - 1 else ""
        freedom = self._size - _DEGREE - 2
        expected = freedom + 4.0 * math.sqrt(2.0 * freedom)
        left_over = self._energy(windows[place : place + 1])[0] - float(found[best]) ** 2
        unlike = left_over > _UNLIKE * float(found[best]) ** 2 + expected * self.sampling.deviation**2
        if unlike or clearness > _TOO_LARGE * self.clearness:
            first, last = place * self.step, (place + self._size) * self.step
            edges = self.pulse.segments()[1:, 0] + self.sampling.delay
            flag = EDGE if ((edges > first) & (edges < last)).any() else UNLIKE
        return ImpactEstimate(shown - self.sampling.delay, flag, clearness)

    def _is_clipped(self, windows: FloatArray) -> BoolArray:
        """Return a mask of the windows that contain readings at the upper end of the converter's range."""
        full_scale = self.sampling.full_scale or math.inf
        return np.asarray((windows >= full_scale - self.sampling.step).any(axis=-1))

    def _energy(self, windows: FloatArray) -> FloatArray:
        """Return the sum of squares of each window of samples after removal of its straight-line fit."""
        return np.asarray((windows**2).sum(axis=1) - ((windows @ self._base) ** 2).sum(axis=1))

    def _likeness(self, windows: FloatArray) -> FloatArray:
        """Return the correlation of each window of samples with the impact signature: 1 for the same shape.

        The impact is assumed at the nominal place within the window, without a trial shift.
        """
        _shifts, weights, sizes = self._filters
        middle = len(weights) // 2
        found = windows @ weights[middle] / sizes[middle]
        # A floor at the noise energy keeps the correlation of pure noise small.
        least = self._size * self.sampling.deviation**2
        return np.asarray(found / np.sqrt(np.maximum(self._energy(windows), least)))

    @cached_property
    def _base(self) -> FloatArray:
        """Orthonormal basis of the straight lines over a window, one column per basis function."""
        offsets = np.arange(self._size) - self._before
        return np.asarray(np.linalg.qr(np.vander(offsets / self._size, _DEGREE + 1))[0], np.float64)

    @cached_property
    def _filters(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Trial shifts of the touch within a window [s], and the matched filter for each shift.

        Contains, in this order: the shifts; the filter weights, shape (shifts, samples of a window); and the
        norms of the weights.
        """
        offsets = self.step * (np.arange(self._size) - self._before)
        grid = max(self.step / PHASES, self.contact / _FINEST)
        count = math.ceil(_AROUND * self.contact / grid)
        shifts = np.asarray(grid * np.arange(-count, count + 1), np.float64)
        fine = self.step / PHASES * np.arange(self._template.size)
        rows = np.interp(self._shown_at + offsets - shifts[:, np.newaxis], fine, self._template)
        rows -= (rows @ self._base) @ self._base.T
        return shifts, rows, np.sqrt((rows**2).sum(axis=1))

    def _dot(self) -> tuple[float, float]:
        """Simulate the dot of the nominal hammer; return its flight time and contact time, s."""
        dot: Any = simulate(self.hammer, PulseTrain(self.pulse), points=2).dots[0]
        if dot.flight_time is not None and dot.contact_time is not None:
            return float(dot.flight_time), float(dot.contact_time)
        raise InputError(
            f"{self.hammer.path}: a single pulse makes no dot",
            file=self.hammer.path,
            key="waveform",
            expected="a pulse that throws the armature into the pack",
        )

    def _without_pack(self, fine: FloatArray) -> FloatArray:
        """Simulate the readings [A or V] of the nominal hammer without its pack, at the times `fine` [s].

        If the simulation ends early, the last value is repeated.
        """
        known = self.hammer.constants
        away = self.hammer.replace({key: _SOFT * known[key].si for key in _FIRM if key in known})
        run = simulate(away, PulseTrain(self.pulse), duration=float(fine[-1]) + self.step, times=fine)
        values = self.sampling.of(run)
        whole = np.concatenate([values, np.full(fine.size - values.size, values[-1])])
        return self.sampling.clipped(self.sampling.shown(fine, whole))

    def _check_signal(self) -> None:
        sampling, (largest, now) = self.sampling, self._currents
        if self.clearness >= FAINTEST:
            return
        if sampling.signal == "voltage" and not self.clearness > 0.0:
            raise InputError(
                (
                    f"{self.hammer.path}: the voltage shows no impact, since the supply or a diode holds"
                    " it, or the magnet is not permanent"
                ),
                file=self.hammer.path,
                key="signal",
                expected="signal = 'current'",
            )
        if sampling.signal == "current" and abs(now) < _FLOWING * largest:
            raise InputError(
                (
                    f"{self.hammer.path}: the current shows no impact, since {1e3 * now:.3g} mA of"
                    f" {1e3 * largest:.3g}"
                    " mA are left of it by then"
                ),
                file=self.hammer.path,
                key="signal",
                expected=(
                    "a pulse that lasts until the impact, a slower decay, or signal = 'voltage' if the"
                    " magnet is permanent"
                ),
            )
        raise InputError(
            (
                f"{self.hammer.path}: the impact changes the {sampling.signal} by {self.clearness:.2g}"
                " standard deviations"
            ),
            file=self.hammer.path,
            key="signal",
            expected=(
                f"less noise than {sampling.noise:.3g} {sampling.unit} (--noise), more bits than"
                f" {sampling.bits} (--bits), or faster sampling (--sampling-rate)"
            ),
        )


def _vertex(score: FloatArray, place: int) -> float:
    """Return the vertex of the parabola through a maximum of `score` and its two neighbours.

    The vertex is given as an offset from the index `place`, and is 0 at the ends of `score`.
    """
    if not 0 < place < score.size - 1:
        return 0.0
    before, here, after = score[place - 1 : place + 2].tolist()
    bend = before - 2.0 * here + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 0.0


Signal = Literal["current", "voltage"]
SIGNALS: Final = get_args(Signal)
UNITS: Final = {"current": "A", "voltage": "V"}
_MOST_BITS: Final = 24  # Largest resolution of a converter; arbitrary


class Sampling(Declared):
    """An A/D converter that samples the coil current or voltage, starting at the firing."""

    signal: Signal = part("sampled signal, current or voltage", default="current")
    noise: float = part("standard deviation of a sample, A or V", default=0.0)
    sampling_rate: float = scalar("Hz", "sampling rate", default=1e6)
    bits: int = part("resolution of the converter, bits", default=12)
    full_scale: float | None = part(
        "upper end of the range, A or V, which begins at 0; None for 1.5 times the largest value of the"
        " nominal signal around the impact",
        default=None,
    )

    delay: float = scalar("s", "delay of the probe before the converter", default=0.0)
    bandwidth: float | None = part("bandwidth of the probe, Hz; None for unlimited", default=None)

    def __post_init__(self) -> None:
        if not 0.0 <= self.delay < math.inf:
            raise InputError.of("delay", self.delay, "a number not below 0")
        if self.bandwidth is not None and not 0.0 < self.bandwidth < math.inf:
            raise InputError.of("bandwidth", self.bandwidth, "a number above 0")
        if self.signal not in SIGNALS:
            raise InputError.of("signal", self.signal, " or ".join(SIGNALS))
        if not 0.0 <= self.noise < math.inf:
            raise InputError.of("noise", self.noise, "a number not below 0")
        if not 0.0 < self.sampling_rate < math.inf:
            raise InputError.of("sampling_rate", self.sampling_rate, "a number above 0")
        if type(self.bits) is not int or not 1 <= self.bits <= _MOST_BITS:
            raise InputError.of("bits", self.bits, f"a whole number from 1 to {_MOST_BITS}")
        if self.full_scale is not None and not 0.0 < self.full_scale < math.inf:
            raise InputError.of("full_scale", self.full_scale, "a number above 0")

    @property
    def unit(self) -> str:
        """SI unit of the signal."""
        return UNITS[self.signal]

    def scaled_to(self, largest: float) -> Sampling:
        """Return a copy with the range from 0 to `largest` [A or V]; a range that is already set is kept."""
        return self if self.full_scale is not None else replace(self, full_scale=largest)

    @property
    def step(self) -> float:
        """Quantisation step of the converter, A or V; NaN without a range."""
        return math.nan if self.full_scale is None else self.full_scale / 2.0**self.bits

    @property
    def deviation(self) -> float:
        """Standard deviation of a sample, quantisation included, A or V."""
        return math.hypot(self.noise, self.step / math.sqrt(12.0))

    def of(self, motion: Motion) -> FloatArray:
        """Return the exact coil current [A] or coil voltage [V] at the output times of a motion."""
        values = motion.current if self.signal == "current" else motion.voltage
        return np.asarray(values, np.float64)

    def shown(self, times: FloatArray, true: FloatArray) -> FloatArray:
        """Apply the bandwidth and the delay of the probe to the signal `true` [A or V].

        `times` are closely spaced times since the firing, s.
        """
        slow = lowpass_lines(times, true, time_constant(self.bandwidth))
        return slow if self.delay == 0.0 else np.interp(times - self.delay, times, slow)

    def clipped(self, values: FloatArray) -> FloatArray:
        """Clip values [A or V] to the range of the converter."""
        span = math.inf if self.full_scale is None else self.full_scale
        return np.clip(values, 0.0, span)

    def read(self, values: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return readings of true values [A or V] of any shape, with noise, quantisation and clipping."""
        noisy = values + self.noise * rng.standard_normal(values.shape)
        return self.clipped(np.rint(noisy / self.step) * self.step)
