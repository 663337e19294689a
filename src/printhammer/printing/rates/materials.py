"""Backstops and packs of other materials, for the damping study."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.parts.pack.power import PowerPack
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import Nominal

KINDS: Final = ("as it is", "hard", "elastomer", "pack")
"""What may be changed: nothing, the constants of the hard backstop, the backstop for an elastomer, the
pack."""

STIFFNESSES: Final = (1.0 / 9.0, 1.0 / 3.0, 3.0)
DAMPINGS: Final = (0.25, 0.5, 2.0, 4.0, 16.0)
"""Factors on stiffness and damping of a hard backstop."""

ELASTOMERS: Final = (8e7, 8e8)
"""Stiffness of the elastomers, N/m^1.5: 10 N at 25 um, about what the paper says of them, and ten times
that."""

RELAXATIONS: Final = (0.0, 10e-6, 30e-6, 100e-6, 300e-6)  # Relaxation times of the elastomers, s

PACKS: Final = (0.5, 2.0)  # Factors on the stiffness of the pack

PACK_DAMPINGS: Final = (0.1, 0.4)  # Damping ratios of packs of a spring and a dashpot


class Material(Declared):
    """What is other than in the hammer that is studied."""

    kind: str = part("one of `KINDS`")
    label: str = part("what it is, in a few words")
    changes: Mapping[str, Any] = part("constants, options and parts as `Hammer.replace` takes them")

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"kind = {self.kind!r} of a material, expected one of {', '.join(KINDS)}")


def materials(hammer: Hammer, single: Nominal) -> list[Material]:
    """List the materials that are studied for a hammer, and its single-pulse dot, unless others are given.

    Hard backstops have other constants of equations (6) and (7); elastomers are after Kuwabara and Kono;
    packs are softer and harder ones of equation (5), and springs with a dashpot, the spring such that the
    loading work of the single-pulse dot presses it with the force of that dot.
    """
    listed = [Material("as it is", "as it is", {})]
    backstop, pack = hammer.backstop, hammer.pack
    hard = backstop if isinstance(backstop, HertzBackstop) else None
    if hard is not None and hard.damping is not None and hard.stiffness is not None:
        k, damping = hard.stiffness, hard.damping
        listed += [
            # The rebound depends on l v / k alone: with both a factor larger, only the duration changes.
            Material(
                "hard", f"k and l x {f:.2g}", {"backstop.stiffness": f * k, "backstop.damping": f * damping}
            )
            for f in STIFFNESSES
        ]
        listed += [Material("hard", f"l x {f:g}", {"backstop.damping": f * damping}) for f in DAMPINGS]
    if hammer.position is not None:
        listed += [
            Material(
                "elastomer",
                f"k {1e-6 * stiffness:g} MN/m^1.5, A {1e6 * time:g} us",
                {
                    "backstop": ElastomerBackstop(
                        position=hammer.position, stiffness=stiffness, relaxation_time=time
                    )
                },
            )
            for stiffness in ELASTOMERS
            for time in RELAXATIONS
        ]
    if isinstance(pack, PowerPack):
        listed += [
            Material("pack", f"stiffness x {f:g}", {"pack.stiffness": f * pack.stiffness}) for f in PACKS
        ]
        stiff = 0.5 * single.force**2 / single.loading_work
        critical = 2.0 * math.sqrt(stiff * hammer.mass)
        listed += [
            Material(
                "pack",
                f"dashpot, {ratio:g} of critical",
                {"pack": DashpotPack(stiffness=stiff, damping=ratio * critical, front=pack.front)},
            )
            for ratio in PACK_DAMPINGS
        ]
    return listed
