"""Results on disk: atomic writing in a format chosen by the file ending, and reopening.

| ending | content |
|---|---|
| `.nc` | the Dataset, in the classic NetCDF format, which every NetCDF reader supports |
| `.zarr` | the Dataset, a Zarr v3 store (needs the extra ``sweep``) |
| `.json` | the Dataset: its attributes, and under ``columns`` every array with dimensions, unit and meaning |
| `.csv` | the table, below lines ``# key: value`` with the attributes |
| `.parquet` | the table, its attributes among the metadata (needs the extra ``tables``) |

JSON is strict: nan is null, and infinite numbers are "inf" and "-inf".
"""

from __future__ import annotations

import json
import math
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from warnings import catch_warnings, simplefilter

import numpy as np

from printhammer.errors import InputError, missing_extra
from printhammer.results.declare import Column, Declared, heading, part
from printhammer.results.provenance import KEYS
from printhammer.support.files import write_file
from printhammer.support.tables.text import read_cells

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


ENDINGS: Final = (".nc", ".zarr", ".csv", ".parquet", ".json")
"""Endings of the files in which results are saved."""

_NEEDED: Final = {
    ".zarr": ("zarr", "Zarr stores need", "sweep"),
    ".parquet": ("pyarrow", "Parquet files need", "tables"),
}
_COLUMNS: Final = "columns"
_MOST_INT: Final = 2**31  # Integers of the classic NetCDF format have 32 bits


class Reopened(Declared):
    """Result read from a file."""

    path: Path = part("path of the file")
    dataset: xr.Dataset = part(
        "arrays as a Dataset; for a table (.csv, .parquet), the columns over the dimension `row`", repr=False
    )
    dataframe: pd.DataFrame = part(
        "columns as a table; for a Dataset, the arrays over the dimensions of the first array", repr=False
    )

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the Dataset: title, scalars, and provenance."""
        return {str(key): value for key, value in self.dataset.attrs.items()}

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the result, as stated in the file."""
        return {key: value for key, value in self.attributes.items() if key in KEYS}


def save(
    path: str | Path,
    dataset: Callable[[], xr.Dataset],
    dataframe: Callable[[], pd.DataFrame],
    endings: Sequence[str] = ENDINGS,
) -> None:
    """Write a result atomically, as a Dataset or as a table, depending on the file ending.

    `dataset` and `dataframe` are functions that build the Dataset and the table; only the function that the
    format needs is called.

    Raises
    ------
    InputError
        The name ends in none of `endings`, the file cannot be written, or a package that the format needs is
        missing; an existing file is kept.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind not in endings:
        some = f"one of {', '.join(endings)}" if len(endings) > 1 else endings[0]
        raise InputError(f"{target}: expected a name that ends in {some}", file=target)
    need_for(target)
    if kind == ".nc":
        write_file(target, _netcdf(dataset()))
    elif kind == ".zarr":
        _save_zarr(dataset(), target)
    elif kind == ".json":
        write_file(target, _json(dataset()))
    elif kind == ".csv":
        write_csv(dataframe(), target)
    else:
        write_parquet(dataframe(), target)


def save_dataset(dataset: xr.Dataset, path: str | Path, endings: Sequence[str] = ENDINGS) -> None:
    """Write a Dataset atomically; see `save`."""
    save(path, lambda: dataset, lambda: frame_of(dataset), endings)


def reopen(path: str | Path) -> Reopened:
    """Open a saved result.

    Parameters
    ----------
    path : path
        File written by `Result.save`. A CSV file without lines ``# key: value`` is accepted as well, and has
        no provenance.

    Raises
    ------
    InputError
        The name ends in none of `ENDINGS`, the file cannot be read, or it does not contain a result.
    """
    import pandas as pd

    source = Path(path)
    kind = source.suffix.lower()
    if kind not in ENDINGS:
        raise InputError(f"{source}: expected a name that ends in one of {', '.join(ENDINGS)}", file=source)
    need_for(source)
    try:
        if kind in (".csv", ".parquet"):
            table = _read_csv(source) if kind == ".csv" else pd.read_parquet(source)
            return Reopened(source, _dataset_of(table), table)
        dataset = _read_json(source) if kind == ".json" else _read_arrays(source)
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - the backends raise what they like
        reason = getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{source}: the result cannot be read ({reason[:200]})", file=source) from None
    return Reopened(source, dataset, frame_of(dataset))


def need_for(path: str | Path, kind: str = "") -> None:
    """Raise InputError unless the package that a file format needs is installed.

    `kind` is the ending of the format, such as ".zarr"; by default the ending of `path`.
    """
    package, what, extra = _NEEDED.get(kind or Path(path).suffix.lower(), ("json", "", ""))
    if find_spec(package) is None:
        raise missing_extra(f"{path}: {what} {package}", extra)


def plain(value: Any) -> Any:
    """Convert a value to Python numbers, texts, lists and dicts, which every file format can store."""
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    return int(value) if isinstance(value, bool) else value


def dataset_of(entries: Mapping[str, tuple[Column, Any]], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Build a Dataset from columns and coordinates with their values, by variable name."""
    import xarray as xr

    data: dict[str, Any] = {}
    coordinates: dict[str, Any] = {}
    for name, (note, values) in entries.items():
        kept = np.asarray(values) if note.dtype is None else np.asarray(values).astype(note.dtype)
        target = coordinates if note.kind == "coordinate" else data
        target[name] = (note.dims, kept, note.attributes)
    return xr.Dataset(data, coords=coordinates, attrs=dict(attributes))


