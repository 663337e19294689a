"""Branch: a curve of periodic orbits along one constant, with what each does and what happens on the way."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, SupportsIndex

import numpy as np

from printhammer.chaos.continuation.branch_points import BIRTH
from printhammer.drive.input import read_count
from printhammer.errors import InputError

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

    from printhammer.chaos.continuation.arclength import Curve, Stop
    from printhammer.chaos.continuation.events import BranchEvent
    from printhammer.chaos.orbits.orbit import Orbit
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray

MOST: Final = 1000
"""Number of steps in either direction unless told otherwise."""

_DIGITS: Final = ".9g"


@dataclass(frozen=True, eq=False)
class Branch:
    """A curve of periodic orbits along one constant.

    Every array has one row for each of N orbits, in order along the curve; their values need not ascend.

    Attributes
    ----------
    regime : Regime
        Hammer and periodic drive at the start, and phase of the section.
    parameter : str
        The constant: "period", "rate", or the dotted key of one of the hammer, the waveform or the drive.
    unit : str
        Its SI unit.
    bounds : tuple of float
        Values between which the branch was followed.
    firings : int
        Number of firings after which the orbits repeat.
    tolerance : float
        Of the integration.
    values : array, shape (N,)
        Of the constant, SI.
    x, v : array, shape (N, firings)
        Displacement, m, and velocity, m/s, at the sections.
    multipliers : complex array, shape (N, 2)
        Of the whole period of the orbit, the larger absolute value first.
    backstop_contacts, pack_contacts, printed, lost : int array, shape (N,)
        Contacts in a period of the orbit; firings with and without a dot.
    flight_time, impact_speed, peak_force : array, shape (N, firings)
        Of the dot of each firing, s, m/s, N; NaN for a lost one.
    coil_work, drive_work, pack_loss, backstop_loss : array, shape (N,)
        Energies of a period of the orbit, J.
    residual : array, shape (N,)
        Distance of the state from itself after a period, in half-widths of the window.
    contacts : tuple of str
        Sequence of the contacts of each orbit, P for the pack and B for the backstop.
    events : tuple of BranchEvent
        Folds, period doublings, Neimark-Sacker points, branchings and grazings, in order along the curve.
    stops : tuple of Stop
        Why and where the branch ends before its first and after its last orbit. Reasons: "bound"; "closed";
        "period doubling": the orbit is born there; "grazing" of a rigid backstop; "merged" with an orbit of
        fewer firings; "no value": a run does not come through; "lost": Newton's method does not converge;
        "length": the steps are used up.
    curve : Curve
        The same in the variables of `printhammer.chaos.continuation.arclength`.
    """

    regime: Regime
    parameter: str
    unit: str
    bounds: tuple[float, float]
    firings: int
    tolerance: float
    values: FloatArray = field(repr=False)
    x: FloatArray = field(repr=False)
    v: FloatArray = field(repr=False)
    multipliers: npt.NDArray[np.complex128] = field(repr=False)
    backstop_contacts: npt.NDArray[np.int64] = field(repr=False)
    pack_contacts: npt.NDArray[np.int64] = field(repr=False)
    printed: npt.NDArray[np.int64] = field(repr=False)
    lost: npt.NDArray[np.int64] = field(repr=False)
    flight_time: FloatArray = field(repr=False)
    impact_speed: FloatArray = field(repr=False)
    peak_force: FloatArray = field(repr=False)
    coil_work: FloatArray = field(repr=False)
    drive_work: FloatArray = field(repr=False)
    pack_loss: FloatArray = field(repr=False)
    backstop_loss: FloatArray = field(repr=False)
    residual: FloatArray = field(repr=False)
    contacts: tuple[str, ...] = field(repr=False)
    events: tuple[BranchEvent, ...] = field(repr=False)
    stops: tuple[Stop, Stop] = field(repr=False)
    curve: Curve = field(repr=False)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def phase(self) -> float:
        """Part of the period between a firing and the section."""
        return self.regime.phase

    @property
    def stable(self) -> npt.NDArray[np.bool_]:
        """Whether all small changes of the state die out, shape (N,).

        Where the branch is born in a period doubling, as of the orbit beside it: a multiplier is 1 there.
        """
        found = np.asarray(np.abs(self.multipliers[:, 0]) < 1.0)
        for end, beside, stop in ((0, 1, self.stops[0]), (-1, -2, self.stops[1])):
            if stop.reason == BIRTH and len(found) > 1:
                found[end] = found[beside]
        return found

    @property
    def closed(self) -> bool:
        """Whether the branch is an island: a closed loop, joined to nothing; its ends are one orbit."""
        return self.curve.closed

    @property
    def stable_ranges(self) -> list[tuple[float, float]]:
        """Ranges of the constant over which the orbits are stable, ascending."""
        from printhammer.chaos.continuation.events import stable_ranges

        return stable_ranges(self)

    @property
    def message(self) -> str:
        """What the branch is, and why it ends at either end, in one line."""
        low, high = float(self.values.min()), float(self.values.max())
        span = f"{self.parameter} from {low:{_DIGITS}} to {high:{_DIGITS}} {self.unit}"
        what = f"period-{self.firings} branch of {len(self)} orbits, {span}"
        if self.closed:
            return f"{what}: a closed loop"
        first, last = (stop.sentence for stop in self.stops)
        return f"{what}; at its first orbit {first}; at its last orbit {last}"

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the branch comes from: fingerprints, versions, tolerance, and how it ends."""
        from printhammer.chaos.orbits.tables import provenance_of

        return {
            **provenance_of(self.regime, self.tolerance),
            "parameter": self.parameter,
            "bounds": list(self.bounds),
            "firings": self.firings,
            "phase": self.phase,
            "closed": "yes" if self.closed else "no",
            "first_end": self.stops[0].sentence,
            "last_end": self.stops[1].sentence,
        }

    def orbit(self, number: int) -> Orbit:
        """Return all about one of the orbits, closed anew at its value of the constant.

        Parameters
        ----------
        number : int
            Its place along the branch.
        """
        from printhammer.chaos.orbits.search import orbit

        regime = self.regime.with_(self.parameter, float(self.values[number]))
        state = self.curve.nodes[number].state
        return orbit(regime, state, firings=self.firings, tolerance=self.tolerance)

    def doubled(
        self, event: BranchEvent, *, most: SupportsIndex = MOST, threads: int | None = None
    ) -> Branch:
        """Return the branch of twice the period that is born at one of the period doublings.

        Parameters
        ----------
        event : BranchEvent
            A period doubling of this branch.
        most : int, optional
            Number of steps.
        threads : int, optional
            By default as many as there are cores.

        Raises
        ------
        InputError
            The event is none of this branch's period doublings, or no orbit of twice the period is near.
        """
        if event.kind != "period doubling" or event not in self.events:
            raise InputError(f"event = {event.kind!r}, expected a period doubling of this branch")
        from printhammer.chaos.continuation.tracer import Tracer

        work = Tracer(self.regime, self.parameter, self.bounds, self.tolerance, threads)
        return work.doubled(self.firings, event, read_count(most, "most"))

    def to_dataset(self) -> xr.Dataset:
        """Return the branch as a Dataset over `orbit`, with units and provenance in the attributes."""
        from printhammer.chaos.continuation.tables import branch_dataset

        return branch_dataset(self)

    def plot(self, **options: Any) -> Any:
        """Draw the branch against its constant; returns a matplotlib figure."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.chaos.continuation").plot(self, **options)
