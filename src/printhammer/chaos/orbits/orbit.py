"""Periodic orbit, stable or not: states, multipliers, contacts and energies of one period."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from printhammer.chaos.orbits.newton import Closing
from printhammer.chaos.strobe.map import margin_of
from printhammer.derivatives.states import follow
from printhammer.results import Column, Result, Rows, column, derived, part
from printhammer.results.files import plain
from printhammer.results.result import named_codes
from printhammer.run.contacts import Contact, Dot
from printhammer.run.energy import Ledger
from printhammer.run.ensemble import MODE_NAMES
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    import pandas as pd

STABLE: Final = "stable"
SADDLE: Final = "saddle"
UNSTABLE: Final = "unstable"
UNDECIDED: Final = "undecided"
KINDS: Final = (STABLE, SADDLE, UNSTABLE, UNDECIDED)

NEUTRAL: Final = 1e-6
"""Distance of a multiplier from the unit circle within which stability is undecided; arbitrary."""

CLOSES: Final = 1e-6
"""Largest closing error of a valid orbit over a whole period, in half-widths of the strobe window.

If the larger multiplier exceeds 1 in absolute value, the limit is multiplied by that absolute value.
Arbitrary.
"""

_OK: Final = "ok"
_KIND: Final = Column(
    "1", "fate of small perturbations of the state", (), name="kind", dtype=np.int32, codes=KINDS
)
_ENERGIES: Final = {
    "coil_work": "work of the coil in one period of the orbit",
    "drive_work": "work of a force drive in one period of the orbit",
    "pack_loss": "energy absorbed by the pack in one period of the orbit",
    "backstop_loss": "energy absorbed by the backstop in one period of the orbit",
    "damping_loss": "energy dissipated by the armature's damping in one period of the orbit",
}
_SECTION: Final = (
    ("section_x", "m", "displacement at the section"),
    ("section_v", "m/s", "velocity at the section"),
)
_POINTS: Final = 2001  # Number of points of the motion's time grid; arbitrary


class Orbit(Result):
    """Periodic orbit of a hammer under a periodic drive, with its multipliers, contacts and dots.

    Its Floquet multipliers are the eigenvalues of the monodromy matrix, which is the derivative of the state
    after one period of the orbit with respect to the initial state.
    """

    regime: Regime = part("hammer, periodic drive, and phase of the section at which the orbit was found")
    firings: int = column(
        "1",
        "number of firings after which the motion repeats",
        "",
        more="the smallest such number",
        dtype=np.int32,
    )
    x: FloatArray = column("m", "displacement at the firing", "firing")
    v: FloatArray = column("m/s", "velocity at the firing", "firing")
    branch: IntArray = column(
        "1",
        "mode of motion at the firing",
        "firing",
        more="as an index of `printhammer.run.ensemble.MODE_NAMES`",
        dtype=np.int32,
        codes=MODE_NAMES,
    )
    memory: FloatArray = column(
        "m", "latest local maximum inside the pack", "firing", more="0 except on the unloading branch"
    )
    section: FloatArray = part(
        "displacement [m] and velocity [m/s] at the section", more="shape (2,)", repr=False
    )
    multipliers: npt.NDArray[np.complex128] = part(
        "Floquet multipliers, the larger absolute value first",
        more="shape (2,); nan where the motion has no derivative",
    )
    smooth: bool = column(
        "1",
        "whether the motion has a derivative",
        "",
        more="False if it passes a touch without velocity",
        dtype=np.int32,
    )
    residual: float = column(
        "1",
        "closing error after one period, in half-widths of the window",
        "",
        more="from one integration of the whole period",
    )
    contacts: Rows[Contact] = part(
        "all contacts that begin in one period of the orbit; times are measured from the first firing",
        repr=False,
    )
    dots: Rows[Dot] = part(
        "dot of each firing; times are measured from the first firing",
        more="empty under a continuous periodic force",
        repr=False,
    )
    energy: Ledger | None = part("energies in one period of the orbit, J", repr=False)
    margin: float = column(
        "1",
        "signed distance from a grazing, in units of the distance from backstop to pack",
        "",
        more="see `printhammer.chaos.strobe.map.Image`",
    )
    tolerance: float = part("tolerance of the integration")
    status: str = part(
        '"ok", or the reason why there is no such orbit', more="in that case all numbers are nan"
    )

    @property
    def title(self) -> str:
        """Title of the orbit: name of the orbit and of the hammer, and firing period."""
        return f"{self.name} of {self.regime.hammer.name}, every {self.regime.period:.9g} s"

    @property
    def ok(self) -> bool:
        """Whether the orbit exists, i.e. Newton's method converged."""
        return self.status == _OK

    @property
    @derived(
        "1", "phase of the section after the first firing, as a fraction of the drive period", kind="column"
    )
    def phase(self) -> float:
        """Phase of the section: time since the last firing, as a fraction of the drive period."""
        return self.regime.phase

    @property
    @derived("s", "time after which the motion repeats", kind="column")
    def period(self) -> float:
        """Period of the orbit, s: its number of firings times the drive period."""
        return self.firings * self.regime.period

    @property
    def kind(self) -> str:
        """Stability type of the orbit: "stable", "saddle", "unstable" or "undecided".

        Small perturbations of a stable orbit decay, perturbations of an unstable orbit grow; a saddle has a
        growing and a decaying direction. An orbit is undecided if a multiplier is within 1e-6 of the unit
        circle or the motion has no derivative.
        """
        sizes = np.abs(self.multipliers)
        if not np.isfinite(sizes).all() or (np.abs(sizes - 1.0) <= NEUTRAL).any():
            return UNDECIDED
        return (STABLE, SADDLE, UNSTABLE)[int(np.count_nonzero(sizes > 1.0))]

    @property
    def stable(self) -> bool:
        """Whether all small perturbations of the state decay."""
        return self.kind == STABLE

    @property
    @derived("1", "number of backstop contacts in one period of the orbit", kind="column", dtype=np.int32)
    def backstop_contacts(self) -> int:
        """Number of backstop contacts in one period of the orbit."""
        return sum(contact.surface == "backstop" for contact in self.contacts)

    @property
    @derived("1", "number of pack contacts in one period of the orbit", kind="column", dtype=np.int32)
    def pack_contacts(self) -> int:
        """Number of pack contacts in one period of the orbit."""
        return sum(contact.surface == "pack" for contact in self.contacts)

    @property
    @derived("1", "number of dots printed in one period", kind="column", dtype=np.int32)
    def printed(self) -> int:
        """Number of dots printed in one period of the orbit."""
        return sum(dot.struck for dot in self.dots)

    @property
    @derived("1", "number of firings in one period that print no dot", kind="column", dtype=np.int32)
    def lost(self) -> int:
        """Number of firings in one period of the orbit that print no dot."""
        return len(self.dots) - self.printed

    @property
    @derived("s", "time from the firing to the touch of the pack", "firing", name="flight_time")
    def flight_times(self) -> FloatArray:
        """Flight time of the dot of each firing, s; NaN for a lost dot."""
        return _numbers(dot.flight_time for dot in self.dots)

    @property
    @derived("N", "largest pack force of the dot", "firing", name="peak_force")
    def peak_forces(self) -> FloatArray:
        """Peak pack force of each dot, N; NaN for a lost dot."""
        return _numbers(dot.peak_force for dot in self.dots)

    @property
    def name(self) -> str:
        """Short name of the orbit, such as "period-2 saddle"."""
        return f"period-{self.firings} {self.kind}" if self.ok else f"no period-{self.firings} orbit"

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the orbit: fingerprint, drive, tolerance, versions."""
        return {**super().provenance, "period": self.regime.period}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: states along `firing`, multipliers, and scalars of the orbit."""
        own = super().entries()
        # Under a continuous periodic force there are firings but no dots.
        for name in ("flight_time", "peak_force"):
            note, values = own[name]
            own[name] = note, values if len(values) else np.full(self.firings, np.nan)
        own["kind"] = _KIND, KINDS.index(self.kind)
        for name, meaning in _ENERGIES.items():
            value = math.nan if self.energy is None else float(getattr(self.energy, name))
            own[name] = Column("J", meaning, (), name=name), value
        for place, (name, unit, meaning) in enumerate(_SECTION):
            own[name] = Column(unit, meaning, (), name=name), float(self.section[place])
        for name in ("real", "imag"):
            note = Column("1", f"{name} part of the multipliers", ("multiplier",), name=f"multiplier_{name}")
            own[note.name] = note, getattr(self.multipliers, name)
        for name, count in (("firing", self.firings), ("multiplier", 2)):
            note = Column("1", f"number of the {name}", (name,), "coordinate", name=name, dtype=np.int32)
            own[name] = note, np.arange(count)
        return own

    def to_dataframe(self) -> pd.DataFrame:
        """Convert the orbit to a table with one row per firing; values of the whole orbit are repeated."""
        return orbits_table([self], self.attributes)

    def motion(self) -> Motion:
        """Integrate one period of the orbit from its state at the section; return the `Motion`.

        The motion begins `phase` periods after a firing of an ongoing train; its start time is therefore not
        0.

        Raises
        ------
        ValueError
            The search found no orbit.
        """
        if not self.ok:
            raise ValueError(f"there is no such orbit: {self.status}")
        return _Run(self.regime, self.section, self.firings, self.tolerance).motion


