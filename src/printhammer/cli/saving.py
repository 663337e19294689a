"""Files that a verb writes: their names checked before any work, their contents written at its end."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from matplotlib.figure import Figure
    from rich.console import Console

    from printhammer.hammer.hammer import Hammer

PICTURES: Final = (".svg", ".png", ".pdf")
"""Endings of the names of pictures."""


def check_endings(paths: Iterable[Path], endings: Sequence[str], option: str = "--out") -> None:
    """Make sure that names end as what can be written there.

    Raises
    ------
    InputError
        One of them ends otherwise, or a package is missing that its format needs.
    """
    from printhammer.errors import InputError
    from printhammer.results.files import need_for

    for path in paths:
        if path.suffix.lower() not in endings:
            raise InputError(f"{option} {path}: expected a name that ends in one of {', '.join(endings)}")
        need_for(path)


def load_fired(name: str, wanted: Iterable[Path]) -> Hammer:
    """Load a hammer that is to be fired with its own waveform.

    Parameters
    ----------
    name : str
        Path of a hammer file, or name of a hammer that ships with the program.
    wanted : iterable of path
        What is to be written.

    Raises
    ------
    InputError
        There is no such hammer, it does not rest at its backstop, it has no waveform, or a table that it is
        read from is to be written.
    """
    from printhammer.cli import run_files
    from printhammer.cli.terminal import load_checked
    from printhammer.drive.trains import PulseTrain
    from printhammer.errors import InputError
    from printhammer.support.outputs import check_outputs

    loaded = load_checked(name)
    if loaded.waveform is None:
        raise InputError(f"{loaded.path}: the hammer has no [waveform] to fire, expected one")
    named = run_files.tables(loaded, Path(name), PulseTrain(loaded.waveform), None)
    check_outputs(wanted, [Path(name), *named])
    return loaded


def write_found(
    screen: Console,
    wanted: Iterable[Path],
    plot: Callable[[], Any],
    save: Callable[[Path], Any],
) -> None:
    """Write a result, as a picture where the name is that of one, and say so.

    Parameters
    ----------
    screen : Console
        Where it is said.
    wanted : iterable of path
        What is to be written.
    plot : callable
        Returns a matplotlib figure.
    save : callable
        Writes any other file.

    Raises
    ------
    InputError
        A file cannot be written.
    """
    for path in wanted:
        if path.suffix.lower() in PICTURES:
            write_picture(path, plot())
        else:
            save(path)
        say_written(screen, path)


def write_picture(path: Path, figure: Figure) -> None:
    """Write a figure; the end of the name, one of `PICTURES`, tells how.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    from printhammer.figures.elements.save import picture
    from printhammer.support.outputs import write_file

    write_file(path, picture(figure, path.suffix.lower()[1:]))


def say_written(screen: Console, path: Path) -> None:
    """Tell that a file was written."""
    screen.print(f"[dim]wrote[/dim] {path}", soft_wrap=True)
