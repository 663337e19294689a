"""A report appears whole: it is made in a hidden folder and moved to its place at the end."""

from __future__ import annotations

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
        if _PICTURE.fullmatch(path.name) and path.relative_to(folder) not in made:
            path.unlink()
    for name in (CLAIMS, PDF):
        if Path(name) not in made:
            (folder / name).unlink(missing_ok=True)
    for path in sorted(made, key=lambda path: path.name == PAGE):
        (draft / path).replace(folder / path)
