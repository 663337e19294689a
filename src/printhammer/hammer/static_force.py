"""Static force on the armature, from the laws of the parts of a hammer."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from itertools import count, takewhile
from typing import Any, Protocol

from printhammer.errors import InputError
from printhammer.hammer.statics import FARTHER, Statics, free_force, limits_of, reach_of, total_force
from printhammer.parts import BackstopPart, MagnetPart, PackPart, Part, SpringPart, absent
from printhammer.parts.base import domain_of


class HammerLike(Protocol):
    """Protocol with the attributes of a hammer that the static computations use."""

    @property
    def name(self) -> str:
        """Name of the hammer, for messages."""

    @property
    def mass(self) -> float:
        """Mass of the armature, kg."""

    @property
    def magnet(self) -> MagnetPart | None:
        """Magnet; None if absent."""

    @property
    def spring(self) -> SpringPart | None:
        """Spring; None if absent."""

    @property
    def pack(self) -> PackPart | None:
        """Ribbon and paper pack; None if absent."""

    @property
    def backstop(self) -> BackstopPart | None:
        """Backstop; None if absent."""

    @property
    def platen(self) -> float | None:
        """Position of the platen, m."""

    @property
    def origin(self) -> float:
        """Position of the backstop, m; 0 without a backstop."""


class StaticForce:
    """Static force on the armature as a function of x, and its domain.

    Magnet, spring and the elastic force of the backstop are functions of x; the pack acts on its loading
    branch, as when fresh paper is pressed slowly. A `rigid` backstop excludes positions below its surface.
    `limits` [m] is the range in which the laws are valid and no rigid backstop is penetrated. `low`
    and `high` [m] bound the default search for equilibria: from the lower limit to the platen, the back of
    the pack or the upper limit, and at most 1 m from the origin.
    """

    def __init__(self, hammer: HammerLike) -> None:
        self.hammer = hammer
        self.statics = statics_of(hammer)
        self.front, self.rigid, self.memory = self.statics.front, self.statics.rigid, self.statics.memory
        self.limits = limits_of(self.statics)
        self.low, self.high = self.reach()
        self.end = self.high
        if hammer.platen is None and hammer.pack is not None:
            self.end = min(self.high, self.front + getattr(hammer.pack, "thickness", 0.0))

    def free(self, x: float, current: float = 0.0) -> float:
        """Compute the net force [N] of magnet and spring without contacts; NaN outside the magnet's range."""
        return free_force(x, current, self.statics)

    def total(self, x: float, current: float = 0.0) -> float:
        """Compute the net force including the contacts, N."""
        return total_force(x, current, self.statics)

    def magnet(self, x: float, current: float = 0.0) -> float:
        """Compute the force of the magnet, N."""
        return float(self.statics.magnet_force(self.statics.magnet, x, current))

    def spring(self, x: float) -> float:
        """Compute the force of the spring, N."""
        return float(self.statics.spring_force(self.statics.spring, x))

    def elastic(self, depth: float) -> float:
        """Compute the elastic force [N] of the backstop at a compression depth [m]."""
        if depth <= 0.0 or self.rigid:
            return 0.0
        return float(self.statics.backstop_elastic(self.statics.backstop, math.sqrt(depth)))

    def pack(self, x: float) -> float:
        """Compute the force of a slowly pressed pack, N."""
        return float(self.statics.pack_loading(self.statics.pack, x, 0.0)) if x > self.front else 0.0

    def slope(self, x: float, current: float = 0.0) -> float:
        """Compute the derivative of the total force, contacts included, with respect to x, N/m.

        The force of each part is differentiated separately, from points within the same contact or range.
        The force of the backstop is differentiated as a function of sqrt(depth), in which it is smooth.
        """
        room = min(x - self.statics.low, self.statics.high - x)
        step = 0.05 * room if math.isfinite(room) else 1e-3
        total = self._spring_slope(x)
        if self.hammer.magnet is not None:
            total += derivative(lambda place: self.magnet(place, current), x, step)
        depth = self.statics.position - x
        if depth > 0.0 and not self.rigid:
            w = math.sqrt(depth)
            total -= derivative(lambda root: self.elastic(root * root), w, 0.2 * w) / (2.0 * w)
        if x > self.front:
            total += derivative(self.pack, x, 0.2 * (x - self.front))
        return total

    def _spring_slope(self, x: float) -> float:
        """Compute the derivative of the spring force, N/m; at a kink of the law, from the right."""
        step = 1e-3
        level_at, constants = self.statics.spring_level, self.statics.spring
        for level in takewhile(math.isfinite, (level_at(constants, float(k)) for k in count())):
            if level == x:
                return (self.spring(x + 1e-7 * step) - self.spring(x)) / (1e-7 * step)
            step = min(step, 0.9 * abs(x - level))
        return derivative(self.spring, x, step)

    def anchors(self) -> list[float]:
        """Return the positions [m] near which the search grid for equilibria is refined."""
        places = [self.low, self.high, self.statics.position, self.front, self.hammer.origin, 0.0]
        return sorted({place for place in places if self.low <= place <= self.high})

    def reach(self, far: float = FARTHER[0]) -> tuple[float, float]:
        """Return the search interval for equilibria [m], at most `far` [m] from the origin."""
        return reach_of(far, self.statics)


