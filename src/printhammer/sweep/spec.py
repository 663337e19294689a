"""Specs of sweeps: parsing of a TOML file into hammer, drive, axes and outputs.

A spec has ``format = 1``, ``hammer``, a table ``[drive]`` with the tables of a drive file, one table
``[[axis]]`` for each axis, and ``[outputs]``; see `printhammer.sweep.tables` for all keys. Every quantity has
its unit.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from printhammer.drive.file import read_drive
from printhammer.drive.text import FORMAT as DRIVE_FORMAT
from printhammer.drive.text import document
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer, load, shipped
from printhammer.hammer.names import quantity_of
from printhammer.results import Declared, part
from printhammer.support.constants import shown
from printhammer.support.files import read_text
from printhammer.sweep.axes import COUNTS, Axis, read_axis
from printhammer.sweep.members import KINDS, Base
from printhammer.sweep.outputs import Outputs, read_outputs
from printhammer.sweep.tables import read_quantity, read_tables


class Spec(Declared):
    """Parsed sweep spec: hammer, drive, axes, outputs and block size."""

    where: str = part("name for messages, usually the file")
    text: str = part("text of the spec, TOML")
    title: str = part("one-line description")
    base: Base = part("common settings of all members")
    axes: tuple[Axis, ...] = part("axes that vary")
    design: str = part('either "grid" or "latin-hypercube"')
    members: int | None = part("number of members of a Latin hypercube; None in a grid")
    seed: int | None = part("seed of a Latin hypercube")
    chunk: int | None = part("members of a block of work")
    outputs: Outputs = part("outputs stored for each member")

    @property
    def grid(self) -> bool:
        """Whether the axes form a grid."""
        return self.design == "grid"

    @property
    def fingerprint(self) -> str:
        """Hexadecimal digest of members, outputs and blocks, independent of layout and comments."""
        base = self.base
        content = {
            "hammer": base.hammer.fingerprint,
            "drive": _plain(base.drive),
            "waveform": None if base.waveform is None else base.waveform.segments().tobytes().hex(),
            "state": [_plain(number) for number in base.state],
            "duration": _plain(base.duration),
            "tolerance": base.tolerance.hex(),
            "axes": [[axis.key, axis.geometric, axis.values.tobytes().hex()] for axis in self.axes],
            "design": [self.design, self.members, self.seed],
            "chunk": self.chunk,
            "outputs": [output.name for output in self.outputs.arrays],
            "times": self.outputs.times.tobytes().hex(),
        }
        return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def read_spec(source: str | Path | Mapping[str, Any]) -> Spec:
    """Parse a spec: a TOML file, or its contents as a mapping.

    Raises
    ------
    InputError
        The file cannot be read, a key is unknown or missing, a value is of the wrong kind, unit or range.
    """
    if isinstance(source, Mapping):
        import tomlkit

        text, where, folder = tomlkit.dumps(source), "spec", Path()
    elif not isinstance(source, str | Path):
        raise InputError.of("spec", source, "a path, or the contents of a spec file as a mapping")
    else:
        path = Path(source)
        where, folder = str(path), path.parent
        text = read_text(path, "the spec", wanted="a TOML file in UTF-8")
    try:
        return _spec(tomllib.loads(text), text, where, folder)
    except InputError as error:
        raise error.within(where) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: expected TOML ({' '.join(str(error).split())})", file=where) from None


def _spec(content: dict[str, Any], text: str, where: str, folder: Path) -> Spec:
    table = read_tables(content)
    grid = table.design == "grid"
    for name, value in (("members", table.members), ("seed", table.seed)):
        if grid != (value is None):
            fault = f"{name} of a grid" if grid else f"{name} is missing"
            raise InputError(fault, key=name, expected="no such key" if grid else "a whole number")
    hammer = load(table.hammer if table.hammer in shipped() else folder / table.hammer)
    hammer = _replaced(hammer, table.constants)
    drive, place = _drive_tables(table.drive, folder)
    own = drive.get("waveform")
    own = own if isinstance(own, Mapping) else None
    named = drive.get("waveforms")
    named = named if isinstance(named, Mapping) else {}
    axes = tuple(
        read_axis(entry, f"axis[{i}]", hammer, own, grid, named) for i, entry in enumerate(table.axis)
    )
    for i, axis in enumerate(axes):
        if any(axis.name == other.name for other in axes[:i]):
            raise InputError.of(f"axis[{i}].key", axis.key, "a key without an axis")
        if axis.key in table.constants:
            raise InputError(
                f"constants: {axis.key!r} is replaced by an axis",
                key="constants",
                expected="one or the other",
            )
    x, v = table.state.x, table.state.v
    duration = None if table.duration is None else read_quantity(table.duration, "s", "duration")
    if duration is not None and not duration > 0.0:
        raise InputError.of("duration", duration, "more than 0 s", unit="s")
    base = Base(
        hammer=hammer,
        drive=drive,
        waveform=None,
        folder=place,
        state=(
            None if x is None else read_quantity(x, "m", "state.x"),
            None if v is None else read_quantity(v, "m/s", "state.v"),
        ),
        duration=duration,
        tolerance=table.tolerance,
        axes=axes,
    )
    base = _checked_drive(base, own)
    outputs = read_outputs(table.outputs, _firings(base))
    return Spec(
        where, text, table.title, base, axes, table.design, table.members, table.seed, table.chunk, outputs
    )


def _replaced(hammer: Hammer, constants: Mapping[str, Any]) -> Hammer:
    changes = {}
    for key, value in constants.items():
        note = quantity_of(hammer, key)
        if note is None:
            raise InputError(
                f"constants: {shown(key)} does not name a constant of {hammer.name}", key="constants"
            )
        changes[key] = read_quantity(value, note.si, f"constants.{key}")
    return hammer.replace(changes, source="constants of a sweep") if changes else hammer


def _drive_tables(source: dict[str, Any] | str, folder: Path) -> tuple[dict[str, Any], Path]:
    """Return the tables of a spec's drive, and the folder of the files that the drive refers to."""
    if not isinstance(source, str):
        return dict(source), folder
    path = folder / source
    try:
        return tomllib.loads(path.read_text(encoding="utf-8")), path.parent
    except OSError as error:
        raise InputError(
            f"{path}: the drive file cannot be read ({error.strerror or error})", file=path, key="drive"
        ) from None
    except ValueError as error:
        raise InputError(f"{path}: expected TOML ({' '.join(str(error).split())})", file=path) from None


