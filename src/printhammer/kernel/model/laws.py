"""Declarations of the force laws and of the compile-time choices for which a kernel is specialised.

The functions and flags below are declarations without values. The modules listed in
:data:`printhammer.kernel.compile.templates.TEMPLATES` import the declarations for the type checker
only. The declared names stay undefined when these modules are lowered. They are linked for each combination
of laws before LLVM optimises the result, so that a replaced part costs nothing at run time.
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
    """Modules that define the force laws of a hammer, and options fixed at compile time.

    Attributes
    ----------
    magnet, spring, pack, backstop, damping : str
        Dotted names of the modules that define the law functions of each part; the empty string for an
        absent part.
    absent : str
        Dotted name of the module that supplies every law function that the module of a part does not define.
    force_drive : bool
        Whether the drive is a force in newtons instead of a coil current in amperes.
    circuit : bool
        Whether the drive is a voltage applied to the coil circuit.
    pack_pulls, backstop_pulls : bool
        Whether the contact force may become tensile, as the law printed in the paper allows.
    reload_along_unloading : bool
        Whether reloading during a pack contact follows the unloading branch instead of jumping to the
        loading branch.
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
    "spring": ("spring_force", "spring_energy", "spring_level", "spring_viscous", "spring_switch"),
    "pack": ("pack_loading", "pack_memory", "pack_unloading", "pack_switch", "pack_rebound"),
    "backstop": (
        "backstop_elastic",
        "backstop_viscous",
        "backstop_energy",
        "backstop_switch",
        "backstop_rebound",
    ),
    "damping": ("damping_force", "friction_force"),
}
"""Names of the law functions of each part, by role; a part need not define all of them."""

PACKING = {role: (f"{role}_packed",) for role in LAW_FUNCTIONS} | {
    "magnet": ("magnet_packed", "magnet_domain"),
    "spring": ("spring_packed", "spring_domain"),
}
"""Names of the functions that pack the constants of a part, by role; for magnet and spring, a second function
writes or narrows the displacement range of the laws."""


def floats_of(law: str) -> int:
    """Return the number of float arguments of a law function, not counting the array of constants."""
    return int(__annotations__[law].removeprefix("Law"))


HAS_MAGNET: bool
HAS_PACK: bool
HAS_BACKSTOP: bool
HAS_DAMPING: bool
HAS_CIRCUIT: bool
MEMORY: bool
RIGID_FRONT: bool
RIGID: bool
LEVELS: bool
VISCOUS: bool
FRICTION: bool
FORCE_DRIVE: bool
PACK_PULLS: bool
BACKSTOP_PULLS: bool
RELOAD_ALONG_UNLOADING: bool
# Used by the variational equations only: whether derivatives with respect to constants are computed, the
# number of rows that change between switching events, and the first row of the electric state.
FORCED: bool
CHANGING: int
ELECTRIC_ROW: int
# Used by lanes only: number of exponentials in the drive, and whether the drive has cubic or sine pieces.
EXPONENTIALS: int
CUBIC: bool
SINE: bool

# The first argument of each law function is the array of the constants of the part.
magnet_force: Law2
"""Net force of permanent magnet and coil [N]; arguments: displacement [m], current [A]."""
magnet_energy: Law1
"""Potential energy of the magnet at zero current [J], whose negative slope is the force; argument:
displacement [m]."""
magnet_linkage: Law2
"""Flux linkage of the coil [Wb], from the same coenergy as the force; arguments: displacement [m], current
[A]."""
magnet_emf: Law2
"""Derivative of the flux linkage with respect to displacement [Wb/m]; equals the derivative of the magnet
force with respect to current [N/A]."""
magnet_inductance: Law2
"""Differential inductance [H]: derivative of the flux linkage with respect to current; arguments:
displacement [m], current [A]."""
magnet_current: Law3
"""Current [A] for a given total flux linkage of magnet and constant inductance; arguments: displacement [m],
flux linkage [Wb], inductance [H]."""
spring_force: Law1
"""Force of the spring [N]; argument: displacement [m]."""
spring_energy: Law1
"""Potential energy of the spring [J], whose negative slope is the force; argument: displacement [m]."""
spring_level: Law1
"""Position [m] at which the slope of the spring force changes; argument: index of the position, from 0;
infinity if there are fewer positions."""
spring_viscous: Law2
"""Dissipative force of the spring [N], zero at zero velocity; arguments: displacement [m], velocity [m/s]."""
spring_switch: Law1
"""Sign function of the dissipative force, which changes sign where the slope of this force jumps; argument:
velocity [m/s]."""
damping_force: Law1
"""Damping force on the armature [N], a differentiable function; argument: velocity [m/s]."""
friction_force: Law1
"""Dry friction [N], at least 0; argument: 0 for the kinetic, 1 for the static friction."""
pack_loading: Law2
"""Force of the pack on the loading branch [N], negative where the pack pushes back; arguments: displacement
[m], velocity [m/s]."""
pack_memory: Law1
"""Memory value passed to `pack_unloading`; argument: displacement at the latest local maximum [m]."""
pack_unloading: Law3
"""Force of the pack on the unloading branch [N]; arguments: displacement [m], velocity [m/s], memory
value."""
pack_switch: Law2
"""Sign function of the pack force: positive while the pack pushes, negative where the law would pull;
arguments: displacement [m], velocity [m/s]."""
pack_rebound: Law1
"""Velocity after an impact on a rigid front [m/s]; argument: velocity before the impact [m/s], positive."""
backstop_elastic: Law1
"""Elastic force of the backstop [N]; argument: w, the square root of the compression [m^0.5]."""
backstop_viscous: Law2
"""Dissipative force of the backstop [N]; arguments: w, the square root of the compression [m^0.5], velocity
[m/s]."""
backstop_energy: Law1
"""Elastic energy of the backstop [J]; argument: w, the square root of the compression [m^0.5]."""
backstop_switch: Law2
"""Sign function of the backstop force: positive while the backstop pushes, negative where the law would pull;
arguments: w, the square root of the compression [m^0.5], velocity [m/s]."""
backstop_rebound: Law1
"""Velocity after an impact on a rigid backstop [m/s]; argument: velocity before the impact [m/s],
negative."""
