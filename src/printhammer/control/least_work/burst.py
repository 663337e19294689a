"""Bursts of least coil work: the swing drive of the discussion in Hendriks (1983).

"More energy might have to be expended in the first dot, but subsequent dots would be printed by keeping the
actuator moving as in a parametric oscillator (swing). In the limit, the only energy to be expended should be
the energy absorbed by the ribbon/paper pack."

The burst is planned slot by slot, each from the final state of the preceding slot (a greedy optimisation, not
a joint one over all slots): the coil brakes the armature on its return from the paper, keeps it away from the
backstop, and throws it again, so that the dot has the requested force at the requested time. After the last
dot the coil lands the armature on the backstop.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, SupportsIndex, Unpack, get_args

import numpy as np
import numpy.typing as npt

from printhammer.control.least_work.bound import Bound, bound
from printhammer.control.least_work.pulses import PulsePlan
from printhammer.control.least_work.search import LANDING, LEAD, NodePlan
from printhammer.control.least_work.slot import CoilForce, Task
from printhammer.control.pulses import current_bound, steepest_rise
from printhammer.drive.input import read_count, read_number, read_positive
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import Sampled, Waveform
from printhammer.errors import InputError, PrinthammerError
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.nominal import Nominal, nominal, pulse_of
from printhammer.printing.dots.settling import settled_from
from printhammer.results import Declared, Result, Rows, part, scalar
from printhammer.results.declare import Column
from printhammer.results.files import frame, plain
from printhammer.results.provenance import provenance
from printhammer.results.result import Entries
from printhammer.results.summary import (
    Cells,
    Facts,
    Grid,
    Summary,
    quantity,
    styled,
)
from printhammer.run.contacts import Contact
from printhammer.run.effort import Effort, InOneThread, computation
from printhammer.run.energy import CoilWork, Ledger, coil_power, stored_energy
from printhammer.run.ensemble import Ensemble
from printhammer.run.motion import Motion
from printhammer.run.problem import TOLERANCE
from printhammer.run.simulate import simulate
from printhammer.support.arrays import FloatArray, IntArray, TextArray
from printhammer.units import from_si

if TYPE_CHECKING:
    import pandas as pd

FORCE: Final = 0.9  # Default required force of a dot, relative to the single pulse; arbitrary
SPACING: Final = 0.6
"""Default time between the nodes of the current, as a fraction of the duration of the indentation by a single
pulse; rounded to a whole fraction of the period. Arbitrary."""

MOST_DOTS: Final = 1000  # Largest number of dots in a burst; arbitrary
Least = Literal["positive work", "heat"]
# Objective: the positive work of the coil, or its heat, which is proportional to the squared current
LEASTS: Final = get_args(Least)
# Default relative changes of the current in `LeastWork.under_supply`; arbitrary
SUPPLY: Final = (-0.03, -0.01, -0.003, -0.001, 0.0, 0.001, 0.003, 0.01, 0.03)
Shape = Literal["free", "pulses"]
# Allowed currents: any current within the limits, or the hammer's pulses with free times and widths
SHAPES: Final = get_args(Shape)
# Time from the touch to the end of a slot, as a fraction of the duration of the indentation by a single
# pulse; arbitrary
_PAST_PEAK: Final = 1.2
_SPARE: Final = 5e-4  # Relative margin on the force of a planned dot; arbitrary
# Energy above rest below which a hammer counts as at rest, as a fraction of the pack loss of a dot; arbitrary
_SETTLED: Final = 1e-2


class NoBurstError(PrinthammerError):
    """Raised when the search finds no current within the limits that prints the burst."""


class SupplyCheck(Declared):
    """Dots of a burst with all currents scaled by 1 + c: arrays with one element per value of c."""

    changes: FloatArray = part("relative change of every current: 0.03 for 3 % more")
    adequate: IntArray = part(
        "number of dots in their slots with the requested force and without extra contacts"
    )
    weakest: FloatArray = part("force of the weakest dot, relative to the single pulse; 0 if a dot is lost")
    spread: FloatArray = part("largest deviation of a touch from its slot, s; NaN if a dot is lost")
    status: TextArray = part("status of each simulation")

    def summary(self, count: int) -> Summary:
        """Tabulate the dots of a burst of `count` dots, one row per relative change of the currents."""
        columns = [
            Cells("current", [f"{100.0 * change:+.1f} %" for change in self.changes]),
            Cells("adequate dots", [f"{adequate} of {count}" for adequate in self.adequate]),
            Cells("weakest force", self.weakest, "", ".3f"),
            Cells("late by", self.spread, "s"),
        ]
        return Summary([Grid(columns)])


class LeastWork(Result, rows="node"):
    """A burst of dots with the requested force, printed with the least coil work, from rest to rest.

    The Dataset contains motion and power against time, and the pack contacts; the data frame contains the
    nodes of the current. Saved as CSV, the nodes are a sampled waveform
    (`printhammer.drive.waveforms.shapes.Sampled`), which, fired once, reproduces the drive of the burst.
    """

    hammer: Hammer = part("driven hammer")
    drive: PulseSequence = part("optimised current, fired slot by slot", repr=False)
    motion: Motion = part(
        "motion of the whole burst, at the tolerance of the ledger, until the hammer has settled",
        repr=False,
    )
    rate: float = scalar("Hz", "dot rate")
    count: int = part("requested number of dots")
    force: float = scalar("1", "requested force, relative to the single pulse", name="least_force")
    largest: float = scalar("A", "largest absolute value of the current", name="largest_current")
    slew: float = scalar(
        "A/s", "largest absolute slope of the current", name="largest_slew", more="does not apply to pulses"
    )
    least: Least = scalar("", "objective of the optimisation", more="see `LEASTS`")
    shape: Shape = scalar("", "kind of current allowed", more="see `SHAPES`")
    slots: FloatArray = part("requested touch times of the dots, s", repr=False)
    single: Nominal = part("single-pulse dot", repr=False)
    single_work: CoilWork = part("coil work of one single pulse, from rest to rest", repr=False)
    bound: Bound = part("lower bounds on the positive work, for any current")
    tolerance: float = part("error tolerance per integration step of the search")

    @property
    def nodes(self) -> tuple[list[float], list[float]]:
        """Times [s] and currents [A] of the nodes of the piecewise linear current."""
        if self.shape != "free":
            raise InputError(
                f"shape = {self.shape!r}: the current has no nodes",
                key="shape",
                value=self.shape,
                expected="a free one",
            )
        times, values = [0.0], [0.0]
        for at, waveform in zip(self.drive.times.tolist(), self.drive.waveforms, strict=True):
            assert isinstance(waveform, Sampled)
            # The last sample only extends the previous one until the next firing replaces it.
            times += [at + offset for offset in waveform.times[1:-1].tolist()]
            values += waveform.values[1:-1].tolist()
        return times, values

    @property
    def contacts(self) -> Rows[Contact]:
        """Pack contacts of the burst, in order of touch."""
        touched = (contact for contact in self.motion.contacts if contact.surface == "pack")
        return Rows(touched, Contact)

    @property
    def forces(self) -> FloatArray:
        """Peak force of each pack contact, relative to the single pulse."""
        return np.array([contact.peak_force or 0.0 for contact in self.contacts]) / self.single.force

    @property
    def adequate(self) -> int:
        """Number of dots that reach the requested force; 0 if contacts and dots differ in number."""
        if len(self.contacts) != self.count:
            return 0
        return int((self.forces >= self.force).sum())

    @property
    def deviations(self) -> FloatArray:
        """Touch time minus requested time of each dot, s; empty if contacts and dots differ in number."""
        if len(self.contacts) != self.count:
            return np.zeros(0)
        return np.array([contact.t_in for contact in self.contacts]) - self.slots

    @property
    def ledger(self) -> Ledger:
        """Energy ledger of the burst."""
        return self.motion.energy

    @property
    def work(self) -> CoilWork:
        """Work of the coil over the burst."""
        return self.motion.coil_work

    @property
    def net_ratio(self) -> float:
        """Ratio of the net coil work to the energy absorbed by the pack, ideally 1; NaN without a dot."""
        return self._over(self.work.net)

    @property
    def positive_ratio(self) -> float:
        """Ratio of the positive coil work to the energy absorbed by the pack."""
        return self._over(self.work.positive)

    @property
    def bound_ratio(self) -> float:
        """Ratio of the lower bound on the positive coil work to the energy absorbed by the pack."""
        return self._over(self.bound.burst(self.count))

    @property
    def single_ratio(self) -> float:
        """Ratio of net coil work to pack loss, for a single pulse from rest to rest."""
        return self.single_work.net / self.single.pack_loss

    def _over(self, work: float) -> float:
        absorbed = self.ledger.pack_loss
        return work / absorbed if absorbed > 0.0 else math.nan

    @cached_property
    def rest_time(self) -> float:
        """Time after which the energy, relative to rest, stays below 1 % of the pack loss of a dot, s."""
        motion, hammer = self.motion, self.hammer
        rest = stored_energy(hammer, rest_state(hammer))
        stored = np.array([stored_energy(hammer, x) for x in motion.x.tolist()])
        energy = 0.5 * hammer.mass * motion.v**2 + stored - rest
        place = settled_from(energy > _SETTLED * self.single.pack_loss)
        return float(motion.t[min(place, motion.t.size - 1)])

    def under_supply(self, changes: npt.ArrayLike = SUPPLY) -> SupplyCheck:
        """Simulate the burst with all currents scaled by 1 + c, for each c in `changes`, as one ensemble."""
        factors = 1.0 + np.atleast_1d(np.asarray(changes, dtype=np.float64))
        if factors.ndim != 1 or not (np.isfinite(factors) & (factors > 0.0)).all():
            raise InputError.of("changes", changes, "relative changes of the current above -1")
        drives = [self.drive.scaled(factor) for factor in factors.tolist()]
        result = Ensemble(self.hammer, drives, self.motion.end).run(dots=True, engine="plain")
        dots = result.dots
        assert dots is not None
        touched = np.where(dots.struck, dots.fired_at + dots.flight_time, np.inf)
        away = np.abs(touched[:, :, np.newaxis] - self.slots)
        # The dot of a slot is the pack contact nearest to the slot in time, whichever pulse caused the
        # contact.
        which = away.argmin(axis=1)
        late = away.min(axis=1)
        rows = np.arange(len(drives))[:, np.newaxis]
        made = late < 0.5 / self.rate
        force = np.where(made, np.nan_to_num(dots.peak_force[rows, which]) / self.single.force, 0.0)
        good = made & (dots.extra_contacts[rows, which] == 0) & (force >= self.force)
        return SupplyCheck(
            changes=factors - 1.0,
            adequate=good.sum(axis=1),
            weakest=force.min(axis=1),
            spread=np.where(made.all(axis=1), late.max(axis=1), np.nan),
            status=np.array(result.status_names, "U16"),
        )

    @property
    def title(self) -> str:
        """One-line title with the name of the hammer."""
        return f"burst of least work of {self.hammer.name}"

    def summary(self) -> Summary:
        """Summarise dots, currents, work and losses of the burst."""
        work, ledger = self.work, self.ledger
        weakest = (
            f", the weakest with {self.forces.min():.4f} of the single pulse's force" if self.contacts else ""
        )
        allowed = f"{self.slew:.4g} A/s allowed" if self.shape == "free" else "pulses of the hammer"
        net, positive = (styled("strong", f"{each:.4f}") for each in (self.net_ratio, self.positive_ratio))
        rows = [
            ("dots", f"{self.adequate} of {self.count} adequate at {self.rate:.6g} Hz{weakest}"),
            ("current", f"at most {quantity(self.drive.peak, 'A')}, {allowed}"),
            ("at rest", f"after {quantity(self.rest_time, 's')}"),
            ("absorbed by the pack", quantity(ledger.pack_loss, "J")),
            ("lost at the backstop", quantity(ledger.backstop_loss, "J")),
            (
                "net work W",
                (
                    f"{quantity(work.net, 'J')}, {net} of what the pack absorbs;"
                    f" {self.single_ratio:.2f} with single pulses"
                ),
            ),
            (
                "positive work W+",
                (
                    f"{quantity(work.positive, 'J')}, {positive} of it; no current does with less than"
                    f" {self.bound_ratio:.4f} for this force"
                ),
            ),
            ("heat of the coil", None if work.heat is None else quantity(work.heat, "J")),
            ("ledger", f"residual {ledger.residual / ledger.throughput:.1e} of the throughput"),
        ]
        return Summary([Facts(rows)])

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of hammer, drive and simulation."""
        return provenance(
            hammer=self.hammer, drive=self.drive, tolerance=self.tolerance, status=self.motion.status
        )

    def notes(self) -> dict[str, Any]:
        """Return the work of the coil and the energy ledger, as attributes of the Dataset."""
        work, ledger = self.work, self.ledger
        return {
            "interpolation": "linear between nodes; a current held from node to node prints fewer dots",
            "adequate_dots": self.adequate,
            "net_work": work.net,
            "positive_work": work.positive,
            "squared_current": work.squared_current,
            "bound_of_positive_work": self.bound.burst(self.count),
            "pack_loss_of_all": ledger.pack_loss,
            "backstop_loss": ledger.backstop_loss,
            "ledger_residual": ledger.residual,
            "ledger_throughput": ledger.throughput,
            "rest_time": self.rest_time,
            "heat": work.heat,
        }

    def entries(self) -> Entries:
        """Return motion, current and coil power against time, and the pack contacts."""
        motion, dots = self.motion, self.contacts
        power = coil_power(self.hammer, motion.x, motion.v, motion.force["magnet"])
        forces = [np.nan if dot.peak_force is None else dot.peak_force for dot in dots]
        arrays: list[tuple[str, str, str, str, Any]] = [
            ("x", "time", "m", "displacement", motion.x),
            ("v", "time", "m/s", "velocity", motion.v),
            ("current", "time", "A", "coil current", motion.current),
            ("power", "time", "W", "power of the coil", power),
            ("touch", "dot", "s", "touch of the pack", [dot.t_in for dot in dots]),
            ("force", "dot", "N", "largest pack force", forces),
            ("pack_loss", "dot", "J", "energy absorbed by the pack", [dot.loss for dot in dots]),
            ("time", "time", "s", "time", motion.t),
            ("dot", "dot", "1", "number of the dot", np.arange(1, len(dots) + 1, dtype=np.int32)),
        ]
        return {
            name: (
                Column(unit, meaning, (dim,), "coordinate" if name == dim else "column", name=name),
                np.asarray(values),
            )
            for name, dim, unit, meaning, values in arrays
        }

    def to_dataframe(self) -> pd.DataFrame:
        """Return the nodes of the current, times and currents, as a data frame."""
        times, values = self.nodes
        micros = [from_si(time, "s", "us") for time in times]
        columns = {"time [us]": (("node",), micros), "current [A]": (("node",), values)}
        return frame(columns, ("node",), plain(self.attributes))


