"""From a hammer to the files of its report."""

from __future__ import annotations

import json
import re
import tomllib
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.resources import files
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final

from printhammer.claims import Context, Result, buzz_search, judge_all
from printhammer.claims.verdicts import printed_verdicts
from printhammer.errors import InputError, PrinthammerError
from printhammer.outputs import make_folder, write_file

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

    from printhammer.hammer import Hammer

_BUZZ: Final = 7
_POINCARE: Final = 11


@dataclass(frozen=True)
class Drawing:
    """One figure of the paper, drawn.

    Attributes
    ----------
    number : int
        Number in the paper.
    title, caption : str
        What it is, and what it shows for this hammer.
    says : str
        What the paper says of it, in our words.
    svg : bytes
        The picture; empty where it could not be drawn.
    reason : str
        Why it could not be drawn; empty where it was.
    claims : tuple of Result
        Claims that cite the figure.
    seconds : float
        Time that it took.
    """

    number: int
    title: str
    caption: str
    says: str
    svg: bytes
    reason: str
    claims: tuple[Result, ...]
    seconds: float


@dataclass(frozen=True)
class Report:
    """What `write_report` found and wrote.

    Attributes
    ----------
    hammer : Hammer
        The hammer.
    results : list of Result
        The claims, judged.
    drawings : list of Drawing
        The figures.
    provenance : mapping
        Versions, fingerprint, tolerance.
    seconds : float
        Time that all took.
    files : list of Path
        What was written.
    """

    hammer: Hammer
    results: list[Result]
    drawings: list[Drawing]
    provenance: Mapping[str, str]
    seconds: float
    files: list[Path] = field(default_factory=list)

    def count(self, verdict: str) -> int:
        """Return how many claims have a verdict."""
        return sum(result.verdict == verdict for result in self.results)


def write_report(
    hammer: Hammer,
    out: str | Path,
    *,
    progress: Callable[[str], None] | None = None,
    claims: Iterable[str] | None = None,
    figures: Iterable[int] | None = None,
) -> Report:
    """Judge the claims, draw the figures, and write the report of a hammer.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    out : path
        Folder for `index.html`, `claims.json` and `figures/`; made where it is missing.
    progress : callable, optional
        Called with a phrase before each step.
    claims, figures : iterable, optional
        Names and numbers of those to report; by default all.

    Returns
    -------
    Report
        What was found, and the files.

    Raises
    ------
    InputError
        The folder cannot be written to; what was there stays.
    """
    from printhammer.report.page import page

    tell = progress or (lambda _: None)
    folder = make_folder(out)
    pictures = make_folder(folder / "figures")
    start = perf_counter()
    context = Context(hammer)
    results = judge_all(hammer, claims, progress=lambda name: tell(f"claim {name}"), context=context)
    drawn = None if figures is None else set(figures)
    written: list[Path] = []
    drawings = []
    for number, says in _sayings().items():
        if drawn is not None and number not in drawn:
            continue
        tell(f"figure {number}")
        drawing = _draw(context, number, says, results, pictures, written)
        if drawing is not None:
            drawings.append(drawing)
    report = Report(hammer, results, drawings, _provenance(hammer, context), perf_counter() - start, written)
    tell("page")
    for name, text in (("claims.json", claims_json(results)), ("index.html", page(report))):
        write_file(folder / name, text)
        written.append(folder / name)
    return report


def claims_json(results: list[Result]) -> str:
    """Return the claims as JSON: a list of objects with name, kind, value, band and verdict, and more."""
    return json.dumps([result.as_dict() for result in results], indent=2, allow_nan=False) + "\n"


def _sayings() -> dict[int, dict[str, str]]:
    """Return what the paper says of each figure."""
    text = files("printhammer").joinpath("report", "figures.toml").read_text(encoding="utf-8")
    return {int(number): entry for number, entry in tomllib.loads(text).items()}


def _draw(
    context: Context,
    number: int,
    says: Mapping[str, str],
    results: list[Result],
    folder: Path,
    written: list[Path],
) -> Drawing | None:
    """Draw a figure into a folder; None where there is no function for it."""
    from printhammer.figures import FIGURES, save

    if number not in FIGURES:
        return None
    entry = FIGURES[number]
    start = perf_counter()
    svg, reason = b"", ""
    try:
        options: dict[str, Any] = {}
        if number == _BUZZ:
            # The train of Fig. 7 has been sought already.
            options["search"] = buzz_search(context)
        elif number == _POINCARE:
            options["printed"] = printed_verdicts()
        figure = entry.draw(context.hammer, **options)
    except InputError as error:
        reason = str(error)
    else:
        paths = save(figure, folder, f"figure{number:02d}")
        svg = next(path for path in paths if path.suffix == ".svg").read_bytes()
        written += paths
    cited = tuple(result for result in results if number in _cited(result.claim.source))
    return Drawing(
        number, entry.title, entry.caption, says["says"], svg, reason, cited, perf_counter() - start
    )


def _cited(source: str) -> set[int]:
    """Return the numbers of the figures that a source names."""
    found = re.search(r"Figs?\. ([\d, and]+)", source)
    return {int(number) for number in re.findall(r"\d+", found[1])} if found else set()


def _provenance(hammer: Hammer, context: Context) -> dict[str, Any]:
    """Return versions and settings; those of a single motion where there is one."""
    import platform

    import matplotlib as mpl

    from printhammer import __version__

    found: dict[str, Any] = {"hammer": hammer.name, "hammer_fingerprint": hammer.fingerprint}
    with suppress(PrinthammerError):
        found |= context.single.provenance
    for name in ("drive", "drive_fingerprint", "status"):
        found.pop(name, None)
    found |= {"printhammer": __version__, "matplotlib": mpl.__version__, "python": platform.python_version()}
    return found
