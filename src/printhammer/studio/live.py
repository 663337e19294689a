"""Page that computes by itself: one HTML file with hammers, their WebAssembly modules and the whole studio.

Whatever never changes is computed when the page is written, and embedded: the description of each hammer, the
limits of states, the kernel as a WebAssembly module. The JavaScript modules in ``web/engine`` read states and
compute the pictures in workers.
"""

from __future__ import annotations

import gzip
import json
import math
from base64 import b64encode
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final, get_args

from printhammer import __version__
from printhammer.drive.waveforms.drivers import Rail
from printhammer.drive.waveforms.shapes import SHAPES
from printhammer.run.energy import Ledger
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.plain.entries import numbers_of
from printhammer.run.plain.page import REFUSALS
from printhammer.run.problem import TOLERANCE, Problem, fresh_carry
from printhammer.run.start import initial_state
from printhammer.studio import bounds
from printhammer.studio.bundle import PLACE, merged, sources, style
from printhammer.studio.frames import plain
from printhammer.studio.pictures.chart import FULL, GAP, PREVIEW, PREVIEW_BY_VOLTAGE
from printhammer.studio.pictures.engine import MOST_ENDS, POINTS
from printhammer.studio.pictures.section import AT_ONCE, LATER
from printhammer.studio.states.controls import describe, vocabulary
from printhammer.studio.states.links import FORMAT, KIND
from printhammer.studio.states.state import START, VIEWS, State, read_state
from printhammer.support.constants import quantities

if TYPE_CHECKING:
    from collections.abc import Iterable

    from printhammer.studio.states.shelf import Shelf

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline' blob: \
'wasm-unsafe-eval'; worker-src blob:; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; \
form-action 'none'">
<title>printhammer studio</title>
<style>{style}</style>
</head>
<body>
<div id="studio"></div>
<noscript>The studio needs JavaScript.</noscript>
<script type="text/plain" id="start">{place}</script>
<script type="text/plain" id="content">{content}</script>
<script type="text/plain" id="worker">{worker}</script>
<script type="module">{sources}
const {{ begin }} = await import(places["engine/page.js"]);
begin();
</script>
</body>
</html>
"""

_SENTENCES: Final = {
    "files": "a hammer file is opened by `printhammer studio FILE`, not by this page",
    "tables": "a measured table is opened by `printhammer studio`, not by this page",
    "strobe": "exponents are computed by `printhammer strobe` on a computer with Python",
    "drive": "the file of a drive is written by `printhammer studio` on a computer with Python",
    "sampled": "a measured pulse is computed by `printhammer run` on a computer with Python",
    "kinds": "another kind of drive is computed by `printhammer run` on a computer with Python",
}
"""What the page says of work that only Python does, by name."""

OPENING: Final = ("motion", "sketch", "map", "line")
"""Views with which a page opens: the map, and beside it the actuator, its curve and what it prints."""


def live_page(shelf: Shelf) -> str:
    """Return the page, with the hammers of a shelf, that opens with the start state of the shelf.

    Raises
    ------
    InputError
        A module is neither in the wheel nor can be linked: the extra `page` is not installed.
    """
    content = content_of(shelf)
    text = json.dumps(plain(content), allow_nan=False, separators=(",", ":"))
    return _PAGE.format(
        style=style(),
        content=_packed(text.encode()),
        place=PLACE,
        worker=json.dumps(merged("engine/worker.js")).replace("<", "\\u003c"),
        sources=sources("engine/page.js"),
    )


def content_of(shelf: Shelf, *, hammers: bool = True) -> dict[str, Any]:
    """Compose the content of the page; with `hammers`, also the hammers of the shelf and their modules."""
    modules: dict[str, str] = {}
    described = {name: _hammer(shelf, name, modules) for name in shelf.names} if hammers else {}
    shared = vocabulary()
    del shared["units"]
    table, notes = shelf.start
    table = {"views": OPENING, **table}
    return {
        "version": __version__,
        "names": shelf.names,
        "start": {"state": table, "notes": notes},
        "vocabulary": shared,
        "hammers": described,
        "modules": list(modules.values()),
        "limits": _limits(),
        "sentences": _SENTENCES,
        "stateFile": {"kind": KIND, "format": FORMAT},
    }


def _packed(content: bytes) -> str:
    """Compress with gzip and encode in base 64, as the page reads it."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _limits() -> dict[str, Any]:
    """Return the limits of states and of work, by name."""
    named = {name: getattr(bounds, name) for name in vars(bounds) if name.isupper()}
    named |= {"POINTS": POINTS, "MOST_ENDS": MOST_ENDS, "FULL": FULL, "GAP": GAP, "VIEWS": VIEWS}
    named["WAVEFORMS"] = {
        name: {
            "known": ["shape", "quantity", *shape.model_fields],
            "fields": list(quantities(shape)),
            "voltages": [field for field, note in quantities(shape).items() if note.also],
            "decays": "decay" in shape.model_fields and "decay" not in quantities(shape),
        }
        for name, shape in SHAPES.items()
    }
    named["POINTS_OF_SECTION"] = (*AT_ONCE, *LATER)
    named["ENERGIES"] = [field.name for field in fields(Ledger)]
    named["LINE"] = _line()
    named |= {"DISPLAY_TOLERANCE": DISPLAY_TOLERANCE, "TOLERANCE": TOLERANCE, "REFUSALS": REFUSALS}
    named["DECAYS"] = get_args(Rail.model_fields["decay"].annotation)
    return named | {"PREVIEW": {"true": PREVIEW_BY_VOLTAGE, "false": PREVIEW}}


