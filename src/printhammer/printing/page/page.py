"""The printed page: position and darkness of every dot on the paper.

Each wire of each print line is a separate simulation from rest; all simulations form one ensemble. The
carriage passes slot n a time n / rate after slot 0, at the speed rate x pitch. A dot lands where the carriage
is at touch; all dots are shifted together by the carriage travel during the flight time of the single pulse,
which a printer corrects. The remaining offset is the placement error: arrival deviation x carriage speed.

Darkness: the optical density of a dot is that of the single-pulse dot times the ratio of the peak forces, and
its darkness, the fraction of light absorbed, is 1 - 10^-density. The relation assumes that ink is
proportional to force, and density to ink. Dots are as wide as the wire.

Print heads: positions and diameter of the wires, and the darkness of a dot. The paper says of the head only
that its wires are arranged in columns and that the carriage moves a fraction of a metre per second. The
defaults are assumptions modelled on heads of the time: nine wires, 1/72 in apart and about as thick,
dot columns 1/60 in apart, so that a character of six columns is a tenth of an inch wide; 18 and 24 thinner
wires over the same height.
"""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from typing import Any, Final, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.drive.input import read_positive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import FAULTS, PRESETS, Limits
from printhammer.printing.dots.nominal import Nominal, nominal
from printhammer.printing.dots.strategy import OpenLoop, Strategy, name_of, open_loop, slots_of
from printhammer.printing.dots.trial import Case, Trial, attempt
from printhammer.printing.page.pattern import Pattern
from printhammer.results import Column, Declared, Result, column, derived, part, scalar
from printhammer.results.result import Entries
from printhammer.results.summary import (
    FactRow,
    Facts,
    Summary,
    quantity,
)
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import BoolArray, FloatArray, IntArray, TextArray

DENSITY: Final = 1.0
"""Optical density of the single-pulse dot, an assumption: a tenth of the light is reflected."""

_THICKNESS: Final = 4 / 3  # Default wire diameter, as a multiple of the wire pitch; arbitrary
_HEIGHT: Final = 9 * 25.4e-3 / 72  # Height of a column of nine wires 1/72 in apart, m; arbitrary
LINE_GAP: Final = 1 / 3
"""Gap between print lines, as a fraction of the height of the wire column; arbitrary."""


class Head(Declared):
    """A print head: one column of wires on a carriage."""

    wires: int = part("number of wires")
    wire_pitch: float = scalar("m", "distance between neighbouring wires")
    pitch: float = scalar(
        "m", "distance between neighbouring dot columns", more="carriage speed = slot rate x pitch"
    )
    wire_diameter: float = scalar("m", "diameter of a wire and of its dot")
    density: float = part("optical density of the single-pulse dot", default=DENSITY)
    line_gap: float = part(
        "gap between print lines, as a fraction of the height of the wire column",
        more="0 for drawings that continue from line to line",
        default=LINE_GAP,
    )

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            least = 0.0 if entry.name == "line_gap" else math.ulp(0.0)
            if isinstance(value, bool) or not (value >= least and math.isfinite(value)):
                expected = "a positive number" if least else "a number not below 0"
                raise InputError.of(entry.name, value, expected, file="head")

    @property
    def line_pitch(self) -> float:
        """Distance between print lines, m: the height of the wire column plus the gap."""
        return (1.0 + self.line_gap) * self.wires * self.wire_pitch


_STANDARD: Final = {
    9: Head(9, _HEIGHT / 9, 25.4e-3 / 60, 0.35e-3),
    18: Head(18, _HEIGHT / 18, _HEIGHT / 18, 0.25e-3),
    24: Head(24, _HEIGHT / 24, _HEIGHT / 24, 0.2e-3),
}


def head_of(
    wires: int,
    *,
    pitch: float | None = None,
    wire_pitch: float | None = None,
    wire_diameter: float | None = None,
    density: float = DENSITY,
    line_gap: float = LINE_GAP,
) -> Head:
    """Build a print head with assumed dimensions, by default as high as a head of nine wires.

    Parameters
    ----------
    wires, density, line_gap
        As for `Head`.
    pitch : float, optional
        Distance between slots, m; by default 1/60 in for 9 wires, else the wire pitch.
    wire_pitch : float, optional
        Distance between neighbouring wires, m; by default 9/72 in divided by the number of
        wires.
    wire_diameter : float, optional
        Diameter of the wires, m; by default 0.35, 0.25 and 0.2 mm for 9, 18 and 24 wires, else 4/3 of the
        wire pitch.
    """
    if wires < 1:
        raise InputError.of("wires", wires, "a positive number", file="head")
    apart = _HEIGHT / wires if wire_pitch is None else wire_pitch
    own = Head(wires, apart, apart, _THICKNESS * apart)
    usual = _STANDARD.get(wires, own) if wire_pitch is None else own
    return Head(
        wires,
        usual.wire_pitch,
        usual.pitch if pitch is None else pitch,
        usual.wire_diameter if wire_diameter is None else wire_diameter,
        density,
        line_gap,
    )


