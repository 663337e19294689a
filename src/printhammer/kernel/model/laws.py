"""What a compiled kernel is bound to: the laws of one hammer's parts, and choices fixed at compile time.

The functions and flags below are declarations. The modules listed in
:data:`printhammer.kernel.compile.specialise.TEMPLATES` import them for the type checker only; at run time
`specialise` of the same module puts the chosen laws in their place and compiles one kernel for each
combination of laws, so that a replaced part costs nothing at run time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

    Constants = NDArray[float64]


@dataclass(frozen=True)
class Laws:
    """The modules that hold the laws of one hammer, and the choices fixed at compile time.

    Attributes
    ----------
    magnet, spring, pack, backstop : str
        Dotted names of modules with the law functions declared in this file; the empty string for an absent
        part.
    absent : str
        Dotted name of the module from which every function that a part's module lacks is taken.
    force_drive : bool
        The drive is a force in newtons instead of a coil current in amperes.
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
    force_drive: bool = False
    pack_pulls: bool = True
    backstop_pulls: bool = True
    reload_along_unloading: bool = False


HAS_PACK: bool
HAS_BACKSTOP: bool
MEMORY: bool
RIGID: bool
FORCE_DRIVE: bool
PACK_PULLS: bool
BACKSTOP_PULLS: bool
RELOAD_ALONG_UNLOADING: bool
# In variational equations only: whether constants force them, and what of a column changes between switches.
FORCED: bool
CHANGING: int
# In lanes only: what the drive consists of.
EXPONENTIALS: int
CUBIC: bool
SINE: bool


def magnet_force(c: Constants, x: float, current: float) -> float:
    """Net force of permanent magnet and coil [N] at displacement `x` [m] and `current` [A]."""
    raise NotImplementedError


def magnet_energy(c: Constants, x: float) -> float:
    """Energy [J] of which minus the slope is the magnet force at zero current."""
    raise NotImplementedError


def spring_force(c: Constants, x: float) -> float:
    """Force of the spring [N]."""
    raise NotImplementedError


def spring_energy(c: Constants, x: float) -> float:
    """Energy [J] of which minus the slope is the spring force."""
    raise NotImplementedError


def pack_loading(c: Constants, x: float, v: float) -> float:
    """Force of the pack [N] on the loading branch, negative where it pushes back."""
    raise NotImplementedError


def pack_memory(c: Constants, peak: float) -> float:
    """Return what `pack_unloading` needs of the latest local maximum `peak` [m]."""
    raise NotImplementedError


def pack_unloading(c: Constants, x: float, v: float, memory: float) -> float:
    """Force of the pack [N] on the unloading branch."""
    raise NotImplementedError


def pack_switch(c: Constants, x: float, v: float) -> float:
    """Return a number that is positive while the pack pushes and negative where its law would pull."""
    raise NotImplementedError


def backstop_elastic(c: Constants, w: float) -> float:
    """Elastic force of the backstop [N] at compression ``w**2`` [m]."""
    raise NotImplementedError


def backstop_viscous(c: Constants, w: float, v: float) -> float:
    """Dissipative force of the backstop [N]."""
    raise NotImplementedError


def backstop_energy(c: Constants, w: float) -> float:
    """Energy [J] stored elastically in the backstop."""
    raise NotImplementedError


def backstop_switch(c: Constants, w: float, v: float) -> float:
    """Return a number that is positive while the backstop pushes and negative where its law would pull."""
    raise NotImplementedError


def backstop_rebound(c: Constants, v_in: float) -> float:
    """Velocity [m/s] after an impact on a rigid backstop with velocity `v_in` < 0."""
    raise NotImplementedError
