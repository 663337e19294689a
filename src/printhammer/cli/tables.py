"""Dots and contacts as rows for files: names with units, SI."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from printhammer.run.contacts import Contact, Dot
    from printhammer.run.ledger import Ledger

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


def named(row: Dot | Contact) -> dict[str, Any]:
    """Return a dot or contact by names such as "flight_time_s", for JSON."""
    return {_name(key): value for key, value in asdict(row).items()}


def named_energy(energy: Ledger) -> dict[str, float]:
    """Return a ledger by names such as "coil_work_J", for JSON."""
    return {f"{key}_J": value for key, value in asdict(energy).items()}


def frame(rows: Sequence[Dot] | Sequence[Contact], kind: type[Dot | Contact]) -> pd.DataFrame:
    """Return dots or contacts as a table with columns such as "flight_time [s]"."""
    import pandas as pd

    names = list(kind.__dataclass_fields__)
    table = pd.DataFrame([asdict(row) for row in rows], columns=names)
    return table.rename(columns={key: f"{key} [{unit}]" for key, unit in UNITS.items()})


def _name(key: str) -> str:
    return f"{key}_{UNITS[key].replace('/', '_per_')}" if key in UNITS else key
