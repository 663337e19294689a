"""Outputs of a sweep: arrays of the store, their units and meanings, and their selection in a spec."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from printhammer.errors import InputError, nearest
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import shown
from printhammer.sweep.tables import OutputsTable, read_quantity

STATUSES: Final = (
    "ok",
    "range left",
    "runaway",
    "step limit",
    "step underflow",
    "worker lost",
    "no such hammer",
)
"""Statuses of members by code; "no such hammer": the axis values yield no hammer with a rest state, or no
drive."""

WORKER_LOST: Final = STATUSES.index("worker lost")
NO_HAMMER: Final = STATUSES.index("no such hammer")
NOT_YET: Final = -1
"""Status code of a member whose block is not computed yet."""

FIRING: Final = "firing"
TIME: Final = "time"


@dataclass(frozen=True)
class Output:
    """Output array of a sweep: name, dimension after the member dimensions, type, unit, meaning."""

    name: str
    dim: str
    dtype: str
    unit: str
    meaning: str

    @property
    def fill(self) -> Any:
        """Fill value of entries of the array that have no result."""
        return {"f": np.nan, "b": False, "i": -1 if self.name in _CODES else 0}[np.dtype(self.dtype).kind]

    @property
    def attrs(self) -> dict[str, Any]:
        """Unit and meaning as attributes of the array."""
        attrs: dict[str, Any] = {"long_name": self.meaning}
        if self.unit:
            attrs["units"] = self.unit
        if self.name == "status":
            attrs["flag_values"] = list(range(NOT_YET, len(STATUSES)))
            attrs["flag_meanings"] = " ".join(name.replace(" ", "_") for name in ("not yet", *STATUSES))
        return attrs


_CODES: Final = ("status", "strobe_branch")

UNSETTLED: Final = Output(
    "unsettled", "", "bool", "", "whether the armature is not at rest at the end of the window of the device"
)
"""Output that is always false if the spec states a duration, or for members with a status other than ok."""

ALWAYS: Final = (
    Output("status", "", "int8", "", "status of the run"),
    Output("reached", "", "float64", "s", "time at which the run ended"),
    Output("steps", "", "int64", "", "steps of the integrator"),
    UNSETTLED,
)
"""Outputs stored for every member."""

DOTS: Final = (
    Output("fired", FIRING, "bool", "", "whether the run includes this firing"),
    Output("fired_at", FIRING, "float64", "s", "time of the firing"),
    Output("struck", FIRING, "bool", "", "whether a dot was struck"),
    Output("flight_time", FIRING, "float64", "s", "time from firing to touch"),
    Output("impact_speed", FIRING, "float64", "m/s", "velocity at touch"),
    Output("peak_force", FIRING, "float64", "N", "largest pack force"),
    Output("indentation", FIRING, "float64", "m", "largest indentation of the pack"),
    Output("contact_time", FIRING, "float64", "s", "time from touch to departure"),
    Output("extra_contacts", FIRING, "int64", "", "further pack contacts before the next firing"),
)
STROBES: Final = (
    Output("strobe_t", FIRING, "float64", "s", "time of the firing"),
    Output("strobe_x", FIRING, "float64", "m", "displacement at the firing"),
    Output("strobe_v", FIRING, "float64", "m/s", "velocity at the firing"),
    Output("strobe_branch", FIRING, "int8", "", "code of the mode at the firing"),
    Output("strobe_memory", FIRING, "float64", "m", "latest local maximum of the displacement in the pack"),
)
FINAL: Final = (
    Output("final_x", "", "float64", "m", "displacement at the end of the run"),
    Output("final_v", "", "float64", "m/s", "velocity at the end of the run"),
)
DISPLACEMENT: Final = Output("displacement", TIME, "float32", "m", "displacement")
OF_DOTS: Final = (
    Output("struck_dots", "", "int64", "", "dots struck"),
    Output("lost_dots", "", "int64", "", "dots lost"),
    Output("flight_time_mean", "", "float64", "s", "mean flight time of the dots struck"),
    Output("flight_time_spread", "", "float64", "s", "largest minus smallest flight time"),
    Output("peak_force_mean", "", "float64", "N", "mean of the largest pack forces of the dots struck"),
    Output("peak_force_spread", "", "float64", "N", "largest minus smallest peak force"),
)
OF_MOTION: Final = (
    Output("peak_displacement", "", "float64", "m", "largest displacement"),
    Output("backstop_touches", "", "int64", "", "touches of the backstop"),
    Output("coil_work", "", "float64", "J", "work of the coil"),
    Output("drive_work", "", "float64", "J", "work of a driving force"),
    Output("pack_loss", "", "float64", "J", "energy dissipated in the pack"),
    Output("backstop_loss", "", "float64", "J", "energy dissipated in the backstop"),
    Output("damping_loss", "", "float64", "J", "energy dissipated by the damping of the armature"),
    Output("energy_residual", "", "float64", "J", "residual of the energy ledger"),
)
"""Scalar outputs that require the whole motion, which takes several times the computation time."""


class Outputs(Declared):
    """Selection of the outputs that are stored for each member."""

    arrays: tuple[Output, ...] = part("all arrays, the status first")
    firings: int = part("length of the dimension of the firings")
    times: FloatArray = part("times of the displacements, s")

    def wants(self, *outputs: Output) -> bool:
        """Whether any of the outputs is selected."""
        return any(output in self.arrays for output in outputs)

    def length(self, output: Output) -> tuple[int, ...]:
        """Return the shape of an output array for one member, such as (firings,); () for a scalar output."""
        return {"": (), FIRING: (self.firings,), TIME: (self.times.size,)}[output.dim]

    def empty(self, members: int) -> dict[str, Any]:
        """Allocate the output arrays by name, shape (members, ...), filled with fill values."""
        return {
            output.name: np.full((members, *self.length(output)), output.fill, output.dtype)
            for output in self.arrays
        }


def read_outputs(table: OutputsTable, firings: int) -> Outputs:
    """Parse the outputs selected by a spec.

    Raises
    ------
    InputError
        A name is unknown or repeated, the times are out of order, or no output is selected.
    """
    arrays = [*ALWAYS]
    arrays += _chosen(table.dots, {output.name: output for output in DOTS}, "dots")
    strobes = {output.name.removeprefix("strobe_"): output for output in STROBES}
    arrays += _chosen(table.strobes, strobes, "strobes")
    arrays += FINAL if table.final else ()
    times = np.zeros(0)
    if table.displacement is not None:
        where = "outputs.displacement"
        start = read_quantity(table.displacement.start, "s", f"{where}.start")
        end = read_quantity(table.displacement.end, "s", f"{where}.end")
        if not 0.0 <= start < end or table.displacement.count < 2:
            raise InputError(
                f"{where}: expected at least 2 times from 0 s on, the end after the start",
                file=where,
                key=where,
            )
        times = np.linspace(start, end, table.displacement.count)
        arrays.append(DISPLACEMENT)
    scalars = {output.name: output for output in (*OF_DOTS, *OF_MOTION)}
    arrays += _chosen(table.scalars, scalars, "scalars")
    if len(arrays) == len(ALWAYS):
        raise InputError(
            "outputs: the list is empty",
            key="outputs",
            expected="dots, strobes, final, displacement or scalars",
        )
    return Outputs(tuple(arrays), firings, times)


def _chosen(names: Sequence[str] | str, known: Mapping[str, Output], where: str) -> list[Output]:
    if isinstance(names, str):
        return list(known.values())
    for name in names:
        if name not in known:
            hint = nearest(name, known, f'some of {", ".join(known)}, or "all"')
            raise InputError(
                f"outputs.{where}: {shown(name)} is not known", key=f"outputs.{where}", expected=hint
            )
    if len(set(names)) < len(names):
        raise InputError(f"outputs.{where}: expected different names", key=f"outputs.{where}")
    return [known[name] for name in names]
