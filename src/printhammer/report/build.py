"""Write a report: evaluate the claims, draw the figures, and publish page and files.

A report is written to a hidden folder first, and moved to its place when it is complete.
"""

from __future__ import annotations

import itertools
import json
import re
import tempfile
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib.resources import files
from pathlib import Path
from time import perf_counter
from typing import Any, Final

from printhammer.claims import Context, JudgedClaim, buzz_search, judge_all
from printhammer.claims import claims as every_claim
from printhammer.claims.verdicts import panel_strobes, printed_verdicts
from printhammer.errors import InputError, PrinthammerError
from printhammer.hammer.hammer import Hammer
from printhammer.report.contents import Drawing, Report, cited_figures
from printhammer.report.reconstruction.results import BaseRates, Results, shipped_results
from printhammer.support.files import make_folder, write_file

PAGE: Final = "index.html"
PICTURES: Final = "figures"
CLAIMS: Final = "claims.json"
PDF: Final = "report.pdf"

_PICTURE: Final = re.compile(r"figure\d\d\.(svg|pdf|png)")


def check_place(out: str | Path) -> None:
    """Raise InputError if a report in the folder `out` would overwrite files other than an earlier report."""
    folder = Path(out)
    pictures = folder / PICTURES
    drawn = sorted(pictures.iterdir()) if pictures.is_dir() else []
    places = [*(folder / name for name in (PAGE, CLAIMS, PDF)), *filter(_is_picture, drawn)]
    there = [path for path in places if path.exists()]
    if there and not _is_report(folder):
        raise InputError(
            f"{there[0]}: expected a new folder or an earlier report, this file belongs to neither; --force"
            " overwrites it",
            file=there[0],
        )


