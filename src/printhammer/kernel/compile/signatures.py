"""Argument types of the entry points; see :data:`printhammer.kernel.compile.calls.Signature`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from printhammer.kernel.lanes.batch import Batch, Kept
from printhammer.kernel.variational.layout import Carried

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from printhammer.kernel.compile.calls import Signature

_TRAIN: Final = ("f1", "i1", "f2", "b", "i1", "f1")
_FOUR: Final = ("f", "f", "f", "f")
_BATCH: Final = Batch(
    hammer_of="i1",
    hammers="f2",
    controls="f2",
    bounds="f2",
    waveform_of="i1",
    piece_starts="i1",
    pieces="f2",
    rates="f2",
    firing_starts="i1",
    firings="f1",
    begins="i1",
    replace="b",  # type: ignore[arg-type]
    states="f2",
    ends="f1",
    max_steps="i",  # type: ignore[arg-type]
)
_KEPT: Final = Kept(
    strobe_starts="i1",
    strobe_times="f1",
    grid="f1",
    want_dots="b",  # type: ignore[arg-type]
    status="i1",
    reached="f1",
    steps="i1",
    extra="i1",
    dot_starts="i1",
    dots="f2",
    strobes="f2",
    x="s2",
)
_FORCING: Final = ("f3", "f2", "i1", "f2", "f3", "f2", "f2", "f")
_CARRIED: Final = Carried(
    columns="f2", work="f2", track="f1", states="f2", changes="f3", growth="f2", passed="f4"
)
_FLOW: Final = ("f2", _TRAIN, "f1", ("f", "f"), _FOUR)

_SIGNATURES: Final[dict[str, Signature]] = {
    "run": ((_TRAIN, "f1", _FOUR, _FOUR, "i"), "f", "f2", "f2", "f1"),
    "resample": ("f1", "f2", _TRAIN, "f1", "f2"),
    "peaks": ("f2", "f2", _TRAIN, "f1", "f2"),
    "quadratures": ("i1", "f1", "f1", "f2", _TRAIN, "f1", "f2"),
    "members": ("i1", _BATCH, _KEPT, "i2", "f2", "f2", "f2", "f1"),
    "lanes": ("i1", _BATCH, _KEPT, "b", "i1", "f1", "f2", "i1", "i2", "f2", "i1", "i1"),
}

RESULTS: Final = {"run": 4, "resample": 0, "peaks": 0, "quadratures": 0, "members": 1, "lanes": 1, "flow": 0}
"""Number of integers that each entry point returns."""


def signature_of(entry: str, variant: Mapping[str, bool]) -> Any:
    """Return the argument types of an entry point in a variant of its template."""
    if entry == "flow":
        return (*_FLOW, _FORCING if variant["FORCED"] else (), "f1", "i1", "b", "b", "f2", _CARRIED)
    return _SIGNATURES[entry]


class Plain(NamedTuple):
    """Entry point outside the kernel: an ordinary function of numbers and arrays, with its argument types.

    The function allocates nothing and raises nothing; it returns None, an integer, or a tuple of integers.
    Its module may leave names of laws, of choices and of functions of the kernel's templates undefined; these
    are bound when the function is compiled; see :func:`printhammer.kernel.compile.templates.bind`.
    """

    function: Callable[..., Any]
    arguments: Any
    """Type codes of the arguments; see :data:`printhammer.kernel.compile.calls.Signature`."""
    results: int = 0
    """Number of integers that the function returns."""
    laws: bool = False
    """Whether the function uses names of the kernel."""
    packing: bool = False
    """Whether the function calls functions that pack the constants of parts."""