_HEAD: Final = ("wire_pitch", "pitch", "line_pitch", "wire_diameter", "density")
_FAULTS: Final = np.array([*FAULTS, "none"], "U16")
_PIECE: Final = 512  # Number of wire lines simulated in one batch, which bounds the memory; arbitrary
_MOST_DOTS: Final = 5_000_000  # Largest number of dots of a page; arbitrary, bounds the time


class Page(Result, rows="dot"):
    """Printed page: the requested dots, the extra contacts, and the simulations of all wires."""

    hammer: Hammer = part("hammer of every wire")
    pattern: Pattern = part("requested dot pattern")
    head: Head = part("wire positions and diameter")
    rate: float = scalar("Hz", "slot rate")
    strategy: str = scalar("", "name of the drive strategy")
    nominal: Nominal = part("single-pulse dot")
    limits: Limits = part("limits on the deviations of the dots")
    line: IntArray = column(
        "1", "index of the print line", "dot", more="of the requested dot, counted from 0"
    )
    wire: IntArray = column("1", "index of the wire; 0 is the topmost", "dot")
    slot: IntArray = column("1", "index of the slot", "dot", more="counted from 0")
    run: BoolArray = column("1", "whether the simulation reached the dot", "dot")
    lost: BoolArray = column("1", "whether the firing made no dot", "dot")
    fault: IntArray = part(
        "index of the first fault in `printhammer.printing.dots.judging.FAULTS`",
        more="-1 for a dot within limits",
        repr=False,
    )
    arrival_deviation: FloatArray = column(
        "s",
        "touch minus slot time and single-pulse flight time",
        "dot",
        more="NaN for a lost dot, as in the columns that follow",
    )
    flight_time: FloatArray = column("s", "time from firing to touch", "dot")
    peak_force: FloatArray = column("N", "largest pack force", "dot")
    indentation: FloatArray = column("m", "largest indentation", "dot")
    extra_contacts: IntArray = column("1", "number of extra pack contacts", "dot")
    extra_of: IntArray = column("1", "index of the dot to which the extra contact belongs", "extra")
    extra_arrival: FloatArray = part(
        "arrival of each extra contact: touch minus slot time and single-pulse flight time, s", repr=False
    )
    extra_force: FloatArray = column("N", "largest pack force of the extra contact", "extra")
    run_line: IntArray = column(
        "1",
        "index of the print line of the simulation",
        "member",
        more="a wire without a dot in a line has no simulation",
    )
    run_wire: IntArray = column("1", "index of the wire of the simulation", "member")
    status: TextArray = column("1", "status of the simulation", "member")
    tolerance: float = part("error tolerance per integration step")

    @property
    def title(self) -> str:
        """One-line title with the name of the hammer that prints the page."""
        return f"page printed by {self.hammer.name}"

    def summary(self) -> Summary:
        """Summarise the page: dots within limits, placement, flight times, darkness."""
        on, count = self.printed, self.line.size
        dots = f"{count} wanted, {int(on.sum())} printed, {int(self.lost.sum())} lost"
        if not self.run.all():
            dots += f", {int((~self.run).sum())} not run"
        faults = ", ".join(f"{name} {number}" for name, number in self.fault_counts.items() if number)
        others = f"; the others by first fault: {faults}" if faults else ""
        rows: list[FactRow] = [
            ("dots", f"{dots}, {int(self.extra_contacts.sum())} extra contacts"),
            ("within limits", f"{int(self.good.sum())} of {count} dots{others}"),
            ("carriage", f"{self.rate:.6g} slots a second, {quantity(self.speed, 'm/s')}"),
        ]
        if not on.any():
            return Summary([Facts(rows)])
        error, flight, dark = self.placement_error[on], self.flight_time[on], self.darkness[on]
        worst = int(np.argmax(np.abs(error)))
        line, wire, slot = (each[on][worst] + 1 for each in (self.line, self.wire, self.slot))
        rows += [
            (
                "placement",
                (
                    f"spread {quantity(float(np.std(error)), 'm')}, worst {quantity(error[worst], 'm')}"
                    f" (line {line}, wire {wire}, slot {slot}, counted from 1)"
                ),
            ),
            (
                "flight time",
                (
                    f"spread {quantity(flight.std(), 's')},"
                    f" peak to peak {quantity(float(np.ptp(flight)), 's')}"
                ),
            ),
            (
                "darkness",
                f"{dark.min():.2f} to {dark.max():.2f}, mean {dark.mean():.2f}, spread {np.std(dark):.3f}",
            ),
        ]
        return Summary([Facts(rows)])

    def notes(self) -> dict[str, Any]:
        """Return pattern, head, single-pulse dot and limits, as attributes of the Dataset."""
        pattern, head, single, limits = self.pattern, self.head, self.nominal, self.limits
        return {
            "pattern": pattern.name,
            **{name: getattr(pattern, name) for name in ("lines", "wires", "slots")},
            **{name: getattr(head, name) for name in _HEAD},
            "nominal_force": single.force,
            "nominal_flight_time": single.flight_time,
            **{f"limit_{name}": value for name, value in asdict(limits).items()},
        }

    def entries(self) -> Entries:
        """Return the columns of the dot table: declared fields, fault names, and positions on the paper."""
        (x, y), (extra_x, extra_y) = self.places, self.extra_places
        more = (
            ("fault", "1", "first fault, by the limits", "dot", _FAULTS[self.fault]),
            ("x", "m", "position of the dot, from the middle of slot 0 to the right", "dot", x),
            ("y", "m", "position of the dot, from the topmost wire down", "dot", y),
            ("extra_x", "m", "position of the extra contact; coordinate as x", "extra", extra_x),
            ("extra_y", "m", "position of the extra contact; coordinate as y", "extra", extra_y),
        )
        columns = {
            name: (Column(unit, meaning, (dim,), name=name), values)
            for name, unit, meaning, dim, values in more
        }
        return {**super().entries(), **columns}

    @property
    def speed(self) -> float:
        """Carriage speed, m/s."""
        return self.rate * self.head.pitch

    @property
    def printed(self) -> BoolArray:
        """Mask of the requested dots that are on the paper."""
        return self.run & ~self.lost

    @property
    def good(self) -> BoolArray:
        """Mask of the requested dots that are within limits."""
        return np.asarray(self.fault < 0)

    @property
    @derived("m", "position minus intended position, along the line", "dot")
    def placement_error(self) -> FloatArray:
        """Distance of each dot from its intended position, m, positive in carriage direction; NaN if lost."""
        return self.arrival_deviation * self.speed

    @property
    @derived("1", "largest pack force over the largest pack force of the single pulse", "dot")
    def force_ratio(self) -> FloatArray:
        """Peak force of each requested dot divided by the single-pulse force; NaN for a lost dot."""
        return self.peak_force / self.nominal.force

    @property
    @derived("1", "fraction of light absorbed", "dot")
    def darkness(self) -> FloatArray:
        """Fraction of light that each requested dot absorbs, 0 to 1; NaN for a lost dot."""
        return darkness(self.density)

    @property
    def density(self) -> FloatArray:
        """Optical density of each requested dot; NaN for a lost dot."""
        return self.head.density * self.force_ratio

    @property
    def places(self) -> tuple[FloatArray, FloatArray]:
        """Position of each dot, m: to the right of the centre of slot 0, downward from the topmost wire."""
        across, down = self.intended
        return np.asarray(across + self.placement_error), down

    @property
    def intended(self) -> tuple[FloatArray, FloatArray]:
        """Intended position of each dot, m; coordinates as in `places`."""
        down = self.line * self.head.line_pitch + self.wire * self.head.wire_pitch
        return np.asarray(self.slot * self.head.pitch), np.asarray(down, dtype=np.float64)

    @property
    def extra_places(self) -> tuple[FloatArray, FloatArray]:
        """Position of the mark of each extra contact, m; coordinates as in `places`."""
        across, down = self.intended
        return np.asarray(across[self.extra_of] + self.extra_arrival * self.speed), down[self.extra_of]

    @property
    def extra_density(self) -> FloatArray:
        """Optical density of the mark of each extra contact."""
        return self.head.density * self.extra_force / self.nominal.force

    @property
    def fault_counts(self) -> dict[str, int]:
        """Number of dots with each kind of first fault, by the name of the fault."""
        return {name: int((self.fault == number).sum()) for number, name in enumerate(FAULTS)}

    def worst_place(self, slots: int) -> tuple[int, int]:
        """Locate the window of `slots` slots with the largest print error; return its line and first slot.

        The print error is a sum over the window: a lost dot adds 1, a printed dot its placement error in
        slots plus its deviation in density, an extra contact its density. Both indices count from 0; the
        first window wins a tie.
        """
        off = np.abs(self.placement_error) / self.head.pitch + np.abs(self.density - self.head.density)
        worth = np.where(self.printed, np.nan_to_num(off), 1.0)
        np.add.at(worth, self.extra_of, self.extra_density)
        sums = np.zeros((self.pattern.lines, self.pattern.slots))
        np.add.at(sums, (self.line, self.slot), worth)
        many = min(slots, self.pattern.slots)
        total = np.cumsum(np.pad(sums, ((0, 0), (1, 0))), axis=1)
        windows = total[:, many:] - total[:, :-many]
        # Rounded, so that rounding errors do not decide between equal windows.
        line, first = np.unravel_index(int(np.argmax(np.round(windows, 9))), windows.shape)
        return int(line), int(first)


