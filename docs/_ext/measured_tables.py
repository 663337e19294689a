"""Tables measured by the scripts in docs/measure; a build ends with a list of the stale tables."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective
from sphinx.util.logging import getLogger

sys.path.insert(0, str(Path(__file__).parents[1] / "measure"))

import measured

if TYPE_CHECKING:
    from sphinx.application import Sphinx

log = getLogger(__name__)


class MeasuredTable(SphinxDirective):
    """Directive that shows a measured table, by name.

    ``columns`` selects columns, ``name; name``; ``format`` sets number formats, ``name = .2e; ...``.
    """

    required_arguments = 1
    option_spec: ClassVar = dict.fromkeys(("columns", "format"), directives.unchanged_required)

    def run(self) -> list[nodes.Node]:
        """Return the nodes of the table, and of the line that names its script."""
        name = self.arguments[0]
        self.env.note_dependency(str(measured.FOLDER / f"{name}.json"))
        try:
            table = measured.read(name)
            columns, rows = chosen(table, self.options.get("columns", ""), self.options.get("format", ""))
        except (OSError, ValueError) as error:
            raise self.error(f"{name}: {error}") from error
        lines = measured.markdown(columns, rows).splitlines()
        holder = nodes.container(classes=["measured"])
        self.state.nested_parse(
            StringList([*lines, "", origin(table)], self.get_source_info()[0]), self.content_offset, holder
        )
        return [holder]


def chosen(
    table: measured.Measured, wanted: str, formats: str
) -> tuple[list[measured.Column], list[list[measured.Cell]]]:
    """Return the columns and rows that a page selects, with its number formats."""
    places = {column.name: place for place, column in enumerate(table.columns)}
    order = [part.strip() for part in wanted.split(";")] if wanted else list(places)
    given = dict(map(str.strip, part.split("=", 1)) for part in formats.split(";") if part.strip())
    unknown = sorted({*order, *given} - set(places))
    if unknown:
        raise ValueError(f"no column {', '.join(unknown)}, expected some of {'; '.join(places)}")
    columns = [table.columns[places[name]] for name in order]
    columns = [
        column.model_copy(update={"format": given[column.name]}) if column.name in given else column
        for column in columns
    ]
    return columns, [[row[places[name]] for name in order] for row in table.rows]


def origin(table: measured.Measured) -> str:
    """Return the line below a table, which names the script that measured it."""
    if not table.code:
        return f"`{table.command}` measures this; the code of these figures was not recorded."
    marks = {**table.hammers, "code": table.code}
    if len(table.hammers) > 1:
        marks = {f"{len(table.hammers)} hammers, code": table.code}
    told = ", ".join(f"{name} {mark[:8]}" for name, mark in marks.items())
    return f"Measured with `{table.command}`: {told}."


def tell(_app: Sphinx, error: Exception | None) -> None:
    """Report the stale tables at the end of a build."""
    for line in [] if error else measured.report():
        log.info(line)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive with Sphinx."""
    app.add_directive("measured", MeasuredTable)
    app.connect("build-finished", tell)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
