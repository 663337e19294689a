"""The state in which a run begins: the rest state, or one that is checked."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from printhammer.errors import InputError
from printhammer.kernel.model.modes import LOADING, RELOADING, UNLOADING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.hammer.hammer import Hammer

_BRANCHES = {LOADING: "loading", UNLOADING: "unloading", RELOADING: "reloading"}


def initial_state(hammer: Hammer, state: Sequence[float] | None) -> tuple[float, float]:
    """Return displacement, m, and velocity, m/s, at the start of a run; by default the rest state.

    Raises
    ------
    InputError
        Not two finite numbers; a displacement where the law of the magnet does not hold, or behind a rigid
        backstop; no state, and the hammer has no rest state.
    """
    if state is None:
        from printhammer.hammer.equilibrium import rest_state

        return rest_state(hammer), 0.0
    x, v = (float(number) for number in state)
    if not (math.isfinite(x) and math.isfinite(v)):
        raise InputError(
            f"state = {tuple(state)!r}, expected two finite numbers, displacement in m and velocity in m/s"
        )
    if hammer.magnet is not None:
        low, high = hammer.magnet.domain
        if not low <= x <= high:
            raise InputError(
                f"state = {tuple(state)!r}, expected a displacement from {low:.9g} m to {high:.9g} m, where"
                " the law of the magnet holds"
            )
    rigid = hammer.backstop is not None and hammer.backstop.law == "rigid"
    if rigid and hammer.position is not None and x < hammer.position:
        raise InputError(f"state = {tuple(state)!r}, expected a displacement not behind the rigid backstop")
    return x, v


def check_branch(hammer: Hammer, state: Sequence[float]) -> None:
    """Check a start inside the pack: displacement, velocity, code of the branch, memory.

    Raises
    ------
    InputError
        No such branch; a displacement outside the pack; a memory that is not a displacement passed before.
    """
    x, _v, branch, memory = (float(number) for number in state)
    if branch not in _BRANCHES or hammer.front is None:
        known = ", ".join(f"{code} ({name})" for code, name in _BRANCHES.items())
        raise InputError(f"state with branch = {branch:g}, expected a pack and one of {known}")
    if not x > hammer.front:
        raise InputError(
            f"state with x = {x:.9g} m on a branch in the pack, expected more than its front,"
            f" {hammer.front:.9g} m"
        )
    if branch != LOADING and not memory >= x:
        raise InputError(
            f"state with memory = {memory:.9g} m, expected a displacement not less than x = {x:.9g} m"
        )