def statics_of(hammer: HammerLike) -> Statics:
    """Return the law functions and constants on which the static force of a hammer depends."""
    if not hasattr(hammer, "backstop"):
        raise InputError.of("hammer", hammer, "a hammer, such as load('hendriks-1983')")
    magnet_force, magnet = law_of(hammer, hammer.magnet, "magnet_force")
    spring_force, spring = law_of(hammer, hammer.spring, "spring_force")
    spring_level, _constants = law_of(hammer, hammer.spring, "spring_level")
    pack_loading, pack = law_of(hammer, hammer.pack, "pack_loading")
    backstop_elastic, backstop = law_of(hammer, hammer.backstop, "backstop_elastic")
    low, high = domain_of(hammer.magnet, hammer.spring)
    return Statics(
        magnet_force,
        spring_force,
        pack_loading,
        backstop_elastic,
        spring_level,
        magnet,
        spring,
        pack,
        backstop,
        position=hammer.backstop.position if hammer.backstop is not None else -math.inf,
        front=hammer.pack.front if hammer.pack is not None else math.inf,
        rigid_front=hammer.pack is not None and hammer.pack.rigid,
        rigid=hammer.backstop is not None and hammer.backstop.rigid,
        memory=hammer.pack is not None and bool(_flag(hammer.pack, "MEMORY")),
        has_magnet=hammer.magnet is not None,
        low=low,
        high=high,
        platen=math.nan if hammer.platen is None else hammer.platen,
        thickness=getattr(hammer.pack, "thickness", math.nan),
    )


def derivative(function: Callable[[float], float], x: float, step: float) -> float:
    """Differentiate a function at `x` by central differences, from step size `step` extrapolated to 0.

    C. J. F. Ridders, Adv. Eng. Software 4 (1982) 75.
    """
    shrink, size = 1.4, 10
    best, error = math.nan, math.inf
    row: list[float] = []
    for _ in range(size):
        new = [(function(x + step) - function(x - step)) / ((x + step) - (x - step))]
        factor = shrink * shrink
        for k, old in enumerate(row):
            new.append((new[k] * factor - old) / (factor - 1.0))
            factor *= shrink * shrink
            doubt = max(abs(new[k + 1] - new[k]), abs(new[k + 1] - old))
            if doubt <= error:
                best, error = new[k + 1], doubt
        if row and abs(new[-1] - row[-1]) >= 2.0 * error:
            break
        row = new
        step /= shrink
    return best


def law_of(
    hammer: HammerLike, part: Part | None, name: str
) -> tuple[Callable[..., float], tuple[float, ...]]:
    """Return the compiled law function `name` of a part, and the packed constants of the part."""
    standard: Callable[..., float] = getattr(absent, name)
    if part is None:
        return standard, ()
    return getattr(import_module(part.module), name, standard), part.packed(hammer.origin)


def _flag(part: Part, name: str) -> Any:
    return getattr(import_module(part.module), name, getattr(absent, name))
