"""What `hammer show` shows: constants, and the statics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape
from rich.padding import Padding

from printhammer.cli.terminal import STATUS_STYLES, honesty, plain_table, warn
from printhammer.cli.units import with_unit

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from printhammer.cli.units import Units
    from printhammer.hammer.equilibrium import EquilibriumPicture
    from printhammer.hammer.hammer import Hammer


def show(hammer: Hammer, units: Units, screen: Console) -> None:
    """Print constants and statics of a hammer."""
    from printhammer.hammer.equilibrium import equilibrium_picture

    title = f"  {escape(hammer.title)}" if hammer.title else ""
    screen.print(f"[bold]{escape(hammer.name)}[/bold]{title}")
    screen.print(f"[dim]{escape(hammer.path)}, fingerprint {hammer.fingerprint[:16]}[/dim]", soft_wrap=True)
    screen.print(f"constants: {honesty(hammer)}\n")
    if hammer.note.strip():
        screen.print(Padding(escape(" ".join(hammer.note.split())), (0, 0, 1, 2)), style="italic")
    screen.print(constants_table(hammer))
    screen.print("\n[bold]sources[/bold]")
    for number, source in enumerate(sources_of(hammer), 1):
        screen.print(f"[dim]{number}  {escape(source)}[/dim]")
    screen.print()
    picture = equilibrium_picture(hammer)
    screen.print(statics_table(hammer, picture, units))
    for warning in hammer.warnings() if picture.rest is not None else [picture.no_rest]:
        warn(f"{hammer.path}: {warning}")


def constants_table(hammer: Hammer) -> Table:
    """Return the constants, with the law of each part before its own."""
    table = plain_table(
        ("constant", "left"), ("value", "right"), ("unit", "left"), ("SI", "right"), ("", "left"),
        ("status", "left"), ("source", "right"), ("meaning", "left"),
    )  # fmt: skip
    sources = sources_of(hammer)
    kinds = {role: f"law {part.law}" for role, part in hammer.parts.items()}
    if hammer.waveform is not None:
        kinds["waveform"] = f"shape {hammer.waveform.shape}"
    current = ""
    for key, constant in hammer.constants.items():
        section = key.rpartition(".")[0]
        if section != current:
            table.add_row("")
            table.add_row(f"[bold]\\[{section}][/bold]", f"[dim]{kinds.get(section, '')}[/dim]")
            current = section
        style = STATUS_STYLES[constant.status]
        same = constant.unit == constant.si_unit
        table.add_row(
            key.rpartition(".")[2],
            f"{constant.value:.9g}",
            escape(constant.unit),
            "" if same else f"{constant.si:.6g}",
            "" if same else escape(constant.si_unit),
            f"[{style}]{constant.status}[/{style}]",
            f"[dim]{sources.index(constant.source) + 1}[/dim]",
            f"[dim]{escape(constant.meaning)}[/dim]",
        )
    return table


def sources_of(hammer: Hammer) -> list[str]:
    """Return the sources of the constants, each once."""
    return list(dict.fromkeys(constant.source for constant in hammer.constants.values()))


def statics_table(hammer: Hammer, picture: EquilibriumPicture, units: Units) -> Table:
    """Return rest state, equilibria, release current and holding margin."""
    from printhammer.hammer.equilibrium import holding_margin

    table = plain_table(("statics, no current", "left"), ("", "left"))
    table.columns[0].style = "dim"
    if picture.rest is None:
        table.add_row("rest state", "[red]none[/red]")
    else:
        depth = None if hammer.position is None else hammer.position - picture.rest
        told = f", {with_unit(depth, 'length', units)} deep in the backstop" if depth else ""
        table.add_row("rest state", with_unit(picture.rest, "length", units) + told)
    for found in picture.equilibria:
        kind = "[green]stable[/green]" if found.stable else "[yellow]unstable[/yellow]"
        rate = f", {found.frequency / 1e3:.3f} kHz" if found.frequency is not None else ""
        where = f", in the {found.surface}" if found.surface else ""
        table.add_row("equilibrium", f"{with_unit(found.x, 'length', units)}  {kind}{rate}{where}")
    if hammer.magnet is not None and hammer.backstop is not None:
        table.add_row("release current", with_unit(picture.release_current, "current", units))
    places = {"backstop": hammer.position, "pack": hammer.front, "platen": hammer.platen}
    if hammer.magnet is not None or hammer.spring is not None:
        for name, x in places.items():
            if x is not None:
                margin = float(holding_margin(hammer, x))
                table.add_row(f"held at the {name}", _force(margin, units))
        x, margin = picture.weakest
        table.add_row("held least", f"{_force(margin, units)} at {with_unit(x, 'length', units)}")
    return table


def _force(margin: float, units: Units) -> str:
    text = with_unit(margin, "force", units)
    return text if margin > 0.0 else f"[yellow]{text}[/yellow]"
