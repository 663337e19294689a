"""Records in a folder of machine code: machine, versions and compile times of its content.

A folder may have been copied from another machine, may be part of a container image, or may be shared by
several machines. The record explains why code in the folder cannot be used, and gives the expected compile
time.
"""

from __future__ import annotations

import json
import math
import os
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import llvmlite

from printhammer import __version__
from printhammer.kernel.compile.link import processor as this_processor

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

FILE: Final = "printhammer-machine-code.json"

LOWERED: Final = "lowered first"
"""Suffix of the kind of a compilation that first has to lower modules, as in a source checkout."""

CIRCUIT: Final = "circuit"
"""Suffix of the kind of a compilation for a hammer whose coil has a circuit."""

_USUAL: Final = {
    "runs": 3.5,
    "curves": 1.2,
    "peaks": 1.8,
    "energies": 1.5,
    "many runs": 6.0,
    "many runs side by side": 5.9,
    "derivatives": 2.5,
}
"""Typical compile times of the entry points, s, by kind; used where no time has been recorded."""

# Factors of the compile time: from processor times of a run, a map and an exponent; and from the ratios
# with and without a circuit for runs (1.0), many runs (0.9) and derivatives (1.2 to 1.3)
_LOWERING: Final = 4.0
_CIRCUIT: Final = 1.2

_ANOTHER: Final = 5.0
"""Compile time assumed for an entry point that is not in `_USUAL`, s; arbitrary."""


def maker() -> dict[str, str]:
    """Return versions, system and processor on which machine code compiled by this process depends."""
    system, processor, features = this_processor()
    return {
        "printhammer": __version__,
        "llvmlite": llvmlite.__version__,
        "system": system,
        "processor": processor,
        "features": features,
    }


def read(folder: Path) -> list[dict[str, Any]]:
    """Read the compile times [s] recorded in a folder: one entry per machine and versions, see `maker`."""
    with suppress(OSError, ValueError, TypeError, KeyError):
        entries = json.loads((folder / FILE).read_bytes())["makers"]
        return [
            entry
            for entry in entries
            if all(isinstance(entry[key], str) for key in maker())
            and all(isinstance(seconds, float) for seconds in entry["seconds"].values())
        ]
    return []


def note(folder: Path, name: str, seconds: float) -> None:
    """Record the compile time [s] of an entry point; raise OSError if the record cannot be written."""
    mine = maker()
    entries = read(folder)
    if (own := _own(entries, mine)) is None:
        own = {**mine, "seconds": {}}
        entries.append(own)
    own["seconds"][name] = round(seconds, 2)
    draft = folder / f".{FILE}.{os.getpid()}"
    try:
        draft.write_text(json.dumps({"makers": entries}, indent=1))
        draft.replace(folder / FILE)
    finally:
        draft.unlink(missing_ok=True)


def expected(folders: Iterable[Path], name: str) -> float:
    """Return the expected compile time [s]: recorded on this machine, else on another, else typical."""
    mine = maker()
    records = [read(folder) for folder in folders]
    own = [entry for entries in records if (entry := _own(entries, mine)) is not None]
    for entry in (*own, *(entry for entries in records for entry in entries)):
        if name in entry["seconds"]:
            return float(entry["seconds"][name])
    kind, *variants = name.split(", ")
    factors = {LOWERED: _LOWERING, CIRCUIT: _CIRCUIT}
    return _USUAL.get(kind, _ANOTHER) * math.prod(factors[variant] for variant in variants)


def mismatch(folder: Path) -> str:
    """Return why this process cannot use the machine code in a folder; empty if usable or absent."""
    mine = maker()
    entries = read(folder)
    if not entries or _own(entries, mine) is not None:
        return ""
    nearest = max(entries, key=lambda entry: sum(entry[key] == mine[key] for key in mine))
    for key in ("printhammer", "llvmlite", "system", "processor"):
        if nearest[key] != mine[key]:
            return f"is for {key} {nearest[key]}, this is {mine[key]}"
    return f"is for a {mine['processor']} with other instructions than this one has"


def _own(entries: Iterable[dict[str, Any]], mine: dict[str, str]) -> dict[str, Any] | None:
    return next((entry for entry in entries if all(entry[key] == mine[key] for key in mine)), None)
