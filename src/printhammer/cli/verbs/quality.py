"""The verbs `quality` and `print`: print quality at a rate, and the printed page."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, away_from_rest, ended_early, rate_text, verb
from printhammer.cli.screen import render
from printhammer.cli.terminal import warn
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.control.table.compensation import CompensationTable
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.page.pattern import Pattern

TABLE: Final = opt.source("Compensation table of the drive (.csv, .json), made by `printhammer tune`.")
SERIAL: Final = opt.text(
    "TEXT", "Serial number of the driven unit, for a learned table; 'any' skips the check."
)
FEEDBACK: Final = opt.switch("Drive with position feedback, as in `printhammer feedback` (slow).")


def chosen_strategy(
    job: Job, hammer: Hammer, table: Path | None, feedback: bool, serial: str | None = None
) -> tuple[dict[str, Any], CompensationTable | None]:
    """Return the keyword argument `strategy`, as a dict (empty for open loop), and the table, if any.

    Raises
    ------
    InputError
        Both a table and feedback are requested; a serial number is set without a table; or the table
        belongs to another hammer.
    """
    if serial is not None and table is None:
        raise InputError(f"--serial {serial}: expected a learned table, --table, as well", key="--serial")
    if feedback and table is not None:
        raise InputError(f"--table {table} and --feedback: expected one of them", key="--table")
    if table is not None:
        from printhammer.control.table.compensation import load_table

        loaded = load_table(table)
        return {"strategy": loaded.strategy(hammer, serial)}, loaded
    if not feedback:
        return {}, None
    from printhammer.control.feedback.closed_loop import FeedbackStrategy
    from printhammer.control.feedback.controller import Controller
    from printhammer.control.feedback.plant import driver_of

    with job.progress_bar("tables of the controller") as tell:
        return {"strategy": FeedbackStrategy(Controller(hammer, driver_of(hammer), progress=tell))}, None


_MORE: Final = "Instead of the report"
_GRID: Final = "Limits and grid of rates"
_report = partial(opt.text, panel="Report")
_more = partial(opt.text, panel=_MORE)
_grid = partial(opt.text, panel=_GRID)
_instead = partial(opt.switch, panel=_MORE)


@verb(
    "quality",
    "printhammer quality hendriks-1983 --rate 900Hz --out quality.png",
    out=opt.results("the result"),
)
def quality(
    job: Job,
    hammer: Hammer = opt.FIRED,
    rate: str | None = _report("RATE", "Dot slots per second, e.g. 900Hz."),
    pattern: str | None = _report(
        "SLOTS", "Dot pattern, one digit per slot, e.g. 10110111 (default: de Bruijn cycle of order 8)."
    ),
    pulses: int | None = opt.whole(
        "Number of dots in successive slots, instead of --pattern.", panel="Report"
    ),
    pitch: str | None = _report("LENGTH", "Distance between neighbouring slots (default: 1/60 in)."),
    paper: Path | None = opt.source(
        "File that describes how the paper varies along the line (.toml).", panel="Report"
    ),
    table: Path | None = TABLE,
    serial: str | None = SERIAL,
    feedback: bool = FEEDBACK,
    safe_rate: bool = _instead(
        "Find the highest rate up to which all patterns of eight slots are printed within the limits."
    ),
    yield_: int | None = opt.whole(
        "Number of random hammers; report the yield at --rate or, without --rate, the safe rates.",
        flag="--yield",
        panel=_MORE,
    ),
    damping: bool = _instead("Compare materials of backstop and pack at equal print force."),
    spread: list[str] | None = _more(
        "X|KEY=X",
        "Relative spread of all constants (1%) or one constant (magnet.Am=2%), with --yield; repeatable.",
        many=True,
    ),
    judged_by: str | None = _more(
        "own|design",
        "Reference dot, with --yield: single pulse of the same hammer (own) or of the nominal hammer"
        " (design).",
    ),
    seed: int | None = opt.whole("Seed for drawing the hammers of --yield (default: 0).", panel=_MORE),
    current: str | None = _more("CURRENT", "Limit on the current, with --damping (default: 2 A)."),
    limits: str = _grid(
        "NAME",
        "Preset of the limits on force and arrival time: slots (10 %, 50 µs), dot-matrix (10 %, 100 µs),"
        " engraved (10 %, 15 µs).",
        default="slots",
    ),
    force_limit: str | None = _grid(
        "X", "Limit on the force deviation, e.g. 10% (default: limit of the preset)."
    ),
    arrival_limit: float | None = opt.quantity(
        "s",
        "TIME",
        "Limit on the deviation of the arrival time, e.g. 50us (default: limit of the preset).",
        panel=_GRID,
    ),
    extra_contacts: int | None = opt.whole(
        "Number of pack contacts allowed beyond those of the single pulse, e.g. from bounces on a stop"
        " (default: 0).",
        panel=_GRID,
    ),
    first: str | None = _grid("RATE", "Lowest rate of the grid (default: 100 Hz; lower for a slow device)."),
    last: str | None = _grid("RATE", "Highest rate of the grid (default: 4 kHz; lower for a slow device)."),
    step: str | None = _grid(
        "RATE", "Rate step of the grid (default: 5 Hz, or 25 Hz for several hammers; less for a slow device)."
    ),
    tolerance: float | None = opt.TOLERANCE,
    threads: int | None = opt.THREADS,
    units: Units = opt.UNITS,
) -> Answer:
    """Report the print quality at a rate, the safe rate, the yield, or the effect of other materials.

    The exit status is 1 if a run stopped early.
    """
    from printhammer.printing.dots.judging import limits_named

    instead = {"safe-rate": safe_rate, "yield": yield_ is not None, "damping": damping}
    tasks = [name for name, wanted in instead.items() if wanted] or ["report"]
    if len(tasks) > 1:
        raise InputError(f"--{tasks[0]} and --{tasks[1]}: expected one of them", key=f"--{tasks[0]}")
    task = tasks[0]
    of_report = opt.given(rate=rate, pattern=pattern, pulses=pulses, pitch=pitch, paper=paper)
    of_drive = opt.given(table=table, serial=serial, feedback=feedback or None)
    of_grid = opt.given(first=first, last=last, step=step)
    of_draw = opt.given(spread=spread, judged_by=judged_by, seed=seed)
    _check_options(
        task, {*of_report, *of_drive, *of_grid, *of_draw, *opt.given(current=current, threads=threads)}
    )
    if task == "report" and rate is None:
        raise InputError(
            f"--rate: expected slots per second, such as --rate {rate_text(hammer, 900.0)!r}, or --safe-rate",
            key="--rate",
        )
    if pattern is not None and pulses is not None:
        raise InputError("--pattern and --pulses: expected one of them", key="--pattern")
    share = None if force_limit is None else opt.read_share(force_limit, "--force-limit")
    bounds = replace(
        limits_named(limits), **opt.given(force=share, arrival=arrival_limit, extra_contacts=extra_contacts)
    )
    strategy, loaded_table = chosen_strategy(job, hammer, table, feedback, serial)
    common: dict[str, Any] = {"limits": bounds, **opt.given(tolerance=tolerance), **strategy}
    many: dict[str, Any] = {**common, **of_grid, "threads": threads}
    if loaded_table is not None:
        # The safe rate is computed on the rates of the table, which covers no other rates.
        many = {"first": float(loaded_table.rates[0]), "last": float(loaded_table.rates[-1]), **many}
    result: Any
    bad: list[str] = []
    if task == "report":
        from printhammer.printing.dots.paper import Paper
        from printhammer.printing.rates.quality import quality as report

        with job.status_line("patterns"):
            slots = pattern if pulses is None else pulses
            varied = None if paper is None else Paper.load(paper)
            result = report(hammer, rate or 0.0, slots, **common, **opt.given(pitch=pitch, paper=varied))
        bad = [] if result.ok else [f"the run ended early: {result.status}"]
    elif task == "safe-rate":
        from printhammer.printing.rates.safe_rate import safe_rate as safe

        with job.status_line("patterns") as say:
            result = safe(hammer, progress=lambda at: say(f"patterns up to {at:g} Hz"), **many)
    elif task == "yield":
        from printhammer.printing.rates.tolerance import tolerance_yield

        spreads = _spreads(hammer, spread or [])
        if yield_ is None or yield_ < 1:
            raise InputError(f"--yield {yield_}: expected a number of hammers, 1 or more", key="--yield")
        drawn = opt.given(seed=seed, judged_by=judged_by)
        with job.progress_bar("hammers") as tell:
            result = tolerance_yield(hammer, rate, number=yield_, progress=tell, **spreads, **drawn, **many)
    else:
        from printhammer.printing.rates.damping import damping_study

        with job.progress_bar("materials") as tell:
            result = damping_study(hammer, progress=tell, **opt.given(current=current), **many)
    return Answer(
        [*render(result.summary(), units), *away_from_rest(hammer)],
        note=f"computed in {job.seconds:.2g} s",
        files={"out": Content.of(result)},
        complaints=bad,
    )


_TAKES: Final = {
    "report": {"rate", "pattern", "pulses", "pitch", "paper", "table", "serial", "feedback"},
    "safe-rate": {"table", "serial", "feedback", "first", "last", "step", "threads"},
    "yield": {"table", "serial", "rate", "spread", "judged_by", "seed", "first", "last", "step", "threads"},
    "damping": {"current", "first", "last", "step", "threads"},
}


def _check_options(task: str, options: set[str]) -> None:
    """Raise InputError if any of the set `options` belongs to a task other than `task`, such as "yield"."""

    def named(name: str) -> str:
        return "the report" if name == "report" else f"--{name}"

    odd = sorted(options - _TAKES[task])
    if odd:
        where = " or ".join(named(name) for name, takes in _TAKES.items() if odd[0] in takes)
        flag = odd[0].replace("_", "-")
        raise InputError(f"--{flag} is set, but belongs to {where}, not to {named(task)}", key=f"--{flag}")


def _spreads(hammer: Hammer, texts: list[str]) -> dict[str, Any]:
    """Parse the texts of --spread: one relative spread for all constants, or one per key."""
    from printhammer.printing.rates.tolerance import spreads_of

    if not texts:
        return {}
    common = [written for written in texts if "=" not in written]
    if len(common) > 1:
        raise InputError(
            f"--spread {common[1]}: expected one spread for all constants, but {common[0]} is set as well",
            key="--spread",
        )
    spreads = spreads_of(hammer, opt.read_share(common[0], "--spread")) if common else {}
    for written in texts:
        key, sign, value = written.partition("=")
        if sign:
            spreads[key.strip()] = opt.read_share(value, f"--spread {key.strip()}")
    return {"spreads": spreads}


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
        "Output file for the page (.png, .pdf, .svg) or its dots (.nc, .csv); repeatable. Default without any"
        " output option:"
        f" {', '.join(_USUAL)}.",
        ".nc",
        ".csv",
        panel=_FILES,
    ),
    zoom=opt.files(
        "Output file for a magnified view of the region with the largest error (.png, .pdf, .svg).",
        many=False,
        panel=_FILES,
    ),
    sheet=opt.files(
        "Output file for the sheet of paper alone, at true size (.png, .pdf, .svg).", many=False, panel=_FILES
    ),
    save=opt.file(
        "Output file for the requested dot pattern (.toml, .png, .pbm, .bmp).",
        ".toml",
        ".png",
        ".pbm",
        ".bmp",
        panel=_FILES,
    ),
)
def print_(
    job: Job,
    text: str | None = opt.argument("[TEXT]", "Text to print; \\n starts a new line."),
    rate: str | None = opt.text("RATE", "Dot slots per second on each wire, e.g. '1.2 kHz'."),
    hammer: Hammer = opt.HAMMER_OPTION,
    pattern: Path | None = opt.source(
        "Dot pattern to print (.toml), or a bitmap (.png, .pbm, .bmp).", panel=_PATTERN
    ),
    wires: int | None = opt.whole(
        "Number of wires of the print head, e.g. 9 (built-in font), 18 or 24.", panel=_PATTERN
    ),
    font: Path | None = opt.source(
        "TrueType font (default: built-in for 9 wires, else DejaVu Sans Mono).", panel=_PATTERN
    ),
    columns: int | None = opt.whole(
        "Maximum number of characters in a print line (default: 40).", panel=_PATTERN
    ),
    pitch: float | None = _length("Distance between slots (default: 1/60 in for 9 wires)."),
    wire_pitch: float | None = _length(
        "Distance between neighbouring wires (default: 1/8 in divided by the number of wires)."
    ),
    wire_diameter: float | None = _length(
        "Diameter of a wire (default: 0.35 mm for 9 wires).", flag="--wire"
    ),
    density: float | None = opt.number(
        "Optical density of a dot printed by a single pulse (default: 1).", panel=_HEAD
    ),
    line_gap: float | None = opt.number(
        "Gap between print lines, as a fraction of the print height (default: 1/3; 0 for a bitmap).",
        panel=_HEAD,
    ),
    limits: str | None = opt.text(
        "NAME", "Preset of the limits on force and arrival time: slots (default), dot-matrix or engraved."
    ),
    table: Path | None = TABLE,
    serial: str | None = SERIAL,
    feedback: bool = FEEDBACK,
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Print a text or a dot pattern at a rate, and draw the page.

    Every wire has its own hammer; every print line starts from rest. The exit status is 1 if a run stopped
    early.
    """
    from printhammer.drive.input import read_positive
    from printhammer.printing.dots.judging import limits_named
    from printhammer.printing.page.page import head_of, print_page
    from printhammer.printing.page.pattern import BITMAPS

    _warn_of_hammer(text, hammer)
    if rate is None:
        raise InputError(
            "--rate is missing",
            key="--rate",
            expected=f"slots per second such as {rate_text(hammer, 1200.0)!r}",
        )
    often = read_positive(rate, "Hz", "--rate")
    if not job.outputs:
        *pages, last = (Path(name) for name in _USUAL)
        job.wanted |= {"out": pages, "zoom": [last]}
        job.check()
    asked = _pattern(text, pattern, font, wires, columns)
    if line_gap is None and pattern is not None and pattern.suffix.lower() in BITMAPS:
        # The drawing of a bitmap continues from print line to print line, without a gap.
        line_gap = 0.0
    head = head_of(
        asked.wires,
        **opt.given(
            pitch=pitch,
            wire_pitch=wire_pitch,
            wire_diameter=wire_diameter,
            density=density,
            line_gap=line_gap,
        ),
    )
    if limits is not None:
        passed["limits"] = limits_named(limits)
    passed |= chosen_strategy(job, hammer, table, feedback, serial)[0]
    with job.status_line("printing"):
        page = print_page(hammer, asked, often, head=head, **passed)
    save = page.save
    views: dict[str, Any] = {name: Content(save, partial(page.plot, view=name)) for name in ("zoom", "sheet")}
    return Answer(
        [*render(page.summary(), units), *away_from_rest(hammer)],
        note=f"{page.status.size} runs, {page.line.size} dots, computed in {job.seconds:.2g} s",
        files={"out": Content(save, page.plot), **views, "save": Content(asked.save)},
        complaints=ended_early(page.status.ravel()),
    )


