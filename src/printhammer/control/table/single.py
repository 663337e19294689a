"""What the single pulse does, as far as the tuning of tables needs it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.printing.dots.nominal import Nominal, nominal
from printhammer.run.simulate import simulate

if TYPE_CHECKING:
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer

QUIET: Final = 2e-4
"""Distance from rest below which the hammer counts as settled, in parts of the way to the pack."""

_LONGEST: Final = 20e-3
_SAMPLE: Final = 2e-6


@dataclass(frozen=True)
class Single:
    """The single pulse from rest.

    Attributes
    ----------
    nominal : Nominal
        Its dot.
    left : float
        Time at which the armature leaves the pack, s.
    returned : float
        Time at which it touches the backstop, s.
    settled : float
        Time from which on it stays at rest, s, within `QUIET`.
    """

    nominal: Nominal
    left: float
    returned: float
    settled: float


def single_of(hammer: Hammer, pulse: Waveform, tolerance: float) -> Single:
    """Fire a hammer once from rest.

    Raises
    ------
    InputError
        It makes no dot, or does not come back to rest.
    """
    known = nominal(hammer, pulse, tolerance=tolerance)
    times = np.arange(0.0, _LONGEST, _SAMPLE)
    motion = simulate(hammer, PulseTrain(pulse), duration=_LONGEST, times=times, tolerance=tolerance)
    dot = next(contact for contact in motion.contacts if contact.surface == "pack")
    back = [
        contact.t_in for contact in motion.contacts if contact.surface == "backstop" and not contact.initial
    ]
    rest, front = rest_state(hammer), hammer.front
    assert front is not None
    away = np.flatnonzero(np.abs(motion.x - rest) > QUIET * (front - rest))
    if dot.t_out is None or not back or not motion.ok or away[-1] == len(motion.x) - 1:
        raise InputError(
            f"{hammer.path}: the hammer is not at rest {1e3 * _LONGEST:g} ms after a single pulse, expected"
            " one that settles on its backstop"
        )
    return Single(known, float(dot.t_out), float(back[0]), float(motion.t[away[-1] + 1]))