def frame_of(dataset: xr.Dataset, attributes: Mapping[str, Any] | None = None) -> pd.DataFrame:
    """Build a table from the arrays of a Dataset that lie over the dimensions of its first data array.

    `attributes` are stored in the `attrs` of the table; by default those of the Dataset.
    """
    first = next(iter(dataset.data_vars.values()), None)
    dims = () if first is None else tuple(map(str, first.dims))
    columns = {}
    for name in (*dataset.coords, *dataset.data_vars):
        values = dataset[name]
        if values.dims and set(values.dims) <= set(dims):
            head = heading(str(name), str(values.attrs.get("units", "")))
            columns[head] = (tuple(map(str, values.dims)), values.values)
    return frame(columns, dims, plain(dict(dataset.attrs if attributes is None else attributes)))


def frame(
    columns: Mapping[str, tuple[tuple[str, ...], Any]], dims: tuple[str, ...], attributes: dict[str, Any]
) -> pd.DataFrame:
    """Build a table with one row for each combination of indices along the dimensions.

    Parameters
    ----------
    columns : mapping
        Dimensions of a column, a subset of `dims`, and its values, by heading of the column.
    dims : tuple of str
        The dimensions; the last varies fastest.
    attributes : dict
        Attributes to store in the `attrs` of the table.
    """
    import pandas as pd

    arrays = {head: (own, np.asarray(values)) for head, (own, values) in columns.items()}
    sizes = {
        dim: length for own, values in arrays.values() for dim, length in zip(own, values.shape, strict=True)
    }
    shape = [sizes.get(dim, 0) for dim in dims]
    flat = {}
    for head, (own, values) in arrays.items():
        ordered = values.transpose([own.index(dim) for dim in dims if dim in own])
        spread = ordered.reshape([sizes[dim] if dim in own else 1 for dim in dims])
        flat[head] = np.broadcast_to(spread, shape).reshape(-1)
    table = pd.DataFrame(flat)
    table.attrs.update(attributes)
    return table


def csv_text(table: pd.DataFrame) -> str:
    """Format a table as CSV with all digits, below lines ``# key: value`` with its `attrs`."""
    head = "".join(f"# {key}: {_text(value)}\n" for key, value in table.attrs.items())
    return head + str(table.to_csv(index=False, float_format="%.17g", lineterminator="\n"))


def write_csv(table: pd.DataFrame, path: str | Path) -> None:
    """Write a table as CSV; see `csv_text`."""
    write_file(path, csv_text(table))


def write_parquet(table: pd.DataFrame, path: str | Path) -> None:
    """Write a table as Parquet, including its `attrs`.

    Raises
    ------
    InputError
        The file cannot be written, or pyarrow is not installed; an existing file is kept.
    """
    need_for(path, ".parquet")
    content = BytesIO()
    table.to_parquet(content, index=False)
    write_file(path, content.getvalue())


def _text(value: Any) -> str:
    """Encode an attribute as text: verbatim, or as JSON if the text would be read as a number or list."""
    if isinstance(value, str) and _decode(value) == value == value.strip() and value.isprintable():
        return value
    return json.dumps(_strict(value), ensure_ascii=False)


def _decode(value: str, starts: str = '[{"-0123456789n') -> Any:
    """Decode an attribute encoded by `_text`; a text that begins with none of `starts` is not JSON."""
    if value[:1] and value[0] in starts:
        with suppress(ValueError):
            decoded = json.loads(value)
            return math.nan if decoded is None else decoded
    return value


def _netcdf(dataset: xr.Dataset) -> bytes:
    kept = dataset.copy()
    kept.attrs = _flat(dataset.attrs)
    # SciPy writes the classic format, which every reader supports.
    return bytes(kept.to_netcdf(None, engine="scipy", format="NETCDF3_64BIT"))