def _warn_of_hammer(text: str | None, hammer: Hammer) -> None:
    """Print a warning if the text to print is the name of a hammer or of a file, as other commands expect."""
    from printhammer.hammer.hammer import shipped

    if text is None or text in (hammer.name, hammer.path):
        return
    if text in shipped():
        warn(f"{text} is printed as a text; --hammer {text} selects the hammer")
    elif text.lower().endswith(".toml") and Path(text).is_file():
        warn(f"{text} is printed as a text; --hammer {text} loads a hammer, --pattern {text} a dot pattern")


def _pattern(
    text: str | None, path: Path | None, font: Path | None, wires: int | None, columns: int | None
) -> Pattern:
    from printhammer.printing.dots.lettering import COLUMNS, WIRES
    from printhammer.printing.page.pattern import Pattern

    if path is not None:
        if text is not None:
            raise InputError("TEXT and --pattern: both are set", key="--pattern", expected="one of them")
        for name, value in (("--font", font), ("--columns", columns)):
            if value is not None:
                raise InputError(
                    f"{name} {value} is given with --pattern {path}",
                    key=name,
                    value=value,
                    expected="this option with a text only",
                )
        return Pattern.load(path, wires)
    if text is None:
        raise InputError("TEXT and --pattern: both are missing", key="--pattern", expected="one of them")
    return Pattern.from_text(
        text.replace("\\n", "\n"),
        WIRES if wires is None else wires,
        font=font,
        columns=COLUMNS if columns is None else columns,
    )
