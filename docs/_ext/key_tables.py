"""Tables of the keys of hammer files, generated from the declarations in the code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

from printhammer.hammer.file import SELECTORS, Body, file_options, kinds_of, model_of
from printhammer.parts.spring.terms import TERMS
from printhammer.support.constants import Quantity, quantities

if TYPE_CHECKING:
    from pydantic import BaseModel
    from sphinx.application import Sphinx

MEANINGS = {
    "side": "side on which the contact acts",
    "pull": "whether the contact may pull",
    "reloading": "where the pack goes in again within a contact",
    "back_emf": "whether the flux of the magnet is linked with the coil",
    "decay": "path of the current after the supply is switched off",
    "file": "CSV file, relative to the hammer file",
    "interpolation": "curve between two samples",
}


class KeyTable(SphinxDirective):
    """Directive for the keys of a table of a hammer file, such as ``pack``; ``top`` for the keys above all
    tables."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the nodes of the table."""
        section = self.arguments[0]
        first = SELECTORS.get(section, "")
        head = ["key", "unit", "meaning", "value"]
        rows: list[list[str]] = []
        if section == "top":
            rows = _cells(Body)
        else:
            head.insert(0, first or "law")
            listed: dict[str, type[BaseModel]] = dict(TERMS.get(section, {}))
            models = listed or {kind: model_of(section, kind) for kind in kinds_of(section)}
            for kind, model in models.items():
                label = f"`{kind}`"
                for cells in _cells(model):
                    rows.append([label, *cells])
                    label = ""
        lines = [_line(head), "|" + "---|" * len(head), *map(_line, rows)]
        holder = nodes.container()
        self.state.nested_parse(StringList(lines, self.get_source_info()[0]), 0, holder)
        return holder.children


def _cells(model: type[BaseModel]) -> list[list[str]]:
    """Return key, unit, meaning and accepted values of each constant and option of a model."""
    rows = [
        [f"`{name}`", _unit(note), f"{note.meaning} ({note.symbol})", _accepted(note)]
        for name, note in quantities(model).items()
    ]
    for name, kind in file_options(model).items():
        default = model.model_fields[name].default
        shown = "" if model.model_fields[name].is_required() else f"; default `{_toml(default)}`"
        rows.append([f"`{name}`", "", MEANINGS[name], f"{_choices(kind)}{shown}"])
    return rows


def _unit(note: Quantity) -> str:
    return " or ".join((note.si, *note.also))


def _accepted(note: Quantity) -> str:
    bounds = ((">", note.gt), ("≥", note.ge), ("<", note.lt), ("≤", note.le))
    said = [f"{sign} {bound:g}" for sign, bound in bounds if bound is not None]
    return ", ".join([*said, *([] if note.required else ["optional"])])


def _choices(kind: Any) -> str:
    if get_origin(kind) is Literal:
        return " or ".join(f'`"{choice}"`' for choice in get_args(kind))
    return "`true` or `false`" if kind is bool else "text"


def _toml(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else f'"{value}"'


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive with Sphinx."""
    app.add_directive("hammer-keys", KeyTable)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
