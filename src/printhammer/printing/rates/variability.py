"""Unit-to-unit variability of a production, and perturbations of a hammer.

`Variability` is a diagonal covariance of the constants: hammers are drawn from a normal distribution, and the
sigma points lie one standard deviation on either side of the design along each constant. A `Perturbation` is
a single deviation from the hammer for which a drive was designed: in current, travel, number of paper forms,
magnet or damping.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.pack.power import PowerPack
from printhammer.results import Declared, part
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray


class Perturbation(Declared):
    """Deviation of a hammer from its design in current, travel, paper forms, magnet and damping."""

    current: float = part(
        "relative change of every current, e.g. by the supply voltage: 0.03 for 3 % more", default=0.0
    )
    travel: float = part(
        "distance by which pack and platen move away from the armature, m: the wire travel", default=0.0
    )
    forms: float = part(
        "relative change of the pack thickness, i.e. of the number of forms",
        more="the platen does not move, so the front of the pack comes nearer",
        default=0.0,
    )
    magnet: float = part("relative change of the permanent-magnet flux, Am of equation (3)", default=0.0)
    damping: float = part(
        "relative change of the backstop damping",
        more="l of equation (7), or the relaxation time of an elastomer",
        default=0.0,
    )

    @property
    def name(self) -> str:
        """Name of the perturbation, such as "current +3 %, travel -10 µm"; "nominal" without a change."""
        words = [
            f"{key} {1e6 * value:+.3g} µm" if key == "travel" else f"{key} {100.0 * value:+.3g} %"
            for key, value in asdict(self).items()
            if value
        ]
        return ", ".join(words) or "nominal"


@checked
def perturbed(hammer: Hammer, by: Perturbation) -> Hammer:
    """Return a copy of a hammer with the changes of a `Perturbation`.

    The current enters equation (3) as Bm I. Scaling every current is therefore the same as scaling Bm, and a
    strategy that is unaware of the change needs no modification.
    """
    changes: dict[str, Any] = {}
    for key, value in asdict(by).items():
        if not math.isfinite(value) or (key != "travel" and value <= -1.0):
            raise InputError.of(key, value, "finite and above -1", file="perturbation")
    magnet, pack, backstop = hammer.magnet, hammer.pack, hammer.backstop
    if by.current or by.magnet:
        if not isinstance(magnet, InverseRootMagnet):
            raise InputError(
                f"{hammer.path}: perturbation of current or magnet",
                file=hammer.path,
                key="magnet",
                expected="a magnet of law 'inverse-root'",
            )
        changes["magnet.Bm"] = magnet.Bm * (1.0 + by.current)
        changes["magnet.Am"] = magnet.Am * (1.0 + by.magnet)
    if by.travel or by.forms:
        if pack is None:
            raise InputError(
                f"{hammer.path}: perturbation of travel or forms",
                file=hammer.path,
                key="travel",
                expected="a hammer with a pack",
            )
        front = pack.front + by.travel
        if by.forms:
            if not isinstance(pack, PowerPack):
                raise InputError(
                    f"{hammer.path}: perturbation of forms",
                    file=hammer.path,
                    key="forms",
                    expected="a pack of the law 'power'",
                )
            front -= by.forms * pack.thickness
            changes["pack.thickness"] = pack.thickness * (1.0 + by.forms)
        changes["pack.front"] = front
        if by.travel and hammer.platen is not None:
            changes["platen"] = hammer.platen + by.travel
    if by.damping:
        if isinstance(backstop, HertzBackstop) and backstop.damping is not None:
            changes["backstop.damping"] = backstop.damping * (1.0 + by.damping)
        elif isinstance(backstop, ElastomerBackstop):
            changes["backstop.relaxation_time"] = backstop.relaxation_time * (1.0 + by.damping)
        else:
            raise InputError(
                f"{hammer.path}: perturbation of damping",
                file=hammer.path,
                key="damping",
                expected="a backstop with damping or relaxation time",
            )
    return hammer.replace(changes, source=f"perturbed: {by.name}") if changes else hammer


def changed(
    hammer: Hammer, changes: Iterable[tuple[Mapping[str, Any], str]]
) -> tuple[list[Hammer], list[str]]:
    """Return modified hammers and the status of each: "ok", "no hammer" or "does not rest".

    Each of `changes` is a pair: new values of constants and their source, both as for `Hammer.replace`. For
    an empty mapping, or if the constants are invalid ("no hammer"), the entry is the hammer itself.
    """
    made, status = [], []
    for change, source in changes:
        other, fate = hammer, "no hammer"
        with suppress(InputError):
            other = hammer.replace(change, source=source) if change else hammer
            fate = "does not rest"
            _ = other.rest
            fate = "ok"
        made.append(other)
        status.append(fate)
    return made, status


CONSTANTS: Final = {
    "magnet": (("magnet.F0", "magnet.Am"), ("magnet.pole_area",), ("magnet.constant",)),
    "spring": (("spring.Bs", "spring.As"), ("spring.preload", "spring.stiffness"), ("spring.stiffness",)),
    "damping": (("backstop.damping",), ("backstop.relaxation_time",), ("backstop.restitution",)),
    "current": (("magnet.Bm",), ("coil.resistance",)),
    "travel": (("pack.front",),),
    "paper": (("pack.stiffness",),),
}
"""Constants to which each standard deviation applies: the first listed group that the hammer has."""

_TRIES: Final = 10  # Maximum number of batches drawn, each of the requested size; arbitrary
WIDEST: Final = 3.0
"""Largest deviation of a drawn constant, in standard deviations; larger draws are clipped; arbitrary."""


class Variability(Declared):
    """Standard deviations of the constants of a production; the constants vary independently."""

    magnet: float = part(
        "relative standard deviation of F0 and Am of equation (3), of "
        "the pole area, or of the force constant",
        default=0.01,
    )
    spring: float = part(
        "relative standard deviation of Bs and As of equation (4), or of preload and stiffness", default=0.01
    )
    damping: float = part(
        "relative standard deviation of damping, relaxation time or restitution of the backstop", default=0.2
    )
    current: float = part(
        "relative standard deviation of all currents: of Bm of equation (3), or of the coil resistance",
        default=0.05,
    )
    travel: float = part("standard deviation of the distance of pack and platen, m", default=10e-6)
    paper: float = part("relative standard deviation of the stiffness of the pack", default=0.1)

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            most = math.inf if name == "travel" else 1.0 / WIDEST
            if not (math.isfinite(value) and 0.0 <= value < most):
                limit = "" if name == "travel" else " and below 1/3"
                raise InputError.of(name, value, f"a number not below 0{limit}", file="variability")

    @classmethod
    def of(cls, hammer: Hammer) -> Variability:
        """Return the default variability for a hammer: 0 for constants that the hammer lacks."""
        known = hammer.constants.keys()
        there = {
            name for name, groups in CONSTANTS.items() if known & {key for keys in groups for key in keys}
        }
        return cls(**{name: 0.0 for name in CONSTANTS if name not in there})

    @property
    def text(self) -> str:
        """Standard deviations in words, for a report."""
        words = [
            f"{name} {1e6 * value:g} µm" if name == "travel" else f"{name} {100.0 * value:g} %"
            for name, value in asdict(self).items()
            if value
        ]
        return ", ".join(words) or "none"

    def times(self, factor: float) -> Variability:
        """Return a copy with all standard deviations scaled by `factor`."""
        return Variability(**{name: factor * value for name, value in asdict(self).items()})

    def constants(self, hammer: Hammer) -> dict[str, float]:
        """Return the standard deviation of each varying constant of a hammer, in SI units.

        Raises
        ------
        InputError
            A standard deviation is nonzero, but the hammer has none of the constants concerned.
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
                    f"{hammer.path}: variability of {name} = {value:g}",
                    file=hammer.path,
                    key=name,
                    expected=f"0 for a hammer without any of {every}",
                )
            spread |= {key: value if name == "travel" else value * abs(known[key].si) for key in there}
        return spread

    def draw(self, hammer: Hammer, count: int, seed: int) -> list[Hammer]:
        """Draw `count` hammers from the normal distribution, clipped at three standard deviations.

        Draws that are invalid, or do not rest at the backstop, are replaced by new draws.
        """
        return [drawn for _row, drawn in self.draw_rows(hammer, count, seed)]

    def draw_rows(self, hammer: Hammer, count: int, seed: int) -> list[tuple[FloatArray, Hammer]]:
        """Draw hammers like `draw`; return (deviations, hammer) pairs.

        The deviations of the constants are in standard deviations, in the order of `constants`.
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
            (
                f"{hammer.path}: {len(drawn)} of {_TRIES * count} hammers drawn with {self.text} rest"
                " at the backstop"
            ),
            file=hammer.path,
            key="variability",
            expected="a smaller variability",
        )

    def sigma_points(self, hammer: Hammer) -> list[Hammer]:
        """Return the sigma points: hammers with one constant shifted by plus or minus its standard deviation.

        Sigma points that are invalid or do not rest at the backstop are omitted.
        """
        own = np.eye(len(self.constants(hammer)))
        points = self.hammers(hammer, np.concatenate([own, -own]))
        return [point for point in points if point is not None]

    def hammers(self, hammer: Hammer, rows: FloatArray) -> list[Hammer | None]:
        """Build hammers with constants shifted by `rows`, shape (M, constants), in standard deviations.

        The constants are in the order of `constants`. An entry is None if the hammer is invalid or does not
        rest at the backstop.
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
