"""Print quality of a hammer at a slot rate: dots within limits, spreads, wear and energy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from printhammer.drive.input import read_positive
from printhammer.drive.trains import Drive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import DOT_MATRIX_SPREAD, ENGRAVED_SPREAD, FAULTS, Limits, judge
from printhammer.printing.dots.nominal import Nominal
from printhammer.printing.dots.nominal import nominal as single_pulse
from printhammer.printing.dots.paper import Paper, PiecewiseMotion, simulate_pieces
from printhammer.printing.dots.settling import Wear, wear_of
from printhammer.printing.dots.strategy import (
    LEAD_IN,
    Strategy,
    checked_drives,
    cycle_with_lead_in,
    name_of,
    open_loop,
    slot_times,
    slots_of,
)
from printhammer.printing.dots.trial import fired_of
from printhammer.results import Declared, Result, column, derived, part, scalar
from printhammer.results.summary import (
    Facts,
    Summary,
    judged,
    quantity,
)
from printhammer.run.contacts import Dot
from printhammer.run.energy import Ledger, squared_current
from printhammer.run.ensemble import DotTable
from printhammer.run.motion import Motion
from printhammer.run.problem import TOLERANCE
from printhammer.run.simulate import simulate
from printhammer.run.window import wait_of
from printhammer.support.arguments import checked
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

PITCH: Final = 25.4e-3 / 60.0
"""Default distance between neighbouring slots on the paper, m: 60 per inch; arbitrary."""

_SPREADS: Final = {"flight_time": "s", "force": "N", "indentation": "m", "arrival": "s", "placement": "m"}

MOST_SLOTS: Final = 20_000  # Largest number of slots in a pattern; arbitrary


class Spread(Declared):
    """Statistics of a sample; all statistics except the count are NaN if the sample is empty."""

    count: int = part("sample size")
    mean: float = part("mean")
    deviation: float = part("standard deviation")
    low: float = part("minimum")
    high: float = part("maximum")

    @property
    def peak_to_peak(self) -> float:
        """Peak-to-peak spread: maximum minus minimum."""
        return self.high - self.low

    def said(self, unit: str, single: float | None = None) -> str:
        """Format mean, standard deviation and peak-to-peak spread in the unit `unit`.

        `single` is the value of the single-pulse dot in SI, which is added for comparison.
        """
        if not self.count:
            return "–"
        mean, most = (quantity(each, unit, bare=True) for each in (self.mean, self.peak_to_peak))
        alone = "" if single is None else f", single pulse {quantity(single, unit, bare=True)}"
        return f"{mean} ± {quantity(self.deviation, unit)}, {most} peak to peak{alone}"


class Quality(Result):
    """Print quality of a hammer at a slot rate: the evaluated dots, their statistics, wear and energy."""

    hammer: Hammer = part("driven hammer")
    strategy: str = scalar("", "name of the drive strategy")
    drive: Drive = part("drive of the run", repr=False)
    rate: float = scalar("Hz", "slot rate", name="rate_Hz")
    wanted: BoolArray = part("mask of the slots with a dot, lead-in included", repr=False)
    judged_from: int = scalar(
        "1",
        "first judged slot",
        more="earlier slots are a lead-in, which is not evaluated",
        name="judged_from_slot",
    )
    limits: Limits = part("limits on the deviations of the dots")
    nominal: Nominal = part("single-pulse dot")
    slot: IntArray = column("1", "index of the slot", "dot", dtype=np.int32)
    flight_time: FloatArray = column(
        "s", "time from firing to touch", "dot", more="NaN for a lost dot, as in the columns that follow"
    )
    force: FloatArray = column("N", "largest pack force", "dot")
    indentation: FloatArray = column("m", "largest indentation", "dot")
    arrival_deviation: FloatArray = column("s", "touch minus slot time and single-pulse flight time", "dot")
    lost: BoolArray = column("1", "whether the firing made no dot", "dot", dtype=np.int8)
    extra_contacts: IntArray = column("1", "number of extra pack contacts", "dot", dtype=np.int32)
    fault: IntArray = column(
        "1",
        "index of the first fault of the dot; -1 for a dot within limits",
        "dot",
        dtype=np.int32,
        attrs={"codes": ", ".join(f"{code} {name}" for code, name in enumerate(FAULTS))},
    )
    wear: Wear = part("load on the backstop in the whole run", more="lead-in and settle-out included")
    energy: Ledger = part("energy ledger of the whole run")
    heat: float | None = part(
        "coil heat in the whole run, J", more="None for a hammer without `coil.resistance`"
    )
    fired: int = part("number of firings in the whole run")
    pitch: float = scalar("m", "distance between neighbouring slots on the paper", name="pitch_m")
    paper: Paper | None = part("variation of the pack along the line", more="None for uniform paper")
    status: str = part("status of the run")
    tolerance: float = part("error tolerance per integration step")

    @property
    def title(self) -> str:
        """One-line title with hammer and slot rate."""
        return f"quality of {self.hammer.name} at {self.rate:g} Hz"

    def summary(self) -> Summary:
        """Summarise the report: dots within limits, spreads, classes of print, wear and work."""
        count, good = len(self.slot), int((self.fault < 0).sum())
        what = "the de Bruijn cycle of order 8" if self.judged_from > 0 else f"{len(self.wanted)} slots"
        lost, extra = int(self.lost.sum()), int(self.extra_contacts.sum())
        wear, single, hardest = self.wear, self.nominal, self.wear.largest_force
        pressed = "" if hardest is None else f", up to {quantity(hardest, 'N')}"
        heat = "" if self.mean_heat is None else f", {self.mean_heat:.3f} W heat"
        alone = {"flight_time": single.flight_time, "force": single.force, "indentation": single.indentation}
        spreads = [
            (name.replace("_", " "), getattr(self, f"{name}_spread").said(unit, alone.get(name)))
            for name, unit in _SPREADS.items()
        ]
        prints = self.hammer.strike == "dot"
        matrix, engraved = "arrivals within 200 µs of each other", "arrivals within 30 µs of each other"
        rows = [
            ("pattern", f"{what}, {count} dots judged, {self.rate:g} Hz, {self.strategy}"),
            ("limits", self.limits.said),
            ("paper", None if self.paper is None else self.paper.text),
            (
                "dots",
                (
                    f"{judged(good == count, f'{good} of {count} within limits')}, {lost} lost"
                    f" ({100.0 * self.missing:.3g} %), {extra} extra contacts"
                ),
            ),
            *spreads,
            ("dot matrix", _verdict(self.dot_matrix, matrix) if prints else None),
            ("engraved", _verdict(self.engraved, engraved) if prints else None),
            (
                "backstop",
                (
                    f"{wear.touches / self.fired:.2f} touches a dot, {1e3 * self.backstop_impulse:.3f} mN·s"
                    f" and {quantity(self.backstop_loss, 'J')} a dot{pressed}"
                ),
            ),
            ("coil", f"{quantity(self.work, 'J')} a dot, {self.mean_power:.3f} W on average{heat}"),
        ]
        return Summary([Facts(rows)])

    def notes(self) -> dict[str, Any]:
        """Return the key figures of the report, as attributes of the Dataset; each name ends in the unit."""
        spreads = {
            f"{name}_{measure}_{unit}": getattr(getattr(self, f"{name}_spread"), measure)
            for name, unit in _SPREADS.items()
            for measure in ("mean", "deviation", "low", "high", "peak_to_peak")
        }
        return {
            "pattern": "".join("1" if dot else "0" for dot in self.wanted),
            "limits": self.limits.text,
            **({} if self.paper is None else {"paper": self.paper.text, "paper_seed": self.paper.seed}),
            "dots": len(self.slot),
            "within_limits": int((self.fault < 0).sum()),
            "extra_contacts": int(self.extra_contacts.sum()),
            "single_force_N": self.nominal.force,
            "single_flight_time_s": self.nominal.flight_time,
            **{key: value for key, value in spreads.items() if not math.isnan(value)},
            "backstop_touches_per_dot": self.wear.touches / self.fired,
            "backstop_largest_speed_m_per_s": self.wear.largest_speed,
            "backstop_largest_force_N": self.wear.largest_force,
        }

    @property
    def ok(self) -> bool:
        """Whether the simulation reached its end."""
        return self.status == "ok"

    @property
    def passed(self) -> bool:
        """Whether all dots are within limits."""
        return bool((self.fault < 0).all())

    @property
    @derived("1", "fraction of requested dots that are lost")
    def missing(self) -> float:
        """Fraction of requested dots that are lost."""
        return float(self.lost.mean())

    @property
    def flight_time_spread(self) -> Spread:
        """Statistics of the flight times, s."""
        return spread_of(self.flight_time)

    @property
    def force_spread(self) -> Spread:
        """Statistics of the peak forces, N."""
        return spread_of(self.force)

    @property
    def indentation_spread(self) -> Spread:
        """Statistics of the indentations, m."""
        return spread_of(self.indentation)

    @property
    def arrival_spread(self) -> Spread:
        """Statistics of the arrivals relative to slot time plus single-pulse flight time, s."""
        return spread_of(self.arrival_deviation)

    @property
    def placement_spread(self) -> Spread:
        """Statistics of the placement error on the paper, m: arrival deviation times carriage speed."""
        return spread_of(self.arrival_deviation * self.rate * self.pitch)

    @property
    @derived("1", "whether the arrivals meet the dot-matrix tolerance", name="dot_matrix_tolerance")
    def dot_matrix(self) -> bool:
        """Whether no dot is lost and arrivals vary by at most 200 us, the limit for dot matrix printing.

        If every dot is fired at its slot, arrival times vary as much as flight times, for which the paper
        states the limit.
        """
        return self._within(DOT_MATRIX_SPREAD)

    @property
    @derived("1", "whether the arrivals meet the engraved-character tolerance", name="engraved_tolerance")
    def engraved(self) -> bool:
        """Whether no dot is lost and arrivals vary by at most 30 us, the limit for engraved characters."""
        return self._within(ENGRAVED_SPREAD)

    def _within(self, peak_to_peak: float) -> bool:
        # Lost dots and dots not simulated are NaN, which the spread would ignore.
        known = not np.isnan(self.arrival_deviation).any()
        return bool(known and self.arrival_spread.peak_to_peak <= peak_to_peak)

    @property
    @derived("N s", "change of momentum at the backstop for each firing", name="backstop_impulse_per_dot_N_s")
    def backstop_impulse(self) -> float:
        """Change of momentum at the backstop per firing, N s: a measure of wear."""
        return self.wear.impulse / self.fired

    @property
    @derived("J", "energy dissipated in the backstop for each firing", name="backstop_loss_per_dot_J")
    def backstop_loss(self) -> float:
        """Energy dissipated in the backstop per firing, J: a measure of wear."""
        return self.wear.loss / self.fired

    @property
    @derived("J", "net work of the drive for each firing", name="work_per_dot_J")
    def work(self) -> float:
        """Net work of the drive per firing, J."""
        return (self.energy.coil_work + self.energy.drive_work) / self.fired

    @property
    @derived("W", "net work of the drive over the duration of all slots", name="mean_power_W")
    def mean_power(self) -> float:
        """Net work of the drive divided by the duration of all slots, W."""
        return self.work * self.fired * self.rate / len(self.wanted)

    @property
    @derived("W", "coil heat over the duration of all slots", name="mean_heat_W")
    def mean_heat(self) -> float | None:
        """Coil heat divided by the duration of all slots, W; None without `coil.resistance`."""
        return None if self.heat is None else self.heat * self.rate / len(self.wanted)


@checked
def quality(
    hammer: Hammer,
    rate: float | str,
    pattern: str | int | npt.ArrayLike | None = None,
    *,
    strategy: Strategy = open_loop,
    limits: Limits | None = None,
    nominal: Nominal | None = None,
    pitch: float | str = PITCH,
    paper: Paper | None = None,
    tolerance: float = TOLERANCE,
) -> Quality:
    """Simulate the printing of a pattern from rest, and report the print quality.

    Parameters
    ----------
    hammer : Hammer
        The hammer to drive.
    rate : float or str
        Slot rate [Hz] or text with a unit.
    pattern : str, int or bool array, optional
        Requested dots by slot: text such as "10110111", 1 for a dot; a number of dots in consecutive slots;
        or a boolean mask. By default one period of the binary de Bruijn cycle of order 8, which contains
        every word of eight slots exactly once, after a lead-in of 64 slots that are not judged.
    strategy, limits, nominal, tolerance
        As for `printhammer.safe_rate`.
    pitch : float or str, optional
        Distance between neighbouring slots on the paper, m, or text with a unit.
    paper : Paper, optional
        Variation of pack stiffness and pack front along the line; by default none. From the firing of a dot
        until the next firing, the hammer has the pack of that dot's slot. A strategy observes the variation
        only through its sensor.

    Returns
    -------
    Quality
        Report with the dots, their spreads, wear, energy and a status.
    """
    slot_rate = read_positive(rate, "Hz", "rate")
    slot_pitch = read_positive(pitch, "m", "pitch")
    wanted = cycle_with_lead_in() if pattern is None else pattern_of(pattern)
    judged_from = LEAD_IN if pattern is None else 0
    bounds = Limits() if limits is None else limits
    single = single_pulse(hammer, tolerance=tolerance) if nominal is None else nominal
    slots = slots_of(wanted)
    places = None if paper is None else paper.hammers(hammer, len(wanted), slot_pitch)
    # A closed loop senses the paper while it drives.
    along = None if places is None else getattr(strategy, "along", None)
    way = strategy if along is None else along(places)
    drive = checked_drives(way, hammer, [slots], slot_rate)[0]
    due = slot_times(slots, slot_rate)
    end = max(float(due[-1]), float(drive.times[-1])) + wait_of(hammer, fired_of(strategy, hammer, drive))
    if places is None:
        motion: Motion | PiecewiseMotion = simulate(
            hammer, drive, duration=end, points=2, tolerance=tolerance
        )
    else:
        motion = simulate_pieces([places[slot] for slot in slots], drive, end, tolerance)
    dots = dot_table(motion.dots, drive.times)
    judged = np.asarray(slots) >= judged_from
    judgement = judge(dots, judged[np.newaxis], due[np.newaxis], single, bounds, np.array([motion.ok]))
    run = judgement.run[0, judged]
    heat = None
    if drive.quantity == "voltage":
        heat = motion.energy.copper_loss
    elif hammer.coil_resistance is not None:
        squared = squared_current(drive, 0.0, motion.end) if drive.quantity == "current" else 0.0
        heat = hammer.coil_resistance * squared
    return Quality(
        hammer=hammer,
        strategy=name_of(strategy),
        drive=drive,
        rate=slot_rate,
        wanted=wanted,
        judged_from=judged_from,
        limits=bounds,
        nominal=single,
        slot=np.asarray(slots)[judged],
        flight_time=np.where(run, dots.flight_time[0, judged], np.nan),
        force=np.where(run, dots.peak_force[0, judged], np.nan),
        indentation=np.where(run, dots.indentation[0, judged], np.nan),
        arrival_deviation=judgement.arrival_deviation[0, judged],
        lost=judgement.lost[0, judged],
        extra_contacts=judgement.extra_contacts[0, judged],
        fault=judgement.faults[0, judged],
        wear=wear_of(motion),
        energy=motion.energy,
        heat=heat,
        fired=len(motion.dots),
        pitch=slot_pitch,
        paper=paper,
        status=motion.status,
        tolerance=tolerance,
    )


def pattern_of(pattern: str | int | npt.ArrayLike) -> BoolArray:
    """Convert a pattern, in any form that `quality` accepts, to a mask of the slots with a dot."""
    if isinstance(pattern, str):
        if not pattern or set(pattern) - {"0", "1"}:
            raise InputError.of("pattern", pattern, "slots such as '10110111'")
        wanted = np.array([letter == "1" for letter in pattern])
    elif isinstance(pattern, int) and not isinstance(pattern, bool):
        if not 1 <= pattern <= MOST_SLOTS:
            raise InputError.of("pattern", pattern, f"1 to {MOST_SLOTS} dots")
        wanted = np.ones(pattern, dtype=np.bool_)
    else:
        wanted = np.asarray(pattern)
        if wanted.dtype != np.bool_ or wanted.ndim != 1:
            raise InputError(
                "pattern: expected text, a number of dots, or truth values in one row", key="pattern"
            )
    if not wanted.any() or len(wanted) > MOST_SLOTS:
        raise InputError(f"pattern: expected at least one dot and at most {MOST_SLOTS} slots", key="pattern")
    return wanted


def _verdict(good: bool, what: str) -> str:
    return f"{judged(good, 'yes' if good else 'no')}: " + (
        f"{what}, none lost" if good else f"not all {what}, or lost"
    )


def spread_of(values: FloatArray) -> Spread:
    """Compute mean, standard deviation, minimum and maximum of numbers; NaN are ignored."""
    known = values[~np.isnan(values)]
    if not known.size:
        return Spread(0, math.nan, math.nan, math.nan, math.nan)
    return Spread(known.size, float(known.mean()), float(known.std()), float(known.min()), float(known.max()))


def dot_table(dots: Sequence[Dot], times: FloatArray) -> DotTable:
    """Convert the dots of one motion, with firing times [s], to a dot table with one ensemble member."""

    def column(name: str) -> FloatArray:
        values = [getattr(dot, name) for dot in dots]
        known = [math.nan if value is None else value for value in values]
        return np.array([[*known, *[math.nan] * (len(times) - len(dots))]])

    missing = np.arange(len(times))[np.newaxis] >= len(dots)
    return DotTable(
        fired=~missing,
        fired_at=np.array(times, dtype=np.float64)[np.newaxis],
        struck=np.nan_to_num(column("struck")) > 0.0,
        flight_time=column("flight_time"),
        impact_speed=column("impact_speed"),
        peak_force=column("peak_force"),
        indentation=column("indentation"),
        contact_time=column("contact_time"),
        extra_contacts=np.nan_to_num(column("extra_contacts")).astype(np.int64),
    )
