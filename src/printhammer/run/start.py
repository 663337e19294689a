"""Initial state of a run: the rest state, or a validated state.

The state includes branch and memory in the pack, and the coil currents for a voltage drive; see `Beyond`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from printhammer.drive.input import read_number
from printhammer.errors import InputError
from printhammer.kernel.model.modes import (
    HELD_LOADING,
    HELD_UNLOADING,
    LOADING,
    PACK_RELEASED,
    RELOADING,
    UNLOADING,
)

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


class Beyond(NamedTuple):
    """State components in addition to (x, v); by default outside the pack, without current.

    In the pack: the branch, an index in `printhammer.run.ensemble.MODE_NAMES` or -1 (determined by
    displacement and velocity), and the latest local maximum of the displacement, m. Under a voltage: the
    currents in the coil and in its shorted turn, A, and the voltage of the supply's capacitor, V, NaN for a
    charged capacitor.
    """

    branch: float = -1.0
    memory: float = 0.0
    current: float = 0.0
    turn: float = 0.0
    reservoir: float = math.nan


AT_REST: Final = Beyond()
FORMS: Final = {2: (), 3: (2,), 4: (0, 1), 5: (2, 3, 4), 7: (0, 1, 2, 3, 4)}
"""Indices of the `Beyond` fields that follow displacement and velocity, by length of the state."""

STATE: Final = (
    "displacement in m and velocity in m/s; in the pack with branch and memory in m; under a voltage then"
    " with the current in A, or with that, the one of the shorted turn in A and the capacitor's voltage in V"
)

HELD_BRANCHES: Final = {HELD_LOADING: LOADING, HELD_UNLOADING: UNLOADING}
"""Modes in which the armature rests in the pack, and the branch of the pack law of each."""

_UNITS: Final = ("m", "m/s")
"""Units of displacement and velocity."""
_UNITS_BEYOND: Final = ("1", "m", "A", "A", "V")
"""Units of the further state components, in the order of the fields of `Beyond`."""

_BRANCHES = {LOADING: "loading", UNLOADING: "unloading", RELOADING: "reloading"}


def read_state(state: Sequence[Any]) -> tuple[float, ...]:
    """Parse a state in any of its forms, in SI or as text with units.

    Raises
    ------
    InputError
        The number of components is not in `FORMS`, or a text has no unit.
    """
    units = (*_UNITS, *(_UNITS_BEYOND[place] for place in FORMS.get(len(state), ())))
    if len(units) != len(state):
        raise InputError.of("state", tuple(state), STATE)
    return tuple(
        float(number) if isinstance(number, Real) else read_number(number, si, "state")
        for number, si in zip(state, units, strict=True)
    )


def initial_state(hammer: Hammer, state: Sequence[float] | None) -> tuple[float, float]:
    """Return displacement [m] and velocity [m/s] at the start of a run; by default the rest state.

    Raises
    ------
    InputError
        The state is not two finite numbers; its displacement is outside the range of the laws, or
        behind a rigid backstop; or no state is passed and the hammer has no rest state.
    """
    if state is None:
        return hammer.rest, 0.0
    if len(state) != 2:
        raise InputError.of("state", tuple(state), "two numbers, displacement in m and velocity in m/s")
    x, v = (float(number) for number in state)
    if not (math.isfinite(x) and math.isfinite(v)):
        raise InputError.of(
            "state", tuple(state), "two finite numbers, displacement in m and velocity in m/s"
        )
    low, high = hammer.domain
    if not low <= x <= high:
        raise InputError.of(
            "state",
            tuple(state),
            f"a displacement from {low:.9g} m to {high:.9g} m, where the laws of magnet and spring hold",
        )
    rigid = hammer.backstop is not None and hammer.backstop.law == "rigid"
    if rigid and hammer.position is not None and x < hammer.position:
        raise InputError.of("state", tuple(state), "a displacement not behind the rigid backstop")
    return x, v


def state_beyond(hammer: Hammer, state: Sequence[float] | None, quantity: str) -> Beyond:
    """Return the components of a state besides displacement and velocity.

    `quantity` is the quantity that the drive controls: "current", "force" or "voltage".

    Raises
    ------
    InputError
        The state has none of the valid forms, or is not finite; the branch is unknown; currents are set
        without a voltage drive, or in a missing shorted turn.
    """
    numbers = tuple(float(number) for number in state or (0.0, 0.0))
    places = FORMS.get(len(numbers))
    if places is None or not all(math.isfinite(number) for number in numbers[:6]):
        raise InputError.of("state", numbers, f"two finite numbers, {STATE}")
    beyond = Beyond(**{Beyond._fields[k]: number for k, number in zip(places, numbers[2:], strict=True)})
    if beyond.branch >= 0.0:
        check_branch(hammer, (*numbers[:2], *beyond[:2]))
    if len(numbers) in (3, 5, 7) and quantity != "voltage":
        raise InputError(
            (
                f"state = {numbers!r} under a drive by {quantity}: the current belongs to the state"
                " under a voltage only"
            ),
            key="state",
            value=numbers,
            expected="displacement in m and velocity in m/s",
        )
    if beyond.turn and not getattr(hammer.coil, "turn_resistance", None):
        raise InputError(
            f"state = {numbers!r}: the coil has no shorted turn",
            key="state",
            value=numbers,
            expected="no current in it",
        )
    return beyond


def state_to_begin(
    hammer: Hammer, x: float, v: float, mode: int, memory: float
) -> tuple[float, float, float, float] | None:
    """Convert a state (x, v, mode, memory) to an initial state (x, v, branch, memory) of another run.

    The result is None if no run can continue from the state, since the pack has just released the armature.
    """
    branch = HELD_BRANCHES.get(mode, mode)
    if mode == PACK_RELEASED:
        return None
    rigid = hammer.backstop is not None and hammer.backstop.law == "rigid"
    if rigid and hammer.position is not None:
        x = max(x, hammer.position)
    if branch not in _BRANCHES:
        return x, v, -1.0, 0.0
    return x, v, float(branch), memory


def check_branch(hammer: Hammer, state: Sequence[float]) -> None:
    """Check an initial state in the pack: (displacement, velocity, branch code, memory).

    Raises
    ------
    InputError
        The branch is unknown, the displacement lies outside the pack, or the memory is not a displacement
        passed before.
    """
    x, _v, branch, memory = (float(number) for number in state[:4])
    if branch not in _BRANCHES or hammer.front is None:
        known = ", ".join(f"{code} ({name})" for code, name in _BRANCHES.items())
        raise InputError(
            f"state with branch = {branch:g}",
            key="branch",
            value=branch,
            expected=f"a pack and one of {known}",
        )
    if not x > hammer.front:
        raise InputError(
            f"state with x = {x:.9g} m on a branch in the pack",
            key="x",
            value=x,
            expected=f"more than its front, {hammer.front:.9g} m",
        )
    if branch != LOADING and not memory >= x:
        raise InputError(
            f"state with memory = {memory:.9g} m",
            key="memory",
            value=memory,
            expected=f"a displacement not less than x = {x:.9g} m",
        )
