"""Plain functions that are compiled, with the kernel, as entry points of a page's WebAssembly module.

A plain function takes numbers, arrays and tuples of them, allocates nothing, raises nothing, and returns
integers; the functions that it calls may be in any folder. Python calls a plain function directly, or as
machine code through `compiled`; a page calls it in the module of a hammer's laws, `page_module`. In a plain
function, a name that its Python module does not define refers to the kernel's law, choice or function of that
name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive import tables
from printhammer.hammer.hammer import Hammer
from printhammer.kernel.model.laws import Laws
from printhammer.kernel.readout import codes, contacts, curves, energy, line, newton, peaks, section
from printhammer.parts import MagnetPart, Part
from printhammer.parts.coil import Winding
from printhammer.run.plain import page, posing

if TYPE_CHECKING:
    from printhammer.kernel.compile.modules import Module, WebModule
    from printhammer.kernel.compile.signatures import Plain

_NO_LAWS: Final = Laws("", "", "", "", absent="printhammer.parts.absent")

_PARTS: Final = ("f1",) * 7

_ENTRIES: Final[dict[str, tuple[Any, ...]]] = {
    "constants": (page.fill_constants, (*_PARTS, "f1", "f1"), 1, False, True),
    "rest": (page.find_rest, ("f1", "f1", "f1", "f2", "f2", "f1"), 1, True),
    "supply": (page.fill_supply, ("f1", "f1", "f1", "f1"), 1, True),
    "scales": (page.fill_scales, ("f1", "f1", "f", "f", "f", "f1", "f", "f1"), 0, True),
    "window": (page.begin_window, ("f1", "f", "f", "f1"), 1),
    "is_window": (page.judge_window, ("i", "f2", "f2", "f1", "f", "f1"), 1),
    "firings": (tables.fill_firings, ("f", "i1", "b", "f1"), 1),
    "pulse": (tables.pulse, ("i", "f1", "f2", "f1"), 1),
    "pulse_values": (tables.fill_values, ("f2", "f1", "f1")),
    "curve_times": (curves.write_times, ("f2", "i", "i", "f1"), 1),
    "curves": (curves.write_curves, ("f2", "b", "s2", "f1")),
    "steps": (contacts.write_steps, ("f2", "i1", "f1", "f1")),
    "pack_peaks": (
        peaks.write_pack_peaks,
        ("f2", "f2", ("f1", "i1", "f2", "b", "i1", "f1"), "f1", "f2"),
        0,
        True,
    ),
    "contacts": (contacts.write_contacts, ("f2", "f2", "f2", "f2", "f1", "b", "f1", "f2")),
    "loading": (contacts.write_loading, ("f2", "f2", "f2", "f1", "f1", "i1", "f1", "f1")),
    "dots": (contacts.write_dots, ("f1", "f", "f2", "f1", "f2", "f2"), 1),
    "quality": (contacts.write_quality, ("f2", "i", "f1")),
    "sums": (energy.write_sums, ("f2", "f1", "f1")),
    "energies": (energy.write_energies, ("f2", "f2", "f1", "f", "f1", "f1"), 0, True),
    "map_rates": (codes.write_rates, ("f", "f", "f1")),
    "map_trains": (codes.write_trains, ("f1", "i1", "b", "i1", "f1")),
    "map_range": (codes.widen_range, ("s2", "f1")),
    "map_codes": (codes.write_codes, ("s2", "f", "f", "i1")),
    "map_struck": (codes.write_struck, ("f2", "i1", "i", "i1")),
    "line_slots": (line.write_slots, ("i1", "f", "f", "f1")),
    "line_dots": (
        line.write_line,
        (("i1", "i1", "i1"), "i1", "f1", ("i1", "f1", "i1", "i1", "f2"), "f", "f1", "f1", "f1", "f2", "f2"),
        1,
    ),
    "line_totals": (line.write_totals, ("f2", "i1", "f1")),
    "exponent": (section.write_exponent, ("f2", "f1", "f1"), 1),
    "section": (section.write_states, ("f2", "f", "f2", "i1")),
    "distances": (section.write_distances, ("f2", "i1", "f1", "f1"), 2),
    "classify": (section.class_of, ("i", "i", "f", "f", "b", "i"), 1),
    "settled": (section.settled_period, ("f2", "f1", "i", "b"), 1),
    "half_widths": (posing.write_half_widths, ("f", "f", "f", "f", "f1")),
    "is_planar": (newton.is_planar, ("f1",), 1),
    "guess": (newton.write_guess, ("f2", "f1", "i", "i", "f2", "f2"), 1),
    "image": (newton.write_image, ("f1", "f2", "f", "f2", "f", "f1", "f1"), 1, True),
    "improve": (newton.improve, ("f2", "b", "f1", "f2", "f2", "f1"), 1),
    "has_settled": (newton.has_settled, ("f2", "f1", "f2", "f1", "i", "f1"), 1),
}
"""Functions by name, with the types of their arguments (as in `printhammer.kernel.compile.calls.Signature`),
the number of integers returned, and whether they use names of the kernel or pack constants of parts."""


Numbers = dict[str, tuple[tuple[str | None, ...], tuple[float, ...]]]
"""Constants of a hammer as named arrays: for each array, the dotted keys of the constants that set its
elements (None for an element that no constant sets), and the elements, SI (NaN where missing)."""


def numbers_of(hammer: Hammer) -> Numbers:
    """Return the constants of a hammer as input arrays of the entry points `constants` and `rest`.

    The arrays are `body`, one array for each part, named after its role, and `limits`, whose first two
    elements are computed by the entry point `constants`. When the user changes a constant, the page replaces
    every element with the key of that constant; the positions of backstop and front occur twice.
    """
    place, front = hammer.position, hammer.front
    missing = math.nan
    body = (hammer.mass, missing if place is None else place, missing if front is None else front)
    numbers: Numbers = {"body": (("mass", "backstop.position", "pack.front"), body)}
    parts: dict[str, Part] = {"coil": Winding(), **hammer.parts}
    for role in ("damping", "spring", "pack", "backstop", "coil", "magnet"):
        part = parts.get(role)
        numbers[role] = ((), ()) if part is None else _numbers_of(part, hammer.origin)
    platen = missing if hammer.platen is None else hammer.platen
    thickness = getattr(hammer.pack, "thickness", missing)
    limits = (-math.inf, math.inf, platen, thickness, hammer.mass)
    return {**numbers, "limits": ((None, None, "platen", "pack.thickness", "mass"), limits)}


def _numbers_of(part: Part, origin: float) -> tuple[tuple[str | None, ...], tuple[float, ...]]:
    if part.function(f"{part.role}_packed") is not None:
        numbers, names = part.numbers(), part.names()
        if isinstance(part, MagnetPart) and part.function("magnet_domain") is None:
            # The function that stands in for a missing one reads the range from the last two numbers.
            numbers = (*numbers, *part.domain)
        keys = (f"{part.role}.{name}" for name in names)
        return (*keys, *(None,) * (len(numbers) - len(names))), numbers
    # Fixed numbers: a table, or a law of the user's own.
    numbers = (*part.packed(origin), *(part.domain if isinstance(part, MagnetPart) else ()))
    return (None,) * len(numbers), numbers


def entries() -> dict[str, Plain]:
    """Return the functions that the web page can call, by name, with the types of their arguments."""
    from printhammer.kernel.compile.signatures import Plain

    return {name: Plain(*entry) for name, entry in _ENTRIES.items()}


def templates() -> Iterator[Module]:
    """Yield the code templates of the page's functions; functions that call laws also with a coil circuit.

    Functions that pack the constants of parts are omitted: they have a template for each combination of laws.
    """
    from printhammer.kernel.compile.modules import plain_template

    for name, plain in entries().items():
        if not plain.packing:
            yield from (plain_template(name, plain, circuit) for circuit in {False, plain.laws})


def compiled(name: str, laws: Laws = _NO_LAWS) -> Callable[..., Any]:
    """Return the plain function `name` as machine code, compiled or loaded from disk, for the given laws."""
    from printhammer.kernel.compile.specialise import specialise

    return specialise(laws).plain(name, entries()[name])


def page_module(laws: Laws) -> WebModule:
    """Return the WebAssembly module of a page: entry points of the kernel, and all plain functions."""
    from printhammer.kernel.compile.specialise import ENTRIES, specialise

    return specialise(laws).web_module((*ENTRIES, "flow"), entries())
