"""Orbit: a motion that repeats after some firings, stable or not, and what it does in a period."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.chaos.strobe.map import margin_of
from printhammer.derivatives.states import follow
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy.typing as npt
    import xarray as xr

    from printhammer.chaos.orbits.newton import Closing
    from printhammer.run.contacts import Contact, Dot
    from printhammer.run.ledger import Ledger
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray

STABLE: Final = "stable"
SADDLE: Final = "saddle"
UNSTABLE: Final = "unstable"
UNDECIDED: Final = "undecided"
KINDS: Final = (STABLE, SADDLE, UNSTABLE, UNDECIDED)

NEUTRAL: Final = 1e-6
"""Distance of the absolute value of a multiplier from 1 within which it does not tell."""

CLOSES: Final = 1e-6
"""Largest distance from itself after a whole period, in half-widths of the window and units of the larger
multiplier if that is more than 1, with which an orbit counts as one."""

_OK: Final = "ok"
_POINTS: Final = 2001


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion of a hammer under a periodic drive.

    Attributes
    ----------
    regime : Regime
        Hammer and periodic drive, and phase of the section at which the orbit was found.
    firings : int
        Number of firings after which the motion repeats, and no smaller number.
    x, v : array, shape (firings,)
        Displacement, m, and velocity, m/s, at the firings.
    branch : int array, shape (firings,)
        Code of the mode of motion there, a place in `printhammer.run.ensemble.MODE_NAMES`.
    memory : array, shape (firings,)
        Displacement of the latest local maximum, m, on the unloading branch inside the pack; else 0.
    section : array, shape (2,)
        Displacement, m, and velocity, m/s, there.
    multipliers : complex array, shape (2,)
        Eigenvalues of the derivative of the state after a period of the orbit with respect to that before
        it, the larger absolute value first. NaN where the motion has no derivative.
    smooth : bool
        False where the motion passes a touch without velocity.
    residual : float
        Distance of the state from itself after one period, re-integrated as a whole, in half-widths of the
        window.
    contacts : tuple of Contact
        All contacts that begin in one period of the orbit; times from its first firing on.
    dots : tuple of Dot
        What each firing did on the paper, times from the first firing on; empty under an endless force.
    energy : Ledger
        Energies of one period of the orbit, J.
    margin : float
        Signed nearness of a grazing, see `printhammer.chaos.strobe.map.Image`.
    tolerance : float
        Of the integration.
    status : str
        "ok", or why there is no such orbit: all numbers are NaN then.
    """

    regime: Regime
    firings: int
    x: FloatArray
    v: FloatArray
    branch: npt.NDArray[np.int64] = field(repr=False)
    memory: FloatArray = field(repr=False)
    section: FloatArray = field(repr=False)
    multipliers: npt.NDArray[np.complex128]
    smooth: bool
    residual: float
    contacts: tuple[Contact, ...] = field(repr=False)
    dots: tuple[Dot, ...] = field(repr=False)
    energy: Ledger | None = field(repr=False)
    margin: float
    tolerance: float
    status: str

    @property
    def ok(self) -> bool:
        """Whether there is such an orbit."""
        return self.status == _OK

    @property
    def phase(self) -> float:
        """Part of the period of the drive from the first of the firings to the section."""
        return self.regime.phase

    @property
    def period(self) -> float:
        """Time after which the motion repeats, s."""
        return self.firings * self.regime.period

    @property
    def kind(self) -> str:
        """What becomes of small changes of the state.

        "stable": all die out; "saddle": some grow and others die out; "unstable": all grow; "undecided": a
        multiplier lies within 1e-6 of the unit circle, or the motion has no derivative.
        """
        sizes = np.abs(self.multipliers)
        if not np.isfinite(sizes).all() or (np.abs(sizes - 1.0) <= NEUTRAL).any():
            return UNDECIDED
        return (STABLE, SADDLE, UNSTABLE)[int(np.count_nonzero(sizes > 1.0))]

    @property
    def stable(self) -> bool:
        """Whether all small changes of the state die out."""
        return self.kind == STABLE

    @property
    def backstop_contacts(self) -> int:
        """Number of backstop contacts in a period of the orbit."""
        return sum(contact.surface == "backstop" for contact in self.contacts)

    @property
    def pack_contacts(self) -> int:
        """Number of pack contacts in a period of the orbit."""
        return sum(contact.surface == "pack" for contact in self.contacts)

    @property
    def printed(self) -> int:
        """Number of dots that the firings of a period make."""
        return sum(dot.struck for dot in self.dots)

    @property
    def lost(self) -> int:
        """Number of firings of a period that make no dot."""
        return len(self.dots) - self.printed

    @property
    def flight_times(self) -> FloatArray:
        """Time from each firing to its dot, s; NaN for a lost one."""
        return _numbers(dot.flight_time for dot in self.dots)

    @property
    def peak_forces(self) -> FloatArray:
        """Largest pack force of each dot, N; NaN for a lost one."""
        return _numbers(dot.peak_force for dot in self.dots)

    @property
    def name(self) -> str:
        """What it is in a few words, such as "period-2 saddle"."""
        return f"period-{self.firings} {self.kind}" if self.ok else f"no period-{self.firings} orbit"

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the orbit comes from: fingerprints, versions, tolerance."""
        from printhammer.chaos.orbits.tables import provenance_of

        return {**provenance_of(self.regime, self.tolerance), "status": self.status}

    def motion(self) -> Motion:
        """Return one period of the orbit, re-integrated from its section.

        It begins `phase` periods after a firing of a train that has fired before, so not at time 0.

        Raises
        ------
        ValueError
            There is no such orbit.
        """
        if not self.ok:
            raise ValueError(f"there is no such orbit: {self.status}")
        return _Run(self.regime, self.section, self.firings, self.tolerance).motion

    def to_dataset(self) -> xr.Dataset:
        """Return the orbit as a Dataset over its firings, with units and provenance in the attributes."""
        from printhammer.chaos.orbits.tables import orbit_dataset

        return orbit_dataset(self)

    def plot(self, **options: Any) -> Any:
        """Draw the orbit in the plane of displacement and velocity and against time; a matplotlib figure."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.chaos.orbits").plot_orbit(self, **options)


