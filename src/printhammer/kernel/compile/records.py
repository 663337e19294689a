"""What lies beside machine code: which machine and versions made it, and how long that took.

A folder of machine code may have been copied from another machine, baked into a container, or be shared by
machines that are not alike. Its record tells why code there cannot be used, and how long making it takes.
"""

from __future__ import annotations

import json
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
"""What is added to the kind of code whose modules have to be lowered first, as in a checkout."""

_USUAL: Final = {
    "runs": 3.0,
    "curves": 1.0,
    "peaks": 1.0,
    "energies": 1.2,
    "many runs": 6.0,
    "many runs side by side": 5.5,
    "derivatives": 2.0,
}
"""How long the entry points take to compile on a usual machine, s."""

_LOWERING: Final = 4.0  # How much longer it takes with modules that have to be lowered first

_ANOTHER: Final = 5.0


def maker() -> dict[str, str]:
    """Return what machine code made by this process depends on, apart from the sources of its kernel."""
    system, processor, features = this_processor()
    return {
        "printhammer": __version__,
        "llvmlite": llvmlite.__version__,
        "system": system,
        "processor": processor,
        "features": features,
    }


def read(folder: Path) -> list[dict[str, Any]]:
    """Return who made the machine code in a folder: entries of `maker`, each with its `seconds`."""
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
    """Record that an entry point took so long to compile, s; OSError if the record cannot be written."""
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
    """Return how long an entry point takes to compile, s: as here before, else elsewhere, else usually."""
    mine = maker()
    records = [read(folder) for folder in folders]
    own = [entry for entries in records if (entry := _own(entries, mine)) is not None]
    for entry in (*own, *(entry for entries in records for entry in entries)):
        if name in entry["seconds"]:
            return float(entry["seconds"][name])
    kind, _, lowered = name.partition(", ")
    return _USUAL.get(kind, _ANOTHER) * (_LOWERING if lowered else 1.0)


def mismatch(folder: Path) -> str:
    """Say why this process cannot use the machine code in a folder; empty if it can, or there is none."""
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
