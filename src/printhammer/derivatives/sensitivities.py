"""Sensitivities: how flight time, force and energy change with every constant of the hammer and the pulse.

The derivatives come from the tangent flow of the constants along one run
(`printhammer.derivatives.constants`), not from differences of runs. The table that follows also tells how
tolerances of the constants show in what is printed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.derivatives.constants import rest_columns
from printhammer.derivatives.dots import DOT_QUANTITIES, RUN_QUANTITIES, changes_of, dot_values
from printhammer.derivatives.parameters import parameter_names, parameters
from printhammer.drive.input import read_number
from printhammer.errors import InputError
from printhammer.hammer.names import unknown
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem, check_tolerance
from printhammer.run.simulate import end_of_run
from printhammer.run.start import initial_state

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import xarray as xr

    from printhammer.derivatives.parameters import Parameter
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

TOLERANCE: Final = 1e-12
"""Tolerance of the run unless told otherwise."""


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of what a hammer prints with respect to its constants.

    Attributes
    ----------
    hammer : Hammer
        The hammer.
    drive : Drive
        The drive.
    constants : tuple of str
        Names of the n constants, as in `printhammer.derivatives.parameters`.
    units, meanings : tuple of str
        SI unit and meaning of each constant.
    values : array, shape (n,)
        Their values, SI.
    quantities : tuple of str
        Names of the q quantities of a dot: flight_time, impact_speed, peak_force, indentation, contact_time,
        loading_work, net_loss, return_time, return_speed.
    dots : array, shape (d, q)
        Their values for each firing, SI; NaN for a lost dot, and for what the run does not reach.
    derivatives : array, shape (d, q, n)
        d(quantity) / d(constant), SI.
    run_quantities : tuple of str
        Names of the quantities of the whole run: coil_work, drive_work, pack_loss, backstop_loss.
    run : array, shape (4,)
        Their values, J.
    run_derivatives : array, shape (4, n)
        d(quantity) / d(constant), SI, the end of the run staying where it is.
    left_out : dict of str
        Constants at whose value nothing is differentiable with them, and why.
    duration : float
        End of the run, s.
    smooth : bool
        False where the motion passes a touch without velocity: derivatives after it mean nothing.
    status : str
        How the run ended; the derivatives are NaN unless it is "ok".
    tolerance : float
        Tolerance of the integration.
    """

    hammer: Hammer
    drive: Drive
    constants: tuple[str, ...]
    units: tuple[str, ...] = field(repr=False)
    meanings: tuple[str, ...] = field(repr=False)
    values: FloatArray = field(repr=False)
    quantities: tuple[str, ...] = field(repr=False)
    dots: FloatArray = field(repr=False)
    derivatives: FloatArray = field(repr=False)
    run_quantities: tuple[str, ...] = field(repr=False)
    run: FloatArray = field(repr=False)
    run_derivatives: FloatArray = field(repr=False)
    left_out: Mapping[str, str] = field(repr=False)
    duration: float
    smooth: bool
    status: str
    tolerance: float

    @property
    def ok(self) -> bool:
        """Whether the run went as asked."""
        return self.status == "ok"

    @property
    def lost(self) -> tuple[int, ...]:
        """Numbers of the firings, from 0, whose dot is lost and has no sensitivities."""
        return tuple(int(k) for k in np.flatnonzero(np.isnan(self.dots[:, 0])))

    @property
    def logarithmic(self) -> FloatArray:
        """Relative change of a quantity of a dot per relative change of a constant, shape (d, q, n).

        NaN for a constant that is zero.
        """
        return _relative(self.derivatives, self.values, self.dots)

    @property
    def run_logarithmic(self) -> FloatArray:
        """The same for the energies of the run, shape (4, n); NaN for an energy that is zero."""
        return _relative(self.run_derivatives, self.values, self.run)

    def spread(self, spreads: Mapping[str, float | str]) -> Spread:
        """Return how relative spreads of constants show in the quantities, to first order.

        Parameters
        ----------
        spreads : mapping
            Relative spread, such as 0.02 or "2 %", by name of a constant; the others are exact.

        Returns
        -------
        Spread
            Standard deviations for independent constants, and the worst case.

        Raises
        ------
        InputError
            A name is not one of the constants, a constant is zero, or a spread is not a number from 0 on.
        """
        given = np.zeros(len(self.constants))
        for name, number in spreads.items():
            if name not in self.constants:
                raise unknown(name, self.constants, "spreads")
            place = self.constants.index(name)
            given[place] = read_number(number, "1", f"spreads: {name}")
            if given[place] < 0.0:
                raise InputError(f"spreads: {name} = {number!r}, expected a relative spread, 0 or more")
            if self.values[place] == 0.0:
                raise InputError(f"spreads: {name} is zero, expected a constant with a relative spread")
        return Spread(
            sensitivities=self,
            spreads=given,
            dots=np.abs(self.derivatives * self.values) * given,
            run=np.abs(self.run_derivatives * self.values) * given,
        )

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the table comes from: fingerprints, versions, tolerance."""
        import numba

        from printhammer import __version__

        return {
            "hammer": self.hammer.name,
            "hammer_fingerprint": self.hammer.fingerprint,
            "drive": repr(self.drive),
            "drive_fingerprint": self.drive.fingerprint,
            "duration": self.duration,
            "status": self.status,
            "smooth": str(self.smooth),
            "left_out": "; ".join(self.left_out.values()),
            "tolerance": repr(self.tolerance),
            "printhammer": __version__,
            "numpy": np.__version__,
            "numba": numba.__version__,
        }

    def to_dataset(self) -> xr.Dataset:
        """Return the table as a Dataset, with units and provenance in the attributes.

        Over `dot`, `quantity` and `constant`: `derivative` and `logarithmic`, and `value` of each quantity;
        over `energy` and `constant` the same of the whole run; `constant_value` over `constant`. Units
        differ along `quantity` and `constant` and stand beside them as coordinates.
        """
        from printhammer.derivatives.tables import sensitivity_dataset

        return sensitivity_dataset(self)

    def plot(self, **options: Any) -> Any:
        """Draw the largest sensitivities of one dot as bars; returns a matplotlib figure."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.chaos.sensitivity").plot(self, **options)

    def __repr__(self) -> str:
        struck = len(self.dots) - len(self.lost)
        return (
            f"<Sensitivities of {self.hammer.name}: {struck} of {len(self.dots)} dots struck,"
            f" {len(self.constants)} constants, {self.status}>"
        )


