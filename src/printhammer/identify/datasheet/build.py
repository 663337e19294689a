"""A hammer of a data sheet: each constant is the sheet's, derived from it, or assumed, and says which.

The armature rests at the backstop at 0 and is pulled through the stroke to its end, where the gap is
`end_gap`. What it strikes, there or at `target`, is a spring and a dashpot with the restitution of the sheet,
so stiff that the work of the magnet presses it in by a quarter of the gap that is left.
"""

from __future__ import annotations

import math
import textwrap
from typing import Any, Final

import numpy as np

from printhammer.errors import InputError, located
from printhammer.hammer.file import FORMAT
from printhammer.hammer.hammer import Hammer
from printhammer.identify.datasheet.magnet import Sheet, SheetMagnet, fit_magnet
from printhammer.identify.datasheet.sheet import DataSheet, plain
from printhammer.parts.magnet import reluctance as law
from printhammer.support.constants import quantities, shown
from printhammer.support.roots import bisect
from printhammer.units import split

RESTITUTION: Final = 0.3
"""Of a stop whose sheet does not tell: steel on steel with a thin film between."""

INDENTATION: Final = 0.25
"""Part of the gap left by which the work of the magnet presses in what is struck."""

_GRID: Final = 200


def hammer_of(sheet: DataSheet) -> tuple[Hammer, SheetMagnet]:
    """Make a hammer of a data sheet; return it, and how well its magnet fits.

    Raises
    ------
    InputError
        The magnet does not pull the armature off its spring at the current of the forces, or the driver is
        none.
    """
    with located(sheet.where):
        return _hammer_of(sheet)


def _hammer_of(sheet: DataSheet) -> tuple[Hammer, SheetMagnet]:
    stroke, end_gap = sheet.si("stroke"), sheet.si("end_gap", 0.0)
    closed_at = stroke + end_gap
    diameter = sheet.entries.get("pole_diameter")
    current = sheet.si("current", sheet.si("rail") / sheet.si("resistance"))
    magnet = fit_magnet(
        Sheet(
            current=current,
            gaps=np.array([gap.si for gap, _force in sheet.force]),
            forces=np.array([force.si for _gap, force in sheet.force]),
            inductance=None if sheet.inductance is None else (sheet.inductance[0].si, sheet.inductance[1].si),
            turns=sheet.entries["turns"].si if "turns" in sheet.entries else None,
            area=None if diameter is None else math.pi * diameter.si**2 / 4.0,
            residual_gap=sheet.entries["residual_gap"].si if "residual_gap" in sheet.entries else None,
            closed_at=closed_at,
        )
    )
    parts: dict[str, Any] = {
        "magnet": _magnet(sheet, magnet),
        "coil": {"resistance": sheet.constant("resistance")},
        "spring": _spring(sheet, magnet, current),
        "pack": _pack(sheet, magnet, current),
        "backstop": {
            "law": "rigid",
            "position": _made(0.0, "mm", "derived", "origin: the armature at rest"),
            "restitution": _restitution(sheet),
        },
        "waveform": _waveform(sheet, magnet, current),
    }
    made = Hammer.from_toml(_head(sheet, magnet, current), sheet.where)
    return made.replace({"mass": sheet.constant("mass"), **parts}), magnet


def _head(sheet: DataSheet, magnet: SheetMagnet, current: float) -> str:
    """Return the text of a hammer file that has texts and a mass, to be replaced."""
    import tomlkit

    points = len(sheet.force)
    said = (
        f"Made of a data sheet: {sheet.texts['source']}. The law of the magnet meets its {points}"
        f" force{'s' if points > 1 else ''} at {current:.3g} A within {100.0 * magnet.misfit:.2g} %. What is"
        " assumed is what such devices have, no property of this one."
    )
    note = " ".join([sheet.texts.get("note", ""), said]).strip()
    lines = textwrap.wrap(note, 110, break_long_words=False)
    document = tomlkit.document()
    document.update({"format": FORMAT, "name": sheet.texts["name"]})
    if "title" in sheet.texts:
        document["title"] = sheet.texts["title"]
    document["note"] = tomlkit.string("".join(f"{line}\n" for line in lines), multiline=True)
    constant = 'mass = { value = 1, unit = "kg", status = "assumed", source = "to be replaced" }'
    return f"{tomlkit.dumps(document)}\n{constant}\n"


