"""Answers to questions about states that a page does not display: pinned states, and rates in a search."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.studio.frames import frame
from printhammer.studio.pictures.engine import dots_frame, motion_frame
from printhammer.studio.pictures.section import LATER, check_strobe, exponent_so_far, strobe_frame

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.studio.states.state import State

SCREENED: Final = 200
"""Number of firings for the exponent at one rate of a search; the average is over the later half."""


def curves(state: State, serial: int) -> bytes:
    """Return the frame with the curves of the single run of a state."""
    return motion_frame(state, serial)[0]


def dots(state: State, serial: int) -> bytes:
    """Return the frame with the dots of the single run of a state."""
    return dots_frame(serial, motion_frame(state, serial)[1])


def exponent(state: State, serial: int) -> bytes:
    """Return a frame with the largest exponent of an endless train, null if it cannot be computed."""
    try:
        check_strobe(state)
    except InputError as error:
        # A train that stops early does not end a search.
        return frame("exponent", serial, exponent=None, reason=str(error))
    return frame("exponent", serial, exponent=exponent_so_far(state, SCREENED), reason="")


def verdict(state: State, serial: int) -> bytes:
    """Return the frame of the strobe section of an endless train, with its classification."""
    check_strobe(state)
    return strobe_frame(state, serial, LATER[-1], judged=True)


QUESTIONS: Final[dict[str, Callable[[State, int], Any]]] = {
    "curves": curves,
    "dots": dots,
    "exponent": exponent,
    "verdict": verdict,
}
"""Function that answers each kind of question in `ASKED`; it raises `InputError` for an invalid state."""