@dataclass(frozen=True)
class Spread:
    """How tolerances of constants show in what is printed, to first order.

    Attributes
    ----------
    sensitivities : Sensitivities
        What it follows from.
    spreads : array, shape (n,)
        Relative spread of each constant.
    dots : array, shape (d, q, n)
        What each constant contributes to the deviation of a quantity of a dot, SI, not negative.
    run : array, shape (4, n)
        The same of the quantities of the run, J.
    """

    sensitivities: Sensitivities
    spreads: FloatArray
    dots: FloatArray = field(repr=False)
    run: FloatArray = field(repr=False)

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of each quantity of each dot for independent constants, SI, shape (d, q)."""
        return np.asarray(np.sqrt((self.dots**2).sum(axis=-1)))

    @property
    def worst(self) -> FloatArray:
        """Deviation with all constants at their worst ends, SI, shape (d, q)."""
        return np.asarray(self.dots.sum(axis=-1))

    @property
    def run_deviation(self) -> FloatArray:
        """Standard deviation of each quantity of the run, J, shape (4,)."""
        return np.asarray(np.sqrt((self.run**2).sum(axis=-1)))

    @property
    def run_worst(self) -> FloatArray:
        """Deviation of the quantities of the run with all constants at their worst ends, J, shape (4,)."""
        return np.asarray(self.run.sum(axis=-1))

    def to_dataset(self) -> xr.Dataset:
        """Return deviations over `dot` and `quantity`, and over `energy`, with provenance."""
        from printhammer.derivatives.tables import spread_dataset

        return spread_dataset(self)


def sensitivities(
    hammer: Hammer,
    drive: Drive,
    *,
    constants: Sequence[str] | None = None,
    duration: float | str | None = None,
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
) -> Sensitivities:
    """Return how flight time, force and energy change with the constants of a hammer and its drive.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    drive : Drive
        The drive.
    constants : sequence of str, optional
        Names such as "pack.stiffness", "waveform.width", "period", "rate" or "firing.1" (the second firing;
        they are counted from 0); by default all of the hammer, of the pulse and of the firing times.
    duration : float or str, optional
        End of the run, s, or text with a unit; by default 4 ms after the last firing, and required for a
        drive that does not end.
    state : tuple of float, optional
        Displacement, m, and velocity, m/s, at time 0, which then do not change with the constants; by
        default the rest state, which does.
    tolerance : float, optional
        Error allowed in one step of the run.

    Returns
    -------
    Sensitivities
        With a status; a run that could not go on is no exception.

    Raises
    ------
    InputError
        An argument is not what is described above; a constant that was asked for by name is not known, or
        nothing is differentiable with it at its value, such as a rise time of zero.
    """
    check_tolerance(tolerance)
    wanted, left_out = _constants(hammer, drive, constants)
    end = end_of_run(drive, duration)
    problem = Problem(hammer, drive, initial_state(hammer, state), 0.0, tolerance)
    initial = np.zeros((3, len(wanted))) if state is not None else rest_columns(problem, wanted)
    record = problem.run(end)
    motion = Motion(problem, record, end, np.array([0.0]), "default")
    scales = np.array([parameter.scale for parameter in wanted])
    run = np.array([getattr(motion.energy, name) for name in RUN_QUANTITIES])
    shape = (len(motion.dots), len(DOT_QUANTITIES))
    if motion.ok:
        found = changes_of(motion, problem, record, wanted, initial)
        dot_changes, run_changes, smooth = found.dots / scales, found.run / scales, found.smooth
    else:
        dot_changes = np.full((*shape, len(wanted)), np.nan)
        run_changes = np.full((len(RUN_QUANTITIES), len(wanted)), np.nan)
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
        run_quantities=tuple(RUN_QUANTITIES),
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
    """Return the constants, and of those not asked for by name why some are left out."""
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
        found = derivatives * values / quantities[..., np.newaxis]
    return np.where((values != 0.0) & np.isfinite(found), found, np.nan)
