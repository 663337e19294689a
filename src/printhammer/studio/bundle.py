"""Scripts and style sheets of the page, as parts of one HTML file."""

from __future__ import annotations

import posixpath
import re
from functools import lru_cache
from importlib.resources import files
from typing import Final

_ENDINGS: Final = (".js", ".mjs", ".css", ".svg", ".html")
_IMPORT: Final = re.compile(r'from "(\.{1,2}/[\w./]+)"')
_IMPORTS: Final = re.compile(r'^import .* from ".*";$\n?', re.MULTILINE)
_EXPORT: Final = re.compile(r"^export (?=(async )?function|const|let|class)", re.MULTILINE)

_BLOCK: Final = 16
_SHORTEST: Final = 32  # Arbitrary
"""Minimum length of a copy, in bytes; shorter copies do not improve the compression."""


@lru_cache
def page_files() -> dict[str, bytes]:
    """Load the files of the page; return their content by name."""
    root = files("printhammer.studio").joinpath("web")
    contents = {
        place + entry.name: entry.read_bytes()
        for place in ("", "vendor/", "engine/")
        for entry in root.joinpath(place).iterdir()
        if entry.name.endswith(_ENDINGS)
    }
    # Vendored files are stored unmodified; the `export` statements of modules are added here.
    contents["vendor/uPlot.js"] = contents["vendor/uPlot.iife.min.js"] + b"\nexport default uPlot;\n"
    toml = root.joinpath("vendor", "smol-toml.min.cjs").read_bytes()
    wrapped = b"export const parseToml = ((exports) => {\n%b\nreturn exports.parse;\n})({});\n"
    contents["vendor/toml.js"] = wrapped % toml
    contents["engine/call.js"] = files("printhammer.kernel.compile.web").joinpath("call.mjs").read_bytes()
    return contents


def merged(wanted: str) -> str:
    """Return the module `wanted` and its dependencies as one script without imports, for web workers."""
    return "\n".join(_EXPORT.sub("", _IMPORTS.sub("", text)) for _, text in sources(wanted))


def sources(wanted: str) -> list[tuple[str, str]]:
    """Return the page's module `wanted` and its dependencies, as pairs of path and text.

    Each module follows the modules that it imports.
    """
    ordered: dict[str, str] = {}

    def add(name: str) -> None:
        if name in ordered:
            return
        folder = posixpath.dirname(name)

        def place(found: re.Match[str]) -> str:
            part = posixpath.normpath(posixpath.join(folder, found[1]))
            add(part)
            return f'from "./{part}"'

        ordered[name] = _IMPORT.sub(place, page_files()[name].decode())

    add(wanted)
    # A module follows the modules that it imports.
    return list(ordered.items())


def deltas(content: bytes) -> bytes:
    """Compress repeated bytes by LZ77 copies at any distance; gzip finds repetitions only within 32 kB.

    Returns
    -------
    bytes
        Blocks, each of which contains the number of literal bytes, the literal bytes, and length and distance
        of a copy. Numbers are stored with seven bits per byte, least significant first; ``unpack`` in
        ``web/engine/shelf.js`` is the decoder.
    """
    places: dict[bytes, int] = {}
    packed = bytearray()
    begin = at = known = 0
    while at + _BLOCK <= len(content):
        while known + _BLOCK <= at:
            places.setdefault(content[known : known + _BLOCK], known)
            known += _BLOCK
        source = places.get(content[at : at + _BLOCK])
        if source is None:
            at += 1
            continue
        distance = at - source
        first = at
        while first > begin and first > distance and content[first - 1] == content[first - 1 - distance]:
            first -= 1
        # A copy may not overlap its source.
        last = min(_common_end(content, at, distance), first + distance)
        if last - first < _SHORTEST:
            at += 1
            continue
        packed += _number(first - begin) + content[begin:first] + _number(last - first) + _number(distance)
        begin = at = last
    return bytes(packed + _number(len(content) - begin) + content[begin:])


def _common_end(content: bytes, at: int, distance: int) -> int:
    """Return the end of the longest match of the bytes at `at` with bytes `distance` earlier."""
    step = 4096
    while step and at < len(content):
        step = min(step, len(content) - at)
        if content[at : at + step] == content[at - distance : at - distance + step]:
            at += step
        else:
            step //= 2
    return at


def _number(value: int) -> bytes:
    """Encode a number with seven bits per byte, least significant first (LEB128)."""
    written = bytearray()
    while value > 127:
        written.append(value & 127 | 128)
        value >>= 7
    return bytes([*written, value])
