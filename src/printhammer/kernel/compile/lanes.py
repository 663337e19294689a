"""The kernel for lanes: which members it suits, and what its template is linked with."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from printhammer.kernel.compile.bindings import bindings_of
from printhammer.kernel.compile.modules import Entry, one_at_a_time
from printhammer.kernel.compile.specialise import Kernel, is_interpreted, specialise

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import Laws

LaneKinds = tuple[int, bool, bool]
"""Number of exponentials in the drive, whether it has a cubic part, whether a sine."""


def suits(laws: Laws) -> bool:
    """Whether members with these laws can run in lanes."""
    choices = _choices(laws)
    return bool(
        not is_interpreted()
        and choices["HAS_BACKSTOP"]
        and not choices["RIGID"]
        and choices["HAS_PACK"]
        and choices["MEMORY"]
        and laws.pack_pulls
        and laws.backstop_pulls
    )


@functools.cache
def _choices(laws: Laws) -> dict[str, bool]:
    """Return the choices of laws; cached, since each run of an ensemble asks for them."""
    return bindings_of(laws).choices


def specialise_lanes(laws: Laws, kinds: LaneKinds) -> Kernel:
    """Return the kernel for `laws` and the pieces that a drive consists of.

    Its entry point is `lanes`, see :mod:`printhammer.kernel.lanes.lanes`.
    """
    with one_at_a_time:
        return _specialised(laws, kinds)


@functools.cache
def _specialised(laws: Laws, kinds: LaneKinds) -> Kernel:
    choices = dict(zip(("EXPONENTIALS", "CUBIC", "SINE"), kinds, strict=True))
    label = specialise(laws).label
    return Kernel(laws, label, [Entry("lanes", {}, bindings_of(laws), choices, label)])
