"""Forces of a hammer for the oracle, derived independently from the constants of its parts.

No law function of ``printhammer.parts`` is called: a part supplies its constants, the formulas are the
oracle's own, equations (3) to (7) of the paper and those of the alternative parts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from tests.oracle.series import CELL, INVERSE_ROOT, NO_MAGNET, Array, offset


@dataclass(frozen=True)
class Contact:
    """Push -sigma (K r**p + E r**q u'), u = sigma (x - surface), r = u / scale."""

    sigma: float
    stiffness: float
    power: float
    viscous: float = 0.0
    viscous_power: float = 0.0
    scale: float = 1.0

    def packed(self) -> Array:
        """Return the coefficients of the contact as the array that the series requires."""
        values = [self.sigma, self.stiffness, self.power, self.viscous, self.viscous_power, self.scale]
        return np.array(values)

    @property
    def singular(self) -> bool:
        """Whether the push is not analytic at first touch."""
        return self.power != round(self.power)

    def push(self, y: float, v: float) -> float:
        """Force on the armature, N, at distance y beyond the surface."""
        r = self.sigma * y / self.scale
        viscous = self.viscous * r**self.viscous_power * self.sigma * v if self.viscous else 0.0
        return float(-self.sigma * (self.stiffness * r**self.power + viscous))

    def impulse(self, speed: float, pull: float, h: float) -> float:
        """Bound of the impulse within ``h`` of a first touch with given speed and acceleration, N s."""
        r = (abs(speed) * h + 0.5 * abs(pull) * h * h) / self.scale
        elastic = self.stiffness * r**self.power
        viscous = self.viscous * r**self.viscous_power * (abs(speed) + abs(pull) * h)
        return float(h * (elastic + viscous))


NO_CONTACT = Contact(0.0, 0.0, 1.0)


class Table:
    """Measured forces F(x, I), interpolated by SciPy's bicubic spline, one polynomial per grid cell."""

    def __init__(self, x: Array, current: Array, force: Array) -> None:
        from scipy.interpolate import RectBivariateSpline

        self.edges = (np.asarray(x), np.asarray(current))
        powers = [min(3, edges.size - 1) for edges in self.edges]
        self._spline = RectBivariateSpline(*self.edges, np.asarray(force), kx=powers[0], ky=powers[1])
        self._cells: dict[tuple[int, int], Array] = {}

    def index(self, x: float, current: float) -> tuple[int, int]:
        """Cell that contains a point; the outermost cells extend without end."""
        i, j = (
            min(max(int(np.searchsorted(edges, value, side="right")) - 1, 0), edges.size - 2)
            for edges, value in zip(self.edges, (x, current), strict=True)
        )
        return i, j

    def packed(self, cell: tuple[int, int]) -> Array:
        """Return (x0, i0, coefficients) of a cell about its centre, away from the knots."""
        if cell not in self._cells:
            spans = [edges[k : k + 2] for edges, k in zip(self.edges, cell, strict=True)]
            middles = [0.5 * (span[0] + span[1]) for span in spans]
            halves = [0.5 * (span[1] - span[0]) for span in spans]
            # The spline is one polynomial there: 4 by 4 of its values give the coefficients.
            nodes = np.array([-0.9, -0.3, 0.3, 0.9])
            values = self._spline(middles[0] + halves[0] * nodes, middles[1] + halves[1] * nodes)
            inverse = np.linalg.inv(nodes[:, None] ** np.arange(4))
            units = [half ** -np.arange(4.0) for half in halves]
            c = inverse @ values @ inverse.T * units[0][:, None] * units[1]
            self._cells[cell] = np.array([*middles, *c.ravel()])
        return self._cells[cell]

    def guards(self, cell: tuple[int, int], x: Array, current: Array) -> list[tuple[str, Array]]:
        """Distances from the edges of a cell, as series like those of x and the current, by event.

        The outer edges of the currents have some slack, for a pulse that ends at zero up to rounding; those
        of the displacements are the range of the magnet.
        """
        distances = []
        for axis, series in ((0, x), (1, current)):
            edges, place = self.edges[axis], cell[axis]
            slack = 1e-9 * (edges[-1] - edges[0])
            for step, edge, sign in ((-1, edges[place], 1.0), (1, edges[place + 1], -1.0)):
                outer = not 0 <= place + step < edges.size - 1
                kind = "range-left" if outer else f"cell {axis} {step}"
                if not outer or axis == 1:
                    distances.append((kind, offset(sign * series, outer * slack - sign * edge)))
        return distances


class ReferenceHammer:
    """Constants of a hammer in the form that the oracle uses."""

    def __init__(self, hammer: Any) -> None:
        self.mass = float(hammer.mass)
        self.backstop = hammer.backstop
        self.pack = hammer.pack
        self.position = math.nan if self.backstop is None else float(self.backstop.position)
        self.front = math.nan if self.pack is None else float(self.pack.front)
        self.rigid = self.backstop is not None and self.backstop.law == "rigid"
        origin = 0.0 if self.backstop is None else self.position
        self.spring = self._spring(hammer.spring, origin)
        self.damping = self._damping(hammer.damping)
        self.table: Table | None = None
        self.magnet_kind, self.magnet = NO_MAGNET, np.zeros(3)
        self.low, self.high = -math.inf, math.inf
        if hammer.magnet is not None:
            self._take_magnet(hammer.magnet)

    @staticmethod
    def _spring(spring: Any, origin: float) -> Array:
        if spring is None:
            return np.zeros(4)
        if spring.law == "linear":
            return np.array([spring.Bs + spring.Bs / spring.As * origin, -spring.Bs / spring.As, 0.0, 0.0])
        if spring.law == "preload":
            return np.array([spring.preload + spring.stiffness * origin, -spring.stiffness, 0.0, 0.0])
        if spring.law == "cubic":
            center = spring.center
            return np.array([spring.stiffness * center, -spring.stiffness, -spring.cubic, center])
        raise ValueError(f"the reference knows no spring law {spring.law!r}")

    @staticmethod
    def _damping(damping: Any) -> float:
        if damping is None:
            return 0.0
        if damping.law == "viscous":
            return float(damping.coefficient)
        raise ValueError(f"the reference knows no damping law {damping.law!r}")

    def _take_magnet(self, magnet: Any) -> None:
        self.low, self.high = magnet.domain
        if magnet.law == "inverse-root":
            self.magnet_kind, self.magnet = INVERSE_ROOT, np.array([magnet.F0, magnet.Am, magnet.Bm])
            # The law is singular at zero: its range ends a nanometre before.
            self.low = max(self.low, 1e-9)
        elif magnet.law == "table":
            points = magnet.content()
            self.magnet_kind = CELL
            self.table = Table(points["x"], points["current"], points["force"])
        else:
            raise ValueError(f"the reference knows no magnet law {magnet.law!r}")

    def loading(self) -> Contact:
        """Pack at first touch: the loading branch of (5), or spring and dashpot."""
        pack = self.pack
        if pack.law == "power":
            return Contact(1.0, pack.stiffness, 2.7, scale=pack.thickness)
        if pack.law == "dashpot":
            return Contact(1.0, pack.stiffness, 1.0, pack.damping, 0.0)
        raise ValueError(f"the reference knows no pack law {pack.law!r}")

    def unloading(self, peak: float) -> Contact:
        """Unloading branch of (5) from the indentation ``peak``: S rmax**2.7 (r / rmax)**11."""
        pack = self.pack
        return Contact(1.0, pack.stiffness * (peak / pack.thickness) ** 2.7, 11.0, scale=peak)

    def stop(self) -> Contact:
        """Backstop: (6) and (7), or the viscoelastic Hertz contact of Kuwabara and Kono."""
        part = self.backstop
        if part.law == "hertz":
            return Contact(-1.0, part.k, 1.5, part.l, 1.5)
        if part.law == "elastomer":
            return Contact(-1.0, part.stiffness, 1.5, 1.5 * part.stiffness * part.relaxation_time, 0.5)
        raise ValueError(f"the reference knows no backstop law {part.law!r}")

    def pack_cut(self) -> tuple[float, float] | None:
        """Return (a, b) of a y + b v, positive while a dashpot pack pushes; None if it may pull."""
        pack = self.pack
        if pack.law != "dashpot" or pack.pull or pack.damping == 0.0:
            return None
        return pack.stiffness, pack.damping

    def stop_cut(self) -> tuple[float, float, float] | None:
        """Return (a, b, c) of a + b y + c v, positive while the backstop pushes; None if it may pull."""
        part = self.backstop
        if part.pull:
            return None
        if part.law == "hertz":
            return (part.k, 0.0, -part.l) if part.l > 0.0 else None
        return (0.0, -1.0, -1.5 * part.relaxation_time) if part.relaxation_time > 0.0 else None

    def held_force(
        self, x: float, drive: Array, is_current: bool, cell: tuple[int, int] | None = None
    ) -> Array:
        """Magnet, spring and drive at a fixed displacement, as a series in time like ``drive``, N.

        ``cell``: the cell of a force table; by default the one that the drive starts in.
        """
        current = drive if is_current else np.zeros(drive.size)
        out = np.zeros(drive.size) if is_current else drive.copy()
        out[0] += self.spring[0] + self.spring[1] * x
        if self.spring[2] != 0.0:
            out[0] += self.spring[2] * (x - self.spring[3]) ** 3
        if self.magnet_kind == INVERSE_ROOT:
            f0, am, bm = self.magnet
            gap = -bm * current
            gap[0] += am
            out -= np.convolve(gap, gap)[: drive.size] / math.sqrt(x)
            out[0] += f0
        elif self.table is not None:
            packed = self.table.packed(cell or self.table.index(x, float(current[0])))
            by_current = (x - packed[0]) ** np.arange(4) @ packed[2:].reshape(4, 4)
            rest = current.copy()
            rest[0] -= packed[1]
            power = np.zeros(drive.size)
            power[0] = 1.0
            for coefficient in by_current:
                out += coefficient * power
                power = np.convolve(power, rest)[: drive.size]
        return out

    def rest(self) -> float:
        """Displacement of rest at the backstop without a drive, m.

        The equilibrium nearest to the backstop: inside it where the other forces push in, else beyond it.
        """
        from scipy.optimize import brentq

        still = np.zeros(1)

        def outside(y: float) -> float:
            return float(self.held_force(self.position + y, still, True)[0])

        if self.backstop is None:
            raise ValueError("a hammer without a backstop needs a state to start from")
        if outside(0.0) >= 0.0:
            raise ValueError("no rest state at the backstop: give a state to start from")
        if self.rigid:
            return self.position
        contact = self.stop()

        def inside(y: float) -> float:
            return outside(-y) + contact.push(-y, 0.0)

        # The other forces change slowly: their size at first touch sets the indentation to start from.
        deep = (-outside(0.0) / contact.stiffness) ** (1.0 / contact.power)
        deepest = self.position - self.low
        while deep < deepest and inside(deep) <= 0.0:
            deep *= 1.1
        if deep >= deepest:
            raise ValueError("no rest state at the backstop: give a state to start from")
        return self.position - float(brentq(inside, 0.0, deep, xtol=1e-22, rtol=1e-15))
