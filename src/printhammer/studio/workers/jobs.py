"""Jobs of a state, run in parallel: curves, map, and detailed views.

Each has its own worker, so that curves never wait for a map or its compilation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol

from printhammer.errors import InputError
from printhammer.studio.frames import nothing, refusal
from printhammer.studio.pictures.chart import FULL, map_frame, preview_of, try_map
from printhammer.studio.pictures.engine import dots_frame, motion_frame
from printhammer.studio.pictures.printed import line_frame
from printhammer.studio.pictures.questions import QUESTIONS
from printhammer.studio.pictures.section import (
    AT_ONCE,
    LATER,
    VERDICT_WORK,
    check_strobe,
    strobe_frame,
)
from printhammer.studio.work import GivenUp, Patience

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.studio.states.state import State
    from printhammer.studio.workers.order import Order

REST: Final = 0.3
"""Time to wait for a newer state before further strobe points and the classification are computed, s."""


class Desk(Protocol):
    """Interface between a job and the worker that runs it: frames to send, and newer states."""

    tried: State | None
    """Last state for which a test showed that its map can be computed in time."""

    def tell(self, data: bytes, view: str, *, whole: bool = True) -> None:
        """Send a frame of a view; `whole` states that no more accurate frame of the view follows."""

    def newer(self) -> bool:
        """Whether a newer state has arrived."""

    def rest(self, seconds: float) -> bool:
        """Wait up to `seconds` for a newer state; return whether one arrived."""


def curves(order: Order, desk: Desk) -> None:
    """Send the curves of the single run, then its dots; or a refusal if the state is invalid."""
    try:
        data, motion = motion_frame(order.state, order.serial, order.outdated)
    except InputError as error:
        desk.tell(refusal(order.serial, str(error)), "refusal")
        return
    desk.tell(data, "motion")
    if not desk.newer():
        desk.tell(dots_frame(order.serial, motion), "dots")


def frequency_map(order: Order, desk: Desk) -> None:
    """Send a coarse map, then the full map."""
    serial, state = order.serial, order.state
    try:
        desk.tried = try_map(state, desk.tried)
        # A coarse map is never cancelled, so that it arrives while a slider moves; the browser draws
        # meanwhile on another core.
        desk.tell(map_frame(state, serial, preview_of(state), lambda: False, 1), "map", whole=False)
        desk.tell(map_frame(state, serial, FULL, desk.newer), "map")
    except InputError as error:
        desk.tell(nothing("map", serial, error), "map")


def detail(order: Order, desk: Desk) -> None:
    """Send the printed line, then the strobe section point by point."""
    works: dict[str, Callable[[Order, Desk], None]] = {"line": _line, "strobe": _section}
    for view in order.views:
        try:
            works[view](order, desk)
        except InputError as error:
            desk.tell(nothing(view, order.serial, error), view)


def _line(order: Order, desk: Desk) -> None:
    desk.tell(line_frame(order.state, order.serial, desk.newer), "line")


def _section(order: Order, desk: Desk) -> None:
    serial, state = order.serial, order.state
    patience = Patience(desk.newer, "the strobe section")
    check_strobe(state)
    for points in AT_ONCE:
        patience.check()
        desk.tell(strobe_frame(state, serial, points), "strobe", whole=False)
    if desk.rest(REST):
        raise GivenUp
    for points in LATER:
        patience.check()
        begun = patience.spent
        desk.tell(strobe_frame(state, serial, points, exponent=True), "strobe", whole=False)
    patience.check(VERDICT_WORK * (patience.spent - begun))
    desk.tell(strobe_frame(state, serial, LATER[-1], judged=True), "strobe")


def asked(order: Order, desk: Desk) -> None:
    """Send the answer to a question about a state."""
    for kind in order.views:
        try:
            desk.tell(QUESTIONS[kind](order.state, order.serial), kind)
        except InputError as error:
            desk.tell(refusal(order.serial, str(error)), "refusal")


ROLES: Final[dict[str, Callable[[Order, Any], None]]] = {
    "curves": curves,
    "map": frequency_map,
    "detail": detail,
    "asked": asked,
}
"""Function that runs a job, by role."""
