"""The verb `figure`: one figure of the paper, for any hammer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Job, verb
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

_POINCARE: Final = 11


@verb("figure", "printhammer figure 3 hendriks-1983 --out build/figures")
def figure(
    job: Job,
    number: str = opt.argument("N", "Number of the figure in the paper.", default=...),
    hammer: Hammer = opt.HAMMER,
    out: Path = opt.folder("Where to write it.", default=Path("build/figures")),
) -> Answer:
    """Draw a figure of the paper as SVG, PNG and PDF."""
    from printhammer.figures import FIGURES, save
    from printhammer.support.outputs import make_folder

    entry = FIGURES.get(opt.read_whole(number, "figure"))
    if entry is None:
        raise InputError(f"figure = {number}: expected one of {', '.join(map(str, FIGURES))}")
    make_folder(out)
    job.screen.print(f"[bold]Figure {entry.number}[/bold]  {entry.title}")
    options = {}
    if entry.number == _POINCARE:
        from printhammer.claims.verdicts import printed_verdicts

        options["printed"] = printed_verdicts()
    for path in save(entry.draw(hammer, **options), out, f"figure{entry.number:02d}"):
        job.wrote(path)
    return Answer()