def _current_of(hammer: Hammer) -> Waveform:
    """Return a hammer's waveform; raise `InputError` unless it is a current and no component is missing."""
    waveform = hammer.waveform
    absent = [role for role in ("magnet", "spring", "backstop", "pack") if getattr(hammer, role) is None]
    faults = [f"the hammer has no {' and no '.join(absent)}"] if absent else []
    expected = ["magnet, spring, backstop and pack"] if absent else []
    if waveform is not None and waveform.quantity != "current":
        faults.insert(0, f"the waveform is a {waveform.quantity}")
        expected.append(
            "a current: the burst is planned in currents, which a driver of the coil does not set"
        )
    if faults:
        key = "waveform" if len(faults) > len(absent[:1]) else absent[0]
        text = f"{hammer.path}: {' and '.join(faults)}"
        raise InputError(text, file=hammer.path, key=key, expected=", and ".join(expected))
    return pulse_of(hammer)


_SEARCH: Final = Effort(1e-9)


@computation
def least_work(
    hammer: Hammer,
    rate: float | str = 1000.0,
    *,
    dots: SupportsIndex = 8,
    force: float = FORCE,
    largest: float | str | None = None,
    slew: float | None = None,
    least: Least = "positive work",
    shape: Shape = "free",
    spacing: float | str | None = None,
    effort: Effort = _SEARCH,
    **_keywords: Unpack[InOneThread],
) -> LeastWork:
    """Find a current that prints a burst of dots with the least coil work, from rest to rest.

    `effort.tolerance` applies to the search; the final drive is simulated at the tolerance of the ledger.

    Parameters
    ----------
    hammer : Hammer
        The hammer, with magnet, spring, pack, backstop and waveform.
    rate : float or str, optional
        Dot rate [Hz] or text with a unit.
    dots : int, optional
        Number of dots.
    force : float, optional
        Required force of every dot, relative to the single pulse.
    largest : float or str, optional
        Limit of the absolute current [A] or text with a unit; by default 2 A or the hammer's peak current.
    slew : float, optional
        Slope limit of the current, A/s; by default the steepest rise of the hammer's waveform.
    least : str, optional
        Objective: "positive work" of the coil, or its "heat".
    shape : str, optional
        "free": any current within the limits; "pulses": the hammer's pulses with optimised times and widths,
        see `printhammer.control.least_work.pulses`; "pulses" ignores `slew` and `spacing`.
    spacing : float or str, optional
        Time between nodes of the current, s, or text with a unit, rounded to a whole fraction of the period;
        by default `SPACING` times the duration of the indentation by a single pulse.

    Returns
    -------
    LeastWork
        The drive, its motion and its ledger.

    Raises
    ------
    NoBurstError
        No current within the limits was found; this does not prove that none exists.
    """
    period = 1.0 / read_positive(rate, "Hz", "rate")
    count = read_count(dots, "dots")
    if count > MOST_DOTS:
        raise InputError.of("dots", count, f"at most {MOST_DOTS}", written=str(count))
    share = read_positive(force, "1", "force")
    if share > 2.0:
        raise InputError.of("force", share, "at most 2 times that of the single pulse")
    if least not in LEASTS:
        raise InputError.of("least", least, f"one of {', '.join(LEASTS)}")
    if shape not in SHAPES:
        raise InputError.of("shape", shape, f"one of {', '.join(SHAPES)}")
    apart = None if spacing is None else read_positive(spacing, "s", "spacing")
    waveform = _current_of(hammer)
    top = current_bound(hammer, largest, "largest")
    steepest = steepest_rise(waveform) if slew is None else read_number(slew, "A/s", "slew")
    if shape == "pulses":
        steepest = math.inf
    elif slew is None and not math.isfinite(steepest):
        raise InputError(
            f"{hammer.path}: the waveform jumps", file=hammer.path, key="waveform", expected="slew (--slew)"
        )
    elif not (math.isfinite(steepest) and steepest > 0.0):
        raise InputError.of(
            "slew", steepest, "a positive number, the steepest slope of a current", unit="A/s"
        )
    single = nominal(hammer)
    alone = simulate(hammer, PulseTrain(waveform), points=2)
    limits = bound(hammer, single, share, top)
    wanted = share * (1.0 + _SPARE) * single.force
    task = Task(
        hammer,
        CoilForce(hammer, top),
        top,
        steepest,
        wanted,
        limits.loading,
        least == "heat",
        effort.tolerance,
    )
    touch = next(contact for contact in alone.contacts if contact.surface == "pack")
    indenting = touch.t_peak - touch.t_in
    apart = SPACING * indenting if apart is None else apart
    past, flight = _PAST_PEAK * indenting, single.flight_time
    plan: NodePlan | PulsePlan
    if shape == "free":
        plan = NodePlan(task, period, past, apart, flight)
    else:
        lead = max(period, LEAD * flight + past)
        plan = PulsePlan(task, waveform, period, past, lead, LANDING * flight, rest_state(hammer))
    what = f"current of at most {top:g} A and {steepest:.4g} A/s was found that prints"
    if shape == "pulses":
        what = f"pulses of at most {top:g} A were found that print"
    for slot in range(count):
        if not plan.add_dot():
            raise NoBurstError(
                f"no {what} dot {slot + 1} of {count} with {share:g} of the force of the single pulse at"
                f" {1.0 / period:.6g} Hz"
            )
        effort.report(slot + 1, count + 1)
    plan.land()
    effort.report(count + 1, count + 1)
    drive = plan.drive()
    motion = simulate(hammer, drive, duration=drive.end + alone.end, tolerance=TOLERANCE, ledger=True)
    return LeastWork(
        hammer=hammer,
        drive=drive,
        motion=motion,
        rate=1.0 / period,
        count=count,
        force=share,
        largest=top,
        slew=steepest,
        least=least,
        shape=shape,
        slots=np.array(plan.touches),
        single=single,
        single_work=alone.coil_work,
        bound=limits,
        tolerance=effort.tolerance,
    )
