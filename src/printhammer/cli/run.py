"""The verb `run`: one hammer, one drive, its dots on the terminal and files on request."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.units import Units

if TYPE_CHECKING:
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.motion import Motion

EXAMPLE = "Example: printhammer run hendriks-1983 --at '0 us, 700 us' --units inch"
PULSES = 9
HAMMER = "hendriks-1983"


class Overlap(StrEnum):
    """What overlapping pulses do."""

    ADD = "add"
    REPLACE = "replace"


class Scheme(StrEnum):
    """Integrators."""

    DEFAULT = "default"
    TRAPEZOID = "trapezoid"
    RUNGE_KUTTA_4 = "runge-kutta-4"


_FILES = "Files (always SI)"
_DRIVE = "Drive (default: a single pulse)"

HammerArgument = Annotated[
    str, typer.Argument(metavar="HAMMER", help="A hammer file, or the name of a shipped hammer.")
]
UnitsOption = Annotated[Units, typer.Option(metavar="si|inch", help="Unit system on the terminal.")]


def _file(flag: str, text: str) -> Any:
    return typer.Option(flag, metavar="FILE", help=text, rich_help_panel=_FILES)


def _drive_option(metavar: str, text: str) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=_DRIVE)


def run(
    hammer: HammerArgument = HAMMER,
    rate: Annotated[str | None, _drive_option("RATE", "Firings per second, such as '1.2 kHz'.")] = None,
    period: Annotated[str | None, _drive_option("TIME", "Time between firings, such as '1.05 ms'.")] = None,
    at: Annotated[str | None, _drive_option("TIMES", "Firing times, such as '0 us, 700 us'.")] = None,
    pulses: Annotated[
        str | None, _drive_option("N", f"Number of firings with --rate or --period ({PULSES}).")
    ] = None,
    overlap: Annotated[
        Overlap | None,
        _drive_option("add|replace", "Overlapping pulses add up (default), or the latest replaces."),
    ] = None,
    drive: Annotated[Path | None, _drive_option("FILE", "A drive file instead.")] = None,
    duration: Annotated[
        str | None, typer.Option(metavar="TIME", help="End of the run (4 ms after the last firing).")
    ] = None,
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    scheme: Annotated[
        Scheme,
        typer.Option(
            metavar="NAME", help="Integrator: default, or those of 1983, trapezoid and runge-kutta-4."
        ),
    ] = Scheme.DEFAULT,
    points: Annotated[
        str | None, typer.Option(metavar="N", help="Points in the record of the motion.")
    ] = None,
    units: UnitsOption = Units.SI,
    csv: Annotated[Path | None, _file("--csv", "Record of the motion, CSV.")] = None,
    parquet: Annotated[Path | None, _file("--parquet", "Record of the motion, Parquet.")] = None,
    dots: Annotated[Path | None, _file("--dots", "Dots, .csv or .parquet.")] = None,
    contacts: Annotated[Path | None, _file("--contacts", "Contacts, .csv or .parquet.")] = None,
    json: Annotated[Path | None, _file("--json", "Dots, contacts, energies and provenance, JSON.")] = None,
    plot: Annotated[Path | None, _file("--plot", "Picture of the motion, .svg, .png or .pdf.")] = None,
) -> None:
    """Fire a hammer and tell what each pulse prints.

    Ends with status 1 where the run stopped before its end, which the status line names.
    """
    from printhammer.cli import run_files, run_screen
    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import announce_compiling, complain, console, load_checked
    from printhammer.drive.input import read_number
    from printhammer.run.problem import TOLERANCE
    from printhammer.run.simulate import simulate

    files = {"csv": csv, "parquet": parquet, "dots": dots, "contacts": contacts, "json": json, "plot": plot}
    wanted = {kind: path for kind, path in files.items() if path is not None}
    read = [Path(hammer), *([drive] if drive is not None else [])]
    run_files.check(wanted, read)
    loaded = load_checked(hammer)
    fired = _drive(
        loaded,
        drive,
        {"rate": rate, "period": period, "at": at, "pulses": whole(pulses, "pulses"), "overlap": overlap},
    )
    run_files.check(wanted, run_files.tables(loaded, Path(hammer), fired, drive))
    announce_compiling()
    motion: Motion = simulate(
        loaded,
        fired,
        duration=None if duration is None else read_number(duration, "s", "duration"),
        tolerance=TOLERANCE if tolerance is None else number(tolerance, "tolerance") or 0.0,
        points=whole(points, "points"),
        scheme=scheme.value,
    )
    screen = console()
    run_screen.show(motion, units, screen)
    run_files.write(motion, wanted)
    for path in wanted.values():
        say_written(screen, path)
    if not motion.ok:
        complain(motion.message)
        raise typer.Exit(1)


def _drive(hammer: Hammer, file: Path | None, options: dict[str, Any]) -> Drive:
    """Make the drive that the options describe."""
    from printhammer.drive.file import load_drive
    from printhammer.drive.trains import PulseTrain
    from printhammer.errors import InputError

    given = [name for name, value in options.items() if value is not None]
    if file is not None:
        if given:
            raise InputError(f"--{given[0]} is given beside --drive {file}, expected one or the other")
        return load_drive(file, hammer.waveform)
    if hammer.waveform is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [waveform] to fire, expected one, or --drive FILE"
        )
    at, pulses = options["at"], options["pulses"]
    if pulses is None and (options["rate"] is not None or options["period"] is not None):
        pulses = PULSES
    overlap = options["overlap"]
    return PulseTrain(
        hammer.waveform,
        rate=options["rate"],
        period=options["period"],
        at=None if at is None else [text.strip() for text in at.split(",")],
        pulses=pulses,
        overlap="add" if overlap is None else overlap.value,
    )
