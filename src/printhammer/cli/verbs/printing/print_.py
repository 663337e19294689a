"""The verb `print`: a text or a pattern on paper, as the hammer prints it at a rate."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units, with_unit
from printhammer.cli.runner import Answer, Content, Job, ended_early, verb
from printhammer.cli.screen import facts
from printhammer.cli.verbs.printing.strategy import FEEDBACK, SERIAL, TABLE, chosen_strategy
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.page.page import Page
    from printhammer.printing.page.pattern import Pattern

_USUAL: Final = ("printed.png", "printed.pdf", "printed-zoom.png")
_PATTERN: Final = "What to print (a text, or --pattern)"
_HEAD: Final = "Print head"
_FILES: Final = "Files"
_length = partial(opt.quantity, "m", "LENGTH", panel=_HEAD, positive=True)


@verb(
    "print",
    "printhammer print 'Bounce and chaotic motion' --rate 1.4kHz --out page.png",
    {"tolerance": opt.TOLERANCE, "threads": opt.THREADS},
    out=opt.files(
        "Page (.png, .pdf, .svg) or its dots (.nc, .csv); may be given repeatedly. Without --out, --zoom,"
        f" --sheet and --save: {', '.join(_USUAL)}.",
        ".nc",
        ".csv",
        panel=_FILES,
    ),
    zoom=opt.files("Picture of the worst place (.png, .pdf, .svg).", many=False, panel=_FILES),
    sheet=opt.files("The paper alone, at its true size (.png, .pdf, .svg).", many=False, panel=_FILES),
    save=opt.file(
        "The pattern itself (.toml, .png, .pbm, .bmp).", ".toml", ".png", ".pbm", ".bmp", panel=_FILES
    ),
)
def print_(
    job: Job,
    text: str | None = opt.argument("[TEXT]", "Text to print; \\n begins a new line."),
    rate: str | None = opt.text("RATE", "Slots per second on each wire, such as '1.2 kHz'."),
    hammer: Hammer = opt.HAMMER_OPTION,
    pattern: Path | None = opt.source("Pattern file (.toml) or bitmap (.png, .pbm, .bmp).", panel=_PATTERN),
    wires: int | None = opt.whole("Wires: 9 (the built-in font), 18, 24 or another number.", panel=_PATTERN),
    font: Path | None = opt.source(
        "TrueType font (built-in for 9 wires, DejaVu Sans Mono for others).", panel=_PATTERN
    ),
    columns: int | None = opt.whole("Most characters of a print line (40).", panel=_PATTERN),
    pitch: float | None = _length("From slot to slot (1/60 in for 9 wires)."),
    wire_diameter: float | None = _length("Thickness of the wires (0.35 mm for 9 wires).", flag="--wire"),
    density: float | None = opt.number("Optical density of the dot of a single pulse (1).", panel=_HEAD),
    line_gap: float | None = opt.number(
        "Between print lines, in parts of the height of the wires (1/3; 0 for a bitmap).", panel=_HEAD
    ),
    limits: str | None = opt.text("NAME", "Limits: slots (default), dot-matrix or engraved."),
    table: Path | None = TABLE,
    serial: str | None = SERIAL,
    feedback: bool = FEEDBACK,
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Print a text or a pattern of dots at a rate, and see the page.

    A hammer on every wire, each print line from rest. Ends with status 1 where a run stopped before its end.
    """
    from printhammer.drive.input import read_positive
    from printhammer.printing.dots.judging import limits_named
    from printhammer.printing.page.head import head_of
    from printhammer.printing.page.page import print_page
    from printhammer.printing.page.pattern import BITMAPS

    if rate is None:
        raise InputError("--rate is missing", key="--rate", expected="slots per second such as '1.2 kHz'")
    often = read_positive(rate, "Hz", "--rate")
    if not job.outputs:
        *pages, last = (Path(name) for name in _USUAL)
        job.wanted |= {"out": pages, "zoom": [last]}
        job.check()
    asked = _pattern(text, pattern, font, wires, columns)
    if line_gap is None and pattern is not None and pattern.suffix.lower() in BITMAPS:
        # A drawing goes on from print line to print line.
        line_gap = 0.0
    head = head_of(
        asked.wires, **opt.given(pitch=pitch, wire_diameter=wire_diameter, density=density, line_gap=line_gap)
    )
    if limits is not None:
        passed["limits"] = limits_named(limits)
    passed |= chosen_strategy(job, hammer, table, feedback, serial)[0]
    with job.telling("printing"):
        page = print_page(hammer, asked, often, head=head, **passed)
    save = page.save
    views: dict[str, Any] = {name: Content(save, partial(page.plot, view=name)) for name in ("zoom", "sheet")}
    return Answer(
        [facts(on_paper(page, units))],
        note=f"{page.status.size} runs, {page.line.size} dots, computed in {job.seconds:.2g} s",
        files={"out": Content(save, page.plot), **views, "save": Content(asked.save)},
        complaints=ended_early(page.status.ravel()),
    )


