"""The files that `run` writes: dots and contacts as rows, and all that a motion tells as JSON; SI."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from printhammer.results import Rows
from printhammer.results.declare import columns_of
from printhammer.run.contacts import Contact, Dot
from printhammer.run.motion import Motion


def write_rows(rows: Rows[Any], path: Path) -> None:
    """Write dots or contacts as CSV or Parquet, columns such as "t_in [s]"; errors as for `write_file`."""
    from printhammer.results.files import write_csv, write_parquet

    (write_parquet if path.suffix.lower() == ".parquet" else write_csv)(rows.to_dataframe(), path)


def write_motion(motion: Motion, path: Path) -> None:
    """Write a motion: all that it tells as JSON, else its record; errors as for `Motion.save`."""
    from printhammer.support.files import write_file

    if path.suffix.lower() == ".json":
        write_file(path, as_json(motion))
    else:
        motion.save(path)


def as_json(motion: Motion) -> str:
    """Return what a motion tells as JSON, SI, names with units."""
    times, x = motion.maxima
    top = int(x.argmax()) if len(x) else None
    content = {
        "status": motion.status,
        "message": motion.message,
        "end_s": motion.end,
        "steps": motion.steps,
        "peak": None if top is None else {"t_s": float(times[top]), "x_m": float(x[top])},
        "dots": [_named(dot) for dot in motion.dots],
        "contacts": [_named(contact) for contact in motion.contacts],
        "energy": {f"{key}_J": value for key, value in asdict(motion.energy).items()},
        "constants": {
            key: {"value": constant.si, "unit": constant.si_unit, "status": constant.status}
            for key, constant in motion.hammer.constants.items()
        },
        "drive": motion.drive.to_toml(),
        "provenance": motion.provenance,
    }
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _named(row: Dot | Contact) -> dict[str, Any]:
    """Return a dot or contact by names such as "flight_time_s"."""
    units = {name: note.unit for name, note in columns_of(type(row)).items()}
    return {
        f"{key}_{units[key].replace('/', '_per_')}" if units[key] else key: value
        for key, value in asdict(row).items()
    }
