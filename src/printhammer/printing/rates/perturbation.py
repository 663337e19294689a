"""Hammers that differ a little from the one that a drive was made for: supply, travel, forms, drift."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from printhammer.errors import InputError
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.pack.power import PowerPack
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from printhammer.hammer.hammer import Hammer


class Perturbation(Declared):
    """By how much a hammer differs; everything 0 by default."""

    current: float = part(
        "relative change of every current, as by the supply rail: 0.03 for 3 % more", default=0.0
    )
    travel: float = part(
        "by how much pack and platen lie farther from the armature, m: the wire travel", default=0.0
    )
    forms: float = part(
        "relative change of the thickness of the pack, the number of forms",
        more="the platen stays, so that the front of the pack comes nearer",
        default=0.0,
    )
    magnet: float = part(
        "relative change of the flux of the permanent magnet, Am of equation (3)", default=0.0
    )
    damping: float = part(
        "relative change of the damping of the backstop",
        more="that is l of equation (7), or the relaxation time of an elastomer",
        default=0.0,
    )

    @property
    def name(self) -> str:
        """In words, such as "current +3 %, travel -10 µm"; "nominal" where nothing differs."""
        words = [
            f"{key} {1e6 * value:+.3g} µm" if key == "travel" else f"{key} {100.0 * value:+.3g} %"
            for key, value in asdict(self).items()
            if value
        ]
        return ", ".join(words) or "nominal"


def perturbed(hammer: Hammer, by: Perturbation) -> Hammer:
    """Return a hammer that differs by a perturbation.

    The current enters equation (3) as Bm I. Every current a factor larger is therefore the same as Bm that
    factor larger, and a strategy that knows nothing of it stays as it is.

    Raises
    ------
    InputError
        A number is not finite, a relative change is not above -1, the hammer does not have the constant that
        changes, or would not be one any more.
    """
    changes: dict[str, Any] = {}
    for key, value in asdict(by).items():
        if not math.isfinite(value) or (key != "travel" and value <= -1.0):
            raise InputError(f"perturbation: {key} = {value!r} is expected to be finite and above -1")
    magnet, pack, backstop = hammer.magnet, hammer.pack, hammer.backstop
    if by.current or by.magnet:
        if not isinstance(magnet, InverseRootMagnet):
            raise InputError(
                f"{hammer.path}: perturbation of current or magnet, expected a magnet of law 'inverse-root'"
            )
        changes["magnet.Bm"] = magnet.Bm * (1.0 + by.current)
        changes["magnet.Am"] = magnet.Am * (1.0 + by.magnet)
    if by.travel or by.forms:
        if pack is None:
            raise InputError(f"{hammer.path}: perturbation of travel or forms, expected a hammer with a pack")
        front = pack.front + by.travel
        if by.forms:
            if not isinstance(pack, PowerPack):
                raise InputError(f"{hammer.path}: perturbation of forms, expected a pack of the law 'power'")
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
                f"{hammer.path}: perturbation of damping, expected a backstop with damping or relaxation time"
            )
    return hammer.replace(changes, source=f"perturbed: {by.name}") if changes else hammer


def changed(
    hammer: Hammer, changes: Iterable[tuple[Mapping[str, Any], str]]
) -> tuple[list[Hammer], list[str]]:
    """Return hammers with other constants, and what becomes of each: "ok", "no hammer" or "does not rest".

    For each there is what `Hammer.replace` takes, and its source. Where there are no changes, or there is no
    hammer with these constants, it is the hammer itself.
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
