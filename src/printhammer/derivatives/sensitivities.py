"""Sensitivities of flight time, force and energy to each constant of hammer and pulse.

The derivatives come from the tangent flow of the constants along one run
(`printhammer.derivatives.flow`), not from differences of runs. `Spread` derives the effect of
tolerances on the dots from these derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.derivatives.dots import DOT_QUANTITIES, RUN_QUANTITIES, changes_of, dot_values
from printhammer.derivatives.flow import rest_columns, without_current
from printhammer.derivatives.parameters import Parameter, parameter_names, parameters
from printhammer.drive.input import read_number
from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import unknown
from printhammer.results import Column, Result, column, coordinate, derived, part, scalar
from printhammer.results.summary import Facts, Summary
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem, check_tolerance
from printhammer.run.simulate import end_of_run
from printhammer.run.start import initial_state
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_IN_PARTS: Final = "relative change of a quantity per relative change of a constant"
_INDEPENDENT: Final = "standard deviation for independent constants"
_WORST: Final = "worst-case deviation, with all constants at their limits"

TOLERANCE: Final = 1e-12
"""Default integration tolerance of the run; arbitrary."""


class Sensitivities(Result):
    """Sensitivities of a run: derivatives of dots and energies with respect to constants.

    The units depend on quantity and constant; they are coordinates of the table.
    """

    hammer: Hammer = part("the hammer")
    drive: Drive = part("the drive")
    constants: tuple[str, ...] = coordinate(
        "",
        "name of the constant",
        "constant",
        more="as in `printhammer.derivatives.parameters`",
        name="constant",
    )
    units: tuple[str, ...] = coordinate("", "SI unit of the constant", "constant", name="constant_unit")
    meanings: tuple[str, ...] = coordinate("", "meaning of the constant", "constant", name="constant_meaning")
    values: FloatArray = column("constant_unit", "value of a constant", "constant", name="constant_value")
    quantities: tuple[str, ...] = coordinate(
        "",
        "name of the quantity of a dot",
        "quantity",
        more="see `printhammer.derivatives.dots.DOT_QUANTITIES`",
        name="quantity",
    )
    dots: FloatArray = column(
        "quantity_unit",
        "value",
        "dot quantity",
        more="nan for a lost dot, and for events after the end of the run",
        name="value",
    )
    derivatives: FloatArray = column(
        "quantity_unit / constant_unit",
        "derivative of a quantity with respect to a constant",
        "dot quantity constant",
        name="derivative",
    )
    run_quantities: tuple[str, ...] = coordinate(
        "", "name of the energy of the whole run", "energy", name="energy"
    )
    run: FloatArray = column("J", "energy of the run", "energy", name="run_value")
    run_derivatives: FloatArray = column(
        "J / constant_unit",
        "derivative of a quantity with respect to a constant",
        "energy constant",
        more="the end time of the run is fixed",
        name="run_derivative",
    )
    left_out: Mapping[str, str] = part(
        "constants at whose value the motion is not differentiable, with the reason", repr=False
    )
    duration: float = scalar("s", "end of the run")
    smooth: bool = part(
        "False if the motion passes a touch without velocity",
        more="derivatives after such a touch are invalid",
    )
    status: str = part("status of the run", more='the derivatives are nan unless it is "ok"')
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """Title of the table of sensitivities."""
        return f"sensitivities of {self.hammer.name}"

    @property
    def ok(self) -> bool:
        """Whether the run reached its end."""
        return self.status == "ok"

    @property
    def lost(self) -> tuple[int, ...]:
        """Indices, from 0, of the firings whose dots are lost; these dots have no sensitivities."""
        return tuple(int(k) for k in np.flatnonzero(np.isnan(self.dots[:, 0])))

    @property
    @derived("1", _IN_PARTS, "dot quantity constant")
    def logarithmic(self) -> FloatArray:
        """Relative change of a dot's quantity per relative change of a constant.

        The shape is (dots, quantities, constants); the entries of a constant that is zero are NaN.
        """
        return _relative(self.derivatives, self.values, self.dots)

    @property
    @derived("1", _IN_PARTS, "energy constant")
    def run_logarithmic(self) -> FloatArray:
        """Relative change of each energy of the run per relative change of a constant; NaN for zero energies.

        The shape is (energies, constants).
        """
        return _relative(self.run_derivatives, self.values, self.run)

    def spread(self, spreads: Mapping[str, float | str]) -> Spread:
        """Propagate relative spreads of the constants to the quantities of dots and run, to first order.

        Parameters
        ----------
        spreads : mapping
            Relative spread, such as 0.02 or "2 %", by name of a constant; all other constants are exact.

        Returns
        -------
        Spread
            Spread with standard deviations for independent constants, and worst cases.

        Raises
        ------
        InputError
            A name is not one of the constants, a constant is zero, or a spread is negative or not a number.
        """
        shares = np.zeros(len(self.constants))
        for name, number in spreads.items():
            if name not in self.constants:
                raise unknown(name, self.constants, "spreads")
            place = self.constants.index(name)
            shares[place] = read_number(number, "1", f"spreads: {name}")
            if shares[place] < 0.0:
                raise InputError.of(name, number, "a relative spread, 0 or more", file="spreads")
            if self.values[place] == 0.0:
                raise InputError(
                    f"spreads: {name} is zero", key="spreads", expected="a constant with a relative spread"
                )
        return Spread(
            sensitivities=self,
            spreads=shares,
            dots=np.abs(self.derivatives * self.values) * shares,
            run=np.abs(self.run_derivatives * self.values) * shares,
        )

    def notes(self) -> dict[str, Any]:
        """Return attributes of the Dataset: differentiability of the motion, and omitted constants."""
        return {"smooth": str(self.smooth), "left_out": "; ".join(self.left_out.values())}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables, with units and meanings of the quantities as coordinates."""
        known = {
            "quantity_unit": ("quantity", "SI unit of the quantity", self.quantities, DOT_QUANTITIES, 0),
            "quantity_meaning": ("quantity", "meaning of the quantity", self.quantities, DOT_QUANTITIES, 1),
            "energy_meaning": ("energy", "meaning of the energy", self.run_quantities, RUN_QUANTITIES, 1),
        }
        number = Column(
            "1", "number of the firing, from 0", ("dot",), "coordinate", name="dot", dtype=np.int32
        )
        return (
            super().entries()
            | {"dot": (number, np.arange(len(self.dots)))}
            | {
                name: (
                    Column("", meaning, (dim,), "coordinate", name=name),
                    [notes[quantity][place] for quantity in quantities],
                )
                for name, (dim, meaning, quantities, notes, place) in known.items()
            }
        )

    def summary(self) -> Summary:
        """Summarise the number of dots, the constants, and the status of the run."""
        struck = len(self.dots) - len(self.lost)
        rows = [
            ("dots", f"{struck} of {len(self.dots)} dots struck"),
            ("constants", ", ".join(self.constants)),
            ("status", self.status),
        ]
        return Summary([Facts(rows)])


