"""Drive files: reading and writing drives as TOML.

A file has ``format = 1``, optionally ``overlap = "add"`` or ``"replace"``, and exactly one of five tables::

    [train]                       # rate or period; pulses, 9 if left out; start
    rate = "1.2 kHz"
    pulses = 9

    [times]                       # explicit firing times
    at = ["0 us", "700 us"]       # or { values = [0, 700], unit = "us" }

    [burst]                       # rate or period, pulses of one burst, bursts, gap between them; start
    rate = "1.2 kHz"
    pulses = 9
    bursts = 4
    gap = "3 ms"

    [sequence]                    # a waveform for each firing, by its name
    at = ["0 us", "700 us", "1.4 ms"]
    waveforms = ["print", "soft", "print"]

    [sine]                        # a sinusoidal force; phase is optional
    amplitude = "0.5 N"
    frequency = "300 Hz"
    phase = "90 deg"

Train, times and burst fire a waveform: the table ``[waveform]`` of the file, or else the hammer's. The
waveforms of a sequence are the tables ``[waveforms.print]``, ``[waveforms.soft]`` and so on. The keys of a
waveform are ``shape`` and the constants of the shape. A sampled waveform names a CSV file (``file``, relative
to the drive file) or contains the samples as ``time`` and ``current`` or ``force``, each ``{ values = [...],
unit = "us" }``. A waveform of the shape "chain" has ``parts``, a list of waveforms, each with its offset
``at`` from the firing. A waveform of the shape "switched" has lists of times ``at`` and of ``levels``, and
the time constant ``edge``.
Every quantity is written with its unit, as a string or as ``{ value = 1.2, unit = "kHz" }``.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from printhammer.drive.sequence import PulseSequence
from printhammer.drive.text import FORMAT
from printhammer.drive.trains import Burst, Drive, PulseTrain, SineForce
from printhammer.drive.waveforms.base import QUANTITY_UNITS, Waveform
from printhammer.drive.waveforms.shapes import SHAPES, Chain, Sampled, Switched
from printhammer.errors import InputError, located
from printhammer.support.constants import invalid, options, quantities, shown
from printhammer.support.files import read_text

_PLAIN: Final = {"pulses", "bursts", "waveforms"}
_KEYS: Final[dict[str, dict[str, str]]] = {
    "train": {"rate": "Hz", "period": "s", "pulses": "", "start": "s"},
    "times": {"at": "s", "start": "s"},
    "burst": {"rate": "Hz", "period": "s", "pulses": "", "bursts": "", "gap": "s", "start": "s"},
    "sequence": {"at": "s", "waveforms": "", "start": "s"},
    "sine": {"amplitude": "N", "frequency": "Hz", "phase": "rad"},
}
_MAKERS: Final[dict[str, Callable[..., Drive]]] = {"train": PulseTrain, "times": PulseTrain, "burst": Burst}


def load_drive(path: str | Path, waveform: Waveform | None = None) -> Drive:
    """Read a drive from a drive file (TOML).

    Parameters
    ----------
    path
        TOML file.
    waveform
        Waveform to use if the file has no ``[waveform]`` table, usually the hammer's.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, has an unknown or missing key, or a value of the wrong kind,
        unit or range; the message names file, key and value.
    """
    path = Path(path)
    return read_drive(read_text(path, "the drive file"), waveform, name=str(path), folder=path.parent)


def read_drive(
    text: str, waveform: Waveform | None = None, *, name: str = "drive", folder: Path | None = None
) -> Drive:
    """Parse the text of a drive file; `name` appears in messages, `folder` contains sampled waveforms.

    `waveform` and the errors are as for `load_drive`.
    """
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # tomllib raises a bare ValueError for a number with thousands of digits.
        raise InputError(f"{name}: expected TOML ({' '.join(str(error).split())})", file=name) from None
    return drive_of(data, waveform, name=name, folder=folder)


def drive_of(
    data: dict[str, Any],
    waveform: Waveform | None = None,
    *,
    name: str = "drive",
    folder: Path | None = None,
) -> Drive:
    """Build a drive from the parsed tables of a drive file; arguments and errors as for `read_drive`."""
    with located(name):
        return _drive(data, waveform, folder or Path())


def save_drive(drive: Drive, path: str | Path) -> None:
    """Write a drive file, from which `load_drive` reads an equal drive."""
    try:
        Path(path).write_text(drive.to_toml(), encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"{path}: the drive file cannot be written ({error.strerror})", file=path, key="drive"
        ) from None


def _drive(data: dict[str, Any], standard: Waveform | None, folder: Path) -> Drive:
    _known(data, {"format", "overlap", "waveform", "waveforms", *_KEYS}, "")
    if data.get("format") != FORMAT or isinstance(data["format"], (bool, float)):
        raise InputError.of("format", data.get("format"), FORMAT, written=shown(data.get("format")))
    kinds = [kind for kind in _KEYS if kind in data]
    if len(kinds) != 1:
        several = " and ".join(f"[{kind}]" for kind in kinds) or "none"
        raise InputError(
            f"{several} given",
            key="drive",
            expected=f"one of the tables {', '.join(f'[{kind}]' for kind in _KEYS)}",
        )
    kind = kinds[0]
    arguments = _arguments(_table(data[kind], kind), kind)
    for key, others in (("waveform", ("sine", "sequence")), ("waveforms", set(_KEYS) - {"sequence"})):
        if key in data and kind in others:
            raise InputError(f"{key} together with [{kind}]", expected="no such key", key=key)
    if kind == "sine":
        if data.get("overlap", "add") != "add":
            raise InputError("overlap together with [sine]", expected="no such key", key="overlap")
        _required(arguments, ("amplitude", "frequency"), kind)
        return _named(kind, SineForce, arguments)
    overlap = data.get("overlap", "add")
    if overlap not in ("add", "replace"):
        raise InputError.of("overlap", overlap, "'add' or 'replace'", written=shown(overlap))
    if kind == "sequence":
        _required(arguments, ("at", "waveforms"), kind)
        waveforms = _waveforms(arguments.pop("waveforms"), data, folder)
        return _named(kind, PulseSequence, {"waveforms": waveforms, "overlap": overlap, **arguments})
    if kind == "times":
        _required(arguments, ("at",), kind)
    elif "rate" not in arguments and "period" not in arguments:
        raise InputError(f"{kind}.rate is missing", key=f"{kind}.rate", expected="a rate or a period")
    elif kind == "burst":
        _required(arguments, ("pulses",), kind)
    if "waveform" in data:
        waveform: Waveform | None = _waveform(_table(data["waveform"], "waveform"), folder, "waveform")
    else:
        waveform = standard
    if waveform is None:
        raise InputError("[waveform] is missing, and there is no hammer with a waveform", key="[waveform]")
    return _named(kind, _MAKERS[kind], {"waveform": waveform, "overlap": overlap, **arguments})


def _named(kind: str, maker: Callable[..., Drive], arguments: Mapping[str, Any]) -> Drive:
    with located(kind, key=kind):
        return maker(**arguments)


def _table(value: Any, name: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError.of(name, value, "a table", written=shown(value))
    return value


def _known(table: Mapping[str, Any], keys: set[str], name: str) -> None:
    for key in table:
        if key not in keys:
            where = f"{name}.{key}" if name else key
            where = where if where.isprintable() else shown(where)
            known = ", ".join(sorted(keys))
            raise InputError(
                f"{where} = {shown(table[key])} is not known",
                key=where,
                value=table[key],
                expected=f"one of {known}",
            )


def _required(table: Mapping[str, Any], keys: tuple[str, ...], name: str) -> None:
    for key in keys:
        if key not in table:
            raise InputError(f"{name}.{key} is missing", key=f"{name}.{key}")


def _arguments(table: dict[str, Any], kind: str) -> dict[str, Any]:
    """Parse the table `kind` of a drive file, such as "train"; return its values in SI, by key."""
    _known(table, set(_KEYS[kind]), kind)
    result: dict[str, Any] = {}
    for key, value in table.items():
        where = f"{kind}.{key}"
        if key in _PLAIN:
            result[key] = value
        elif key == "at":
            result[key] = _column(value, "s", where)
        else:
            result[key] = _quantity(value, (_KEYS[kind][key],), where)[0]
    return result


def _quantity(value: Any, units: tuple[str, ...], where: str) -> tuple[float, str]:
    """Parse a quantity that may have one of several dimensions; return its SI value and SI unit."""
    from printhammer.units import split, to_si

    if isinstance(value, str):
        with located(where, key=where):
            number, unit = split(value, units[0])
    elif isinstance(value, dict):
        _known(value, {"value", "unit"}, where)
        _required(value, ("value", "unit"), where)
        number, unit = value["value"], value["unit"]
        if not isinstance(unit, str):
            raise InputError.of(
                f"{where}.unit",
                unit,
                f"a unit, such as {units[0]!r}",
                written=shown(unit),
            )
    else:
        raise InputError(
            f"{where} = {shown(value)} has no unit",
            key=where,
            value=value,
            expected=f"a string such as '1 {units[0]}'",
        )
    for si in units[1:]:
        with suppress(InputError):
            return to_si(number, unit, si), si
    with located(where, key=where):
        return to_si(number, unit, units[0]), units[0]


def _column(value: Any, si: str, where: str) -> list[float]:
    """Parse several quantities: a list of strings with units, or values with a common unit."""
    if isinstance(value, list):
        return [_quantity(entry, (si,), where)[0] for entry in value]
    if not isinstance(value, dict):
        raise InputError.of(where, value, "a list, or values with a unit", written=shown(value))
    _known(value, {"values", "unit"}, where)
    _required(value, ("values", "unit"), where)
    values, unit = value["values"], value["unit"]
    if not isinstance(values, list):
        raise InputError.of(f"{where}.values", values, "a list of numbers", written=shown(values))
    return [_quantity({"value": entry, "unit": unit}, (si,), where)[0] for entry in values]


def _waveforms(names: Any, data: dict[str, Any], folder: Path) -> list[Waveform]:
    """Return the waveforms of a sequence, in the order of the names."""
    tables = _table(data.get("waveforms", {}), "waveforms")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError.of("sequence.waveforms", names, "a list of names", written=shown(names))
    made = {
        name: _waveform(_table(table, f"waveforms.{name}"), folder, f"waveforms.{name}")
        for name, table in tables.items()
    }
    for name in names:
        if name not in made:
            known = (
                ", ".join(f"[waveforms.{known}]" for known in made)
                or "a table [waveforms.NAME] for each name"
            )
            raise InputError(
                f"sequence.waveforms: {shown(name)} does not name a waveform of the file",
                key="sequence.waveforms",
                expected=known,
            )
    return [made[name] for name in names]


def _waveform(table: dict[str, Any], folder: Path, where: str) -> Waveform:
    shape = table.get("shape")
    known: dict[str, type[Waveform]] = {**SHAPES, Chain.shape: Chain, Switched.shape: Switched}
    if not isinstance(shape, str) or shape not in known:
        raise InputError.of(
            f"{where}.shape",
            shape,
            f"one of {', '.join(known)}",
            written=shown(shape),
        )
    model = known[shape]
    data = {key: value for key, value in table.items() if key != "shape"}
    if model is Chain:
        return _chain(data, folder, where)
    if model is Switched:
        return _read_switched(data, where)
    if model is Sampled and "file" not in data:
        return _samples(data, where)
    notes = quantities(model)
    _known(data, {*notes, *(set(options(model)) - {"quantity"})}, where)
    fields: dict[str, Any] = {}
    for key, value in data.items():
        if key not in notes:
            fields[key] = value
            continue
        fields[key], si = _quantity(value, (notes[key].si, *notes[key].also), f"{where}.{key}")
        if notes[key].also:
            fields["quantity"] = QUANTITY_UNITS[si]
    try:
        return model.model_validate(fields, context={"folder": folder})
    except ValidationError as error:
        raise invalid(error, model, f"{where}.") from None


def _chain(data: dict[str, Any], folder: Path, where: str) -> Chain:
    """Parse a chain: a list of waveforms, each with its offset from the firing."""
    _known(data, {"parts"}, where)
    _required(data, ("parts",), where)
    if not isinstance(data["parts"], list) or not data["parts"]:
        raise InputError.of(
            f"{where}.parts",
            data["parts"],
            "a list of waveforms",
            written=shown(data["parts"]),
        )
    parts = []
    for number, entry in enumerate(data["parts"]):
        own = f"{where}.parts[{number}]"
        table = dict(_table(entry, own))
        _required(table, ("at",), own)
        parts.append((_quantity(table.pop("at"), ("s",), f"{own}.at")[0], _waveform(table, folder, own)))
    try:
        return Chain(parts=parts)
    except InputError as error:
        fault = InputError(f"{where}.{error}", key=f"{where}.{error.key}", value=error.value)
        fault.expected = error.expected
        raise fault from None


def _read_switched(data: dict[str, Any], where: str) -> Switched:
    """Parse a switched waveform; the unit of its levels determines the driven quantity."""
    _known(data, {"at", "levels", "edge", "initial"}, where)
    _required(data, ("at", "levels", "edge"), where)
    levels, refused = None, None
    for si, driven in QUANTITY_UNITS.items():
        try:
            levels, unit, quantity = _column(data["levels"], si, f"{where}.levels"), si, driven
            break
        except InputError as error:
            refused = refused or error
    if levels is None:
        assert refused is not None
        raise refused
    fields: dict[str, Any] = {
        "at": tuple(_column(data["at"], "s", f"{where}.at")),
        "levels": tuple(levels),
        "edge": _quantity(data["edge"], ("s",), f"{where}.edge")[0],
        "quantity": quantity,
    }
    if "initial" in data:
        fields["initial"] = _quantity(data["initial"], (unit,), f"{where}.initial")[0]
    try:
        return Switched.model_validate(fields)
    except ValidationError as error:
        fault = invalid(error, Switched, f"{where}.")
        if str(fault).startswith(where):
            raise fault from None
        raise InputError(f"{where}.{fault}", key=f"{where}.{fault.key}", value=fault.value) from None


def _samples(data: dict[str, Any], where: str) -> Waveform:
    """Parse a sampled waveform whose samples are stored in the drive file itself."""
    si = {name: unit for unit, name in QUANTITY_UNITS.items()}
    _known(data, {"interpolation", "time", *si}, where)
    driven = [name for name in si if name in data]
    if "time" not in data or len(driven) != 1:
        raise InputError(where, key=where, expected="a file, or time and either current or force")
    interpolation = data.get("interpolation", "pchip")
    if interpolation not in ("pchip", "linear"):
        raise InputError.of(
            f"{where}.interpolation",
            interpolation,
            "'pchip' or 'linear'",
            written=shown(interpolation),
        )
    name = driven[0]
    times = _column(data["time"], "s", f"{where}.time")
    values = _column(data[name], si[name], f"{where}.{name}")
    return Sampled.from_samples(times, values, quantity=QUANTITY_UNITS[si[name]], interpolation=interpolation)
