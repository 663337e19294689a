"""The verbs `figure` and `paper`: one figure of the paper for any hammer, or all figures and claims."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Job, verb
from printhammer.cli.screen import Column, marked, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.results.summary import Style

_POINCARE: Final = 11  # Number of the figure of strobe points


@verb("figure", "printhammer figure 3 hendriks-1983 --out build/figures")
def figure(
    job: Job,
    number: str = opt.argument("N", "Figure number in the paper.", default=...),
    hammer: Hammer = opt.HAMMER,
    out: Path = opt.folder("Output folder for the figure files.", default=Path("build/figures")),
    scheme: str = opt.choice(
        "exact|runge-kutta-4|trapezoid",
        "Integrator for Fig. 11: exact, or one of the two schemes of the 1983 paper.",
        default="exact",
    ),
    reading: str = opt.choice(
        "firings|look-ahead|inside|grid|no-late-step",
        "Rule that decides when a 1983 scheme takes short steps at the backstop (only with --scheme).",
        default="firings",
    ),
) -> Answer:
    """Draw a figure of the paper as SVG, PNG and PDF."""
    from printhammer.figures import FIGURES, save
    from printhammer.figures.elements.save import FORMATS
    from printhammer.support.files import make_folder

    entry = FIGURES.get(opt.read_whole(number, "figure"))
    if entry is None:
        raise InputError.of("figure", number, f"one of {', '.join(map(str, FIGURES))}", written=str(number))
    if scheme == "exact" and reading != "firings":
        raise InputError.of(
            "--reading",
            reading,
            "--scheme as well, since the exact motion has no step size",
            written=str(reading),
        )
    if scheme != "exact" and entry.number != _POINCARE:
        raise InputError.of(
            "--scheme",
            scheme,
            f"this option with figure {_POINCARE}, not {entry.number}",
            written=str(scheme),
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


_STYLES: Final[dict[str, Style]] = {"holds": "good", "fails": "bad", "not yet": "poor"}


def _verdict(verdict: str, said: object) -> str:
    from printhammer.results.summary import styled

    return styled(_STYLES[verdict], said)


_COLUMNS: Final[tuple[Column[Any], ...]] = (
    Column("claim", lambda result: result.claim.name, left=True),
    Column("kind", lambda result: result.claim.kind, left=True),
    Column("verdict", lambda result: _verdict(result.verdict, result.verdict), left=True),
    Column("measured", lambda result: result.detail, left=True),
)


@verb("paper", "printhammer paper hendriks-1983 --out build/paper")
def paper(
    job: Job,
    hammer: Hammer = opt.HAMMER,
    out: Path = opt.folder(
        "Output folder for the report; an earlier report is replaced.", default=Path("build/paper")
    ),
    pdf: bool = opt.switch("Add a PDF version of the report, report.pdf."),
    strict: bool = opt.switch("Exit with status 1 if a claim fails."),
) -> Answer:
    """Reproduce all figures and claims of the paper: HTML report, figures and claims.json."""
    from printhammer.report import write_report
    from printhammer.report.build import check_place

    if not job.force:
        check_place(out)
    with job.progress_bar("paper,") as count:
        report = write_report(hammer, out, progress=count, pdf=pdf)
    counts = ", ".join(_verdict(verdict, f"{report.count(verdict)} {verdict}") for verdict in _STYLES)
    job.show(table(_COLUMNS, report.results), "", marked(f"{len(report.results)} claims: {counts}"))
    held, made = report.statements
    job.show(f"{held} of {made} statements hold, each panel of Fig. 11 counted as one.")
    reports = [path for path in report.files if path.parent == out]
    for path in reports:
        job.wrote(path)
    job.wrote(f"{out / 'figures'}, {len(report.files) - len(reports)} files")
    return Answer(failed=strict and report.count("fails") > 0)
