"""The files that `run` writes: dots and contacts as rows, and all that a motion tells as JSON; SI."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from printhammer.run.contacts import Contact, Dot
    from printhammer.run.motion import Motion

UNITS: Final = {
    "fired_at": "s",
    "flight_time": "s",
    "impact_speed": "m/s",
    "peak_force": "N",
    "indentation": "m",
    "contact_time": "s",
    "loading_work": "J",
    "net_loss": "J",
    "t_in": "s",
    "v_in": "m/s",
    "t_out": "s",
    "v_out": "m/s",
    "t_peak": "s",
    "depth": "m",
    "loss": "J",
}


def write_rows(rows: Sequence[Dot] | Sequence[Contact], kind: type[Dot | Contact], path: Path) -> None:
    """Write dots or contacts as CSV or Parquet, columns such as "t_in [s]"; errors as for `write_file`."""
    import pandas as pd

    from printhammer.results.files import write_csv, write_parquet

    frame = pd.DataFrame([asdict(row) for row in rows], columns=list(kind.__dataclass_fields__))
    frame = frame.rename(columns={key: f"{key} [{unit}]" for key, unit in UNITS.items()})
    (write_parquet if path.suffix.lower() == ".parquet" else write_csv)(frame, path)


def write_motion(motion: Motion, path: Path) -> None:
    """Write a motion: all that it tells as JSON, else its record; errors as for `Motion.save`."""
    from printhammer.support.outputs import write_file

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
    return {
        f"{key}_{UNITS[key].replace('/', '_per_')}" if key in UNITS else key: value
        for key, value in asdict(row).items()
    }