def _pattern(
    text: str | None, path: Path | None, font: Path | None, wires: int | None, columns: int | None
) -> Pattern:
    from printhammer.printing.page.lettering import COLUMNS, WIRES
    from printhammer.printing.page.pattern import Pattern

    if path is not None:
        if text is not None:
            raise InputError("TEXT and --pattern: both are given", key="--pattern", expected="one of them")
        for name, value in (("--font", font), ("--columns", columns)):
            if value is not None:
                raise InputError(
                    f"{name} {value} is given beside --pattern {path}",
                    key=name,
                    value=value,
                    expected="with a text only",
                )
        return Pattern.load(path, wires)
    if text is None:
        raise InputError("TEXT and --pattern: neither is given", key="--pattern", expected="one of them")
    return Pattern.from_text(
        text.replace("\\n", "\n"),
        WIRES if wires is None else wires,
        font=font,
        columns=COLUMNS if columns is None else columns,
    )


def on_paper(page: Page, units: Units) -> list[tuple[str, str | None]]:
    """Return what is on the paper: dots, where they are, how dark they are."""
    import numpy as np

    on = page.printed
    dots = f"{page.line.size} wanted, {int(on.sum())} printed, {int(page.lost.sum())} lost"
    if not page.run.all():
        dots += f", {int((~page.run).sum())} not run"
    faults = ", ".join(f"{name} {count}" for name, count in page.fault_counts.items() if count)
    others = f"; the others by first fault: {faults}" if faults else ""
    rows: list[tuple[str, str | None]] = [
        ("dots", f"{dots}, {int(page.extra_contacts.sum())} extra contacts"),
        ("within limits", f"{int(page.good.sum())} of {page.line.size} dots{others}"),
        ("carriage", f"{page.rate:.6g} slots a second, {with_unit(page.speed, 'speed', units)}"),
    ]
    if not on.any():
        return rows
    error, flight, dark = page.placement_error[on], page.flight_time[on], page.darkness[on]
    worst = int(np.argmax(np.abs(error)))
    line, wire, slot = (part[on][worst] + 1 for part in (page.line, page.wire, page.slot))
    spread, most = (with_unit(float(value), "length", units) for value in (np.std(error), error[worst]))
    scatter, range_ = (with_unit(float(value), "time", units) for value in (np.std(flight), np.ptp(flight)))
    return [
        *rows,
        (
            "placement",
            f"spread {spread}, worst {most} (line {line}, wire {wire}, slot {slot}, counted from 1)",
        ),
        ("flight time", f"spread {scatter}, peak to peak {range_}"),
        (
            "darkness",
            f"{dark.min():.2f} to {dark.max():.2f}, mean {dark.mean():.2f}, spread {np.std(dark):.3f}",
        ),
    ]
