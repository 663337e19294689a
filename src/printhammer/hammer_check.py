"""Checks of a whole hammer: does it rest at its backstop, and does it come back to it."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Final

from printhammer.errors import InputError
from printhammer.units import from_si

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.hammer import Hammer

_POINTS: Final = 2000
_HALVINGS: Final = 60


def check(hammer: Hammer) -> None:
    """Refuse a hammer that has no rest state at its backstop.

    Parameters
    ----------
    hammer : Hammer
        Checked only where it has magnet, spring and backstop: a stored-energy hammer.

    Raises
    ------
    InputError
        The net force of magnet and spring at zero current at the backstop is not negative.
    """
    if hammer.magnet is None or hammer.spring is None or hammer.backstop is None:
        return
    force = _force_at_zero_current(hammer)(hammer.backstop.position)
    if not force < 0.0:
        raise InputError(
            f"{hammer.path}: the net force at zero current at backstop.position is {force:.4g} N, expected a "
            "negative one that holds the armature against the backstop"
        )


def warnings(hammer: Hammer) -> list[str]:
    """Say where the armature may never return to the backstop.

    Parameters
    ----------
    hammer : Hammer
        The hammer.

    Returns
    -------
    list of str
        A sentence for each interval between backstop and platen (without one: the back of the pack) in which
        the net force of magnet and spring at zero current is positive.

    Raises
    ------
    InputError
        As `check`.
    """
    check(hammer)
    end = _far_end(hammer)
    if hammer.backstop is None or end is None or (hammer.magnet is None and hammer.spring is None):
        return []
    force = _force_at_zero_current(hammer)
    told = []
    for low, high in positive_intervals(force, hammer.backstop.position, end):
        span = f"{from_si(low, 'm', 'um'):.4g} to {from_si(high, 'm', 'um'):.4g} um"
        told.append(
            f"the net force at zero current is positive from {span}: the armature may never return from there"
        )
    return told


def _far_end(hammer: Hammer) -> float | None:
    end = hammer.platen
    if end is None and hammer.pack is not None:
        end = hammer.pack.front + getattr(hammer.pack, "thickness", 0.0)
    if end is not None and hammer.magnet is not None:
        end = min(end, hammer.magnet.domain[1])
    return end


def _force_at_zero_current(hammer: Hammer) -> Callable[[float], float]:
    terms: list[Callable[[float], float]] = []
    if hammer.magnet is not None:
        magnet, magnet_constants = import_module(hammer.magnet.module), hammer.magnet.packed(hammer.origin)
        terms.append(lambda x: magnet.magnet_force(magnet_constants, x, 0.0))
    if hammer.spring is not None:
        spring, spring_constants = import_module(hammer.spring.module), hammer.spring.packed(hammer.origin)
        terms.append(lambda x: spring.spring_force(spring_constants, x))
    return lambda x: sum(term(x) for term in terms)


def positive_intervals(
    function: Callable[[float], float], low: float, high: float
) -> list[tuple[float, float]]:
    """Find where a smooth function is positive.

    Parameters
    ----------
    function : callable
        Of one float.
    low, high : float
        Where to look, at 2000 even steps; a maximum between them that stays below zero there is followed up.

    Returns
    -------
    list of (float, float)
        Ends of each interval, to the last few bits.
    """
    places = [low + (high - low) * step / _POINTS for step in range(_POINTS)] + [high]
    values = [function(place) for place in places]
    for k in range(len(places) - 2, 0, -1):
        if values[k] <= 0.0 and values[k] >= values[k - 1] and values[k] >= values[k + 1]:
            top = _maximum(function, places[k - 1], places[k + 1])
            if function(top) > 0.0:
                at = k if top < places[k] else k + 1
                places.insert(at, top)
                values.insert(at, function(top))
    found: list[tuple[float, float]] = []
    start = low if values[0] > 0.0 else None
    for k in range(1, len(places)):
        if values[k] > 0.0 and start is None:
            start = _crossing(function, places[k - 1], places[k])
        elif values[k] <= 0.0 and start is not None:
            found.append((start, _crossing(function, places[k], places[k - 1])))
            start = None
    if start is not None:
        found.append((start, high))
    return found


def _crossing(function: Callable[[float], float], below: float, above: float) -> float:
    """Return where a function turns from not positive (`below`) to positive (`above`)."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (below + above)
        if function(middle) > 0.0:
            above = middle
        else:
            below = middle
    return above


def _maximum(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the place of a maximum between two places, by thirds."""
    for _ in range(_HALVINGS):
        third = (high - low) / 3.0
        if function(low + third) < function(high - third):
            low += third
        else:
            high -= third
    return 0.5 * (low + high)
