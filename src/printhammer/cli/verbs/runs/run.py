"""The verb `run`: one hammer, one drive, its dots on the terminal and files on request."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.markup import escape
from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.options import Units, with_unit
from printhammer.cli.runner import Answer, Content, Job, tables_beside, verb
from printhammer.cli.screen import Column, coloured, facts, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.contacts import Dot
    from printhammer.run.motion import Motion

MOST_ROWS: Final = 40
"""Dots shown; of more, the first and the last."""

_DRIVE: Final = "Drive (default: a single pulse)"
_FILES: Final = "Files (always SI)"
_drive = partial(opt.text, panel=_DRIVE)
_record = partial(opt.file, panel=_FILES)


@verb(
    "run",
    "printhammer run hendriks-1983 --at '0 us, 700 us' --units inch",
    {
        "duration": opt.quantity("s", "TIME", "End of the run (4 ms after the last firing)."),
        "tolerance": opt.TOLERANCE,
        "scheme": opt.choice(
            "default|trapezoid|runge-kutta-4", "Integrator: default, or those of 1983.", default="default"
        ),
        "points": opt.whole("Points in the record of the motion."),
    },
    out=opt.results(
        "Motion, as .json its dots, contacts and energies",
        panel=_FILES,
    ),
    dots=_record("Dots, .csv or .parquet.", ".csv", ".parquet"),
    contacts=_record("Contacts, .csv or .parquet.", ".csv", ".parquet"),
)
def run(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    rate: str | None = _drive("RATE", "Firings per second, such as '1.2 kHz'."),
    period: str | None = _drive("TIME", "Time between firings, such as '1.05 ms'."),
    at: str | None = _drive("TIMES", "Firing times, such as '0 us, 700 us'."),
    pulses: int | None = opt.whole("Number of firings with --rate or --period (9).", panel=_DRIVE),
    overlap: str | None = opt.overlapping(_DRIVE),
    drive: Path | None = opt.source("A drive file instead.", panel=_DRIVE),
    units: Units = opt.UNITS,
    **passed: Any,
) -> Answer:
    """Fire a hammer and tell what each pulse prints.

    Ends with status 1 where the run stopped before its end, which the status line names.
    """
    from printhammer.cli.verbs.runs.motion_files import write_motion, write_rows
    from printhammer.run.simulate import simulate

    train = {"rate": rate, "period": period, "at": at, "pulses": pulses, "overlap": overlap}
    fired = _fired(hammer, drive, train)
    if drive is not None:
        job.check(*tables_beside(drive, fired.waveform))
    motion = simulate(hammer, fired, **passed)
    shown: list[Table | str] = [facts(summary(motion, units))]
    if fired.quantity == "current" or hammer.pack is not None:
        shown = [table(_COLUMNS, motion.dots, units, most=MOST_ROWS), "", *shown]
    return Answer(
        shown,
        note=escape(repr(motion.drive)[1:-1]),
        files={
            "out": Content(partial(write_motion, motion), motion.plot),
            "dots": Content(partial(write_rows, motion.dots)),
            "contacts": Content(partial(write_rows, motion.contacts)),
        },
        complaints=[] if motion.ok else [motion.message],
    )


def _fired(hammer: Hammer, file: Path | None, train: dict[str, Any]) -> Drive:
    """Make the drive that the options describe."""
    from printhammer.drive.file import load_drive
    from printhammer.drive.trains import PulseTrain

    beside = opt.given(**train)
    if file is not None:
        for name in beside:
            raise InputError(
                f"--{name} is given beside --drive {file}", key=f"--{name}", expected="one or the other"
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


def _remark(dot: Dot) -> str:
    if not dot.struck:
        return "[red]lost[/red]"
    if dot.contact_time is None:
        return "[yellow]open[/yellow]"
    return f"[yellow]+{dot.extra_contacts}[/yellow]" if dot.extra_contacts else ""


_COLUMNS: Final[tuple[Column[Dot], ...]] = (
    Column("dot", lambda dot: dot.index + 1),
    Column("fired", lambda dot: dot.fired_at, "time"),
    Column("flight", lambda dot: dot.flight_time, "time"),
    Column("speed", lambda dot: dot.impact_speed, "speed"),
    Column("force", lambda dot: dot.peak_force, "force"),
    Column("depth", lambda dot: dot.indentation, "length"),
    Column("contact", lambda dot: dot.contact_time, "time"),
    Column("work", lambda dot: dot.loading_work, "energy"),
    Column("loss", lambda dot: dot.net_loss, "energy"),
    Column("", _remark, left=True),
)


def summary(motion: Motion, units: Units) -> list[tuple[str, str | None]]:
    """Return status, dots, peak, contacts and energies."""
    state = coloured(motion.ok, "ok" if motion.ok else motion.status, "bold red")
    struck = sum(dot.struck for dot in motion.dots)
    lost = len(motion.dots) - struck
    rows: list[tuple[str, str | None]] = [
        ("status", f"{state}, {motion.end * 1e3:.4g} ms in {motion.steps} steps"),
        ("dots", f"{struck} struck" + (f", [red]{lost} lost[/red]" if lost else "")),
    ]
    times, x = motion.maxima
    if len(x):
        top = int(x.argmax())
        rows.append(
            ("peak", f"{with_unit(x[top], 'length', units)} at {with_unit(times[top], 'time', units)}")
        )
    for surface in ("pack", "backstop"):
        touches = [c for c in motion.contacts if c.surface == surface and not c.initial]
        forces = [c.peak_force for c in touches if c.peak_force is not None]
        up_to = f", up to {with_unit(max(forces), 'force', units)}" if forces else ""
        rows.append((surface, f"{len(touches)} {'touch' if len(touches) == 1 else 'touches'}{up_to}"))
    energy = motion.energy
    force = motion.drive.quantity == "force"
    work, pack, backstop, damping, armature = (
        with_unit(value, "energy", units)
        for value in (
            energy.drive_work if force else energy.coil_work,
            energy.pack_loss,
            energy.backstop_loss,
            energy.damping_loss,
            energy.kinetic + energy.stored,
        )
    )
    source = "drive" if force else "coil"
    damped = "" if motion.hammer.damping is None else f" + damping {damping}"
    residual = max(energy.residual, energy.electric_residual, key=abs)
    share = residual / energy.throughput if energy.throughput else 0.0
    if motion.drive.quantity == "voltage":
        rows.append(_supply_row(motion, units))
    return [
        *rows,
        (
            "energy",
            f"{source} {work} = pack {pack} + backstop {backstop}{damped} + armature {armature}",
        ),
        ("residual", f"{share:+.1e} of the energy that passed through"),
    ]


def _supply_row(motion: Motion, units: Units) -> tuple[str, str]:
    """Return what the supply of a voltage gave, and where it went."""
    energy = motion.energy
    supply, copper, driver, eddy, field, coil = (
        with_unit(value, "energy", units)
        for value in (
            energy.supply_work,
            energy.copper_loss,
            energy.driver_loss,
            energy.eddy_loss,
            energy.field,
            energy.coil_work,
        )
    )
    turn = f" + eddies {eddy}" if energy.eddy_loss else ""
    return "supply", f"{supply} = copper {copper} + driver {driver}{turn} + coil {coil} + field {field}"
