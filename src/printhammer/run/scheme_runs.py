"""Runs of the paper's two integrators, recorded in the format of the default integrator.

The schemes define no motion between the ends of their fixed steps; the record uses the cubic Hermite
interpolant of position and velocity. A touch is recorded at the first step end inside a contact, since the
schemes locate no discontinuity.
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any

import numpy as np

from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.kernel import schemes_1983
from printhammer.kernel.model import modes as M
from printhammer.parts import absent
from printhammer.run.problem import Problem, Record
from printhammer.support.arrays import FloatArray, IntArray

READINGS = schemes_1983.READINGS
"""Rules that decide when a 1983 scheme takes a short step; see `printhammer.kernel.schemes_1983`."""

Reading = schemes_1983.Reading
Scheme = schemes_1983.Scheme

_GAUSS = np.polynomial.legendre.leggauss(4)  # Nodes and weights of the quadrature of 4 points; arbitrary


class SchemeProblem(Problem):
    """Hammer under a drive, integrated with a scheme of the 1983 paper.

    The arguments are as for `Problem`; the tolerance is ignored. `scale` multiplies all step sizes of the
    paper's schedule, and `reading`, one of `READINGS`, decides when a short step is taken. Raises InputError
    if `scale` is not positive, or the hammer has damping.
    """

    def __init__(
        self,
        hammer: Hammer,
        drive: Drive,
        state: tuple[float, float],
        tolerance: float,
        scheme: schemes_1983.Scheme,
        scale: float = 1.0,
        reading: schemes_1983.Reading = "look-ahead",
    ) -> None:
        if not (math.isfinite(scale) and scale > 0.0):
            raise InputError.of("step_scale", scale, "a positive number")
        if hammer.is_damped:
            raise InputError(
                f"{hammer.path}: the schemes of 1983 expect a hammer without damping",
                file=hammer.path,
                key="damping",
            )
        if hammer.pack is not None and hammer.pack.rigid:
            raise InputError.of(
                "pack.law", hammer.pack.law, "a pack with a force for the schemes of 1983", file=hammer.path
            )
        if drive.quantity == "voltage":
            raise InputError(
                "the drive is a voltage", key="drive", expected="a current or a force for the schemes of 1983"
            )
        super().__init__(hammer, drive, state, 0.0, tolerance)
        self._scheme: schemes_1983.Scheme = scheme
        self._scale = scale
        self._reading: schemes_1983.Reading = reading
        self._modules = {role: import_module(part.module) for role, part in hammer.parts.items()}
        self._packed = {
            role: np.array(hammer.parts[role].packed(hammer.origin) if role in hammer.parts else ())
            for role in ("magnet", "spring", "pack", "backstop")
        }

    def _law(self, name: str) -> Any:
        module = self._modules.get(name.partition("_")[0], absent)
        return getattr(module, name, None) or getattr(absent, name)

    def integrate(self, end: float, moments: FloatArray | None = None) -> schemes_1983.SchemeRun:
        """Integrate to time `end` [s]; return the states at the step ends, or at given times."""
        hammer = self.hammer
        return schemes_1983.integrate(
            self.laws,
            self._packed,
            self.drive.kernel_arrays(),
            mass=hammer.mass,
            front=hammer.front if hammer.front is not None else math.inf,
            position=hammer.position if hammer.position is not None else -math.inf,
            state=self.state,
            t_end=end,
            scheme=self._scheme,
            scale=self._scale,
            reading=self._reading,
            moments=moments,
            rigid=self._rigid,
            reload_along_unloading=self.laws.reload_along_unloading,
        )

    def strobed(
        self, moments: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, IntArray, FloatArray, str]:
        """Return the states at given times [s], and the status of the run.

        The result contains, in this order: time [s], displacement [m], velocity [m/s], mode of motion, memory
        of the pack [m], and status. After a failure of the scheme, the values are NaN and the modes -1.
        """
        run = self.integrate(float(moments[-1]), moments)
        t, x, v, memory = np.full((4, moments.size), np.nan)
        for row, column in zip((t, x, v, memory), (run.t, run.x, run.v, run.memory), strict=True):
            row[: column.size] = column
        front = math.inf if self.hammer.front is None else self.hammer.front
        position = -math.inf if self.hammer.position is None else self.hammer.position
        mode = np.where(x > front, np.where(v >= 0.0, M.LOADING, M.UNLOADING), M.FREE)
        mode = np.where(x < position, M.BACKSTOP, mode).astype(np.int64)
        mode[run.t.size :] = -1
        return t, x, v, mode, memory, run.status

    def run(self, end: float) -> Record:
        """Integrate to time `end` [s]; a diverged run has the status "step underflow"."""
        run = self.integrate(end)
        nodes = self._nodes(run.t, run.x, run.v)
        return Record(
            M.OK if run.status == "ok" else M.STEP_UNDERFLOW, nodes, _contacts(nodes), len(nodes) - 1
        )

    @property
    def _rigid(self) -> bool:
        return self.hammer.backstop is not None and self.hammer.backstop.rigid

    def _nodes(self, t: FloatArray, x: FloatArray, v: FloatArray) -> FloatArray:
        """Convert step ends to nodes, each with the mode of motion that the schemes assign to its state."""
        position, front = self.hammer.position, self.hammer.front
        keep = np.isfinite(x) & np.isfinite(v)
        nodes = np.zeros((int(keep.sum()), 5))
        nodes[:, 0], nodes[:, 1], nodes[:, 2] = t[keep], x[keep], v[keep]
        nodes[:, 3] = M.FREE
        peak = 0.0
        for node in nodes:
            if position is not None and node[1] < position and not self._rigid:
                node[3], node[4] = M.BACKSTOP, math.sqrt(position - node[1])
            elif front is not None and node[1] > front:
                peak = node[1] if node[2] >= 0.0 else max(peak, node[1])
                node[3], node[4] = (M.LOADING, 0.0) if node[2] >= 0.0 else (M.UNLOADING, peak)
            else:
                peak = 0.0
        return nodes

    def resample(self, record: Record, times: FloatArray) -> FloatArray:
        """Return states and forces at ascending times [s], shape (n, 10).

        The columns are, in this order: displacement [m], velocity [m/s], value of the drive [A or N], the six
        forces of `_forces` [N], and the mode of motion.
        """
        nodes = record.nodes
        step = np.clip(np.searchsorted(nodes[:, 0], times, side="right") - 1, 0, max(len(nodes) - 2, 0))
        end = np.minimum(step + 1, len(nodes) - 1)
        h = np.maximum(nodes[end, 0] - nodes[step, 0], 1e-300)
        s = np.clip((times - nodes[step, 0]) / h, 0.0, 1.0)
        rise = (nodes[end, 1] - nodes[step, 1]) / h
        v0, v1 = nodes[step, 2], nodes[end, 2]
        c2, c3 = 3.0 * rise - 2.0 * v0 - v1, v0 + v1 - 2.0 * rise
        x = nodes[step, 1] + h * s * (v0 + s * (c2 + s * c3))
        v = v0 + s * (2.0 * c2 + 3.0 * s * c3)
        value = self.drive.value(times)
        forces = [
            self._forces(*row)
            for row in zip(x, v, value, nodes[step, 3], np.maximum(nodes[step, 4], x), strict=True)
        ]
        table = np.column_stack([x, v, value, np.array(forces).reshape(-1, 6), nodes[step, 3]])
        return np.ascontiguousarray(table)

    def _forces(self, x: float, v: float, value: float, mode: float, peak: float) -> tuple[float, ...]:
        """Return the forces on the armature, N.

        The forces are, in this order: magnet, spring, pack, elastic part of the backstop, viscous part of the
        backstop, and 0 for damping. `value` is the value of the drive [A or N], `mode` the mode of motion,
        and `peak` the largest displacement in the present contact with the pack [m].
        """
        packed = self._packed
        position, front = self.hammer.position, self.hammer.front
        current = 0.0 if self.laws.force_drive else value
        pack = elastic = viscous = 0.0
        if front is not None and x > front:
            if mode == M.UNLOADING and v < 0.0:
                memory = self._law("pack_memory")(packed["pack"], peak)
                pack = self._law("pack_unloading")(packed["pack"], x, v, memory)
            else:
                pack = self._law("pack_loading")(packed["pack"], x, v)
        if position is not None and x < position and not self._rigid:
            w = math.sqrt(position - x)
            elastic = self._law("backstop_elastic")(packed["backstop"], w)
            viscous = self._law("backstop_viscous")(packed["backstop"], w, v)
        magnet = self._law("magnet_force")(packed["magnet"], x, current)
        return magnet, self._law("spring_force")(packed["spring"], x), pack, elastic, viscous, 0.0

    def peaks(self, record: Record) -> FloatArray:
        """Return time [s], depth [m] and force [N] of the peak of each contact, shape (m, 3).

        Time and depth are taken at the step end with the largest depth; the force is the largest force at any
        step end of the contact.
        """
        nodes = record.nodes
        out = np.zeros((len(record.contacts), 3))
        table = self.resample(record, nodes[:, 0])
        for row, contact in enumerate(record.contacts):
            first = int(contact[5])
            last = len(nodes) if math.isnan(contact[3]) else int(np.searchsorted(nodes[:, 0], contact[3]))
            pack = contact[0] == M.PACK_SURFACE
            depth = nodes[first:last, 1] - (self.hammer.front or 0.0)
            force = -table[first:last, 5]
            if not pack:
                depth = (self.hammer.position or 0.0) - nodes[first:last, 1]
                force = table[first:last, 6] + table[first:last, 7]
            best = int(np.argmax(depth))
            out[row] = nodes[first + best, 0], depth[best], float(force.max())
        return out

    def quadratures(
        self,
        record: Record,
        steps: Any,  # noqa: ARG002 - the cubics are found by time
        starts: FloatArray,
        ends: FloatArray,
    ) -> FloatArray:
        """Integrate powers over intervals from `starts` to `ends` [s]; return the energies [J], shape (n, 5).

        For the columns see `printhammer.run.energy.increments_of`.
        """
        points, weights = _GAUSS
        half = 0.5 * (np.asarray(ends) - np.asarray(starts))
        times = (np.asarray(starts) + half)[:, None] + half[:, None] * points
        table = self.resample(record, times.ravel())
        v = table[:, 1]
        at_rest = np.array([self._law("magnet_force")(self._packed["magnet"], x, 0.0) for x in table[:, 0]])
        drive = table[:, 2] * v if self.laws.force_drive else np.zeros(len(v))
        powers = [(table[:, 3] - at_rest) * v, drive, -table[:, 5] * v, -table[:, 7] * v, np.zeros(len(v))]
        share = half[:, None] * weights
        return np.column_stack([(power.reshape(share.shape) * share).sum(axis=1) for power in powers])


def _contacts(nodes: FloatArray) -> FloatArray:
    """Convert the states at the step ends of a fixed-step run to contacts, in the format of the kernel."""
    surface = np.where(nodes[:, 3] == M.BACKSTOP, M.BACKSTOP_SURFACE, -1)
    surface = np.where((nodes[:, 3] == M.LOADING) | (nodes[:, 3] == M.UNLOADING), M.PACK_SURFACE, surface)
    changes = np.flatnonzero(np.diff(surface)) + 1
    rows = []
    for first, last in zip(np.r_[0, changes], np.r_[changes, len(surface)], strict=True):
        if surface[first] < 0:
            continue
        out = nodes[last, [0, 2]] if last < len(nodes) else [math.nan, math.nan]
        rows.append([surface[first], *nodes[first, [0, 2]], *out, first, float(first == 0)])
    return np.array(rows, dtype=np.float64).reshape(-1, 7)