def _checked_drive(base: Base, own: Mapping[str, Any] | None) -> Base:
    """Validate the drive of `base` without the axes; parse its waveform unless an axis changes the waveform.

    `own` is the waveform table of the drive; None without such a table.
    """
    kinds = [name for name in KINDS if name in base.drive]
    if len(kinds) != 1 or not isinstance(base.drive[kinds[0]], Mapping):
        tables = ", ".join(f"[drive.{name}]" for name in KINDS)
        raise InputError(f"drive: expected exactly one of the tables {tables}", key="drive")
    timing = base.drive[kinds[0]]
    for axis in base.axes:
        if kinds == ["sequence"] and axis.key.startswith("waveform."):
            raise InputError(
                f"the axis {axis.key!r} names a waveform that [drive.sequence] does not fire",
                key=axis.key,
                expected="one of its waveforms, such as 'waveforms.NAME.amplitude'",
            )
        if axis.target == "drive" and axis.field in timing:
            raise InputError(
                f"drive.{kinds[0]}.{axis.field} is set twice, also by the axis {axis.key!r}",
                key=f"drive.{kinds[0]}.{axis.field}",
            )
        if axis.target == "at":
            at = timing.get("at")
            if not isinstance(at, list) or int(axis.field) >= len(at):
                raise InputError(
                    f"the axis {axis.key!r} does not name a firing",
                    key=axis.key,
                    expected="drive.times.at with enough firings",
                )
    if base.duration is None and kinds == ["sine"]:
        raise InputError("duration is missing, and the drive does not end", key="duration")
    if own is None or any(axis.target == "waveform" for axis in base.axes):
        return base
    rest = {name: table for name, table in base.drive.items() if name != "waveform"}
    pulse = {"rate": "1 Hz", "pulses": 1}
    text = document({"format": DRIVE_FORMAT}, {"train": pulse, "waveform": own})
    return replace(base, drive=rest, waveform=read_drive(text, folder=base.folder).waveform)


def _firings(base: Base) -> int:
    """Return the largest number of firings of any member."""
    timing = base.drive[base.kind]
    if "at" in timing:
        at = timing["at"]
        return len(at["values"] if isinstance(at, Mapping) and "values" in at else at)
    product = 1
    for name in COUNTS:
        values = [axis.values.max() for axis in base.axes if axis.target == "drive" and axis.field == name]
        count = int(values[0]) if values else timing.get(name, 1)
        product *= count if isinstance(count, int) else 1
    return max(product, 1)


def _plain(value: Any) -> Any:
    """Convert a value to plain data with floats as exact hexadecimal text, for the digest."""
    if isinstance(value, Mapping):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    return float(value).hex() if isinstance(value, float | np.floating) else value