def no_orbit(regime: Regime, firings: int, tolerance: float, status: str) -> Orbit:
    """Return an orbit that there is none of, and why."""
    none = np.full(firings, np.nan)
    return Orbit(
        regime=regime,
        firings=firings,
        x=none,
        v=none.copy(),
        branch=np.full(firings, -1),
        memory=none.copy(),
        section=np.full(2, np.nan),
        multipliers=np.full(2, complex(math.nan, math.nan)),
        smooth=False,
        residual=math.nan,
        contacts=(),
        dots=(),
        energy=None,
        margin=math.nan,
        tolerance=tolerance,
        status=status,
    )


def orbit_of(regime: Regime, closing: Closing, tolerance: float) -> Orbit:
    """Return all about an orbit that Newton's method has closed.

    Parameters
    ----------
    regime : Regime
        Hammer, periodic drive and phase of the section.
    closing : Closing
        The orbit.
    tolerance : float
        Of the integration.
    """
    firings = int(closing.firings.sum())
    if not closing.closed:
        return no_orbit(regime, firings, tolerance, closing.reason)
    first = int(np.lexsort((closing.states[:, 1], closing.states[:, 0]))[0])
    start = closing.states[first]
    run = _Run(regime, start, firings, tolerance)
    if run.record.status_name != _OK:
        return no_orbit(regime, firings, tolerance, run.record.status_name)
    returned = run.record.nodes[-1, 1:3]
    residual = float(np.abs((returned - start) / regime.window.half_widths).max())
    jacobians = np.roll(closing.jacobians, -first, axis=0)
    multipliers = multipliers_of(jacobians)
    # What Newton's method left open grows on the way round.
    if not residual <= CLOSES * max(1.0, abs(multipliers[0])):
        return no_orbit(regime, firings, tolerance, "does not close when re-integrated as a whole")
    states = run.at_firings()
    contacts, dots = _contacts_and_dots(regime, start, firings, tolerance)
    none = np.full(2, complex(math.nan, math.nan))
    return Orbit(
        regime=regime,
        firings=firings,
        x=states[:, 0].copy(),
        v=states[:, 1].copy(),
        branch=states[:, 2].astype(np.int64),
        memory=states[:, 3].copy(),
        section=start.copy(),
        multipliers=multipliers if closing.smooth else none,
        smooth=closing.smooth,
        residual=residual,
        contacts=contacts,
        dots=dots,
        energy=run.motion.energy,
        margin=margin_of(run.problem, run.record),
        tolerance=tolerance,
        status=_OK,
    )


