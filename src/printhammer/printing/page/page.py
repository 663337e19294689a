"""The printed page: every dot at its true place and as dark as it was struck.

Each wire of each print line is a run of its own, from rest; all of them are one ensemble. The carriage passes
slot n at the time of the slot, n / rate after slot 0, at the speed rate x pitch. A dot lands where the
carriage is at touch; all dots are shifted together by what the carriage moves in the flight time of the
single pulse, which a printer allows for. What is left is the placement error: arrival deviation x speed.

How dark a dot is: its optical density is that of the single-pulse dot in the proportion of the peak forces,
so that its darkness, the share of the light that does not come back, is 1 - 10^-density. This is an
assumption: ink in proportion to force, density in proportion to ink. Dots are as wide as the wire.

Print heads: where the wires are, how thick they are, and how dark a dot of theirs is.

The paper says of the head only that its wires are arranged in columns and that the carriage moves a fraction
of a metre per second. The numbers here are assumptions in the manner of the heads of the time: nine wires
1/72 in apart and about as thick as that, columns of dots 1/60 in apart, so that a character of six columns
takes a tenth of an inch; 18 and 24 wires on the same height, thinner.
"""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any, Final, Unpack

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
from printhammer.results.summary import (
    FactRow,
    Facts,
    Summary,
    quantity,
)
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import BoolArray, FloatArray, IntArray, TextArray

if TYPE_CHECKING:
    from printhammer.results.result import Entries

DENSITY: Final = 1.0
"""Optical density of the dot of a single pulse, an assumption: a tenth of the light comes back."""

_THICKNESS: Final = 4 / 3
_HEIGHT: Final = 9 * 25.4e-3 / 72
LINE_GAP: Final = 1 / 3
"""Between print lines, in parts of the height of the wires."""


class Head(Declared):
    """A print head: one column of wires on a carriage."""

    wires: int = part("number of wires")
    wire_pitch: float = scalar("m", "from wire to wire")
    pitch: float = scalar(
        "m", "from one column of dots to the next", more="carriage speed = rate of slots x pitch"
    )
    wire_diameter: float = scalar("m", "also that of a dot")
    density: float = part("optical density of the dot of a single pulse", default=DENSITY)
    line_gap: float = part(
        "between print lines, in parts of the height of the wires",
        more="0 for drawings that go on from line to line",
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
        """From print line to print line, m: the height of the wires, and the gap."""
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
    wire_diameter: float | None = None,
    density: float = DENSITY,
    line_gap: float = LINE_GAP,
) -> Head:
    """Return a head of an assumed kind: as high as that of nine wires, whatever their number.

    Parameters
    ----------
    wires, density, line_gap
        As for `Head`.
    pitch : float, optional
        From slot to slot, m; by default 1/60 in for 9 wires, else as from wire to wire.
    wire_diameter : float, optional
        Thickness of the wires, m; by default 0.35, 0.25 and 0.2 mm for 9, 18 and 24 wires, else a third more
        than from wire to wire.
    """
    if wires < 1:
        raise InputError.of("wires", wires, "a positive number", file="head")
    apart = _HEIGHT / wires
    usual = _STANDARD.get(wires, Head(wires, apart, apart, _THICKNESS * apart))
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
_PIECE: Final = 512
_MOST_DOTS: Final = 5_000_000


