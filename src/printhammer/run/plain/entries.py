"""Plain functions that are entry points of the page's WebAssembly module, beside those of the kernel.

A plain function takes numbers, arrays and tuples of them, allocates nothing, raises nothing, and returns
integers; it and all functions that it calls are ordinary functions of any room. Python calls it as it is, or
as machine code through `compiled`; a page calls it in the module of a hammer's laws, `page_module`. A name
that its module leaves undefined is bound to the law, choice or function of the kernel of that name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive import tables
from printhammer.kernel.model.laws import Laws
from printhammer.kernel.readout import codes, contacts, curves, energy, line, peaks, section

if TYPE_CHECKING:
    from printhammer.kernel.compile.modules import Module, WebModule
    from printhammer.kernel.compile.signatures import Plain

_NO_LAWS: Final = Laws("", "", "", "", absent="printhammer.parts.absent")

_ENTRIES: Final[dict[str, tuple[Any, ...]]] = {
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
}
"""Functions by name, with the types of their arguments (as in `printhammer.kernel.compile.calls.Signature`),
the number of integers that they return, and whether they use names of the kernel."""


def entries() -> dict[str, Plain]:
    """Return the plain functions of the page, by name."""
    from printhammer.kernel.compile.signatures import Plain

    return {name: Plain(*entry) for name, entry in _ENTRIES.items()}


def templates() -> Iterator[Module]:
    """Yield the templates of plain functions, with and without a coil circuit if they call laws.

    A function that packs the constants of parts has a template for each combination of laws instead.
    """
    from printhammer.kernel.compile.modules import plain_template

    for name, plain in entries().items():
        if not plain.packing:
            yield from (plain_template(name, plain, circuit) for circuit in {False, plain.laws})


def compiled(name: str, laws: Laws = _NO_LAWS) -> Callable[..., Any]:
    """Return a plain function as machine code; compiled or loaded from disk, with `laws` if it calls laws."""
    from printhammer.kernel.compile.specialise import specialise

    return specialise(laws).plain(name, entries()[name])


def page_module(laws: Laws) -> WebModule:
    """Return the WebAssembly module of a page: entry points of the kernel, and all plain functions."""
    from printhammer.kernel.compile.specialise import ENTRIES, specialise

    return specialise(laws).web_module((*ENTRIES, "flow"), entries())