def darkness(density: npt.ArrayLike) -> FloatArray:
    """Convert an optical density to the fraction of light absorbed, 1 - 10^-density."""
    return np.asarray(1.0 - 10.0 ** -np.asarray(density, dtype=np.float64))


@computation
def print_page(
    hammer: Hammer,
    what: Pattern | str,
    rate: float | str,
    *,
    waveform: Waveform | None = None,
    strategy: Strategy = open_loop,
    head: Head | None = None,
    limits: Limits | None = None,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> Page:
    """Simulate the printing of a pattern or text, with the same hammer on every wire of the head.

    Parameters
    ----------
    hammer : Hammer
        Hammer of every wire.
    what : Pattern or str
        Requested dots; a text is set in the built-in font of nine wires.
    rate : float or str
        Slot rate [Hz] or text with a unit: the largest firing rate of a wire. The carriage moves one pitch
        per slot.
    waveform : Waveform, optional
        Waveform of every firing in open loop, and of the single pulse; by default the waveform of the hammer.
    strategy, limits
        As for `printhammer.safe_rate`.
    head : Head, optional
        Wire positions and diameter; by default the result of `printhammer.printing.page.page.head_of`.

    Returns
    -------
    Page
        The page, with a status for each simulation; a failed simulation raises no exception.
    """
    pattern = Pattern.from_text(what) if isinstance(what, str) else what
    if not isinstance(pattern, Pattern):
        raise InputError(f"{what!r}", expected="a pattern or a text", value=what, key="pattern")
    slot_rate = read_positive(rate, "Hz", "rate")
    if pattern.wanted > _MOST_DOTS:
        raise InputError(
            f"{pattern.wanted} dots are requested", key="pattern", expected=f"{_MOST_DOTS} at most"
        )
    print_head = head_of(pattern.wires) if head is None else head
    if print_head.wires != pattern.wires:
        raise InputError(
            f"head: {print_head.wires} wires", key="head", expected=f"{pattern.wires} as the pattern has"
        )
    bounds = PRESETS["slots"] if limits is None else limits
    single = nominal(hammer, waveform, tolerance=effort.tolerance)
    if waveform is not None and strategy is open_loop:
        strategy = OpenLoop(waveform)
    run_line, run_wire = np.nonzero(pattern.dots.any(axis=2))
    rows = [slots_of(row) for row in pattern.dots[run_line, run_wire]]
    pieces = []
    for first in range(0, len(rows), _PIECE):
        trial = attempt(
            [Case(hammer, single, slot_rate)],
            rows[first : first + _PIECE],
            strategy,
            limits=bounds,
            extra=True,
            effort=effort.within(first, len(rows)),
        )
        pieces.append(_dots_of(trial))
    counts = np.array([len(slots) for slots in rows])
    before = np.cumsum([0, *(piece["run"].size for piece in pieces[:-1])])
    for piece, count in zip(pieces, before, strict=True):
        piece["extra_of"] = piece["extra_of"] + count
    joined = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    return Page(
        hammer=hammer,
        pattern=pattern,
        head=print_head,
        rate=slot_rate,
        strategy=name_of(strategy),
        nominal=single,
        limits=bounds,
        line=np.repeat(run_line, counts),
        wire=np.repeat(run_wire, counts),
        slot=np.concatenate([np.asarray(slots) for slots in rows]),
        run_line=run_line,
        run_wire=run_wire,
        tolerance=effort.tolerance,
        **joined,
    )


def _dots_of(trial: Trial) -> dict[str, Any]:
    """Collect the columns of `Page` from the dots and extra contacts of a trial, wire by wire."""
    ((_hammer, single, _rate),) = trial.cases
    dots, extra, judged, wanted = trial.dots, trial.extra, trial.judgement, trial.slots >= 0
    assert extra is not None
    place = np.cumsum(wanted).reshape(wanted.shape) - 1
    late = extra.touch - single.flight_time - trial.due[extra.member, extra.firing]
    return {
        "run": judged.run[wanted],
        "lost": judged.lost[wanted],
        "fault": judged.faults[wanted],
        "arrival_deviation": judged.arrival_deviation[wanted],
        "flight_time": dots.flight_time[wanted],
        "peak_force": dots.peak_force[wanted],
        "indentation": dots.indentation[wanted],
        "extra_contacts": np.where(dots.struck, dots.extra_contacts, 0)[wanted],
        "extra_of": place[extra.member, extra.firing],
        "extra_arrival": late,
        "extra_force": extra.peak_force,
        "status": np.array(trial.statuses, "U16"),
    }
