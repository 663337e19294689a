"""Laws to which a kernel is bound, and choices fixed before it is optimised.

The functions and flags below are declarations. The modules listed in
:data:`printhammer.kernel.compile.templates.TEMPLATES` import them for the type checker only. They stay
open when these modules are lowered, and are linked for each combination of laws before LLVM optimises the
whole, so that a replaced part costs nothing at run time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy import float64
    from numpy.typing import NDArray

    Constants = NDArray[float64]
    Law1 = Callable[[Constants, float], float]
    Law2 = Callable[[Constants, float, float], float]
    Law3 = Callable[[Constants, float, float, float], float]


@dataclass(frozen=True)
class Laws:
    """Modules with the laws of one hammer, and the choices fixed at compile time.

    Attributes
    ----------
    magnet, spring, pack, backstop, damping : str
        Dotted names of modules with the law functions declared in this file; the empty string for an absent
        part.
    absent : str
        Dotted name of the module from which every function that a part's module lacks is taken.
    force_drive : bool
        The drive is a force in newtons instead of a coil current in amperes.
    circuit : bool
        The drive is a voltage that acts on the circuit of the coil.
    pack_pulls, backstop_pulls : bool
        Whether the contact force may become tensile, as the printed law allows.
    reload_along_unloading : bool
        Reloading inside one pack contact follows the unloading branch instead of jumping to the loading
        branch.
    """

    magnet: str
    spring: str
    pack: str
    backstop: str
    absent: str
    damping: str = ""
    force_drive: bool = False
    circuit: bool = False
    pack_pulls: bool = True
    backstop_pulls: bool = True
    reload_along_unloading: bool = False


LAW_FUNCTIONS = {
    "magnet": (
        "magnet_force",
        "magnet_energy",
        "magnet_linkage",
        "magnet_emf",
        "magnet_inductance",
        "magnet_current",
    ),
    "spring": ("spring_force", "spring_energy"),
    "pack": ("pack_loading", "pack_memory", "pack_unloading", "pack_switch"),
    "backstop": (
        "backstop_elastic",
        "backstop_viscous",
        "backstop_energy",
        "backstop_switch",
        "backstop_rebound",
    ),
    "damping": ("damping_force",),
}
"""Names of the law functions of each part."""


def floats_of(law: str) -> int:
    """Return the number of arguments of a law function after its constants."""
    return int(__annotations__[law].removeprefix("Law"))


HAS_PACK: bool
HAS_BACKSTOP: bool
HAS_DAMPING: bool
HAS_CIRCUIT: bool
MEMORY: bool
RIGID: bool
FORCE_DRIVE: bool
PACK_PULLS: bool
BACKSTOP_PULLS: bool
RELOAD_ALONG_UNLOADING: bool
# For variational equations only: whether constants force them, the number of rows that change between
# switches, and the first row of a circuit.
FORCED: bool
CHANGING: int
ELECTRIC_ROW: int
# For lanes only: the pieces of which the drive consists.
EXPONENTIALS: int
CUBIC: bool
SINE: bool

# The packed constants of the part are the first argument of each function.
magnet_force: Law2
"""Net force of permanent magnet and coil [N] at a displacement [m] and a current [A]."""
magnet_energy: Law1
"""Potential energy [J] at a displacement [m]: minus its slope is the magnet force at zero current."""
magnet_linkage: Law2
"""Flux linkage [Wb] at a displacement [m] and a current [A], of the same coenergy as the force."""
magnet_emf: Law2
"""Slope of the flux linkage with displacement [Wb/m], equal to that of the force with current [N/A]."""
magnet_inductance: Law2
"""Slope of the flux linkage with current [H]."""
magnet_current: Law3
"""Current [A] at a displacement [m] at which magnet and an inductance [H] produce a flux linkage [Wb]."""
spring_force: Law1
"""Force of the spring [N] at a displacement [m]."""
spring_energy: Law1
"""Potential energy [J] at a displacement [m]: minus its slope is the spring force."""
damping_force: Law1
"""Force of the damping of the armature [N] at a velocity [m/s]; differentiable."""
pack_loading: Law2
"""Force of the pack [N] on the loading branch, negative where it pushes; of displacement and velocity."""
pack_memory: Law1
"""Memory of the latest local maximum [m], passed to `pack_unloading`."""
pack_unloading: Law3
"""Force of the pack [N] on the unloading branch; of displacement, velocity and memory."""
pack_switch: Law2
"""Positive while the pack pushes, negative where its law would pull; of displacement and velocity."""
backstop_elastic: Law1
"""Elastic force of the backstop [N] at w, compression ``w**2`` [m]."""
backstop_viscous: Law2
"""Dissipative force of the backstop [N]; of w and velocity."""
backstop_energy: Law1
"""Energy [J] stored elastically in the backstop at w."""
backstop_switch: Law2
"""Positive while the backstop pushes, negative where its law would pull; of w and velocity."""
backstop_rebound: Law1
"""Velocity [m/s] after an impact on a rigid backstop with a velocity below zero."""
