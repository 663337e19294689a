"""Studio page without a server: one HTML file with hammers, their WebAssembly modules and scripts.

Constant data are computed when the page is written, and embedded: the description of each hammer, the
limits of states, the kernel as a WebAssembly module. The JavaScript modules in ``web/engine`` read states and
compute the pictures in workers.
"""

from __future__ import annotations

import gzip
import json
import math
import re
import struct
from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from printhammer import __version__
from printhammer.drive.waveforms.drivers import DECAYS
from printhammer.drive.waveforms.shapes import SHAPES, Sine
from printhammer.errors import InputError, missing_extra
from printhammer.hammer.file import VIEWS
from printhammer.hammer.hammer import Hammer
from printhammer.run.energy import Ledger
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.plain.entries import numbers_of, page_module
from printhammer.run.plain.page import REFUSALS
from printhammer.run.problem import TOLERANCE, constants_of, fresh_carry, laws_of
from printhammer.run.window import THRESHOLDS
from printhammer.studio import bounds
from printhammer.studio.bundle import deltas, merged, page_files, sources
from printhammer.studio.controls import SINE, describe, units_of, vocabulary
from printhammer.studio.launch import FORMAT, KIND
from printhammer.studio.shelf import Shelf
from printhammer.studio.terms import sums_of
from printhammer.support.constants import quantities

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import Laws


def live_page(shelf: Shelf, start: Mapping[str, Any] | str = "") -> str:
    """Return the studio as one HTML file that computes in the browser.

    Parameters
    ----------
    shelf : Shelf
        Hammers of the page.
    start : mapping or str, optional
        State with which the page opens unless its address contains a state: entries of a state, or their text
        as in the address. The page reports entries that it cannot use.

    Raises
    ------
    InputError
        A module is not in the wheel and cannot be linked, since the extra `page` is not installed.
    """
    content = content_of(shelf)
    modules = [gzip.decompress(b64decode(module)) for module in content.pop("modules")]
    content |= {
        "sizes": [len(module) for module in modules],
        "scripts": sources("engine/page.js"),
        "worker": merged("engine/worker.js"),
    }
    text = json.dumps(content, allow_nan=False, separators=(",", ":")).encode()
    packed = gzip.compress(struct.pack("<I", len(text)) + text + deltas(b"".join(modules)), 9, mtime=0)
    parts = {
        "style": "\n".join(page_files()[name].decode() for name in ("vendor/uPlot.min.css", "studio.css")),
        "icon": b64encode(page_files()["icon.svg"]).decode(),
        # Without "<", no text ends the enclosing script element.
        "start": json.dumps({"text" if isinstance(start, str) else "state": start}).replace("<", "\\u003c"),
        "content": b64encode(packed).decode(),
    }
    return re.sub(r"{{(\w+)}}", lambda place: parts[place[1]], page_files()["page.html"].decode())


def content_of(shelf: Shelf) -> Any:
    """Compose the content of the page as plain data for JSON."""
    modules: dict[Laws, str] = {}
    hammers = {name: _hammer(shelf, name, modules) for name in shelf.names}
    places = {laws: place for place, laws in enumerate(modules)}
    for name, entry in hammers.items():
        hammer, described = shelf.hammer(name), entry["described"]
        current = [] if hammer.magnet is None else ["current"]
        voltage = [] if described["rail"] is None else ["voltage"]
        laws = {quantity: laws_of(hammer, quantity) for quantity in [*current, "force", *voltage]}
        # Hammers with equal laws share modules.
        entry["modules"] = {quantity: places[own] for quantity, own in laws.items() if own in places}
        described["quantities"] = list(entry["modules"])
    return _plain(
        {
            "version": __version__,
            "names": shelf.names,
            "vocabulary": vocabulary(),
            "hammers": hammers,
            "modules": list(modules.values()),
            "limits": _limits(),
            "sentences": {
                "kinds": "this page has no kernel for this drive of the hammer: expected a page whose first"
                " hammer is this hammer, written with the extra `page`",
            },
            "stateFile": {"kind": KIND, "format": FORMAT},
        }
    )


