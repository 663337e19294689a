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
    "magnet": ("magnet.F0", "magnet.Am"),
    "spring": ("spring.Bs", "spring.As"),
    "damping": ("backstop.damping",),
    "current": ("magnet.Bm",),
    "travel": ("pack.front",),
    "paper": ("pack.stiffness",),
}
"""The constants that each standard deviation is that of."""

_TRIES: Final = 10  # How often as many hammers are drawn as are wanted
_WIDEST: Final = 3.0  # Standard deviations at which a draw is cut off


class Variability(Declared):
    """Standard deviations of the constants of a production, each constant independent of the others.

    Raises
    ------
    InputError
        A number is negative or not finite, or a relative one not below a third.
    """

    magnet: float = part("of F0 and Am of equation (3), relative", default=0.01)
    spring: float = part("of Bs and As of equation (4), relative", default=0.01)
    damping: float = part("of the damping of the backstop, relative", default=0.2)
    current: float = part("of all currents, relative; Bm of equation (3)", default=0.05)
    travel: float = part("of the distance of pack and platen, m", default=10e-6)
    paper: float = part("of the stiffness of the pack, relative", default=0.1)

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            most = math.inf if name == "travel" else 1.0 / _WIDEST
            if not (math.isfinite(value) and 0.0 <= value < most):
                limit = "" if name == "travel" else " and below 1/3"
                raise InputError(
                    f"variability: {name} = {value!r} is expected to be a number not below 0{limit}"
                )

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
            there = [key for key in CONSTANTS[name] if key in known]
            if not there:
                raise InputError(
                    f"{hammer.path}: variability of {name} = {value:g}, expected 0 for a hammer without"
                    f" {' and '.join(CONSTANTS[name])}"
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
        rng = np.random.default_rng(seed)
        drawn: list[Hammer] = []
        for _ in range(_TRIES):
            rows = rng.standard_normal((count, len(self.constants(hammer))))
            drawn += self._hammers(hammer, np.clip(rows, -_WIDEST, _WIDEST))
            if len(drawn) >= count:
                return drawn[:count]
        raise InputError(
            f"{hammer.path}: {len(drawn)} of {_TRIES * count} hammers drawn with {self.text} rest at the"
            " backstop, expected a smaller variability"
        )

    def sigma_points(self, hammer: Hammer) -> list[Hammer]:
        """Return the hammers of which one constant is one standard deviation off, up or down."""
        own = np.eye(len(self.constants(hammer)))
        return self._hammers(hammer, np.concatenate([own, -own]))

    def _hammers(self, hammer: Hammer, rows: FloatArray) -> list[Hammer]:
        """Return the hammers whose constants are off by standard deviations (M, constants)."""
        spread = self.constants(hammer)
        changes: list[tuple[dict[str, Any], str]] = []
        for row in rows.tolist():
            off = {key: sigma * z for (key, sigma), z in zip(spread.items(), row, strict=True)}
            change = {key: hammer.constants[key].si + by for key, by in off.items()}
            if "pack.front" in off and hammer.platen is not None:
                change["platen"] = hammer.platen + off["pack.front"]
            changes.append((change, "drawn from the variability of a production"))
        hammers, status = changed(hammer, changes)
        return [other for other, fate in zip(hammers, status, strict=True) if fate == "ok"]
