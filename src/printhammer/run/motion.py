"""Motion: the result of one run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.parts.friction import DryFriction
from printhammer.results import Column, Result, Rows, derived, provenance
from printhammer.results.declare import columns_of
from printhammer.results.files import write_csv, write_parquet
from printhammer.results.result import Entries
from printhammer.results.summary import (
    Cells,
    FactRow,
    Facts,
    Grid,
    Summary,
    judged,
    quantity,
    styled,
)
from printhammer.run.contacts import (
    Closing,
    Contact,
    Dot,
    Stick,
    closings_of,
    contact_rows,
    contacts_of,
    dots_of,
    extrema,
    named,
    sticks_of,
)
from printhammer.run.energy import CoilWork, Ledger, coil_work_of, increments_of, ledger_of
from printhammer.run.problem import Problem, Record, message_of
from printhammer.run.start import state_to_begin
from printhammer.run.switching.timings import Timing, timing_facts, timings_of
from printhammer.run.window import moves_on
from printhammer.support.arrays import FloatArray
from printhammer.support.files import write_file

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

FORCES: Final = ("magnet", "spring", "pack", "backstop", "damping", "drag", "drive", "total")
"""Names of the forces: equations (3) to (7), "drag" (damping of the armature, and of contacts in the list
``[[contact]]``, if the hammer has any), a drive that is a force, and the total."""

PATHS: Final = ("supply", "chopped", "blocked", "backward")
"""Conduction paths of the coil: through the supply, through the diode of a chopper, no path (no current), and
decay of a negative current."""

MOST_DOTS: Final = 40
"""Largest number of dots in a summary; a longer list shows its first and last dots. Arbitrary."""


def _remark(dot: Dot) -> str:
    if not dot.struck:
        return styled("bad", "lost")
    if dot.contact_time is None:
        return styled("poor", "open")
    return styled("poor", f"+{dot.extra_contacts}") if dot.extra_contacts else ""


class Motion(Result, fields=False):
    """Motion of one hammer under one drive, from `printhammer.simulate`.

    All quantities are computed on first access from the recorded steps, with the integrator itself, never by
    interpolation; nothing depends on the output grid.
    """

    unsettled = ""
    """Sentence that describes an armature not at rest at the end of the run; empty if a duration was
    stated."""

    def __init__(self, problem: Problem, record: Record, end: float, times: FloatArray, scheme: str) -> None:
        self._problem = problem
        self._record = record
        self._end = end
        self._times = times
        self._scheme = scheme

    @property
    def hammer(self) -> Hammer:
        """Hammer whose motion was simulated."""
        return self._problem.hammer

    @property
    def drive(self) -> Drive:
        """Drive under which the motion was simulated."""
        return self._problem.drive

    @property
    def status(self) -> str:
        """Status of the run: "ok", "range left", "runaway", "step limit" or "step underflow"."""
        return self._record.status_name

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self._record.status == 0

    @property
    def message(self) -> str:
        """Reason for an early end of the run, in one sentence; empty if the run reached its end."""
        return message_of(self._record, self.hammer)

    @property
    def start(self) -> float:
        """Time of the initial state, s."""
        return float(self._record.nodes[0, 0])

    @property
    def end(self) -> float:
        """Time of the last state, s: the requested end, or where the run stopped."""
        return float(self._record.nodes[-1, 0])

    @property
    def steps(self) -> int:
        """Number of steps of the integrator."""
        return self._record.steps

    @property
    def step_times(self) -> FloatArray:
        """End times of all steps, s, shape (n,), including every discontinuity of the force."""
        return self._record.nodes[:, 0].copy()

    @property
    @derived("s", "time", "t", kind="coordinate")
    def t(self) -> FloatArray:
        """Times of the output grid, s, shape (n,)."""
        return self._times

    @cached_property
    def _grid(self) -> FloatArray:
        return self._problem.resample(self._record, self._times)

    @property
    @derived("m", "displacement", "t")
    def x(self) -> FloatArray:
        """Displacement on the output grid, m, shape (n,)."""
        return self._grid[:, 0]

    @property
    @derived("m/s", "velocity", "t")
    def v(self) -> FloatArray:
        """Velocity on the output grid, m/s, shape (n,)."""
        return self._grid[:, 1]

    @property
    @derived("A", "coil current", "t")
    def current(self) -> FloatArray:
        """Coil current on the output grid, A, shape (n,); zero under a drive that is a force."""
        return self._electric(10) if self._problem.laws.circuit else self._driven("current")

    @property
    def voltage(self) -> FloatArray:
        """Voltage across the coil on the output grid, V, shape (n,); zero unless the drive is a voltage."""
        return self._electric(11)

    @property
    def linkage(self) -> FloatArray:
        """Flux linkage of the coil on the output grid, Wb, shape (n,); zero unless the drive is a voltage."""
        return self._electric(12)

    @property
    def driven(self) -> Literal["current", "force"]:
        """Kind of drive: "current" through the coil (also for voltage drives), or "force" on the armature."""
        return "force" if self.drive.quantity == "force" else "current"

    def driven_at(self, t: npt.ArrayLike) -> FloatArray:
        """Return the current in the coil [A] or the force of the drive [N] at any times of the run [s]."""
        return self._resampled(t)[:, 10] if self._problem.laws.circuit else self.drive.value(t)

    def curves_at(
        self, t: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, Mapping[str, FloatArray]]:
        """Return all curves of a plot at the given times of the run [s], in one pass.

        The curves are displacement [m], velocity [m/s], coil current [A] or drive force [N],
        voltage across the coil [V] (zero unless the drive is a voltage), and the forces [N], by name.
        """
        table = self._resampled(t)
        if self._problem.laws.circuit:
            driven, voltage = table[:, 10], table[:, 11]
        else:
            driven, voltage = self.drive.value(t), np.zeros(len(table))
        return table[:, 0], table[:, 1], driven, voltage, self._forces(table)

    @cached_property
    def switchings(self) -> tuple[FloatArray, tuple[str, ...]]:
        """Times [s] at which the coil current changed its conduction path, and the new paths; see `PATHS`."""
        if not self._problem.laws.circuit:
            return np.zeros(0), ()
        times, paths = self._record.nodes[:, 0], self._record.nodes[:, -1]
        rows = np.flatnonzero(np.diff(paths) != 0.0) + 1
        return times[rows], tuple(PATHS[int(code)] for code in paths[rows].tolist())

    def _electric(self, column: int) -> FloatArray:
        return self._grid[:, column] if self._problem.laws.circuit else np.zeros(len(self._times))

    def _driven(self, quantity: str) -> FloatArray:
        return self._grid[:, 2] if self.drive.quantity == quantity else np.zeros(len(self._times))

    @property
    def force(self) -> Mapping[str, FloatArray]:
        """Forces on the output grid by name (see `FORCES`), N, each of shape (n,)."""
        return self._forces(self._grid)

    def _forces(self, table: FloatArray) -> Mapping[str, FloatArray]:
        drive = table[:, 2] if self.drive.quantity == "force" else np.zeros(len(table))
        columns = [*table[:, 3:9].T, drive]
        named = dict(zip(FORCES, [*columns, np.sum(columns, axis=0)], strict=True))
        if not self.hammer.is_damped:
            del named["drag"]
        return MappingProxyType(named)

    def _resampled(self, t: npt.ArrayLike) -> FloatArray:
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
        inside = (times >= self.start) & (times <= self.end)
        if not inside.all():
            raise InputError(
                f"t = {times[~inside][0]:.9g} s lies outside the motion",
                key="t",
                value=times[~inside][0],
                expected=f"a time from {self.start:.9g} s to {self.end:.9g} s",
            )
        order = np.argsort(times, kind="stable")
        table = np.empty((times.size, self._problem.columns))
        table[order] = self._problem.resample(self._record, np.ascontiguousarray(times[order]))
        return table

    def at(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return displacement [m] and velocity [m/s] at times `t` [s]; at a rigid impact, those after it."""
        table = self._resampled(t)
        return table[:, 0], table[:, 1]

    def state_at(self, t: float) -> tuple[float, ...]:
        """Return the state at a time [s] of the run, from which another run can start: see `simulate`.

        The components are displacement [m], velocity [m/s], branch of the pack law (-1 outside the pack) and
        memory of the pack [m]; under a voltage also the currents in coil and shorted turn [A], and the
        voltage of the supply's capacitor [V]. A new run that starts from the state at a firing, and begins
        with that firing, continues the motion, unless a pulse of an earlier firing is still active.

        Raises
        ------
        InputError
            The time is outside the run, or the pack has just released the armature permanently.
        """
        (row,) = self._resampled(t)
        node = self._record.nodes[np.searchsorted(self._record.nodes[:, 0], t, side="right") - 1]
        x, v, mode = row[[0, 1, 9]].tolist()
        begun = state_to_begin(self.hammer, x, v, int(mode), float(node[4]))
        if begun is None:
            raise InputError(
                f"t = {t:.9g} s: no run can begin where the pack has just released the armature",
                key="t",
                value=t,
            )
        return (*begun, *(row[[10, 14, 13]].tolist() if self._problem.laws.circuit else ()))

    def forces_at(self, t: npt.ArrayLike) -> Mapping[str, FloatArray]:
        """Return the forces [N], by name, at any times of the run [s]."""
        return self._forces(self._resampled(t))

    @cached_property
    def _increments(self) -> FloatArray:
        return increments_of(self._problem, self._record)

    @cached_property
    def _contact_rows(self) -> FloatArray:
        rigid = self.hammer.backstop is not None and self.hammer.backstop.rigid
        return contact_rows(self._problem, self._record, self._increments, rigid)

    @cached_property
    def contacts(self) -> Rows[Contact]:
        """All contacts in order of touch time, also any present at the start; a tuple, shown as a table."""
        return Rows(contacts_of(self._contact_rows), Contact)

    @cached_property
    def closings(self) -> Rows[Closing]:
        """Closings of all contacts of the list ``[[contact]]`` in order of time, shown as a table."""
        return Rows(closings_of(self._problem, self._record), Closing)

    @cached_property
    def timings(self) -> Rows[Timing]:
        """Operate, release and bounce times of contacts in ``[[contact]]``; none under a sinusoidal force."""
        return Rows(timings_of(self._problem, self._record, self.closings), Timing)

    @cached_property
    def sticks(self) -> Rows[Stick]:
        """Phases in which dry friction holds the armature, in order of time; empty without dry friction."""
        is_dry = isinstance(self.hammer.damping, DryFriction)
        return Rows(sticks_of(self._record) if is_dry else [], Stick)

    @cached_property
    def dots(self) -> Rows[Dot]:
        """Dots of all firings up to the end of the run, in order; a tuple, shown as a table."""
        return Rows(dots_of(self._problem, self._record, self._contact_rows, self._increments), Dot)

    @cached_property
    def energy(self) -> Ledger:
        """Energy ledger of the whole run."""
        return ledger_of(self._problem, self._record, self._increments)

    @cached_property
    def coil_work(self) -> CoilWork:
        """Coil work over the whole run: net and positive work, squared current, and heat of the coil."""
        return coil_work_of(self._problem, self._record)

    @cached_property
    def strobe(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Firing times inside the run [s], with displacement [m] and velocity [m/s] at each firing."""
        times = self.drive.times
        times = np.array(times[(times >= self.start) & (times <= self.end)])
        return times, *self.at(times)

    @cached_property
    def maxima(self) -> tuple[FloatArray, FloatArray]:
        """Times [s] and displacements [m] of all local maxima of the displacement."""
        return extrema(self._problem, self._record, 1.0)

    def peak_after(self, firing: int) -> tuple[float, float] | None:
        """Return time [s] and displacement [m] of the largest local maximum from a firing to the next.

        The result is None without such a maximum; the displacement at the firing itself does not count.
        """
        fired = self.drive.times
        if not 0 <= firing < len(fired):
            raise InputError(
                f"firing = {firing}: the drive has firings 0 to {len(fired) - 1}", key="firing", value=firing
            )
        until = fired[firing + 1] if firing + 1 < len(fired) else np.inf
        times, x = self.maxima
        inside = (times > fired[firing]) & (times <= until)
        if not inside.any():
            return None
        best = int(np.argmax(np.where(inside, x, -np.inf)))
        return float(times[best]), float(x[best])

    @property
    def title(self) -> str:
        """One-line title: hammer, start and end of the motion."""
        return f"motion of {self.hammer.name}, {self.start:.9g} s to {self.end:.9g} s"

    def summary(self) -> Summary:
        """Summarise dots, status, largest displacement, contacts and energies."""
        lost = len(self.dots) - sum(dot.struck for dot in self.dots)
        state = judged(self.ok, "ok" if self.ok else self.status, "bad")
        missing = f", {styled('bad', f'{lost} lost')}" if lost else ""
        rows: list[FactRow] = [
            ("status", f"{state}, {self.end * 1e3:.4g} ms in {self.steps} steps"),
            ("dots", f"{len(self.dots) - lost} struck{missing}"),
        ]
        if self.unsettled:
            moves = moves_on(self.hammer, self._record.nodes)
            advice = "a duration sets a longer run" if moves else "there it stands still"
            rows.append(("at the end", styled("poor", f"{self.unsettled}; {advice}")))
        times, x = self.maxima
        if len(x):
            top = int(x.argmax())
            rows.append(("peak", f"{quantity(x[top], 'm')} at {quantity(times[top], 's')}"))
        for surface in ("pack", "backstop"):
            touches = [each for each in self.contacts if each.surface == surface and not each.initial]
            forces = [each.peak_force for each in touches if each.peak_force is not None]
            up_to = f", up to {quantity(max(forces), 'N')}" if forces else ""
            rows.append((surface, f"{len(touches)} {'touch' if len(touches) == 1 else 'touches'}{up_to}"))
        if self.sticks:
            first = quantity(self.sticks[0].t_in, "s")
            rows.append(("held by friction", f"{len(self.sticks)} x, first at {first}"))
        energies = Facts([*rows, *timing_facts(self.timings, self.closings, self.end), *self._energy_facts()])
        if self.drive.quantity != "current" and self.hammer.pack is None:
            return Summary([energies])
        heads = {
            "fired": "fired_at",
            "flight": "flight_time",
            "speed": "impact_speed",
            "force": "peak_force",
            "depth": "indentation",
            "contact": "contact_time",
            "work": "loading_work",
            "loss": "net_loss",
        }
        units = columns_of(Dot)
        columns = [
            Cells("dot", [dot.index + 1 for dot in self.dots]),
            *(
                Cells(head, [getattr(dot, name) for dot in self.dots], units[name].unit)
                for head, name in heads.items()
            ),
            Cells("", [_remark(dot) for dot in self.dots], left=True),
        ]
        return Summary([Grid(columns, most=MOST_DOTS), "", energies])

    def _energy_facts(self) -> list[FactRow]:
        """Return the energies of the run and the residual of the ledger, for the summary."""
        energy, rows = self.energy, list[FactRow]()
        if self.drive.quantity == "voltage":
            eddies = f" + eddies {quantity(energy.eddy_loss, 'J')}" if energy.eddy_loss else ""
            spent = (
                f"{quantity(energy.supply_work, 'J')} = copper {quantity(energy.copper_loss, 'J')}"
                f" + driver {quantity(energy.driver_loss, 'J')}{eddies}"
                f" + coil {quantity(energy.coil_work, 'J')}"
                f" + field {quantity(energy.field, 'J')}"
            )
            rows.append(("supply", spent))
        force = self.drive.quantity == "force"
        work = (
            f"drive {quantity(energy.drive_work, 'J')}"
            if force
            else f"coil {quantity(energy.coil_work, 'J')}"
        )
        damping = f" + damping {quantity(energy.damping_loss, 'J')}" if self.hammer.is_damped else ""
        balance = (
            f"{work} = pack {quantity(energy.pack_loss, 'J')}"
            f" + backstop {quantity(energy.backstop_loss, 'J')}"
            f"{damping} + armature {quantity(energy.kinetic + energy.stored, 'J')}"
        )
        residual = max(energy.residual, energy.electric_residual, key=abs)
        share = residual / energy.throughput if energy.throughput else 0.0
        return [*rows, ("energy", balance), ("residual", f"{share:+.1e} of the energy that passed through")]

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the motion: fingerprints, versions, tolerance."""
        return provenance(
            hammer=self.hammer,
            drive=self.drive,
            scheme=self._scheme,
            tolerance=self._problem.tolerance,
            status=self.status,
        )

    def entries(self) -> Entries:
        """Return arrays on the output grid by name: `x`, `v`, `current`, and forces as `force_magnet` etc."""
        forces = {f"force_{name}": (name, values) for name, values in self.force.items()}
        return super().entries() | {
            key: (Column("N", f"{name} force", ("t",)), values) for key, (name, values) in forces.items()
        }

    def to_xarray(self) -> xr.Dataset:
        """Return the motion on the output grid as a Dataset along `t`, with units and provenance."""
        return self.to_dataset()

    def to_pandas(self) -> pd.DataFrame:
        """Return the motion on the output grid as a DataFrame, with units in the column names."""
        return self.to_dataframe()

    def to_csv(self, path: str | Path) -> None:
        """Write the motion on the output grid as CSV; ``# key: value`` lines contain the provenance."""
        write_csv(self.to_pandas(), path)

    def to_parquet(self, path: str | Path) -> None:
        """Write the motion, with provenance, as Parquet; requires the optional dependencies `tables`."""
        write_parquet(self.to_pandas(), path)

    def write(self, path: Path) -> None:
        """Write the motion: a .json file in the format of `to_json`, any other in the format of `save`."""
        if path.suffix.lower() == ".json":
            write_file(path, self.to_json())
        else:
            self.save(path)

    def to_json(self) -> str:
        """Return dots, contacts, energies, constants and drive as JSON text, SI, with units in the names."""
        times, x = self.maxima
        top = int(x.argmax()) if len(x) else None
        content = {
            "status": self.status,
            "message": self.message,
            "unsettled": self.unsettled,
            "end_s": self.end,
            "steps": self.steps,
            "peak": None if top is None else {"t_s": float(times[top]), "x_m": float(x[top])},
            "dots": [named(dot) for dot in self.dots],
            "contacts": [named(contact) for contact in self.contacts],
            "energy": {f"{key}_J": value for key, value in asdict(self.energy).items()},
            "constants": {
                key: {"value": constant.si, "unit": constant.si_unit, "status": constant.status}
                for key, constant in self.hammer.constants.items()
            },
            "drive": self.drive.to_toml(),
            "provenance": self.provenance,
        }
        return json.dumps(content, indent=2, allow_nan=False) + "\n"
