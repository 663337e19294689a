"""Continuation of branches up to a grazing of a rigid backstop, where they end.

As the impact speed of an orbit falls to zero, a multiplier grows as the inverse of the speed, and the steps
along the branch shrink with the square of the speed: with the state at a section as unknown, the grazing is
never reached. In terms of phase and speed of the impact, the branch is smooth up to and through the grazing
(see `flights`). The last orbits of a branch are therefore computed in these variables.
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
"""Largest distance of a touch from a grazing, in half-widths, for a branch to end in that grazing."""
_NEAR: Final = 1e-2
"""Largest distance from the last orbit to the grazing that ends its branch, in parameter scales."""
_STEEP: Final = 10.0
"""Smallest multiplier of an orbit close to its grazing; beyond it no multiplier crosses the unit circle."""
_CLOSER: Final = 0.7
"""Impact speed, relative to that at the last attempt, below which a grazing is sought again."""
_ON_CURVE: Final = 1e-5
"""Largest scaled closing error of an orbit that is accepted as one of the last orbits of a branch."""


def grazing_end(
    family: RegimeFamily, scales: FloatArray, node: Node, *, impacts: bool = False
) -> tuple[list[Node], float] | None:
    """Compute the last orbits of a branch before the grazing that ends it, and the parameter there.

    `node` is the last known orbit; with `impacts`, its turning points are ignored. None if the orbit is not
    close to a grazing.
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
    """Convert orbits, each by impact phase, impact speed and parameter, to nodes that extend a branch."""
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
    """Build the test of two successive nodes: whether an impact slows down toward a grazing.

    A grazing is located only if the impact speed has fallen well below the speed at the last attempt.
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
