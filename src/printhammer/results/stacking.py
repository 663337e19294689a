"""Many results of one class as one: their arrays stacked along a new dimension."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.results.result import Entries, Result


def stacked(results: Sequence[Result], dim: str, kind: type[Result]) -> Entries:
    """Return the arrays of results, stacked; ragged ones are filled up with NaN, -1 or no text.

    Parameters
    ----------
    results : sequence of Result
        The results, all of one class; possibly none.
    dim : str
        Name of the new dimension, the first one of every array.
    kind : type
        The class, which alone says what arrays there are where there are no results.

    Returns
    -------
    dict
        As `Result.entries` returns it; of a coordinate the longest is kept as it is.
    """
    declared = (note for note in kind.COLUMNS.values() if note.kind in ("column", "coordinate"))
    none: Entries = {note.name: (note, np.zeros((0,) * len(note.dims))) for note in declared}
    every = [result.entries() for result in results]
    entries: Entries = {}
    for name, (note, nothing) in (every[0] if every else none).items():
        arrays = [np.asarray(entry[name][1], dtype=note.dtype) for entry in every]
        if note.kind == "coordinate":
            entries[name] = (note, max(arrays, key=len, default=nothing))
            continue
        entries[name] = (replace(note, dims=(dim, *note.dims)), _filled_up(arrays, len(note.dims)))
    return entries


def _filled_up(arrays: list[Any], dims: int) -> Any:
    if not arrays:
        return np.zeros((0,) * (dims + 1))
    shape = [max(array.shape[axis] for array in arrays) for axis in range(dims)]
    dtype = np.result_type(*arrays)
    nothing: Any = {"U": "", "i": -1, "b": False}.get(dtype.kind, np.nan)
    table: Any = np.full((len(arrays), *shape), nothing, dtype=dtype)
    for k, array in enumerate(arrays):
        table[(k, *(slice(length) for length in array.shape))] = array
    return table
