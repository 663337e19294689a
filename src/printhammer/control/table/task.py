"""Tuning task of a compensation table: settings, single-pulse dot, and deviations from that dot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from printhammer.control.table.drive import fading
from printhammer.drive.trains import Drive, PulseTrain
from printhammer.drive.waveforms.shapes import TAIL, Waveform
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import Nominal, nominal
from printhammer.printing.dots.settling import settled_from, touches
from printhammer.run.effort import Effort
from printhammer.run.ensemble import Ensemble
from printhammer.run.plain.posing import FLIGHTS
from printhammer.run.simulate import simulate
from printhammer.run.window import time_scale, wait_of
from printhammer.support.arrays import BoolArray, FloatArray

# Distance from rest below which the hammer counts as settled, as a fraction of the distance to the pack;
# arbitrary
QUIET: Final = 2e-4
_LONGEST: Final = 20e-3  # Lower bound of the time limit for settling after a single pulse, s; arbitrary
_WINDOWS: Final = 2.0
"""Lower bound of the time limit for settling, in windows of `printhammer.run.window`; arbitrary."""
_SAMPLE: Final = 2e-6  # Sampling interval of the motion that is tested for settling, s; arbitrary
# Allowance for a late or wide print pulse before a brake pulse, s; arbitrary
_WIDE: Final = 50e-6
_TAIL: Final = 1e-3
"""Shortest simulation time after the last slot, s: until the last contact is over; arbitrary."""
_CONTACT: Final = 1.5
"""Shortest simulation time after the last slot, in single-pulse times to departure; arbitrary."""
_PIECE: Final = 4096  # Simulations per ensemble, which bounds the memory; arbitrary


@dataclass(frozen=True)
class Single:
    """The single pulse from rest: its dot, and the times of departure from the pack and of settling, s."""

    nominal: Nominal
    left: float
    settled: float


def single_of(hammer: Hammer, pulse: Waveform, tolerance: float) -> Single:
    """Simulate a single pulse from rest; return its dot and the times of departure and settling."""
    known = nominal(hammer, pulse, tolerance=tolerance)
    longest = max(_LONGEST, _WINDOWS * wait_of(hammer, pulse))
    times = np.arange(0.0, longest, _SAMPLE)
    motion = simulate(hammer, PulseTrain(pulse), duration=longest, times=times, tolerance=tolerance)
    dot = next(contact for contact in motion.contacts if contact.surface == "pack")
    rest, front = rest_state(hammer), hammer.front
    assert front is not None
    place = settled_from(np.abs(motion.x - rest) > QUIET * (front - rest))
    if dot.t_out is None or not touches(motion) or not motion.ok or place == len(motion.x):
        raise InputError(
            f"{hammer.path}: the hammer is not at rest {1e3 * longest:g} ms after a single pulse",
            file=hammer.path,
            key="hammer",
            expected="one that settles on its backstop",
        )
    return Single(known, float(dot.t_out), float(motion.t[place]))


def search_scale(hammer: Hammer, pulse: Waveform) -> float:
    """Return the scale factor of the search's time ranges, relative to the paper's hammer; at least 1.

    The ranges are not shortened for a faster device: with shorter ranges, a device twice as fast lost its
    only stable candidate at 1.3 kHz (`tests/control/table/test_tuning.py`).
    """
    return max(1.0, time_scale(hammer, pulse))


@dataclass(frozen=True)
class Task:
    """Settings for tuning a compensation table: hammers, limits, pulse shapes and bounds.

    The table is tuned on `hammers`, the design first; the hammers of `spread` are perturbed copies of the
    design. No pulse is wider than `widest` [s], and none begins earlier than `wait` [s] after the end of a
    brake pulse. `report` is called after each step of the work.
    """

    gaps: int
    reach: int
    hammers: Sequence[Hammer]
    spread: Sequence[Hammer]
    pulse: Waveform
    largest: float
    widest: float
    wait: float
    single: Single
    limits: Limits
    brake: bool
    effort: Effort
    report: Callable[[], None]
    barred: tuple[tuple[float, float, float], ...] = ()
    """Period, delay and width of brake pulses, s, of candidates that failed in a tuned table."""
    located: bool = False
    """Whether to locate the periodic orbits of all rows of dots, even of rows whose second dot is good."""
    mean_square: bool = False
    """Whether the cost of a candidate is the RMS over all hammers instead of the worst case."""

    @property
    def width(self) -> float:
        """Width of the hammer's own pulse, s."""
        own: Any = self.pulse
        return float(own.width)

    @cached_property
    def scale(self) -> float:
        """Factor on all times that are stated for the paper's hammer; see `search_scale`."""
        return search_scale(self.hammers[0], self.pulse)

    @cached_property
    def faded(self) -> float:
        """Time from the end of a pulse until its current has decayed to a negligible value, s."""
        return fading(self.hammers[0], self.pulse, 0.5 * TAIL)

    @property
    def brake_from(self) -> float:
        """Earliest time of a brake pulse, s, measured from the slot of the preceding dot.

        By then the armature has left the pack and the print pulse has decayed, even if the pulse is late or
        wide by `_WIDE`.
        """
        return float(max(self.single.left, self.width + _WIDE * self.scale + self.faded))

    @cached_property
    def window(self) -> float:
        """Simulation time after the last firing of a complete pattern or line, s."""
        return wait_of(self.hammers[0], self.pulse)

    @property
    def tail(self) -> float:
        """Simulation time after the last firing in the search, s, long enough for the last contact."""
        return max(_TAIL, FLIGHTS * self.single.nominal.flight_time, _CONTACT * self.single.left)

    def earliest(self, delay: FloatArray, brake: FloatArray) -> FloatArray:
        """Return the earliest firing time [s] measured from the slot of the preceding dot.

        By then the armature has left the pack, so that no dot uses energy returned by the pack of the
        preceding dot. A brake pulse of the width `brake`, which begins at `delay`, has decayed so far that
        the current stays within its limit.
        """
        return np.asarray(np.where(brake > 0.0, delay + brake + self.wait, self.single.left))

    def latest(self, width: FloatArray) -> FloatArray:
        """Return the latest firing time, s after the slot of the dot, that leaves time for a brake pulse.

        `width` is the width of the print pulse, s.
        """
        return np.asarray(self.brake_from - self.faded - width)

    def deviations(
        self, hammer: Hammer, drives: Sequence[Drive], slots: FloatArray, ends: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        """Simulate drives; return deviations from the single-pulse dot, and a mask of extra contacts.

        Row k of `slots` contains the slot times [s] of the dots of drive k, padded with NaN. The simulation
        of drive k continues for `tail` after the time `ends[k]` [s].

        Returns
        -------
        off : array, shape (drives, dots, 2)
            Deviations of force and arrival, as fractions of the limits; NaN for a lost dot, and for all dots
            of a simulation that failed.
        crowded : bool array, shape (drives, dots)
            Whether a dot has more extra contacts than the limits allow.
        """
        single = self.single.nominal
        off, crowded = np.full((*slots.shape, 2), np.nan), np.zeros(slots.shape, np.bool_)
        for start in range(0, len(drives), _PIECE):
            rows = slice(start, start + _PIECE)
            ensemble = Ensemble(
                hammer, list(drives[rows]), ends[rows] + self.tail, tolerance=self.effort.tolerance
            )
            result = ensemble.run(dots=True, threads=self.effort.threads)
            dots = result.dots
            assert dots is not None
            own = rows, slice(dots.fired_at.shape[1])
            touched = dots.fired_at + dots.flight_time
            off[own] = np.stack(
                [
                    (dots.peak_force / single.force - 1.0) / self.limits.force,
                    (touched - (slots[own] + single.flight_time)) / self.limits.arrival,
                ],
                axis=2,
            )
            off[rows][~result.ok] = np.nan
            crowded[own] = dots.extra_contacts > single.extra_contacts + self.limits.extra_contacts
        return off, crowded
