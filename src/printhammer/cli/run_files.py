"""The files that `run` writes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli.saving import PICTURES, write_picture
from printhammer.cli.tables import frame, named, named_energy
from printhammer.errors import InputError
from printhammer.support.outputs import check_outputs, write_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from printhammer.drive.trains import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.motion import Motion

_SUFFIXES: Final = {
    "dots": (".csv", ".parquet"),
    "contacts": (".csv", ".parquet"),
    "plot": PICTURES,
}


def check(wanted: Mapping[str, Path], inputs: Iterable[Path]) -> None:
    """Make sure, before the run, that the files can be written.

    Raises
    ------
    InputError
        As `check_outputs`, or the end of a name says no format.
    """
    for kind, path in wanted.items():
        known = _SUFFIXES.get(kind)
        if known is not None and path.suffix.lower() not in known:
            raise InputError(f"--{kind} {path}: expected a name that ends in {' or '.join(known)}")
    check_outputs(wanted.values(), inputs)


def tables(hammer: Hammer, path: Path, drive: Drive, drive_path: Path | None) -> list[Path]:
    """Return the tables that a hammer file and a drive file name, beside them."""
    named = [(path, hammer.magnet), (path, hammer.waveform), (drive_path, drive.waveform)]
    found = [(place, getattr(model, "file", None)) for place, model in named]
    return [place.parent / name for place, name in found if place is not None and name]


def write(motion: Motion, wanted: Mapping[str, Path]) -> None:
    """Write the files.

    Raises
    ------
    InputError
        A file cannot be written.
    """
    from printhammer.results.files import write_csv, write_parquet
    from printhammer.run.contacts import Contact, Dot

    for kind, path in wanted.items():
        if kind == "csv":
            motion.to_csv(path)
        elif kind == "parquet":
            motion.to_parquet(path)
        elif kind == "json":
            write_file(path, json.dumps(as_json(motion), indent=2, allow_nan=False) + "\n")
        elif kind == "plot":
            write_picture(path, motion.plot())
        else:
            table = frame(motion.dots, Dot) if kind == "dots" else frame(motion.contacts, Contact)
            (write_parquet if path.suffix.lower() == ".parquet" else write_csv)(table, path)


def as_json(motion: Motion) -> dict[str, Any]:
    """Return what a motion tells, SI, names with units."""
    times, x = motion.maxima
    top = int(x.argmax()) if len(x) else None
    return {
        "status": motion.status,
        "message": motion.message,
        "end_s": motion.end,
        "steps": motion.steps,
        "peak": None if top is None else {"t_s": float(times[top]), "x_m": float(x[top])},
        "dots": [named(dot) for dot in motion.dots],
        "contacts": [named(contact) for contact in motion.contacts],
        "energy": named_energy(motion.energy),
        "constants": {
            key: {"value": constant.si, "unit": constant.si_unit, "status": constant.status}
            for key, constant in motion.hammer.constants.items()
        },
        "drive": motion.drive.to_toml(),
        "provenance": motion.provenance,
    }
