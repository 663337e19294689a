"""What a current probe shows of a coil that a voltage drives, with a free armature or a locked one.

The probe is a first-order low-pass. Between moments at most 0.5 us apart the current is taken as straight.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.identify.lowpass import lowpass_lines
from printhammer.run.simulate import simulate

if TYPE_CHECKING:
    from printhammer.drive.waveforms.base import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_FINEST: Final = 0.5e-6
"""Largest step of the current that goes through the probe, s."""

_MOST: Final = 2_000_000
"""Steps of a record, which bound its room in the memory."""

_LOCKED: Final = 1e9
"""Mass of a locked armature, kg: in a second 100 N move it by 0.05 um."""


def check_driver(hammer: Hammer) -> None:
    """Refuse a hammer whose waveform is no voltage.

    Raises
    ------
    InputError
        As said.
    """
    if hammer.waveform is None or hammer.waveform.unit != "V":
        raise InputError(
            f"{hammer.path}: the hammer has no [waveform] that is a voltage, expected the driver of its coil"
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
        raise InputError(f"a record of {after[-1]:.6g} s is too long for the probe, expected a shorter one")
    fine = np.interp(np.arange(count + 1) / each, np.arange(len(knots)), knots)
    state = None
    if locked is not None:
        hammer, state = hammer.replace("mass", _LOCKED), (locked, 0.0)
    run = simulate(hammer, PulseTrain(waveform), duration=float(fine[-1]), state=state, points=2)
    if not run.ok:
        raise InputError(f"{hammer.path}: the current did not reach its end: {run.message}")
    current = lowpass_lines(fine, run.driven_at(fine), tau)[::each]
    shown[t >= 0.0] = current[len(knots) - len(after) :]
    return shown
