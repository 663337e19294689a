"""Vector-lane kernel: the supported force laws, and the compile-time choices of its template."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from printhammer.kernel.compile.bindings import bindings_of
from printhammer.kernel.compile.modules import Entry, one_at_a_time
from printhammer.kernel.compile.specialise import Kernel, is_interpreted, specialise

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import Laws

LaneKinds = tuple[int, bool, bool]
"""Kinds of waveform pieces in the drive: number of exponentials; whether a cubic or a sine occurs."""


def suits(laws: Laws) -> bool:
    """Whether the vector-lane kernel supports the force laws `laws`."""
    choices = _choices(laws)
    return bool(
        not is_interpreted()
        and choices["HAS_BACKSTOP"]
        and not choices["RIGID"]
        and choices["HAS_PACK"]
        and choices["MEMORY"]
        and not choices["RIGID_FRONT"]
        and not choices["LEVELS"]
        and not choices["FRICTION"]
        and laws.pack_pulls
        and laws.backstop_pulls
    )


@functools.cache
def _choices(laws: Laws) -> dict[str, bool]:
    """Return the compile-time choices for `laws`; cached, since every run of an ensemble needs them."""
    return bindings_of(laws).choices


def specialise_lanes(laws: Laws, kinds: LaneKinds) -> Kernel:
    """Return the lane kernel for the force laws `laws` and for a drive with waveform pieces of `kinds`.

    The entry point of the kernel is `lanes`; see :mod:`printhammer.kernel.lanes.lanes`.
    """
    with one_at_a_time:
        return _specialised(laws, kinds)


@functools.cache
def _specialised(laws: Laws, kinds: LaneKinds) -> Kernel:
    choices = dict(zip(("EXPONENTIALS", "CUBIC", "SINE"), kinds, strict=True))
    label = specialise(laws).label
    return Kernel(laws, label, [Entry("lanes", {}, bindings_of(laws), choices, label)])
