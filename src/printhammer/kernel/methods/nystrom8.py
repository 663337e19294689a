"""Step of the Runge-Kutta-Nystrom pair 8(6), for accelerations that do not depend on the velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.kernel.compile.compiling import inlined
from printhammer.kernel.methods import nystrom8_tableau as T

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import acceleration
    from printhammer.kernel.model.layout import ForceLaw


@inlined
def nystrom_step(
    t0: float, x0: float, v0: float, a1: float, h: float, law: ForceLaw
) -> tuple[float, float, float, float, float]:
    """Compute a Runge-Kutta-Nystrom step of `h` [s] from a state with acceleration `a1` [m/s^2].

    Returns
    -------
    tuple of float
        Position [m], velocity [m/s] and acceleration [m/s^2] at the end, and the error estimates of position
        and velocity: the differences from the embedded method of order 6.
    """
    mode, memory, hammer, drive = law
    h2 = h * h
    a2 = acceleration(t0 + T.C2 * h, x0 + T.C2 * h * v0 + h2 * (T.A21 * a1), v0, mode, memory, hammer, drive)
    s = T.A31 * a1 + T.A32 * a2
    a3 = acceleration(t0 + T.C3 * h, x0 + T.C3 * h * v0 + h2 * s, v0, mode, memory, hammer, drive)
    s = T.A41 * a1 + T.A42 * a2 + T.A43 * a3
    a4 = acceleration(t0 + T.C4 * h, x0 + T.C4 * h * v0 + h2 * s, v0, mode, memory, hammer, drive)
    s = T.A51 * a1 + T.A52 * a2 + T.A53 * a3 + T.A54 * a4
    a5 = acceleration(t0 + T.C5 * h, x0 + T.C5 * h * v0 + h2 * s, v0, mode, memory, hammer, drive)
    s = T.A61 * a1 + T.A62 * a2 + T.A63 * a3 + T.A64 * a4 + T.A65 * a5
    a6 = acceleration(t0 + T.C6 * h, x0 + T.C6 * h * v0 + h2 * s, v0, mode, memory, hammer, drive)
    s = T.A71 * a1 + T.A72 * a2 + T.A73 * a3 + T.A74 * a4 + T.A75 * a5 + T.A76 * a6
    a7 = acceleration(t0 + T.C7 * h, x0 + T.C7 * h * v0 + h2 * s, v0, mode, memory, hammer, drive)
    s = T.A81 * a1 + T.A82 * a2 + T.A83 * a3 + T.A84 * a4 + T.A85 * a5 + T.A86 * a6 + T.A87 * a7
    a8 = acceleration(t0 + h, x0 + h * v0 + h2 * s, v0, mode, memory, hammer, drive)
    x1 = x0 + h * v0 + h2 * (T.BX1 * a1 + T.BX3 * a3 + T.BX4 * a4 + T.BX5 * a5 + T.BX6 * a6 + T.BX7 * a7)
    v1 = v0 + h * (T.BV1 * a1 + T.BV3 * a3 + T.BV4 * a4 + T.BV5 * a5 + T.BV6 * a6 + T.BV7 * a7 + T.BV8 * a8)
    a9 = acceleration(t0 + h, x1, v1, mode, memory, hammer, drive)
    error_x = h2 * (T.EX1 * a1 + T.EX3 * a3 + T.EX4 * a4 + T.EX5 * a5 + T.EX6 * a6 + T.EX7 * a7)
    error_v = h * (
        T.EV1 * a1 + T.EV3 * a3 + T.EV4 * a4 + T.EV5 * a5 + T.EV6 * a6 + T.EV7 * a7 + T.EV8 * a8 + T.EV9 * a9
    )
    return x1, v1, a9, error_x, error_v
