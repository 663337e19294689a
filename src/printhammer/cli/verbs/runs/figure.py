"""The verb `figure`: one figure of the paper, for any hammer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

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
    scheme: str = opt.choice(
        "exact|runge-kutta-4|trapezoid",
        "Of Fig. 11: its points exactly, or as an integrator of 1983 computes them.",
        default="exact",
    ),
    reading: str = opt.choice(
        "firings|look-ahead|inside|grid|no-late-step",
        "With that: when its short step is taken, into and out of the backstop.",
        default="firings",
    ),
) -> Answer:
    """Draw a figure of the paper as SVG, PNG and PDF."""
    from printhammer.figures import FIGURES, save
    from printhammer.figures.elements.save import FORMATS
    from printhammer.support.files import make_folder

    entry = FIGURES.get(opt.read_whole(number, "figure"))
    if entry is None:
        raise InputError.of(
            "figure", number, f"one of {', '.join(map(str, FIGURES))}", written=str(number), said=": expected"
        )
    if scheme == "exact" and reading != "firings":
        raise InputError.of(
            "--reading", reading, "it with --scheme, since the exact motion has no step", written=str(reading)
        )
    if scheme != "exact" and entry.number != _POINCARE:
        raise InputError.of(
            "--scheme", scheme, f"it with figure {_POINCARE}, not {entry.number}", written=str(scheme)
        )
    options: dict[str, Any] = {}
    name = f"figure{entry.number:02d}"
    if entry.number == _POINCARE:
        from printhammer.claims.verdicts import printed_verdicts

        options["printed"] = printed_verdicts()
        if scheme != "exact":
            options |= {"scheme": scheme, "reading": reading}
            name = f"{name}-{scheme}-{reading}"
    job.check_new(out / f"{name}.{kind}" for kind in FORMATS)
    make_folder(out)
    job.screen.print(f"[bold]Figure {entry.number}[/bold]  {entry.title}")
    for path in save(entry.draw(hammer, **options), out, name):
        job.wrote(path)
    return Answer()