def no_orbit(regime: Regime, firings: int, tolerance: float, status: str) -> Orbit:
    """Build the result for an orbit that was not found; `status` is the reason."""
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
        contacts=Rows((), Contact),
        dots=Rows((), Dot),
        energy=None,
        margin=math.nan,
        tolerance=tolerance,
        status=status,
    )


def orbit_of(regime: Regime, closing: Closing, tolerance: float) -> Orbit:
    """Compute the properties of the orbit to which Newton's method converged.

    If Newton's method failed, the status of the result is the reason.
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
    # The residual of multiple shooting grows along the orbit.
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
    """Compute the two eigenvalues of a product of m matrices, shape (m, 2, 2); the last is leftmost.

    The eigenvalues are computed from the trace and the determinant of the product. The determinant is the
    product of the determinants of the factors: rounding in the matrix product would destroy the small
    eigenvalue of a strong contraction.
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
    """Run from a section over several drive periods; pulses fired before the section may still be active."""

    def __init__(self, regime: Regime, start: FloatArray, periods: int, tolerance: float) -> None:
        self.regime, self.periods = regime, periods
        self.train, self.fired_at = regime.train(periods)
        self.sections = regime.moments(self.train, periods)
        state = (float(start[0]), float(start[1]))
        self.problem = Problem(regime.hammer, self.train, state, float(self.sections[0]), tolerance)
        self.record = self.problem.run(float(self.sections[-1]))

    @property
    def motion(self) -> Motion:
        """Motion along the orbit, sampled on a uniform time grid."""
        end = float(self.sections[-1])
        times = np.linspace(float(self.sections[0]), float(self.record.nodes[-1, 0]), _POINTS)
        return Motion(self.problem, self.record, end, times, "default")

    def at_firings(self) -> FloatArray:
        """Return displacement [m], velocity [m/s], mode and memory [m] at each firing, one row per firing.

        The first row belongs to the last firing at or before the section.
        """
        firings = self.regime.moments(self.train, self.periods, 0.0)
        marks = firings[:-1] if self.regime.phase == 0.0 else firings[1:]
        marks = np.concatenate([self.sections[:1], marks])
        states = follow(self.problem, marks, np.eye(3), renormalise=False).states[1:]
        return states if self.regime.phase == 0.0 else np.roll(states, 1, axis=0)