class Spread(Result):
    """Spread of the dots due to tolerances of the constants, to first order."""

    sensitivities: Sensitivities = part("sensitivities from which the spread is computed", repr=False)
    spreads: FloatArray = column("1", "relative spread of a constant", "constant", name="spread")
    dots: FloatArray = column(
        "quantity_unit",
        "deviation caused by a single constant",
        "dot quantity constant",
        more="absolute value, per quantity of a dot",
        name="contribution",
    )
    run: FloatArray = part(
        "deviation of the energies of the run caused by a single constant, J", more="shape (4, n)", repr=False
    )

    @property
    def title(self) -> str:
        """Title of the table of deviations."""
        return f"spread of what {self.sensitivities.hammer.name} prints"

    @property
    @derived("quantity_unit", _INDEPENDENT, "dot quantity")
    def deviation(self) -> FloatArray:
        """Standard deviation of each quantity of each dot, in SI, if the constants are independent.

        The shape is (dots, quantities).
        """
        return np.asarray(np.sqrt((self.dots**2).sum(axis=-1)))

    @property
    @derived("quantity_unit", _WORST, "dot quantity")
    def worst(self) -> FloatArray:
        """Worst-case deviation of each quantity of each dot, in SI, with all constants at their limits.

        A limit is one relative spread away from the value. The shape is (dots, quantities).
        """
        return np.asarray(self.dots.sum(axis=-1))

    @property
    @derived("J", _INDEPENDENT, "energy")
    def run_deviation(self) -> FloatArray:
        """Standard deviation [J] of each energy of the run, if the constants are independent."""
        return np.asarray(np.sqrt((self.run**2).sum(axis=-1)))

    @property
    @derived("J", _WORST, "energy")
    def run_worst(self) -> FloatArray:
        """Worst-case deviation [J] of each energy of the run, with all constants at their limits.

        A limit is one relative spread away from the value.
        """
        return np.asarray(self.run.sum(axis=-1))

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the sensitivities."""
        return self.sensitivities.provenance

    def notes(self) -> dict[str, Any]:
        """Return attributes of the Dataset: duration of the run, and the notes of the sensitivities."""
        return {"duration": self.sensitivities.duration, **self.sensitivities.notes()}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: deviations, with values and coordinates of the sensitivities."""
        kept = self.sensitivities.entries()
        names = [name for name, (note, _) in kept.items() if note.kind == "coordinate"]
        return super().entries() | {name: kept[name] for name in (*names, "value", "run_value")}

    def plot(self, **options: Any) -> Figure:
        """Draw the sensitivities from which the spread is computed."""
        return self.sensitivities.plot(**options)


