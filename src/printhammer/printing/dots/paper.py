"""Paper that varies along the line: stiffness and front of the pack are random functions of position.

Both are normal and independent of each other, with the correlation exp(-d / length) between two positions d
apart: a first-order autoregressive process. Draws are clipped at three standard deviations.

A paper file is TOML with the keys ``stiffness``, ``front``, ``length`` and ``seed``, each of them optional::

    stiffness = "5 %"
    front = "3 um"
    length = "2 mm"
    seed = 1
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from printhammer.drive.input import read_number
from printhammer.errors import InputError, located
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, part, scalar
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import shown
from printhammer.support.files import read_text

_WIDEST: Final = 3.0  # Standard deviations at which a draw is clipped; arbitrary
_UNITS: Final = {"stiffness": "1", "front": "m", "length": "m"}


class Paper(Declared):
    """Random variation of pack stiffness and pack front along a print line, about the hammer's values."""

    stiffness: float = part("standard deviation of the stiffness of the pack, relative", default=0.05)
    front: float = scalar("m", "standard deviation of the front of the pack", default=3e-6)
    length: float = scalar("m", "distance over which the correlation falls to 1/e", default=2e-3)
    seed: int = part("seed of the random number generator", default=0)

    def __post_init__(self) -> None:
        for name in _UNITS:
            value = getattr(self, name)
            most = 1.0 / _WIDEST if name == "stiffness" else math.inf
            if not (math.isfinite(value) and 0.0 <= value < most):
                limit = " and below 1/3" if name == "stiffness" else ""
                raise InputError.of(name, value, f"a number not below 0{limit}", file="paper")
        if type(self.seed) is not int or self.seed < 0:
            raise InputError.of("seed", self.seed, "a whole number not below 0", file="paper")

    @classmethod
    def load(cls, path: str | Path) -> Paper:
        """Read a paper file.

        Raises
        ------
        InputError
            The file cannot be read, or it has an unknown key or an invalid value.
        """
        text = read_text(Path(path), "the paper file")
        known = [field.name for field in fields(cls)]
        with located(str(path)):
            try:
                keys = tomllib.loads(text)
            except (ValueError, RecursionError) as error:
                raise InputError(f"expected TOML ({' '.join(str(error).split())})") from None
            for key in keys:
                if key not in known:
                    odd = key if key.isprintable() else shown(key)
                    raise InputError(f"{odd} is not known", key=odd, expected=f"{', '.join(known)}")
            values: dict[str, Any] = {
                key: read_number(value, _UNITS[key], key) if key in _UNITS else value
                for key, value in keys.items()
            }
            return cls(**values)

    @property
    def text(self) -> str:
        """Standard deviations and correlation length in words, for a report."""
        return (
            f"stiffness {100.0 * self.stiffness:g} %, front {1e6 * self.front:g} µm, correlated over"
            f" {1e3 * self.length:g} mm"
        )

    def deviations(self, slots: int, pitch: float) -> FloatArray:
        """Draw deviations of stiffness and front, in standard deviations, shape (2, slots); `pitch` in m."""
        rng = np.random.default_rng(self.seed)
        white = rng.standard_normal((2, slots))
        kept = math.exp(-pitch / self.length) if self.length else 0.0
        off = white.copy()
        for slot in range(1, slots):
            off[:, slot] = kept * off[:, slot - 1] + math.sqrt(1.0 - kept**2) * white[:, slot]
        return np.asarray(np.clip(off, -_WIDEST, _WIDEST))

    def hammers(self, hammer: Hammer, slots: int, pitch: float) -> tuple[Hammer, ...]:
        """Return the hammer with the pack at each slot, for a slot pitch in m; the platen does not move."""
        spread = {"pack.stiffness": self.stiffness, "pack.front": self.front}
        for key, value in spread.items():
            if value and key not in hammer.constants:
                raise InputError(
                    f"{hammer.path}: paper that varies",
                    file=hammer.path,
                    key=key,
                    expected=f"a hammer with {key}",
                )
        if not any(spread.values()):
            return (hammer,) * slots
        own = {key: hammer.constants[key].si for key, value in spread.items() if value}
        places = []
        for stiffness, front in self.deviations(slots, pitch).T.tolist():
            off = {
                "pack.stiffness": own.get("pack.stiffness", 0.0) * (1.0 + self.stiffness * stiffness),
                "pack.front": own.get("pack.front", 0.0) + self.front * front,
            }
            change: dict[str, Any] = {key: off[key] for key in own}
            places.append(hammer.replace(change, source="paper that varies along the line"))
        return tuple(places)
