"""The verb `print`: a text or a pattern on paper, as the hammer prints it at a rate."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, UnitsOption
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from rich.table import Table

    from printhammer.printing.page.page import Page
    from printhammer.printing.page.pattern import Pattern

EXAMPLE: Final = "Example: printhammer print 'Bounce and chaotic motion' --rate 1.4kHz --out page.png"

_USUAL: Final = ("printed.png", "printed.pdf", "printed-zoom.png")
_PATTERN: Final = "What to print (a text, or --pattern)"
_HEAD: Final = "Print head"
_FILES: Final = "Files"


def _option(panel: str, flag: str, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=panel)


def print_(
    text: Annotated[
        str | None, typer.Argument(metavar="[TEXT]", help="Text to print; \\n begins a new line.")
    ] = None,
    rate: Annotated[
        str | None,
        typer.Option("--rate", metavar="RATE", help="Slots per second on each wire, such as '1.2 kHz'."),
    ] = None,
    hammer: Annotated[
        str, typer.Option("--hammer", metavar="HAMMER", help="Name of a shipped hammer, or a hammer file.")
    ] = HAMMER,
    pattern: Annotated[
        Path | None,
        _option(_PATTERN, "--pattern", "FILE", "Pattern file (.toml) or bitmap (.png, .pbm, .bmp)."),
    ] = None,
    wires: Annotated[
        str | None,
        _option(_PATTERN, "--wires", "N", "Wires: 9 (the built-in font), 18, 24 or another number."),
    ] = None,
    font: Annotated[
        Path | None,
        _option(
            _PATTERN, "--font", "FILE", "TrueType font (built-in for 9 wires, DejaVu Sans Mono for others)."
        ),
    ] = None,
    columns: Annotated[
        str | None, _option(_PATTERN, "--columns", "N", "Most characters of a print line (40).")
    ] = None,
    pitch: Annotated[
        str | None, _option(_HEAD, "--pitch", "LENGTH", "From slot to slot (1/60 in for 9 wires).")
    ] = None,
    wire_diameter: Annotated[
        str | None, _option(_HEAD, "--wire", "LENGTH", "Thickness of the wires (0.35 mm for 9 wires).")
    ] = None,
    density: Annotated[
        str | None, _option(_HEAD, "--density", "X", "Optical density of the dot of a single pulse (1).")
    ] = None,
    line_gap: Annotated[
        str | None,
        _option(
            _HEAD,
            "--line-gap",
            "X",
            "Between print lines, in parts of the height of the wires (1/3; 0 for a bitmap).",
        ),
    ] = None,
    limits: Annotated[
        str | None,
        typer.Option("--limits", metavar="NAME", help="Limits: slots (default), dot-matrix or engraved."),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option("--table", metavar="FILE", help="Compensation table of the hammer (.csv, .json)."),
    ] = None,
    feedback: Annotated[
        bool,
        typer.Option("--feedback", help="Drive with feedback, see `printhammer feedback`; takes a while."),
    ] = False,
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (all cores).")] = None,
    units: UnitsOption = Units.SI,
    out: Annotated[
        list[Path] | None,
        _option(
            _FILES,
            "--out",
            "FILE",
            "Page (.png, .pdf, .svg) or its dots (.nc, .csv, .json, .zarr, .parquet); repeatable. Without"
            f" --out, --zoom, --sheet and --save: {', '.join(_USUAL)}.",
        ),
    ] = None,
    zoom: Annotated[
        Path | None, _option(_FILES, "--zoom", "FILE", "Picture of the worst place (.png, .pdf, .svg).")
    ] = None,
    sheet: Annotated[
        Path | None,
        _option(_FILES, "--sheet", "FILE", "The paper alone, at its true size (.png, .pdf, .svg)."),
    ] = None,
    save: Annotated[
        Path | None,
        _option(_FILES, "--save", "FILE", "The pattern itself (.toml, .png, .pbm, .bmp)."),
    ] = None,
) -> None:
    """Print a text or a pattern of dots at a rate, and see the page.

    A hammer on every wire, each print line from rest. Ends with status 1 where a run stopped before its end.
    """
    from rich.markup import escape

    from printhammer.cli.feedback import feedback_strategy
    from printhammer.cli.saving import PICTURES, check_endings, say_written, write_found
    from printhammer.cli.terminal import announce_compiling, complain, console, honesty, load_checked
    from printhammer.errors import InputError
    from printhammer.printing.dots.limits import limits_named
    from printhammer.printing.dots.nominal import rate_of
    from printhammer.printing.page.page import Page, print_page
    from printhammer.printing.page.pattern_file import BITMAPS, SUFFIXES
    from printhammer.support.outputs import check_outputs

    if rate is None:
        raise InputError("--rate is missing, expected slots per second such as '1.2 kHz'")
    often = rate_of(rate, "--rate")
    if feedback and table is not None:
        raise InputError(f"--table {table} and --feedback: expected one of them")
    wanted = list(out or [])
    views = [(path, "zoom") for path in (zoom,) if path] + [(path, "sheet") for path in (sheet,) if path]
    if not wanted and not views and save is None:
        *pages, last = (Path(name) for name in _USUAL)
        wanted, views = pages, [(last, "zoom")]
    check_endings(wanted, (*PICTURES, *Page.ENDINGS))
    check_endings([zoom] if zoom else [], PICTURES, "--zoom")
    check_endings([sheet] if sheet else [], PICTURES, "--sheet")
    check_endings([save] if save else [], SUFFIXES, "--save")
    read = [path for path in (pattern, font, table, Path(hammer)) if path is not None]
    check_outputs([*wanted, *(path for path, _view in views), *([save] if save else [])], read)
    asked = _pattern(text, pattern, font, whole(wires, "--wires"), whole(columns, "--columns"))
    gap = number(line_gap, "--line-gap")
    if gap is None and pattern is not None and pattern.suffix.lower() in BITMAPS:
        # A drawing goes on from print line to print line.
        gap = 0.0
    head = _head(asked.wires, pitch, wire_diameter, number(density, "--density"), gap)
    options: dict[str, Any] = {
        "tolerance": number(tolerance, "tolerance"),
        "threads": whole(threads, "threads"),
        "limits": None if limits is None else limits_named(limits),
    }
    loaded = load_checked(hammer)
    if table is not None:
        from printhammer.control.table.compensation import load_table

        options["strategy"] = load_table(table).strategy(loaded)
    announce_compiling()
    if feedback:
        options["strategy"] = feedback_strategy(loaded)
    screen = console()
    begin = perf_counter()
    page = print_page(
        loaded, asked, often, head=head, **{key: value for key, value in options.items() if value is not None}
    )
    seconds = perf_counter() - begin
    screen.print(f"[bold]{escape(loaded.name)}[/bold]  {honesty(loaded)}")
    screen.print(f"[dim]{page.status.size} runs, {page.line.size} dots, computed in {seconds:.2g} s[/dim]\n")
    screen.print(told(page, units))
    write_found(screen, wanted, page.plot, page.save)
    for path, view in views:
        write_found(screen, [path], partial(page.plot, view=view), page.save)
    if save is not None:
        asked.save(save)
        say_written(screen, save)
    failed = page.status[page.status != "ok"]
    if failed.size:
        kinds = ", ".join(sorted(set(failed.tolist())))
        complain(f"{failed.size} of {page.status.size} runs ended early: {kinds}")
        raise typer.Exit(1)


def _pattern(
    text: str | None, path: Path | None, font: Path | None, wires: int | None, columns: int | None
) -> Pattern:
    from printhammer.errors import InputError
    from printhammer.printing.page.lettering import COLUMNS
    from printhammer.printing.page.matrix_font import WIRES
    from printhammer.printing.page.pattern import Pattern

    if (text is None) == (path is None):
        given = "neither is" if text is None else "both are"
        raise InputError(f"TEXT and --pattern: {given} given, expected one of them")
    if path is not None:
        for name, value in (("--font", font), ("--columns", columns)):
            if value is not None:
                raise InputError(
                    f"{name} {value} is given beside --pattern {path}, expected with a text only"
                )
        return Pattern.load(path, wires)
    assert text is not None
    return Pattern.from_text(
        text.replace("\\n", "\n"),
        WIRES if wires is None else wires,
        font=font,
        columns=COLUMNS if columns is None else columns,
    )


def _head(
    wires: int, pitch: str | None, wire_diameter: str | None, density: float | None, gap: float | None
) -> Any:
    from printhammer.drive.input import read_positive
    from printhammer.printing.page.head import DENSITY, LINE_GAP, head_of

    return head_of(
        wires,
        pitch=None if pitch is None else read_positive(pitch, "m", "--pitch"),
        wire_diameter=None if wire_diameter is None else read_positive(wire_diameter, "m", "--wire"),
        density=DENSITY if density is None else density,
        line_gap=LINE_GAP if gap is None else gap,
    )


def told(page: Page, units: Units) -> Table:
    """Return what is on the paper: dots, where they are, how dark they are."""
    import numpy as np

    from printhammer.cli.terminal import plain_table
    from printhammer.cli.units import with_unit

    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    on = page.printed
    dots = f"{page.line.size} wanted, {int(on.sum())} printed, {int(page.lost.sum())} lost"
    if not page.run.all():
        dots += f", {int((~page.run).sum())} not run"
    table.add_row("dots", f"{dots}, {int(page.extra_contacts.sum())} extra contacts")
    faults = ", ".join(f"{name} {count}" for name, count in page.fault_counts.items() if count)
    others = f"; the others by first fault: {faults}" if faults else ""
    table.add_row("within limits", f"{int(page.good.sum())} of {page.line.size} dots{others}")
    speed = with_unit(page.speed, "speed", units)
    table.add_row("carriage", f"{page.rate:.6g} slots a second, {speed}")
    if on.any():
        error, flight = page.placement_error[on], page.flight_time[on]
        worst = int(np.argmax(np.abs(error)))
        where = [part[on][worst] + 1 for part in (page.line, page.wire, page.slot)]
        spread, most = (with_unit(float(value), "length", units) for value in (np.std(error), error[worst]))
        table.add_row(
            "placement",
            f"spread {spread}, worst {most}"
            f" (line {where[0]}, wire {where[1]}, slot {where[2]}, counted from 1)",
        )
        table.add_row(
            "flight time",
            f"spread {with_unit(float(np.std(flight)), 'time', units)}, peak to peak"
            f" {with_unit(float(np.ptp(flight)), 'time', units)}",
        )
        dark = page.darkness[on]
        table.add_row(
            "darkness",
            f"{dark.min():.2f} to {dark.max():.2f}, mean {dark.mean():.2f}, spread {np.std(dark):.3f}",
        )
    return table