def _flat(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes as arrays, numbers and texts for NetCDF; other values are encoded as JSON."""
    flat = {}
    for key, value in attributes.items():
        kept = plain(value)
        # NetCDF readers return an array of one number as a number.
        entries = kept if isinstance(kept, list) and len(kept) > 1 else [kept]
        numbers = all(
            isinstance(entry, float) or (isinstance(entry, int) and abs(entry) < _MOST_INT)
            for entry in entries
        )
        flat[str(key)] = kept if numbers or isinstance(kept, str) else json.dumps(_strict(kept))
    return flat


def _save_zarr(dataset: xr.Dataset, target: Path) -> None:
    if target.exists() and not (target / "zarr.json").is_file():
        raise InputError(f"{target}: expected a new store; the existing folder is no Zarr store", file=target)
    draft: Path | None = None
    try:
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
        with catch_warnings():
            # Consolidated metadata, in addition to the metadata of each array, avoid a warning in readers.
            simplefilter("ignore")
            dataset.assign_attrs(_flat(dataset.attrs)).to_zarr(
                draft / target.name, mode="w", zarr_format=3, consolidated=True
            )
        if target.exists():
            target.rename(draft / "before")
        (draft / target.name).rename(target)
    except OSError as error:
        raise InputError(
            f"{target}: the store cannot be written ({error.strerror or error})", file=target
        ) from None
    finally:
        if draft is not None:
            if (draft / "before").exists() and not target.exists():
                (draft / "before").rename(target)
            with suppress(OSError):
                shutil.rmtree(draft)


def _json(dataset: xr.Dataset) -> str:
    def text(value: Any) -> str:
        return json.dumps(_strict(value), allow_nan=False, ensure_ascii=False)

    columns = {
        str(name): {
            "dims": list(map(str, values.dims)),
            **plain(values.attrs),
            "dtype": values.dtype.str[1:],
            "coordinate": name in dataset.coords,
            "values": values.values.tolist(),
        }
        for name, values in dataset.variables.items()
    }
    # One line for each attribute and each array.
    head = "".join(f"  {text(str(key))}: {text(plain(value))},\n" for key, value in dataset.attrs.items())
    body = ",\n".join(f"    {text(name)}: {text(entry)}" for name, entry in columns.items())
    return f"{{\n{head}  {text(_COLUMNS)}: {{\n{body}\n  }}\n}}\n"


def _strict(value: Any) -> Any:
    """Convert a value to strict JSON: null for NaN, and text for infinite numbers."""
    if isinstance(value, dict):
        return {key: _strict(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_strict(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def _read_json(source: Path) -> xr.Dataset:
    import xarray as xr

    content = json.loads(source.read_text("utf-8"))
    columns = content.pop(_COLUMNS, None) if isinstance(content, dict) else None
    if not isinstance(columns, dict):
        raise InputError(
            f"{source}: expected a result of printhammer, with {_COLUMNS}", file=source, key="columns"
        )
    data: dict[bool, dict[str, Any]] = {True: {}, False: {}}
    for name, entry in columns.items():
        dims, values = entry.pop("dims"), np.array(entry.pop("values"), dtype=entry.pop("dtype"))
        data[entry.pop("coordinate")][name] = (dims, values, entry)
    return xr.Dataset(data[False], data[True], {key: _number(value) for key, value in content.items()})


def _number(value: Any) -> Any:
    return math.nan if value is None else float(value) if value in ("inf", "-inf") else value


def _read_arrays(source: Path) -> xr.Dataset:
    import xarray as xr

    options: dict[str, Any] = {"engine": "scipy"}
    if source.suffix.lower() == ".zarr":
        options = {"engine": "zarr", "consolidated": False}
    with xr.open_dataset(source, decode_times=False, **options) as opened:
        dataset = opened.load()
    for key, value in dataset.attrs.items():
        dataset.attrs[key] = _decode(value, "[{") if isinstance(value, str) else plain(value)
    return dataset


def _read_csv(source: Path) -> pd.DataFrame:
    import pandas as pd

    sheet = read_cells(source, "the result", gaps=True)
    lengths = {len(cells) for _line, cells in sheet.rows}
    if len(lengths) != 1:
        raise InputError(
            f"{source}: expected a heading, and rows with the same number of cells", file=source, key="rows"
        )
    (_line, heads), *rows = sheet.rows
    table = pd.DataFrame(
        {head: _parse_column([cells[k] for _line, cells in rows]) for k, head in enumerate(heads)}
    )
    attributes = {key: _number(_decode(value)) for key, value in sheet.comments.items()}
    table.attrs.update(attributes)
    return table


def _parse_column(cells: list[str]) -> Any:
    """Convert a column of text cells to Booleans, integers or floats; leave other columns as text."""
    if set(cells) <= {"True", "False"}:
        return np.array([cell == "True" for cell in cells])
    for kind in (int, float):
        with suppress(ValueError):
            return np.array([kind(cell) if cell or kind is int else math.nan for cell in cells], dtype=kind)
    return cells


def _dataset_of(table: pd.DataFrame) -> xr.Dataset:
    import xarray as xr

    data = {}
    for head in table:
        name, _, unit = str(head).partition(" [")
        values = table[head].to_numpy()
        if values.dtype.kind == "O":
            values = np.array([value if isinstance(value, str) else "" for value in values], dtype=np.str_)
        data[name] = ("row", values, {"units": unit.removesuffix("]")} if unit else {})
    return xr.Dataset(data, attrs=table.attrs)
