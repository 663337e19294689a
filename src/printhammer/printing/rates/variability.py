"""Unit-to-unit variability: how far the constants of a production are spread, independently.

What it states is a diagonal covariance of the constants. Hammers are drawn from it, normally distributed, and
its sigma points lie one standard deviation to either side of the design along each constant.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.printing.rates.perturbation import changed
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

CONSTANTS: Final = {
    "magnet": (("magnet.F0", "magnet.Am"), ("magnet.pole_area",), ("magnet.constant",)),
    "spring": (("spring.Bs", "spring.As"), ("spring.preload", "spring.stiffness"), ("spring.stiffness",)),
    "damping": (("backstop.damping",), ("backstop.relaxation_time",), ("backstop.restitution",)),
    "current": (("magnet.Bm",), ("coil.resistance",)),
    "travel": (("pack.front",),),
    "paper": (("pack.stiffness",),),
}
"""The constants that each standard deviation is that of: the first group of which a hammer has any."""

_TRIES: Final = 10  # How often as many hammers are drawn as are wanted
WIDEST: Final = 3.0
"""Standard deviations at which a draw is cut off."""


class Variability(Declared):
    """Standard deviations of the constants of a production, each constant independent of the others.

    Raises
    ------
    InputError
        A number is negative or not finite, or a relative one not below a third.
    """

    magnet: float = part(
        "of F0 and Am of equation (3), of the area of a pole or the force constant, relative", default=0.01
    )
    spring: float = part("of Bs and As of equation (4), of preload and stiffness, relative", default=0.01)
    damping: float = part("of damping, relaxation time or restitution of the backstop, relative", default=0.2)
    current: float = part(
        "of all currents, relative: Bm of equation (3), or the resistance of the coil", default=0.05
    )
    travel: float = part("of the distance of pack and platen, m", default=10e-6)
    paper: float = part("of the stiffness of the pack, relative", default=0.1)

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            most = math.inf if name == "travel" else 1.0 / WIDEST
            if not (math.isfinite(value) and 0.0 <= value < most):
                limit = "" if name == "travel" else " and below 1/3"
                raise InputError(
                    f"variability: {name} = {value!r} is expected to be a number not below 0{limit}"
                )

    @classmethod
    def of(cls, hammer: Hammer) -> Variability:
        """Return the usual one, without what a hammer has no constants of."""
        known = hammer.constants.keys()
        there = {
            name for name, groups in CONSTANTS.items() if known & {key for keys in groups for key in keys}
        }
        return cls(**{name: 0.0 for name in CONSTANTS if name not in there})

    @property
    def text(self) -> str:
        """In words."""
        words = [
            f"{name} {1e6 * value:g} µm" if name == "travel" else f"{name} {100.0 * value:g} %"
            for name, value in asdict(self).items()
            if value
        ]
        return ", ".join(words) or "none"

    def times(self, factor: float) -> Variability:
        """Return the same with all standard deviations a factor larger."""
        return Variability(**{name: factor * value for name, value in asdict(self).items()})

    def constants(self, hammer: Hammer) -> dict[str, float]:
        """Return the standard deviation of each constant of a hammer that varies, in SI.

        Raises
        ------
        InputError
            The hammer has none of the constants of a standard deviation that is not 0.
        """
        spread: dict[str, float] = {}
        known = hammer.constants
        for name, value in asdict(self).items():
            if not value:
                continue
            groups = [[key for key in group if key in known] for group in CONSTANTS[name]]
            there = next((group for group in groups if group), [])
            if not there:
                every = ", ".join(dict.fromkeys(key for group in CONSTANTS[name] for key in group))
                raise InputError(
                    f"{hammer.path}: variability of {name} = {value:g}, expected 0 for a hammer without any"
                    f" of {every}"
                )
            spread |= {key: value if name == "travel" else value * abs(known[key].si) for key in there}
        return spread

    def draw(self, hammer: Hammer, count: int, seed: int) -> list[Hammer]:
        """Return random hammers, normally distributed, no constant beyond three standard deviations.

        Those that are no hammers, or do not rest at the backstop, are drawn again.

        Raises
        ------
        InputError
            As for `constants`; or hardly any of those drawn is a hammer that rests.
        """
        return [drawn for _row, drawn in self.draw_rows(hammer, count, seed)]

    def draw_rows(self, hammer: Hammer, count: int, seed: int) -> list[tuple[FloatArray, Hammer]]:
        """Return what `draw` does, each hammer after the standard deviations that its constants are off by.

        Raises
        ------
        InputError
            As for `draw`.
        """
        rng = np.random.default_rng(seed)
        drawn: list[tuple[FloatArray, Hammer]] = []
        for _ in range(_TRIES):
            rows = np.clip(rng.standard_normal((count, len(self.constants(hammer)))), -WIDEST, WIDEST)
            made = zip(rows, self.hammers(hammer, rows), strict=True)
            drawn += [(row, other) for row, other in made if other is not None]
            if len(drawn) >= count:
                return drawn[:count]
        raise InputError(
            f"{hammer.path}: {len(drawn)} of {_TRIES * count} hammers drawn with {self.text} rest at the"
            " backstop, expected a smaller variability"
        )

    def sigma_points(self, hammer: Hammer) -> list[Hammer]:
        """Return the hammers of which one constant is one standard deviation off, up or down."""
        own = np.eye(len(self.constants(hammer)))
        points = self.hammers(hammer, np.concatenate([own, -own]))
        return [point for point in points if point is not None]

    def hammers(self, hammer: Hammer, rows: FloatArray) -> list[Hammer | None]:
        """Return the hammers whose constants are off by standard deviations (M, constants).

        The constants are in the order of `constants`. There is none where it would be no hammer, or not rest
        at the backstop.
        """
        spread = self.constants(hammer)
        changes: list[tuple[dict[str, Any], str]] = []
        for row in rows.tolist():
            off = {key: sigma * z for (key, sigma), z in zip(spread.items(), row, strict=True)}
            change = {key: hammer.constants[key].si + by for key, by in off.items()}
            if "pack.front" in off and hammer.platen is not None:
                change["platen"] = hammer.platen + off["pack.front"]
            changes.append((change, "drawn from the variability of a production"))
        hammers, status = changed(hammer, changes)
        return [other if fate == "ok" else None for other, fate in zip(hammers, status, strict=True)]
