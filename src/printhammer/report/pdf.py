"""Report as a PDF, typeset by Typst from the same data as the page.

The template `templates/report.typ` receives all data as JSON, so that no text is interpreted as markup.
"""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from printhammer.claims import JudgedClaim
from printhammer.errors import missing_extra
from printhammer.report.contents import Report, percent, typeset
from printhammer.report.page import view
from printhammer.report.reconstruction.results import Share
from printhammer.support.constants import Constant
from printhammer.support.files import write_file

_SHOWN = (
    *(
        "has_reconstructed",
        "statuses",
        "parts",
        "statements",
        "verdicts",
        "kinds",
        "by_kind",
        "claims",
        "failing",
    ),
    *("rates", "panels", "schemes", "search", "predictions", "family"),
)


def check_typesetter() -> None:
    """Check that Typst is installed."""
    if find_spec("typst") is None:
        raise missing_extra("a PDF of the report needs typst", "pdf")


def write_pdf(report: Report, path: Path) -> None:
    """Write a report as PDF next to its folder of figures; equal reports give identical files."""
    check_typesetter()
    import matplotlib as mpl
    import typst

    template = files("printhammer").joinpath("report", "templates", "report.typ").read_bytes()
    # Use the fonts of Typst and Matplotlib only, so that the machine does not affect the layout.
    fonts = typst.Fonts(include_system_fonts=False, font_paths=[f"{mpl.get_data_path()}/fonts/ttf"])
    data = json.dumps(_typeset(_contents(report)), default=_plain)
    compiler = typst.Compiler(template, root=str(path.parent), font_paths=fonts, sys_inputs={"data": data})
    made = compiler.compile(format="pdf")
    assert isinstance(made, bytes)
    write_file(path, made)


def _contents(report: Report) -> dict[str, Any]:
    """Collect the data that the Typst template of a report receives."""
    hammer, shown = report.hammer, view(report)
    shown = {key: shown[key] for key in _SHOWN}
    if shown["search"] is not None:
        search = shown["search"].model_dump()
        effort = {"core_hours": f"{search['core_hours']:.3g}", "tolerance": f"{search['tolerance']:g}"}
        shown["search"] = {**search, **effort}
    return {
        **shown,
        "hammer": {
            "name": hammer.name,
            "title": hammer.title or "",
            "note": " ".join(hammer.note.split()),
            "fingerprint": hammer.fingerprint,
            "constants": len(hammer.constants),
        },
        "drawings": [
            {
                **{name: getattr(drawing, name) for name in ("number", "title", "caption", "says", "reason")},
                "claims": drawing.claims,
                "image": drawing.pdf and drawing.pdf.as_posix(),
            }
            for drawing in report.drawings
        ],
        "provenance": {name: str(value) for name, value in report.provenance.items()},
    }


def _plain(entry: Any) -> Any:
    """Convert a value of the report's data to plain JSON data."""
    if isinstance(entry, JudgedClaim):
        claim = {
            name: getattr(entry.claim, name) for name in ("name", "kind", "source", "says", "reading", "note")
        }
        return _typeset({**claim, "verdict": entry.verdict, "detail": entry.detail})
    if isinstance(entry, Share):
        return entry.as_dict() | {"rate": percent(entry.rate)}
    if is_dataclass(entry):
        plain = {field.name: getattr(entry, field.name) for field in fields(entry)}
        return plain | ({"value": f"{entry.value:.9g}"} if isinstance(entry, Constant) else {})
    return entry.model_dump()


def _typeset(data: Any) -> Any:
    """Apply `typeset` to all texts of the report's data."""
    if isinstance(data, dict):
        return {key: _typeset(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_typeset(value) for value in data]
    return typeset(data) if isinstance(data, str) else data
