"""The verb `run`: simulate one hammer under one drive; show its dots and write files on request."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, tables_beside, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer

_DRIVE: Final = "Drive (default: a single pulse)"
_FILES: Final = "Files (always SI)"
_drive = partial(opt.text, panel=_DRIVE)
_record = partial(opt.file, panel=_FILES)


@verb(
    "run",
    "printhammer run hendriks-1983 --at '0 us, 700 us' --units inch",
    {
        "duration": opt.quantity(
            "s", "TIME", "End time of the run (default: 4 ms after the last firing, later for a slow device)."
        ),
        "tolerance": opt.TOLERANCE,
        "scheme": opt.choice(
            "default|trapezoid|runge-kutta-4",
            "Integrator: the default, or one of the two schemes of the 1983 paper.",
            default="default",
        ),
        "points": opt.whole("Number of time points of the saved motion."),
    },
    out=opt.files(
        "Output file: the motion (.nc, .zarr, .csv, .parquet; SI), its dots, contacts and energies (.json),"
        " or a picture (.svg, .png, .pdf); repeatable.",
        *opt.DATA,
        panel=_FILES,
    ),
    dots=_record("Output file for the table of dots (.csv, .parquet).", ".csv", ".parquet"),
    contacts=_record("Output file for the table of contacts (.csv, .parquet).", ".csv", ".parquet"),
    closings=_record("Output file for the closings of contacts (.csv, .parquet).", ".csv", ".parquet"),
    timings=opt.files(
        "Output file for operate, release and bounce times of contacts (.csv, .parquet), or a picture of the"
        " contacts (.svg, .png, .pdf); repeatable.",
        ".csv",
        ".parquet",
        panel=_FILES,
    ),
)
def run(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    rate: str | None = _drive("RATE", "Firings per second, e.g. '1.2 kHz'."),
    period: str | None = _drive("TIME", "Time between firings, e.g. '1.05 ms'."),
    at: str | None = _drive("TIMES", "Firing times, e.g. '0 us, 700 us'."),
    pulses: int | None = opt.whole("Number of firings for --rate or --period (default: 9).", panel=_DRIVE),
    overlap: str | None = opt.overlapping(_DRIVE),
    drive: Path | None = opt.source("Drive file, instead of --rate, --period or --at.", panel=_DRIVE),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Simulate a hammer under a drive and report the dot that each pulse prints.

    The exit status is 1 if the run stopped early; the status line gives the reason.
    """
    from printhammer.run.simulate import simulate

    train = {"rate": rate, "period": period, "at": at, "pulses": pulses, "overlap": overlap}
    fired = _drive_of(hammer, drive, train)
    if drive is not None:
        job.check(*tables_beside(drive, getattr(fired.waveform, "file", None)))
    motion = simulate(hammer, fired, **passed)
    return Answer(
        render(motion.summary(), units),
        note=escape(repr(motion.drive)[1:-1]),
        files={
            "out": Content(motion.write, motion.plot),
            "dots": Content(motion.dots.save),
            "contacts": Content(motion.contacts.save),
            "closings": Content(motion.closings.save),
            "timings": Content(motion.timings.save, partial(motion.plot, picture="timings")),
        },
        complaints=[] if motion.ok else [motion.message],
    )


def _drive_of(hammer: Hammer, file: Path | None, train: dict[str, Any]) -> Drive:
    """Build the drive from the options of the command line."""
    from printhammer.drive.file import load_drive
    from printhammer.drive.trains import PulseTrain

    beside = opt.given(**train)
    if file is not None:
        for name in beside:
            raise InputError(
                f"--{name} is given with --drive {file}",
                key=f"--{name}",
                expected="only one of these options",
            )
        return load_drive(file, hammer.waveform)
    if hammer.waveform is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [waveform] to fire",
            file=hammer.path,
            key="waveform",
            expected="one, or --drive FILE",
        )
    if "at" in beside:
        beside["at"] = [each.strip() for each in beside["at"].split(",")]
    return PulseTrain(hammer.waveform, **beside)