def _is_report(folder: Path) -> bool:
    """Whether a folder contains a report, complete or incomplete."""
    try:
        claims = json.loads((folder / CLAIMS).read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(claims, list) and all(
        isinstance(c, dict) and {"name", "verdict"} <= c.keys() for c in claims
    )


def _is_picture(path: Path) -> bool:
    return _PICTURE.fullmatch(path.name) is not None


@contextmanager
def staged(out: str | Path) -> Iterator[Path]:
    """Yield a temporary folder for a report; its contents are moved to `out` at the end.

    If the context ends with an exception, an earlier report stays intact. The page is moved last, so that a
    page implies a complete report. The folder `out` is created if missing.

    Raises
    ------
    InputError
        The folder cannot be written to, or a file of an earlier report cannot be replaced.
    """
    folder = make_folder(out)
    with tempfile.TemporaryDirectory(prefix=".report-", dir=folder) as name:
        draft = Path(name)
        (draft / PICTURES).mkdir()
        yield draft
        try:
            _publish(draft, folder)
        except OSError as error:
            place = error.filename2 or error.filename or folder
            raise InputError(
                f"{place}: the file cannot be replaced ({error.strerror or error})", file=place
            ) from None


def _publish(draft: Path, folder: Path) -> None:
    made = sorted(path.relative_to(draft) for path in draft.rglob("*") if path.is_file())
    pictures = folder / PICTURES
    pictures.mkdir(exist_ok=True)
    (folder / PAGE).unlink(missing_ok=True)
    # Remove pictures of an earlier report, which readers could mistake for pictures of this report.
    for path in pictures.iterdir():
        if _is_picture(path) and path.relative_to(folder) not in made:
            path.unlink()
    for name in (CLAIMS, PDF):
        if Path(name) not in made:
            (folder / name).unlink(missing_ok=True)
    for path in sorted(made, key=lambda path: path.name == PAGE):
        (draft / path).replace(folder / path)


_BUZZ: Final = 7  # Number of the figure of buzz printing
_POINCARE: Final = 11  # Number of the figure of strobe points


def write_report(
    hammer: Hammer,
    out: str | Path,
    *,
    progress: Callable[[int, int, str], None] | None = None,
    claims: Iterable[str] | None = None,
    figures: Iterable[int] | None = None,
    reconstruction: Results | None = None,
    pdf: bool = False,
) -> Report:
    """Evaluate the claims, draw the figures, and write the report of a hammer.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    out : path
        Folder for `index.html`, `claims.json` and `figures/`; created if missing.
    progress : callable, optional
        Called before each step with the number of steps done, the total, and a phrase for the next step.
    claims, figures : iterable, optional
        Names of claims and numbers of figures to report; by default all.
    reconstruction : Results, optional
        Results of the reconstruction; by default those that ship with the package.
    pdf : bool, optional
        Whether to write `report.pdf` too, which needs the extra `pdf`.

    Returns
    -------
    Report
        The evaluated claims, the figures, and the written files.

    Raises
    ------
    InputError
        The folder cannot be written to, a result of the reconstruction cannot be read, or the packages for a
        PDF are missing. An existing report is kept.
    """
    from printhammer.report.page import page
    from printhammer.report.pdf import check_typesetter, write_pdf

    reconstruction = shipped_results() if reconstruction is None else reconstruction
    reconstruction.check()
    if pdf:
        check_typesetter()
    sayings = tomllib.loads(files("printhammer").joinpath("report", "figures.toml").read_text("utf-8"))
    drawn = None if figures is None else set(figures)
    numbered = {int(name): says for name, says in sayings.items() if drawn is None or int(name) in drawn}
    wanted = set(every_claim() if claims is None else claims) & set(every_claim())
    steps, done = len(wanted) + len(numbered) + 1 + pdf, itertools.count()

    def tell(what: str) -> None:
        if progress is not None:
            progress(next(done), steps, what)

    with staged(out) as folder:
        start = perf_counter()
        context = Context(hammer)
        results = judge_all(hammer, wanted, progress=lambda name: tell(f"claim {name}"), context=context)
        written: list[Path] = []
        drawings = []
        for number, says in numbered.items():
            tell(f"figure {number}")
            drawing = _draw(context, number, says, results, folder / PICTURES, written)
            if drawing is not None:
                drawings.append(drawing)
        provenance = _provenance(hammer, context)
        took = perf_counter() - start
        report = Report(hammer, results, drawings, provenance, reconstruction, took, written)
        tell("page")
        for name, text in ((CLAIMS, claims_json(results, reconstruction.base_rates)), (PAGE, page(report))):
            write_file(folder / name, text)
            written.append(folder / name)
        if pdf:
            tell("PDF")
            write_pdf(report, folder / PDF)
            written.append(folder / PDF)
        places = [path.relative_to(folder) for path in written]
    written[:] = [Path(out) / place for place in places]
    return report


def claims_json(results: list[JudgedClaim], rates: BaseRates | None = None) -> str:
    """Return the evaluated claims as JSON: a list of objects with name, kind, value, band and verdict.

    Each object also has `base_rate`, the fraction of random hammers for which the claim holds, from `rates`;
    null if unknown.
    """
    entries = []
    for result in results:
        share = rates.share(result.claim.name) if rates is not None else None
        entries.append({**result.as_dict(), "base_rate": None if share is None else share.as_dict()})
    return json.dumps(entries, indent=2, allow_nan=False) + "\n"


def _draw(
    context: Context,
    number: int,
    says: Mapping[str, str],
    results: list[JudgedClaim],
    folder: Path,
    written: list[Path],
) -> Drawing | None:
    """Draw the figure `number` into a folder; return None if no drawing function exists for the number.

    `says` is the entry of the figure in the list of figures of the paper, `results` are the evaluated claims.
    The paths of the files are appended to `written`.
    """
    from printhammer.figures import FIGURES, save

    if number not in FIGURES:
        return None
    entry = FIGURES[number]
    start = perf_counter()
    svg, reason, paths = b"", "", dict[str, Path]()
    options: dict[str, Any] = {}
    try:
        if number == _BUZZ:
            # The evaluation of the claim has already found the pulse train of Fig. 7.
            options["search"] = buzz_search(context)
        elif number == _POINCARE:
            options["printed"] = printed_verdicts()
            options["strobes"] = panel_strobes(context)
        figure = entry.draw(context.hammer, **options)
    except InputError as error:
        reason = str(error)
    else:
        paths = {path.suffix: path for path in save(figure, folder, f"figure{number:02d}")}
        svg = paths[".svg"].read_bytes()
        written += paths.values()
    cited = tuple(result for result in results if number in cited_figures(result.claim.source))
    vectors = Path(PICTURES, paths[".pdf"].name) if paths else None
    text, took = " ".join(says["says"].split()), perf_counter() - start
    return Drawing(number, entry.title, entry.caption, text, svg, vectors, reason, cited, took)


def _provenance(hammer: Hammer, context: Context) -> dict[str, Any]:
    """Return the provenance of the report: hammer, settings and software versions."""
    import platform

    import matplotlib as mpl

    from printhammer import __version__

    settings: dict[str, Any] = {"hammer": hammer.name, "hammer_fingerprint": hammer.fingerprint}
    with suppress(PrinthammerError):
        settings |= context.single.provenance
    for name in ("drive", "drive_fingerprint", "waveform", "overlap", "status"):
        settings.pop(name, None)
    settings |= {
        "printhammer": __version__,
        "matplotlib": mpl.__version__,
        "python": platform.python_version(),
    }
    return settings