def _made(value: float, unit: str, status: str, source: str) -> dict[str, Any]:
    return {"value": plain(float(f"{value:.6g}")), "unit": unit, "status": status, "source": source}


def _magnet(sheet: DataSheet, magnet: SheetMagnet) -> dict[str, Any]:
    """Return the table of the magnet."""
    count = len(sheet.force)
    guessed = "force" in sheet.assumed
    what = f"fitted to {count}{' assumed' * guessed} force{'s' if count > 1 else ''}"
    what += " and the inductance" if sheet.inductance is not None else ""
    fitted = "assumed" if guessed else "derived"
    table: dict[str, Any] = {"law": "reluctance"}
    for name, note in quantities(law.ReluctanceMagnet).items():
        value = getattr(magnet.part, name)
        if value is None or (name == "leakage" and value == 0.0):
            continue
        if name in sheet.entries:
            table[name] = sheet.constant(name)
        elif name == "closed_at":
            table[name] = _made(value, "m", *_derived_from(sheet, "stroke", "stroke and the gap at its end"))
        elif name == "pole_area" and "pole_diameter" in sheet.entries:
            table[name] = _made(
                value, note.si, *_derived_from(sheet, "pole_diameter", "a round pole of the diameter")
            )
        elif name == "pole_area":
            table[name] = _made(value, note.si, fitted, what)
        elif name == "fringe_perimeter":
            status = table["pole_area"]["status"]
            table[name] = _made(value, note.si, status, "circumference of a round pole of that area")
        elif name in magnet.derived:
            error = 100.0 * magnet.derived[name]
            table[name] = _made(value, note.si, fitted, f"{what}, within {error:.2g} %")
        elif name in magnet.assumed:
            table[name] = _made(
                value, note.si, "assumed", f"{magnet.assumed[name]}, and {what}, which hardly tell"
            )
    return table


def _derived_from(sheet: DataSheet, key: str, how: str) -> tuple[str, str]:
    status, source = sheet.origin(key)
    return ("derived" if status == "datasheet" else status), f"{how}; {source}"


def _spring(sheet: DataSheet, magnet: SheetMagnet, current: float) -> dict[str, Any] | None:
    """Return the table of the return spring, None without one; InputError if the magnet is weaker."""
    stated = [name for name in ("preload", "stiffness") if f"spring.{name}" in sheet.entries]
    if not stated:
        return None
    pull = law.magnet_force(magnet.part.packed(0.0), 0.0, current)
    preload = sheet.si("spring.preload", 0.0)
    if preload >= pull:
        raise InputError.of(
            "spring.preload",
            preload,
            f"less than the {pull:.3g} N of the magnet at full gap and {current:.3g} A",
            written=f"{preload:g}",
            unit="N",
            said=": expected",
        )
    zero: dict[str, Any] = {"preload": _made(0.0, "N", "assumed", "the sheet does not tell")}
    zero["stiffness"] = _made(0.0, "N/m", "assumed", "the sheet does not tell")
    table: dict[str, Any] = {
        "law": "preload",
        **zero,
        **{name: sheet.constant(f"spring.{name}") for name in stated},
    }
    # The spring drives the armature back to the backstop.
    table["preload"]["value"] = plain(-float(table["preload"]["value"]))
    return table


def _restitution(sheet: DataSheet) -> dict[str, Any]:
    if "stop.restitution" in sheet.entries:
        return sheet.constant("stop.restitution")
    return _made(RESTITUTION, "1", "assumed", "steel on steel with a thin film between")