@checked
def sensitivities(
    hammer: Hammer,
    drive: Drive,
    *,
    constants: Sequence[str] | None = None,
    duration: float | str | None = None,
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
) -> Sensitivities:
    """Compute the sensitivities of flight time, force and energy to the constants of hammer and drive.

    Parameters
    ----------
    hammer, drive, duration
        As for `printhammer.simulate`.
    constants : sequence of str, optional
        Names such as "pack.stiffness", "waveform.width", "period", "rate" or "firing.1" (the second firing,
        since firings are counted from 0); by default all constants of hammer, pulse and firing times.
    state : tuple of float, optional
        Displacement [m] and velocity [m/s] at time 0, independent of the constants; by default the rest
        state, which depends on the constants.
    tolerance : float, optional
        Error allowed in one step of the run.

    Returns
    -------
    Sensitivities
        Sensitivities with a status; a run that ends early raises no exception.
    """
    check_tolerance(tolerance)
    wanted, left_out = _constants(hammer, drive, constants)
    end = end_of_run(hammer, drive, duration)
    problem = Problem(hammer, drive, initial_state(hammer, state), 0.0, tolerance)
    initial = np.zeros((3, len(wanted)))
    if state is None:
        initial = rest_columns(problem, wanted)
    elif problem.laws.circuit:
        initial = without_current(problem, wanted, initial)
    record = problem.run(end)
    motion = Motion(problem, record, end, np.array([0.0]), "default")
    scales = np.array([parameter.scale for parameter in wanted])
    energies = [name for name in RUN_QUANTITIES if name != "damping_loss" or hammer.is_damped]
    run = np.array([getattr(motion.energy, name) for name in energies])
    shape = (len(motion.dots), len(DOT_QUANTITIES))
    if motion.ok:
        changes = changes_of(motion, problem, record, wanted, initial)
        dot_changes, run_changes, smooth = (
            changes.dots / scales,
            changes.run[: len(energies)] / scales,
            changes.smooth,
        )
    else:
        dot_changes = np.full((*shape, len(wanted)), np.nan)
        run_changes = np.full((len(energies), len(wanted)), np.nan)
        smooth = False
    return Sensitivities(
        hammer=hammer,
        drive=drive,
        constants=tuple(parameter.name for parameter in wanted),
        units=tuple(parameter.unit for parameter in wanted),
        meanings=tuple(parameter.meaning for parameter in wanted),
        values=np.array([parameter.value for parameter in wanted]),
        quantities=tuple(DOT_QUANTITIES),
        dots=dot_values(motion),
        derivatives=dot_changes,
        run_quantities=tuple(energies),
        run=run,
        run_derivatives=run_changes,
        left_out=left_out,
        duration=motion.end,
        smooth=smooth,
        status=motion.status,
        tolerance=tolerance,
    )


def _constants(
    hammer: Hammer, drive: Drive, names: Sequence[str] | None
) -> tuple[list[Parameter], dict[str, str]]:
    """Return the constants to differentiate, and the reason for each constant that was omitted."""
    if names is not None:
        return parameters(hammer, drive, list(dict.fromkeys(names))), {}
    wanted: list[Parameter] = []
    left_out: dict[str, str] = {}
    for name in parameter_names(hammer, drive):
        try:
            wanted += parameters(hammer, drive, [name])
        except InputError as error:
            left_out[name] = str(error)
    return wanted, left_out


def _relative(derivatives: FloatArray, values: FloatArray, quantities: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithmic = derivatives * values / quantities[..., np.newaxis]
    return np.where((values != 0.0) & np.isfinite(logarithmic), logarithmic, np.nan)
