"""Precomputed pictures of the shipped hammers, shown with a mark while machine code is compiled.

``python -m printhammer.studio.pictures.ahead`` computes them again after a change of a hammer, its opening
state or a frame; the tests report when that is necessary.
"""

from __future__ import annotations

import gzip
import hashlib
import json
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.studio.frames import frame, unframe
from printhammer.studio.states.controls import opening_of
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import START, read_state

if TYPE_CHECKING:
    from printhammer.studio.states.state import State

SIZE: Final = (128, 192)
"""Numbers of rates and times of a precomputed map."""

_FIRED: Final = ("constants", "waveform", "rate", "pulses", "pattern", "overlap", "low", "high")


def opening(name: str) -> State:
    """Return the opening state of a shipped hammer."""
    shelf = Shelf()
    return read_state({**START, "hammer": name, **opening_of(shelf.hammer(name))}, shelf)


def key_of(state: State) -> str:
    """Return a digest of hammer and drive of a state, which identifies its precomputed pictures."""
    content = [state.base.fingerprint, *(getattr(state, name) for name in _FIRED)]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]


def frames_ahead(state: State, serial: int) -> list[bytes]:
    """Return the precomputed frames of the opening state of a shipped hammer; empty for other states."""
    if state.constants or state.text:
        return []
    key, parts = _kept(state.base.name)
    if key is None or key != key_of(state):
        return []
    shown = {"motion", "dots", *state.views}
    return [
        frame(heading.pop("kind"), serial, arrays, **{**heading, "ahead": True})
        for heading, arrays in ((dict(heading), arrays) for heading, arrays in parts)
        if heading["kind"] in shown
    ]


@lru_cache(maxsize=8)
def _kept(name: str) -> tuple[str | None, list[tuple[dict[str, Any], dict[str, Any]]]]:
    """Load the stored key and frames of a hammer; the headings lack `serial`, which varies by request."""
    place = files("printhammer.studio").joinpath("ahead", f"{name}.gz")
    if not place.is_file():
        return None, []
    data = gzip.decompress(place.read_bytes())
    key, data = data[:16].decode(), data[16:]
    parts = []
    while data:
        length = int.from_bytes(data[:8], "little")
        heading, arrays = unframe(data[8 : 8 + length])
        for gone in ("serial", "arrays"):
            del heading[gone]
        parts.append((heading, arrays))
        data = data[8 + length :]
    return key, parts


def draw(name: str) -> bytes:
    """Compute the content of the file with a hammer's precomputed pictures."""
    from printhammer.studio.pictures.chart import map_frame
    from printhammer.studio.pictures.engine import dots_frame, motion_frame

    state = opening(name)
    data, motion = motion_frame(state, 1)
    frames = [data, dots_frame(1, motion), map_frame(state, 1, SIZE, lambda: False)]
    whole = b"".join(len(each).to_bytes(8, "little") + each for each in frames)
    return gzip.compress(key_of(state).encode() + whole, 9, mtime=0)


def main() -> None:
    """Compute and write the precomputed pictures of all shipped hammers."""
    from printhammer.hammer.hammer import shipped
    from printhammer.support.files import write_file

    folder = Path(__file__).parents[1] / "ahead"
    for name in shipped():
        write_file(folder / f"{name}.gz", draw(name))


if __name__ == "__main__":
    main()