def _pack(sheet: DataSheet, magnet: SheetMagnet, current: float) -> dict[str, Any]:
    """Return the table of what is struck."""
    place = "target" if "target" in sheet.entries else "stroke"
    table: dict[str, Any] = {"law": "dashpot", "front": sheet.constant(place)}
    if "stop.stiffness" in sheet.entries:
        return {**table, **{name: sheet.constant(f"stop.{name}") for name in ("stiffness", "damping")}}
    front = sheet.si(place)
    work = _work(sheet, magnet, front, current)
    left = magnet.part.closed_at - front + magnet.part.residual_gap
    stiffness = 2.0 * work / (INDENTATION * left) ** 2
    why = (
        f"the magnet's work of {1e3 * work:.3g} mJ presses it in by a quarter of the gap left,"
        f" {1e6 * left:.3g} um"
    )
    restitution = _restitution(sheet)
    damping = 2.0 * damping_ratio(restitution["value"]) * math.sqrt(stiffness * sheet.si("mass"))
    table["stiffness"] = _made(stiffness, "N/m", "assumed", why)
    table["damping"] = _made(damping, "N s/m", "assumed", f"returns {restitution['value']:g} of the speed")
    return table


def _work(sheet: DataSheet, magnet: SheetMagnet, front: float, current: float) -> float:
    """Return the work of magnet and spring up to a place at a constant current, J."""
    c = magnet.part.packed(0.0)
    x = np.linspace(0.0, front, _GRID)
    pull = np.array([law.magnet_force(c, place, current) for place in x.tolist()])
    held = sheet.si("spring.preload", 0.0) + sheet.si("spring.stiffness", 0.0) * x
    work = float(np.trapezoid(pull - held, x))
    if work <= 0.0:
        raise InputError.of(
            "spring.stiffness",
            sheet.si("spring.stiffness", 0.0),
            f"a spring that the magnet overcomes on the way at {current:.3g} A",
            written=f"{sheet.si('spring.stiffness', 0.0):g}",
            unit="N/m",
            said=": expected",
        )
    return work


def damping_ratio(restitution: float) -> float:
    """Return the damping ratio of a spring and dashpot that do not pull, which return a part of the speed."""

    def returned(ratio: float) -> float:
        root = math.sqrt(1.0 - ratio * ratio)
        angle = math.pi - math.atan2(2.0 * ratio * root, 1.0 - 2.0 * ratio * ratio)
        return math.exp(-ratio / root * angle) - restitution

    # At critical damping exp(-2) is returned; less than that asks for more.
    if restitution <= math.exp(-2.0) or restitution >= 1.0:
        return float(restitution < 1.0)
    return bisect(returned, 0.0, 1.0 - 1e-12)


def _waveform(sheet: DataSheet, magnet: SheetMagnet, current: float) -> dict[str, Any]:
    """Return the table of the standard waveform: the driver of the sheet, or the rail alone."""
    from printhammer.drive.waveforms.shapes import SHAPES

    table: dict[str, Any] = {"shape": sheet.driver.get("shape", "rail"), "voltage": sheet.constant("rail")}
    if table["shape"] not in SHAPES:
        raise InputError.of(
            "driver.shape",
            table["shape"],
            f"one of {', '.join(SHAPES)}",
            written=shown(table["shape"]),
            said=": expected",
        )
    known = quantities(SHAPES[table["shape"]])
    for key, value in sheet.driver.items():
        status, source = sheet.origin(f"driver.{key}")
        if key in known and isinstance(value, str):
            with located(f"driver.{key}", key=f"driver.{key}"):
                number, unit = split(value, known[key].si)
            table[key] = {"value": plain(number), "unit": unit, "status": status, "source": source}
        elif key != "shape":
            table[key] = value
    if "on_time" in sheet.entries:
        table["width"] = sheet.constant("on_time")
    elif "width" not in table:
        # Twice what the current takes to rise and the armature to fly, at the mean force.
        work = _work(sheet, magnet, sheet.si("stroke"), current)
        flight = math.sqrt(2.0 * sheet.si("mass") * sheet.si("stroke") ** 2 / work)
        width = 2.0 * (magnet.inductance / sheet.si("resistance") + flight)
        why = "twice the time constant of the coil at full gap and the flight under the mean force"
        table["width"] = _made(float(f"{1e3 * width:.2g}"), "ms", "assumed", why)
    return table
