"""Parts of a hammer, one law per file.

Every module of this package and its folders whose name does not start with an underscore is imported and
registers its part; a part defined elsewhere is added with `register`. A module contains, for its role, plain
scalar functions (floats in, float out, `c` the float64 array of `Part.packed`), written so that numba
compiles them; they call nothing but `math`:

========  ===================================================================================================
role      functions
========  ===================================================================================================
magnet    ``magnet_force(c, x, current)``, ``magnet_energy(c, x)``; for a coil driven by a voltage also
          ``magnet_linkage(c, x, current)``, ``magnet_emf(c, x, current)``,
          ``magnet_inductance(c, x, current)`` and ``magnet_current(c, x, linkage, inductance)``
coil      none; the circuit is in the kernel, `printhammer.kernel.model.circuit`
spring    ``spring_force(c, x)``, ``spring_energy(c, x)``; a law whose slope jumps also ``LEVELS`` = True and
          ``spring_level(c, k)``, the position of the k-th jump; one that dissipates energy ``VISCOUS`` =
          True and ``spring_viscous(c, x, v)``, its force at the velocity v, 0 at rest;
          if its slope jumps also ``spring_switch(c, v)``; for a web page, a law that does not hold
          everywhere also ``spring_domain(q, ends)``, which narrows the range of displacements
pack      ``MEMORY``, ``pack_loading(c, x, v)``, ``pack_memory(c, peak)``, ``pack_unloading(c, x, v, q)``,
          ``pack_switch(c, x, v)``; a rigid stop instead ``RIGID_FRONT`` = True and
          ``pack_rebound(c, v_in)``
backstop  ``RIGID``, ``backstop_rebound(c, v_in)``, or with w = sqrt(b - x) ``backstop_elastic(c, w)``,
          ``backstop_viscous(c, w, v)``, ``backstop_energy(c, w)``, ``backstop_switch(c, w, v)``
damping   ``damping_force(c, v)``; with dry friction also ``FRICTION`` = True and ``friction_force(c, k)``,
          the kinetic (k = 0) and the static friction (k = 1)
========  ===================================================================================================

============  ===============================================================================================
argument      meaning
============  ===============================================================================================
``c``         packed constants, a float64 array, in the order that the module states
``x``, ``v``  displacement [m] and velocity [m/s]
``current``   current of the coil, A
``linkage``   flux linkage of the coil, Wb, including that of a constant series ``inductance``, H
``peak``      displacement of the latest local maximum inside this contact of the pack, m
``q``         result of ``pack_memory`` for this peak
``w``         sqrt(b - x), root of the compression of the backstop, m^0.5
``v_in``      velocity before an impact, m/s, positive at the front, negative at the backstop
============  ===============================================================================================

Forces are in N, positive toward the paper. The force is minus the slope of the energy [J]; for the magnet, at
zero current. Force and flux linkage of a magnet are slopes of one coenergy: ``magnet_emf`` is the slope of
the linkage along x and that of the force along the current, ``magnet_inductance`` the slope of the linkage
along the current, and ``magnet_current`` its inverse. Functions that a module omits are taken from
`printhammer.parts.absent`, the absent part. A ``..._switch`` function changes sign where a law has a kink
inside a contact (such as the force cut-off of a surface that may not pull), so that an integrator can locate
the kink.
"""

from importlib import import_module
from pkgutil import walk_packages

from printhammer.parts.base import (
    PARTS,
    ROLES,
    BackstopPart,
    CoilPart,
    DampingPart,
    MagnetPart,
    PackPart,
    Part,
    SpringPart,
    laws,
    register,
)

for _module in walk_packages(__path__, f"{__name__}."):
    if not _module.name.rpartition(".")[2].startswith("_"):
        import_module(_module.name)

__all__ = [
    "PARTS",
    "ROLES",
    "BackstopPart",
    "CoilPart",
    "DampingPart",
    "MagnetPart",
    "PackPart",
    "Part",
    "SpringPart",
    "laws",
    "register",
]
