"""A motion as tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd
    import xarray as xr

    from printhammer.run.motion import Motion

_NAMES: Final = {
    "x": ("m", "displacement"),
    "v": ("m/s", "velocity"),
    "current": ("A", "coil current"),
}


def motion_dataset(motion: Motion) -> xr.Dataset:
    """Return the output grid of a motion as a Dataset.

    Parameters
    ----------
    motion : Motion
        The motion.

    Returns
    -------
    xarray.Dataset
        Over the coordinate `t` [s]: `x`, `v`, `current` and the forces as `force_magnet` and so on; units
        and long names in the attributes of each, provenance in those of the set.
    """
    import xarray as xr

    data = {
        name: ("t", getattr(motion, name), {"units": unit, "long_name": meaning})
        for name, (unit, meaning) in _NAMES.items()
    }
    for name, values in motion.force.items():
        data[f"force_{name}"] = ("t", values, {"units": "N", "long_name": f"{name} force"})
    time = ("t", motion.t, {"units": "s", "long_name": "time"})
    return xr.Dataset(data, coords={"t": time}, attrs=motion.provenance)


def motion_table(motion: Motion) -> pd.DataFrame:
    """Return the output grid of a motion as a table, columns such as "x [m]"; provenance in `attrs`."""
    import pandas as pd

    columns = {"t [s]": motion.t}
    columns.update({f"{name} [{unit}]": getattr(motion, name) for name, (unit, _meaning) in _NAMES.items()})
    columns.update({f"force_{name} [N]": values for name, values in motion.force.items()})
    table = pd.DataFrame(columns)
    table.attrs.update(motion.provenance)
    return table


def write_csv(table: pd.DataFrame, path: str | Path) -> None:
    """Write a table as CSV with all digits.

    Raises
    ------
    InputError
        The file cannot be written; what was there stays.
    """
    _write(path, lambda draft: table.to_csv(draft, index=False, float_format="%.17g"))


def write_parquet(table: pd.DataFrame, path: str | Path) -> None:
    """Write a table as Parquet, its `attrs` with it.

    Raises
    ------
    InputError
        The file cannot be written, or pyarrow is not installed; what was there stays.
    """
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise InputError(
            f"{path}: writing Parquet needs pyarrow, which the extra printhammer[tables] installs"
        ) from None
    _write(path, lambda draft: table.to_parquet(draft, index=False))


def _write(path: str | Path, write: Callable[[Path], object]) -> None:
    """Write beside the target first, so that nothing is lost if writing fails."""
    target = Path(path)
    draft = target.with_name(target.name + ".part")
    try:
        write(draft)
        draft.replace(target)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise InputError(f"{target}: the file cannot be written ({error.strerror or error})") from None
