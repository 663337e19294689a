"""What `run` shows on the terminal: a table of dots, and what else happened."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape

from printhammer.cli.terminal import honesty, plain_table
from printhammer.cli.units import shown, unit, with_unit

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from printhammer.cli.units import Units
    from printhammer.run.motion import Motion

MOST_ROWS = 40
"""Dots shown; of more, the first and the last."""

_COLUMNS = (
    ("fired", "fired_at", "time"),
    ("flight", "flight_time", "time"),
    ("speed", "impact_speed", "speed"),
    ("force", "peak_force", "force"),
    ("depth", "indentation", "length"),
    ("contact", "contact_time", "time"),
    ("work", "loading_work", "energy"),
    ("loss", "net_loss", "energy"),
)


def show(motion: Motion, units: Units, screen: Console) -> None:
    """Print the dots and a summary of a motion."""
    hammer = motion.hammer
    screen.print(f"[bold]{escape(hammer.name)}[/bold]  {honesty(hammer)}")
    screen.print(f"[dim]{escape(repr(motion.drive)[1:-1])}[/dim]\n")
    if motion.drive.quantity == "current" or hammer.pack is not None:
        screen.print(dots_table(motion, units))
        screen.print()
    screen.print(summary(motion, units))


def dots_table(motion: Motion, units: Units) -> Table:
    """Return the table of dots."""
    heads = [(f"{name}\n{unit(kind, units)}", "right") for name, _, kind in _COLUMNS]
    table = plain_table(("dot", "right"), *heads, ("", "left"))
    rows = []
    for dot in motion.dots:
        cells = [shown(getattr(dot, name), kind, units) for _, name, kind in _COLUMNS]
        remark = ""
        if not dot.struck:
            remark = "[red]lost[/red]"
        elif dot.contact_time is None:
            remark = "[yellow]open[/yellow]"
        elif dot.extra_contacts:
            remark = f"[yellow]+{dot.extra_contacts}[/yellow]"
        rows.append([str(dot.index + 1), *cells, remark])
    hidden = len(rows) - MOST_ROWS
    if hidden > 0:
        half = MOST_ROWS // 2
        rows[half:-half] = [["…"] * (1 + len(_COLUMNS)) + [f"[dim]{hidden} more[/dim]"]]
    for row in rows:
        table.add_row(*row)
    return table


def summary(motion: Motion, units: Units) -> Table:
    """Return status, dots, peak, contacts and energies, one row each."""
    table = plain_table(("", "left"), ("", "left"))
    table.show_header = False
    table.columns[0].style = "dim"
    state = "[green]ok[/green]" if motion.ok else f"[bold red]{motion.status}[/bold red]"
    table.add_row("status", f"{state}, {motion.end * 1e3:.4g} ms in {motion.steps} steps")
    struck = sum(dot.struck for dot in motion.dots)
    lost = len(motion.dots) - struck
    table.add_row("dots", f"{struck} struck" + (f", [red]{lost} lost[/red]" if lost else ""))
    times, x = motion.maxima
    if len(x):
        top = int(x.argmax())
        table.add_row(
            "peak", f"{with_unit(x[top], 'length', units)} at {with_unit(times[top], 'time', units)}"
        )
    for surface in ("pack", "backstop"):
        found = [c for c in motion.contacts if c.surface == surface and not c.initial]
        forces = [c.peak_force for c in found if c.peak_force is not None]
        told = f", up to {with_unit(max(forces), 'force', units)}" if forces else ""
        noun = "touch" if len(found) == 1 else "touches"
        table.add_row(surface, f"{len(found)} {noun}{told}")
    energy = motion.energy
    work = (
        f"drive {with_unit(energy.drive_work, 'energy', units)}"
        if motion.drive.quantity == "force"
        else f"coil {with_unit(energy.coil_work, 'energy', units)}"
    )
    table.add_row(
        "energy",
        f"{work} = pack {with_unit(energy.pack_loss, 'energy', units)}"
        f" + backstop {with_unit(energy.backstop_loss, 'energy', units)}"
        f" + armature {with_unit(energy.kinetic + energy.stored, 'energy', units)}",
    )
    share = energy.residual / energy.throughput if energy.throughput else 0.0
    table.add_row("residual", f"{share:+.1e} of the energy that passed through")
    return table
