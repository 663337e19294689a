"""Output of figures: SVG and PDF for print, PNG for the screen; equal figures give equal bytes."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.figures.elements.style import in_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS: Final = ("svg", "pdf", "png")

DOTS_PER_INCH: Final = 200.0
"""Default resolution of a PNG, dots per inch; arbitrary."""

_METADATA: Final[dict[str, dict[str, Any]]] = {
    # No dates or versions, which would make equal figures differ.
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}


def picture(figure: Figure, kind: str, *, dpi: float = DOTS_PER_INCH) -> bytes:
    """Return a figure as bytes in one of the `FORMATS`; `dpi` applies to PNG."""
    buffer = BytesIO()
    with in_style():
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=_METADATA[kind])
    return buffer.getvalue()


def save(
    figure: Figure,
    folder: str | Path,
    name: str,
    *,
    formats: Sequence[str] = FORMATS,
    dpi: float = DOTS_PER_INCH,
) -> list[Path]:
    """Write a figure into a folder, created if missing; return the paths in the order of the formats.

    `name` is the file name without suffix; `dpi` applies to PNG.

    Raises
    ------
    InputError
        A format is unknown, or the folder cannot be written to; existing files are kept.
    """
    unknown = [kind for kind in formats if kind not in FORMATS]
    if unknown:
        raise InputError.of("format", unknown[0], f"one of {', '.join(FORMATS)}")
    target = Path(folder)
    paths = {kind: target / f"{name}.{kind}" for kind in formats}
    drafts = {kind: target / f".{name}.{kind}.part" for kind in formats}
    try:
        target.mkdir(parents=True, exist_ok=True)
        try:
            for kind, draft in drafts.items():
                draft.write_bytes(picture(figure, kind, dpi=dpi))
            # Write all formats or none, so that an interrupted call does not mix the files of two figures.
            for kind, draft in drafts.items():
                draft.replace(paths[kind])
        finally:
            for draft in drafts.values():
                draft.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(
            f"{target}: the figure {name} cannot be written ({error.strerror or error})", file=target
        ) from None
    return list(paths.values())