def _line() -> dict[str, Any]:
    """Return font, head and limits of the printed line."""
    from printhammer.printing.dots import lettering
    from printhammer.printing.dots.judging import FAULTS, PRESETS
    from printhammer.printing.dots.strategy import FIRST_SLOT
    from printhammer.printing.page.page import head_of

    head, limits = head_of(lettering.WIRES), PRESETS["slots"]
    drawn = {
        mark: ["".join(".#"[int(dot)] for dot in row) for row in dots]
        for mark, dots in lettering.glyphs().items()
    }
    return {
        "font": {"glyphs": drawn, "columns": lettering.COLUMNS, "name": lettering.NAME},
        "head": {
            "numbers": [head.pitch, head.wire_pitch, head.line_pitch, head.density],
            "wire": head.wire_diameter,
        },
        "limits": [limits.force, limits.arrival, limits.extra_contacts],
        "faults": FAULTS,
        "first": FIRST_SLOT,
    }


def _hammer(shelf: Shelf, name: str, modules: dict[str, str]) -> dict[str, Any]:
    """Compose the entry of a hammer; add its module to `modules`, by its identity."""
    hammer = shelf.hammer(name)
    described = describe(hammer)
    opening = {**START, "hammer": name, **described["start"]}
    state = read_state(opening, shelf)
    entry: dict[str, Any] = {
        "described": described,
        "units": vocabulary(hammer)["units"],
        "text": hammer.to_toml(),
        "shipped": shelf.is_shipped(name),
    }
    return entry | _numbers(state, modules)


def _numbers(state: State, modules: dict[str, str]) -> dict[str, Any]:
    """Return the arguments of the kernel for a state, and the index of its module."""
    hammer, drive = state.changed, state.drive
    problem = Problem(hammer, drive, initial_state(hammer, None), 0.0, DISPLAY_TOLERANCE)
    module = problem.page_module
    if module.name not in modules:
        modules[module.name] = b64encode(gzip.compress(module.content(), 9, mtime=0)).decode()
    return {
        "module": list(modules).index(module.name),
        "circuit": problem.laws.circuit,
        "quantity": drive.quantity,
        "numbers": {name: (keys, _numbers_of(own)) for name, (keys, own) in numbers_of(hammer).items()},
        "size": len(problem.constants),
        "carry": _numbers_of(fresh_carry(0.0, (math.pi, 0.0))),
        "placeOfRest": fresh_carry(0.0, (math.pi, 0.0)).tolist().index(math.pi),
        "damped": hammer.damping is not None,
    }


def _numbers_of(values: Iterable[float]) -> list[float | str]:
    """Return numbers for JSON, which has neither infinity nor NaN: these are texts that JavaScript reads."""
    return [
        value if math.isfinite(value) else repr(value).replace("inf", "Infinity").replace("nan", "NaN")
        for value in map(float, values)
    ]
