"""States from a link or a file: valid entries are used, the others reported."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.studio.bounds import LARGEST_MESSAGE
from printhammer.studio.states.state import READERS, ProtocolError, check_constant, dropped_hammer, read_state

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.hammer.hammer import Hammer
    from printhammer.studio.states.shelf import Shelf, Told
    from printhammer.studio.states.state import State

FORMAT: Final = 1
KIND: Final = "printhammer studio state"
_MOST_NOTES: Final = 6


def taken(content: Any, shelf: Shelf) -> Told:
    """Validate a state from a link; return its valid entries, and one sentence for each invalid entry.

    Parameters
    ----------
    content
        Content of a link or a file; missing entries are allowed.
    shelf : Shelf
        Hammers that the studio offers.
    """
    if not isinstance(content, dict):
        return {}, ["a state is expected to be a table"]
    table: dict[str, Any] = {}
    notes: list[str] = []
    constants = content.get("constants")
    for key, value in content.items():
        try:
            if key not in READERS:
                raise ProtocolError(f"{key[:40]!r} is not known")
            if key != "constants" or not isinstance(constants, dict):
                READERS[key](value)
                table[key] = value
        except ProtocolError as error:
            notes.append(f"{error}; it is left as it was" if key in READERS else f"{error}; it is not used")
    base = _hammer(table, shelf, notes)
    if isinstance(constants, dict):
        table["constants"] = _constants(constants, base, notes)
    if table.get("waveform") is not None:
        _check(table, "waveform", shelf, notes)
    _check(table, "constants", shelf, notes)
    more = len(notes) - _MOST_NOTES
    return table, notes if more <= 1 else [*notes[:_MOST_NOTES], f"and {more} more like these"]


def _hammer(table: dict[str, Any], shelf: Shelf, notes: list[str]) -> Hammer:
    """Determine the hammer of a state table; invalid entries are replaced by defaults."""
    try:
        if table.get("text"):
            return dropped_hammer(table["text"])
        return shelf.hammer(table.get("hammer") or shelf.names[0])
    except InputError as error:
        notes.append(f"{error}; {shelf.names[0]} is shown instead")
        table.update(hammer=shelf.names[0], text="")
        return shelf.hammer(shelf.names[0])


def _constants(content: dict[Any, Any], base: Hammer, notes: list[str]) -> dict[str, float]:
    kept: dict[str, float] = {}
    for key, value in content.items():
        try:
            ((name, number),) = READERS["constants"]({key: value})
            check_constant(base, name, number)
            kept[name] = number
        except (ProtocolError, InputError) as error:
            notes.append(f"{error}; it is left as the hammer has it")
    return kept


def _check(table: dict[str, Any], key: str, shelf: Shelf, notes: list[str]) -> None:
    """Remove an entry from a table if no hammer or pulse can be built with it."""
    rest: dict[str, Any] = {"waveform": None, "constants": {}}
    named = {"hammer": table.get("hammer") or shelf.names[0], "text": table.get("text", "")}
    made = {name: table[name] for name in rest if name in table}
    state = read_state({**_PLAIN, **rest, **named, **made}, shelf)
    try:
        _ = state.changed if key == "constants" else state.fired
    except InputError as error:
        notes.append(f"{error}; {key} is left as the hammer has it")
        table[key] = rest[key]


_PLAIN: Final[dict[str, Any]] = {
    "hammer": "",
    "text": "",
    "constants": {},
    "waveform": None,
    "rate": 1000.0,
    "pulses": 1,
    "pattern": "",
    "overlap": "add",
    "low": 500.0,
    "high": 1000.0,
    "line": "",
    "views": [],
}


def read_file(text: str, where: str, shelf: Shelf) -> Told:
    """Parse the text of a state file; return its valid entries, and one sentence for each invalid entry.

    Raises
    ------
    InputError
        The text is not a state file.
    """
    if len(text) > LARGEST_MESSAGE:
        raise InputError(
            f"{where}: {len(text)} characters",
            file=where,
            key="characters",
            expected=f"at most {LARGEST_MESSAGE}",
        )
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise InputError(
            f"{where}: expected a state file of the studio, as its export saves it", file=where, key="state"
        )
    if content.get("format") != FORMAT:
        raise InputError.of(
            "format",
            str(content.get("format"))[:40],
            FORMAT,
            file=where,
            written=str(str(content.get("format"))[:40]),
        )
    return taken(content.get("state"), shelf)


def open_file(path: Path, shelf: Shelf) -> None:
    """Make the state in an exported file the start state of a shelf.

    Raises
    ------
    InputError
        The file is not a state.
    """
    from printhammer.support.files import read_text

    shelf.start = read_file(read_text(path, "the state"), str(path), shelf)


def file_of(state: State) -> str:
    """Return the text of a state file; a hammer that is not shipped is included completely."""
    table = {key: getattr(state, key) for key in READERS}
    table["constants"] = dict(state.constants)
    table["waveform"] = None if state.waveform is None else dict(state.waveform)
    if not state.text and state.shelf.is_guest(state.hammer) and not state.shelf.is_shipped(state.hammer):
        table.update(hammer="", text=state.base.to_toml())
    return json.dumps({"kind": KIND, "format": FORMAT, "state": table}, indent=1) + "\n"
