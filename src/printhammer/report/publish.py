"""A report appears whole: it is made in a hidden folder and moved to its place at the end."""

from __future__ import annotations

import json
import re
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from printhammer.errors import InputError
from printhammer.support.outputs import make_folder

if TYPE_CHECKING:
    from collections.abc import Iterator

PAGE: Final = "index.html"
PICTURES: Final = "figures"
CLAIMS: Final = "claims.json"
PDF: Final = "report.pdf"

_PICTURE: Final = re.compile(r"figure\d\d\.(svg|pdf|png)")


def check_place(out: str | Path) -> None:
    """Make sure that a report writes over nothing in a folder but an earlier report, which it replaces.

    Raises
    ------
    InputError
        A file is there that is no part of an earlier report.
    """
    folder = Path(out)
    pictures = folder / PICTURES
    drawn = sorted(pictures.iterdir()) if pictures.is_dir() else []
    places = [*(folder / name for name in (PAGE, CLAIMS, PDF)), *filter(_is_picture, drawn)]
    there = [path for path in places if path.exists()]
    if there and not _is_report(folder):
        raise InputError(
            f"{there[0]}: expected a new folder or an earlier report, this file is of neither; --force writes"
            " over it"
        )


def _is_report(folder: Path) -> bool:
    """Tell whether a folder holds a report, even one that was not published to its end."""
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
    """Give a folder to write a report into; what is there at the end is moved to its place.

    Whatever ends the block early leaves the files of an earlier report as they were. While files are moved
    there is no page; it comes last, so that a page stands for a report that is complete.

    Parameters
    ----------
    out : path
        Folder of the report; made where it is missing.

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
            raise InputError(f"{place}: the file cannot be replaced ({error.strerror or error})") from None


def _publish(draft: Path, folder: Path) -> None:
    made = sorted(path.relative_to(draft) for path in draft.rglob("*") if path.is_file())
    pictures = folder / PICTURES
    pictures.mkdir(exist_ok=True)
    (folder / PAGE).unlink(missing_ok=True)
    # Pictures of an earlier report that this one does not have would pass for its own.
    for path in pictures.iterdir():
        if _is_picture(path) and path.relative_to(folder) not in made:
            path.unlink()
    for name in (CLAIMS, PDF):
        if Path(name) not in made:
            (folder / name).unlink(missing_ok=True)
    for path in sorted(made, key=lambda path: path.name == PAGE):
        (draft / path).replace(folder / path)
