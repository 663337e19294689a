"""Files dropped onto the page: a state, a hammer file, measured curves."""

from __future__ import annotations

from printhammer.studio.frames import frame
from printhammer.studio.states.links import read_file
from printhammer.studio.states.records import QUANTITIES, Record, read_record
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import dropped_hammer


def dropped(
    serial: int,
    name: str,
    text: str,
    columns: list[tuple[str, str]] | None = None,
    shelf: Shelf | None = None,
) -> bytes:
    """Read a dropped file: a state, a hammer, or measured curves.

    Parameters
    ----------
    serial : int
        Serial number of the question.
    name, text : str
        Name and text of the file.
    columns : list of tuple, optional
        Quantity and unit of each column of a table, if the page asked for them.
    shelf : Shelf, optional
        Hammers that the studio offers.

    Returns
    -------
    bytes
        A frame; `what` is "state", "hammer", "curves", or "columns" if the page has to ask for their
        quantities.

    Raises
    ------
    InputError
        The file is neither a state, nor a hammer file, nor a table of curves.
    """
    where = name[-80:] or "dropped file"
    if name.lower().endswith(".json"):
        table, notes = read_file(text, where, shelf or Shelf())
        return frame("dropped", serial, what="state", name=where, state=table, notes=notes)
    if name.lower().endswith(".toml"):
        hammer = dropped_hammer(text)
        return frame("dropped", serial, what="hammer", name=hammer.name, text=text)
    record = read_record(text, where, columns)
    if not isinstance(record, Record):
        listed = [column._asdict() for column in record]
        return frame("dropped", serial, what="columns", name=where, columns=listed, quantities=QUANTITIES)
    return frame("dropped", serial, {"t": record.times, **record.curves}, what="curves", name=where)
