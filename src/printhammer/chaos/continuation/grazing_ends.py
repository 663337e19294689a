"""Continuation of branches to a grazing of a rigid backstop.

Where the impact of an orbit fades, a multiplier grows as the inverse of its speed, and steps along the branch
shrink with the square of that speed: in the state at a section the grazing is never reached. With phase and
speed of the impact as variables the branch is smooth up to the grazing and through it (`flights`); its last
orbits are computed in these.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from printhammer.chaos.continuation.family import Passage, RegimeFamily
from printhammer.chaos.continuation.fixed_points import Node
from printhammer.chaos.continuation.flights import fading, near_touches
from printhammer.chaos.strobe.map import state_later
from printhammer.support.arrays import FloatArray

_GENTLE: Final = 1e-2
"""Largest distance from a grazing, in half-widths of the window, of a touch that may be at its end."""
_NEAR: Final = 1e-2
"""Largest distance, in scales of the parameter, from an orbit to the grazing in which it ends."""
_STEEP: Final = 10.0
"""Smallest multiplier of an orbit whose impact fades: no multiplier crosses the unit circle beyond it."""
_CLOSER: Final = 0.7
"""Speed, as a fraction of that at the last attempt, at which a grazing is sought again."""
_ON_CURVE: Final = 1e-5
"""Largest scaled closing error of one of the last orbits."""


def grazing_end(
    family: RegimeFamily, scales: FloatArray, node: Node, *, impacts: bool = False
) -> tuple[list[Node], float] | None:
    """Compute the last orbits of a branch before the grazing in which it ends, and the parameter there.

    `node` is the last known orbit; with `impacts` its turning points are ignored. None if no grazing is
    close.
    """
    regime, width = family.regime.with_(family.name, node.parameter), float(scales[-1])
    every = near_touches(regime, node.state, family.firings, family.tolerance)
    near = [touch for touch in every if touch.gap < _GENTLE and (touch.speed > 0.0 or not impacts)]
    for touch in near[:1]:
        way = fading(regime, family.name, touch, family.firings, family.tolerance, width)
        if way is None:
            continue
        place = way[-1][2]
        if touch.speed > 0.0 and abs(node.multipliers[0]) > _STEEP:
            nodes = _orbits(family, scales, node, way[1:-1])
            if nodes is not None:
                return nodes, place
        if not impacts and abs(place - node.parameter) < _NEAR * width:
            return [], place
    return None


def _orbits(
    family: RegimeFamily,
    scales: FloatArray,
    node: Node,
    way: list[tuple[float, float, float]],
) -> list[Node] | None:
    """Convert orbits, as phase and speed of an impact and parameter, to nodes behind another node."""
    nodes = [node]
    place = family.regime.hammer.position
    for phase, speed, value in way:
        regime = replace(family.regime.with_(family.name, value), phase=phase % 1.0)
        start = np.array([place, speed])
        state = state_later(regime, start, family.regime.phase, family.tolerance)
        image = family(state, value) if np.isfinite(state).all() else None
        if image is None or image.trouble or image.label != node.value.label:
            return None
        residual = float(np.abs((image.image - state) / scales[:-1]).max())
        last = nodes[-1]
        chord = np.append(state - last.state, value - last.parameter) / scales
        length = float(np.linalg.norm(chord))
        if residual > _ON_CURVE or not length > 0.0 or chord[-1] == 0.0:
            return None
        tangent = chord / length
        # Finite differences in the parameter cross the grazing; differences along the curve do not.
        along = tangent * scales
        slope = -(image.jacobian - np.eye(2)) @ along[:-1] / along[-1]
        nodes.append(Node(state, value, tangent, last.arc + length, replace(image, slope=slope), residual))
    return nodes[1:]


def fades(family: RegimeFamily, scales: FloatArray) -> Callable[[Node, Node], bool]:
    """Create the predicate of two successive nodes: whether an impact between them fades toward a grazing.

    A grazing is located only where the speed of the impact has fallen well below that at the last attempt.
    """
    tried = math.inf

    def is_fading(here: Node, ahead: Node) -> bool:
        nonlocal tried
        before, slow = _slowest(here), _slowest(ahead)
        fast = float(scales[1])
        if not (slow < before and (slow / fast) ** 2 < _GENTLE and slow < _CLOSER * tried):
            return False
        if abs(ahead.multipliers[0]) < _STEEP:
            return False
        tried = slow
        return grazing_end(family, scales, ahead, impacts=True) is not None

    return is_fading


def _slowest(node: Node) -> float:
    """Return the speed of the slowest impact on the backstop, m/s; infinite without impacts."""
    passage: Passage = node.value.extra
    return min((abs(touch.v_in) for touch in passage.of("backstop")), default=math.inf)