def _plain(value: Any) -> Any:
    """Convert a value to plain data for JSON: NaN and infinity become None."""
    if isinstance(value, dict):
        return {str(name): _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _limits() -> dict[str, Any]:
    """Return the limits of page states and of computation, by name."""
    waveforms = {
        name: {
            "known": ["shape", "quantity", *shape.model_fields],
            "fields": list(quantities(shape)),
            "voltages": [field for field, note in quantities(shape).items() if note.also],
            "decays": "decay" in shape.model_fields and "decay" not in quantities(shape),
        }
        for name, shape in SHAPES.items()
    }
    # The frequency of a continuous force is the rate. Its code is the number of shapes, as in `drive.tables`.
    sine = {"known": ["shape", "quantity", *SINE], "fields": list(SINE), "voltages": [], "decays": False}
    return {
        **{name: getattr(bounds, name) for name in vars(bounds) if name.isupper()},
        "VIEWS": VIEWS,
        "WAVEFORMS": {**waveforms, Sine.shape: sine},
        "ENERGIES": [field.name for field in fields(Ledger)],
        "LINE": _line(),
        "DISPLAY_TOLERANCE": DISPLAY_TOLERANCE,
        "TOLERANCE": TOLERANCE,
        "REFUSALS": REFUSALS,
        "DECAYS": DECAYS,
        "WINDOW": THRESHOLDS,
    }


def _line() -> dict[str, Any]:
    """Return font, print head and quality limits of the printed line."""
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


def _hammer(shelf: Shelf, name: str, modules: dict[Laws, str]) -> dict[str, Any]:
    """Compose the page entry of a hammer, and add its WebAssembly modules to `modules`.

    Every hammer has the module for its pulse, or for the pulse that the page initially shows; the first
    hammer also has the modules for current and voltage drives.
    """
    hammer = shelf.hammer(name)
    described = describe(hammer)
    pulse = described["waveform"] or described["start"]["waveform"]
    further = ["current", "voltage"] if name == shelf.names[0] and described["rail"] is not None else []
    for quantity in [pulse["quantity"], *further]:
        laws = laws_of(hammer, quantity)
        if laws in modules:
            continue
        try:
            modules[laws] = b64encode(gzip.compress(page_module(laws).content(), 1)).decode()
        except InputError:
            # Without the linker, modules of other driving quantities are omitted.
            if quantity == pulse["quantity"]:
                raise
    carry, sums = fresh_carry(0.0, (math.pi, 0.0)), sums_of(hammer)
    return {
        "described": described,
        "units": units_of(hammer),
        "text": hammer.to_toml(),
        "shipped": shelf.is_shipped(name),
        "numbers": {
            role: (keys, _numbers_of(own), sums.get(role, []))
            for role, (keys, own) in numbers_of(hammer).items()
        },
        "size": len(constants_of(hammer)),
        "carry": _numbers_of(carry),
        "placeOfRest": carry.tolist().index(math.pi),
        "damped": hammer.is_damped,
    }


def _numbers_of(values: Iterable[float]) -> list[float | str]:
    """Convert numbers for JSON; infinity and NaN become texts that JavaScript parses."""
    return [
        value if math.isfinite(value) else repr(value).replace("inf", "Infinity").replace("nan", "NaN")
        for value in map(float, values)
    ]


def widget(*hammers: Hammer, state: str = "", height: str = "760px") -> Any:
    """Return the studio as a notebook widget (anywidget), for Jupyter and marimo.

    Parameters
    ----------
    *hammers : Hammer
        Hammers of the page; by default all shipped hammers.
    state : str, optional
        Initial state, written as in the page's address after the #.
    height : str, optional
        Height of the widget, in CSS syntax.

    Returns
    -------
    anywidget.AnyWidget
        Widget whose trait `state` follows the settings; setting `state` changes them.

    Raises
    ------
    InputError
        The extra `notebook` is not installed, or a hammer has custom laws and the extra `page` is not
        installed.
    """
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise missing_extra(f"the widget needs {error.name}", "notebook") from None

    class StudioWidget(anywidget.AnyWidget):
        """Notebook widget that shows the page."""

        _esm = page_files()["widget.mjs"].decode()
        page = traitlets.Unicode("").tag(sync=True)
        state = traitlets.Unicode("").tag(sync=True)
        height = traitlets.Unicode("").tag(sync=True)

    return StudioWidget(page=live_page(Shelf(*hammers, only=True)), state=state, height=height)