def _contacts_and_dots(
    regime: Regime, start: FloatArray, firings: int, tolerance: float
) -> tuple[Rows[Contact], Rows[Dot]]:
    """Compute the contacts and dots that begin in one period of an orbit, each followed to its end.

    `start` is the state of the orbit at the section.
    """
    skipped = 0 if regime.phase == 0.0 or regime.drive is not None else 1
    run = _Run(regime, start, firings + skipped + 1, tolerance)
    motion, period = run.motion, firings * regime.period
    # Under a continuous periodic force no firing marks the period; it begins at the section.
    begin = run.fired_at + skipped * regime.period if regime.drive is None else float(run.sections[0])
    before = regime.memory
    contacts = []
    for contact in motion.contacts:
        if contact.initial or not begin <= contact.t_in < begin + period:
            continue
        back = run.fired_at + (period if contact.t_in - run.fired_at >= period else 0.0)
        fired = contact.firing if regime.drive is None else None
        contacts.append(
            replace(
                contact,
                t_in=contact.t_in - back,
                t_out=None if contact.t_out is None else contact.t_out - back,
                t_peak=contact.t_peak - back,
                firing=None if fired is None else (fired - before) % firings,
            )
        )
    contacts.sort(key=lambda contact: contact.t_in)
    if regime.drive is not None:
        return Rows(contacts, Contact), Rows((), Dot)
    fired_dots = motion.dots[before + skipped : before + skipped + firings]
    dots = [
        replace(dot, index=k, fired_at=k * regime.period)
        for k, dot in enumerate([*fired_dots[firings - skipped :], *fired_dots[: firings - skipped]])
    ]
    return Rows(contacts, Contact), Rows(dots, Dot)


def _numbers(values: Iterable[float | None]) -> FloatArray:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)


def orbits_table(orbits: Sequence[Orbit], attributes: Mapping[str, Any]) -> pd.DataFrame:
    """Tabulate orbits, one row per firing of each orbit."""
    import pandas as pd

    tables = []
    for number, orbit in enumerate(orbits):
        columns: dict[str, Any] = {"orbit": np.full(orbit.firings, number)}
        entries = orbit.entries()
        for name, (note, value) in entries.items():
            if not note.dims:
                named = note.codes[value] if note.codes else note.dtype(value) if note.dtype else value
                columns[note.heading(name)] = np.full(orbit.firings, named)
        for k, multiplier in enumerate(orbit.multipliers.tolist()):
            columns[f"multiplier_real {k + 1}"] = np.full(orbit.firings, multiplier.real)
            columns[f"multiplier_imag {k + 1}"] = np.full(orbit.firings, multiplier.imag)
        columns["firing"] = entries["firing"][1]
        for name, (note, values) in entries.items():
            if note.dims == ("firing",) and note.kind == "column":
                columns[note.heading(name)] = named_codes(values, note)
        tables.append(pd.DataFrame(columns))
    table = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=["orbit", "firing"])
    table.attrs.update(plain(dict(attributes)))
    return table