def multipliers_of(jacobians: FloatArray) -> npt.NDArray[np.complex128]:
    """Return the eigenvalues of a product of matrices, shape (m, 2, 2), the last one on the left.

    From trace and determinant, the latter from those of the factors: the small eigenvalue of a strong
    contraction would drown in the rounding of the product.
    """
    product = np.eye(2)
    for factor in jacobians:
        product = factor @ product
    determinant = float(np.prod(np.linalg.det(jacobians)))
    half = 0.5 * float(np.trace(product))
    inside = half * half - determinant
    if inside < 0.0:
        root = math.sqrt(-inside)
        return np.array([complex(half, root), complex(half, -root)])
    large = half + math.copysign(math.sqrt(inside), half)
    return np.array([large, determinant / large if large else 0.0], np.complex128)


class _Run:
    """Some periods of the drive from a section on, in a train that has fired before."""

    def __init__(self, regime: Regime, start: FloatArray, periods: int, tolerance: float) -> None:
        self.regime, self.periods = regime, periods
        self.train, self.fired_at = regime.train(periods)
        self.sections = regime.moments(self.train, periods)
        state = (float(start[0]), float(start[1]))
        self.problem = Problem(regime.hammer, self.train, state, float(self.sections[0]), tolerance)
        self.record = self.problem.run(float(self.sections[-1]))

    @property
    def motion(self) -> Motion:
        """The motion, on a grid of its own."""
        end = float(self.sections[-1])
        times = np.linspace(float(self.sections[0]), float(self.record.nodes[-1, 0]), _POINTS)
        return Motion(self.problem, self.record, end, times, "default")

    def at_firings(self) -> FloatArray:
        """Return displacement, velocity, mode and memory at as many firings as there are periods.

        The first of them is that before the section, or at it.
        """
        firings = self.regime.moments(self.train, self.periods, 0.0)
        marks = firings[:-1] if self.regime.phase == 0.0 else firings[1:]
        marks = np.concatenate([self.sections[:1], marks])
        found = follow(self.problem, marks, np.eye(3), renormalise=False).states[1:]
        return found if self.regime.phase == 0.0 else np.roll(found, 1, axis=0)


def _contacts_and_dots(
    regime: Regime, start: FloatArray, firings: int, tolerance: float
) -> tuple[tuple[Contact, ...], tuple[Dot, ...]]:
    """Return what begins in one period of an orbit; its run goes on until all of that has ended."""
    skipped = 0 if regime.phase == 0.0 or regime.drive is not None else 1
    run = _Run(regime, start, firings + skipped + 1, tolerance)
    motion, period = run.motion, firings * regime.period
    # Under an endless force there is no firing to begin with, and the period begins at the section.
    begin = run.fired_at + skipped * regime.period if regime.drive is None else float(run.sections[0])
    before = regime.memory
    contacts = []
    for contact in motion.contacts:
        if contact.initial or not begin <= contact.t_in < begin + period:
            continue
        back = run.fired_at + (period if contact.t_in - run.fired_at >= period else 0.0)
        fired = None if contact.firing is None else (contact.firing - before) % firings
        contacts.append(_earlier(contact, back, fired if regime.drive is None else None))
    contacts.sort(key=lambda contact: contact.t_in)
    if regime.drive is not None:
        return tuple(contacts), ()
    found = motion.dots[before + skipped : before + skipped + firings]
    dots = [
        replace(dot, index=k, fired_at=k * regime.period)
        for k, dot in enumerate([*found[firings - skipped :], *found[: firings - skipped]])
    ]
    return tuple(contacts), tuple(dots)


def _earlier(contact: Contact, back: float, firing: int | None) -> Contact:
    """Return a contact with times on another axis."""
    return replace(
        contact,
        t_in=contact.t_in - back,
        t_out=None if contact.t_out is None else contact.t_out - back,
        t_peak=contact.t_peak - back,
        firing=firing,
    )


def _numbers(values: Iterable[float | None]) -> FloatArray:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)