class Page(Result, rows="dot"):
    """What was printed: every wanted dot, every extra contact, every run."""

    hammer: Hammer = part("the hammer of every wire")
    pattern: Pattern = part("what was wanted")
    head: Head = part("where the wires are, and how thick")
    rate: float = scalar("Hz", "slots per second")
    strategy: str = scalar("", "name of the way to drive")
    nominal: Nominal = part("the dot of the single pulse")
    limits: Limits = part("by which dots are judged")
    line: IntArray = column("1", "print line", "dot", more="where a dot is wanted, counted from 0")
    wire: IntArray = column("1", "wire, the topmost one is 0", "dot")
    slot: IntArray = column("1", "slot", "dot", more="counted from 0")
    run: BoolArray = column("1", "whether the run came so far", "dot")
    lost: BoolArray = column("1", "whether the firing made no dot", "dot")
    fault: IntArray = part(
        "number of the first fault in `printhammer.printing.dots.judging.FAULTS`",
        more="-1 for a dot within limits",
        repr=False,
    )
    arrival_deviation: FloatArray = column(
        "s",
        "touch less slot time and nominal flight time",
        "dot",
        more="NaN for a lost dot, as in all that follows",
    )
    flight_time: FloatArray = column("s", "from firing to touch", "dot")
    peak_force: FloatArray = column("N", "largest pack force", "dot")
    indentation: FloatArray = column("m", "largest indentation", "dot")
    extra_contacts: IntArray = column("1", "further pack contacts", "dot")
    extra_of: IntArray = column("1", "dot that the extra contact belongs to", "extra")
    extra_arrival: FloatArray = part(
        "touch of each extra contact less slot time and nominal flight time, s", repr=False
    )
    extra_force: FloatArray = column("N", "largest pack force of the extra contact", "extra")
    run_line: IntArray = column(
        "1", "print line of the run", "member", more="a wire without a wanted dot in a line has none"
    )
    run_wire: IntArray = column("1", "wire of the run", "member")
    status: TextArray = column("1", "how the run ended", "member")
    tolerance: float = part("error allowed in one step of the integration")

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return f"page printed by {self.hammer.name}"

    def summary(self) -> Summary:
        """Return what is on the paper: dots, where they are, how dark they are."""
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
        """Return pattern, head, single pulse and limits."""
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
        """Return the columns: those of the fields, faults by name, and places on the paper."""
        (x, y), (extra_x, extra_y) = self.places, self.extra_places
        more = (
            ("fault", "1", "first fault, by the limits", "dot", _FAULTS[self.fault]),
            ("x", "m", "place of the dot, from the middle of slot 0 to the right", "dot", x),
            ("y", "m", "place of the dot, from the topmost wire down", "dot", y),
            ("extra_x", "m", "place of the extra contact, as x", "extra", extra_x),
            ("extra_y", "m", "place of the extra contact, as y", "extra", extra_y),
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
        """Which dots are on the paper."""
        return self.run & ~self.lost

    @property
    def good(self) -> BoolArray:
        """Which dots are within the limits."""
        return np.asarray(self.fault < 0)

    @property
    @derived("m", "place less wanted place, along the line", "dot")
    def placement_error(self) -> FloatArray:
        """How far each dot is from its place, m, positive where the carriage goes; NaN without a dot."""
        return self.arrival_deviation * self.speed

    @property
    @derived("1", "largest pack force over that of the single pulse", "dot")
    def force_ratio(self) -> FloatArray:
        """Peak force over that of the single pulse; NaN without a dot."""
        return self.peak_force / self.nominal.force

    @property
    @derived("1", "share of the light that does not come back", "dot")
    def darkness(self) -> FloatArray:
        """Share of the light that does not come back from the dot, 0 to 1; NaN without one."""
        return darkness(self.density)

    @property
    def density(self) -> FloatArray:
        """Optical density of each dot; NaN without one."""
        return self.head.density * self.force_ratio

    @property
    def places(self) -> tuple[FloatArray, FloatArray]:
        """Where each dot is, m: from the middle of slot 0 to the right, from the topmost wire down."""
        across, down = self.intended
        return np.asarray(across + self.placement_error), down

    @property
    def intended(self) -> tuple[FloatArray, FloatArray]:
        """Where each dot is wanted, m; as `places`."""
        down = self.line * self.head.line_pitch + self.wire * self.head.wire_pitch
        return np.asarray(self.slot * self.head.pitch), np.asarray(down, dtype=np.float64)

    @property
    def extra_places(self) -> tuple[FloatArray, FloatArray]:
        """Where each extra contact is, m; as `places`."""
        across, down = self.intended
        return np.asarray(across[self.extra_of] + self.extra_arrival * self.speed), down[self.extra_of]

    @property
    def extra_density(self) -> FloatArray:
        """Optical density of each extra contact."""
        return self.head.density * self.extra_force / self.nominal.force

    @property
    def fault_counts(self) -> dict[str, int]:
        """Number of dots by their first fault."""
        return {name: int((self.fault == number).sum()) for number, name in enumerate(FAULTS)}

    def worst_place(self, slots: int) -> tuple[int, int]:
        """Return where the print is worst.

        What counts is the sum, over some slots in a row of a print line, of what is off: a lost dot counts 1,
        another one its placement error in slots and its deviation in density, an extra contact its density.
        The place is a print line and the first of its slots, counted from 0; of several the first.
        """
        off = np.abs(self.placement_error) / self.head.pitch + np.abs(self.density - self.head.density)
        worth = np.where(self.printed, np.nan_to_num(off), 1.0)
        np.add.at(worth, self.extra_of, self.extra_density)
        sums = np.zeros((self.pattern.lines, self.pattern.slots))
        np.add.at(sums, (self.line, self.slot), worth)
        many = min(slots, self.pattern.slots)
        total = np.cumsum(np.pad(sums, ((0, 0), (1, 0))), axis=1)
        windows = total[:, many:] - total[:, :-many]
        # Rounding tells no two places apart.
        line, first = np.unravel_index(int(np.argmax(np.round(windows, 9))), windows.shape)
        return int(line), int(first)


def darkness(density: npt.ArrayLike) -> FloatArray:
    """Return the share of the light that does not come back from ink of an optical density."""
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
    """Print a pattern, or a text in the built-in font, with a hammer on every wire.

    Parameters
    ----------
    hammer : Hammer
        The hammer of every wire.
    what : Pattern or str
        What is wanted; a text is set in the built-in font of nine wires.
    rate : float or str
        Slots per second, Hz, or text with a unit: how often a wire may be fired. The carriage moves one pitch
        in a slot.
    waveform : Waveform, optional
        What every firing does in open loop, and the single pulse; by default the hammer's own.
    strategy, limits
        As for `printhammer.safe_rate`.
    head : Head, optional
        Where the wires are, and how thick; by default `printhammer.printing.page.page.head_of` their number.

    Returns
    -------
    Page
        With a status for each run; a run that could not go on is no exception.
    """
    pattern = Pattern.from_text(what) if isinstance(what, str) else what
    if not isinstance(pattern, Pattern):
        raise InputError(f"{what!r} is expected to be a pattern or a text", value=what, key="pattern")
    slot_rate = read_positive(rate, "Hz", "rate")
    if pattern.wanted > _MOST_DOTS:
        raise InputError(f"{pattern.wanted} dots are wanted", key="pattern", expected=f"{_MOST_DOTS} at most")
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
    """Return what became of the dots of some wires, one wire after the other."""
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
        "extra_contacts": judged.extra_contacts[wanted],
        "extra_of": place[extra.member, extra.firing],
        "extra_arrival": late,
        "extra_force": extra.peak_force,
        "status": np.array(trial.statuses, "U16"),
    }
