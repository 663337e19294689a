"""Build a hammer from a data sheet; each constant is marked as printed, derived or assumed.

The armature rests at the backstop at 0 and is pulled through the stroke to its end, where the gap is
`end_gap`. The struck object, at the end of the stroke or at `target`, is a spring with a dashpot that has the
restitution of the sheet and is so stiff that the work of the magnet indents it by a quarter of the remaining
gap.

Contacts are linear springs. A make contact is compressed between its gap and the end of the stroke; a break
contact is closed at rest, and the armature opens it as it moves.

The magnet follows the reluctance law. A sheet has a few forces at one current, whereas the law has seven
constants, so the fit is a maximum a posteriori estimate: every constant but the pole area has a log-normal
prior typical of such devices, and the sum of squared misfits of forces, inductance and priors is minimised. A
constant whose uncertainty is much smaller than that of its prior is marked as derived, any other as assumed.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from printhammer.errors import InputError, located
from printhammer.hammer.file import FORMAT
from printhammer.hammer.hammer import Hammer
from printhammer.identify.datasheet.sheet import DataSheet, plain
from printhammer.parts.magnet import reluctance as law
from printhammer.parts.magnet.reluctance import MU0, ReluctanceMagnet
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import quantities, shown
from printhammer.support.roots import bisect
from printhammer.units import split

FORCE_ERROR: Final = 0.03
"""Relative standard error of a printed force; assumed."""

INDUCTANCE_ERROR: Final = 0.05
"""Relative standard error of a printed inductance; assumed."""

DERIVED: Final = 0.5
"""Ratio of posterior to prior standard deviation below which a constant is marked as derived; arbitrary."""


@dataclass(frozen=True)
class Guess:
    """Log-normal prior of a magnet constant, typical of small solenoids."""

    value: float
    spread: float
    """Standard deviation of the natural logarithm of the constant."""
    why: str


GUESSES: Final = {
    "turns": Guess(1000.0, 0.7, "1000 turns, within a factor of 2"),
    "residual_gap": Guess(
        0.1e-3, 1.0, "air beside the armature and a film at the stop, 0.1 mm within a factor of e"
    ),
    "core": Guess(0.05e-3, 1.0, "iron equivalent to 0.05 mm of air, within a factor of e"),
    "field": Guess(1.6, 0.2, "1.6 T in the core at saturation, within 20 %"),
    "fringe": Guess(0.5, 0.7, "fringing flanks half as high as the pole radius, within a factor of 2"),
    "leakage": Guess(
        0.3, 1.0, "a third of the stated inductance bypasses the armature, within a factor of e"
    ),
}
"""Log-normal priors of the magnet's constants, SI: `core` is the air gap equivalent to the iron, `fringe` a
fraction of the pole radius, `leakage` a fraction of the stated inductance."""


@dataclass(frozen=True)
class Sheet:
    """Magnet data of a data sheet, SI."""

    current: float
    """Coil current at which the forces are stated, A."""
    gaps: FloatArray
    """Gaps at which the forces are stated, m, shape (n,)."""
    forces: FloatArray
    """Forces at the gaps, N, shape (n,)."""
    inductance: tuple[float, float] | None
    """Inductance at small currents, H, and the gap of the measurement, m."""
    turns: float | None
    """Number of turns of the coil; None if not stated."""
    area: float | None
    """Area of the pole face, m^2; None if not stated."""
    residual_gap: float | None
    """Air gap in series with the working gap, m; None if not stated."""
    closed_at: float
    """Displacement at which the gap is closed, m."""


@dataclass(frozen=True)
class SheetMagnet:
    """Magnet fitted to a data sheet, with the origin of its constants."""

    part: ReluctanceMagnet
    derived: dict[str, float]
    """Constants that the data sheet determines, with their relative standard errors."""
    assumed: dict[str, str]
    """Assumed constants, each with the text of the assumption."""
    forces: FloatArray
    """Forces of the fitted law at the gaps of the data sheet, N."""
    misfit: float
    """Largest relative deviation of the fitted forces from the forces in the data sheet."""
    inductance: float
    """Small-current inductance of the fitted law, at the data sheet's inductance gap or the full gap, H."""


def fit_magnet(sheet: Sheet) -> SheetMagnet:
    """Fit the reluctance law to a data sheet by maximum a posteriori estimation."""
    from scipy.optimize import least_squares

    known = {"turns": sheet.turns is not None, "leakage": sheet.inductance is None}
    known["residual_gap"] = sheet.residual_gap is not None
    names = [name for name in GUESSES if not known.get(name)]
    # Estimate the pole area from the force at the widest gap, without fringe and iron.
    widest = int(np.argmax(sheet.gaps))
    open_gap = float(sheet.gaps[widest]) + GUESSES["residual_gap"].value
    turned = (sheet.turns or GUESSES["turns"].value) * sheet.current
    first = 2.0 * float(sheet.forces[widest]) * open_gap**2 / (MU0 * turned**2)
    free = sheet.area is None
    start = [0.0] * (free + len(names))

    def made(moved: FloatArray) -> ReluctanceMagnet:
        area = first * math.exp(moved[0]) if free else float(sheet.area or 0.0)
        each = {
            name: GUESSES[name].value * math.exp(GUESSES[name].spread * move)
            for name, move in zip(names, moved[free:], strict=True)
        }
        share = each.get("leakage", 0.0)
        return ReluctanceMagnet(
            turns=each.get("turns", sheet.turns or 0.0),
            pole_area=area,
            closed_at=sheet.closed_at,
            residual_gap=each.get("residual_gap", sheet.residual_gap or 0.0),
            fringe_perimeter=2.0 * math.sqrt(math.pi * area),
            fringe_height=each["fringe"] * math.sqrt(area / math.pi),
            core_reluctance=each["core"] / (MU0 * area),
            saturation_flux=each["field"] * area,
            leakage=share * sheet.inductance[0] if sheet.inductance else 0.0,
        )

    def off(moved: FloatArray) -> FloatArray:
        part = made(moved)
        rows = list(np.log(forces_of(part, sheet) / sheet.forces) / FORCE_ERROR)
        if sheet.inductance is not None:
            rows.append(math.log(inductance_of(part, sheet) / sheet.inductance[0]) / INDUCTANCE_ERROR)
        return np.array([*rows, *moved[free:]])

    best = least_squares(off, start, xtol=1e-14, ftol=1e-14, gtol=1e-12, max_nfev=400)
    slopes = np.asarray(best.jac)
    spread = np.sqrt(np.diag(np.linalg.pinv(slopes.T @ slopes)))[free:]
    part = made(best.x)
    return _classify(sheet, part, dict(zip(names, spread.tolist(), strict=True)), forces_of)


def forces_of(part: ReluctanceMagnet, sheet: Sheet) -> FloatArray:
    """Compute the forces of a magnet at the gaps of a data sheet, N."""
    c = part.packed(0.0)
    places = (sheet.closed_at - sheet.gaps).tolist()
    return np.array([law.magnet_force(c, place, sheet.current) for place in places])


def inductance_of(part: ReluctanceMagnet, sheet: Sheet) -> float:
    """Compute the small-current inductance [H] at the sheet's inductance gap, or else at its widest gap."""
    gap = float(sheet.gaps.max()) if sheet.inductance is None else sheet.inductance[1]
    return law.magnet_inductance(part.packed(0.0), sheet.closed_at - gap, 0.0)


def _classify(
    sheet: Sheet,
    part: ReluctanceMagnet,
    spread: dict[str, float],
    forces: Callable[[ReluctanceMagnet, Sheet], FloatArray],
) -> SheetMagnet:
    """Classify the constants of a fitted magnet as derived or assumed.

    `spread` contains the ratio of posterior to prior standard deviation of each constant.
    """
    key = {
        "turns": "turns",
        "residual_gap": "residual_gap",
        "core": "core_reluctance",
        "field": "saturation_flux",
        "fringe": "fringe_height",
        "leakage": "leakage",
    }
    settled = {name for name, left in spread.items() if left < DERIVED}
    derived = {key[name]: spread[name] * GUESSES[name].spread for name in settled}
    assumed = {key[name]: GUESSES[name].why for name in spread if name not in settled}
    at_gaps = forces(part, sheet)
    return SheetMagnet(
        part=part,
        derived=derived,
        assumed=assumed,
        forces=at_gaps,
        misfit=float(np.abs(at_gaps / sheet.forces - 1.0).max()),
        inductance=inductance_of(part, sheet),
    )


RESTITUTION: Final = 0.3
"""Assumed coefficient of restitution of a stop: steel on steel, with a thin film between the surfaces."""

INDENTATION: Final = 0.25
"""Fraction of the remaining gap by which the magnet's work indents the struck object; assumed."""

CONTACTS: Final = (("make_contact", "front", "gap"), ("break_contact", "back", "overtravel"))
"""Contacts of a data sheet: table, side of the armature, and key of the position of the contact."""

_GRID: Final = 200  # Number of sampled displacements from rest to the front of the pack; arbitrary


def hammer_of(sheet: DataSheet) -> tuple[Hammer, SheetMagnet]:
    """Build the hammer of a data sheet; return the hammer and its fitted magnet.

    Raises
    ------
    InputError
        The magnet cannot overcome the spring at the current of the data sheet, or the driver is invalid.
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
        **_contacts(sheet),
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
    """Render the head of the hammer file as TOML: name, title, note and a placeholder mass."""
    import tomlkit

    points = len(sheet.force)
    said = (
        f"Built from a data sheet: {sheet.texts['source']}. The magnet law reproduces its {points}"
        f" force{'s' if points > 1 else ''} at {current:.3g} A within {100.0 * magnet.misfit:.2g} %. Assumed"
        " values are typical of such devices, not properties of this one."
    )
    rating = f"The contacts are rated {sheet.texts['rating']}." if "rating" in sheet.texts else ""
    note = " ".join(filter(None, [sheet.texts.get("note", ""), rating, said])).strip()
    lines = textwrap.wrap(note, 110, break_long_words=False)
    document = tomlkit.document()
    document.update({"format": FORMAT, "name": sheet.texts["name"]})
    if "title" in sheet.texts:
        document["title"] = sheet.texts["title"]
    document["note"] = tomlkit.string("".join(f"{line}\n" for line in lines), multiline=True)
    if "strike" in sheet.texts:
        document["strike"] = sheet.texts["strike"]
    constant = 'mass = { value = 1, unit = "kg", status = "assumed", source = "to be replaced" }'
    return f"{tomlkit.dumps(document)}\n{constant}\n"


def _made(value: float, unit: str, status: str, source: str) -> dict[str, Any]:
    return {"value": plain(float(f"{value:.6g}")), "unit": unit, "status": status, "source": source}


def _magnet(sheet: DataSheet, magnet: SheetMagnet) -> dict[str, Any]:
    """Build the magnet table of the hammer file, with status and source of each constant."""
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
            table[name] = _made(value, "m", *_derived_from(sheet, "stroke", "stroke plus the gap at its end"))
        elif name == "pole_area" and "pole_diameter" in sheet.entries:
            table[name] = _made(
                value,
                note.si,
                *_derived_from(sheet, "pole_diameter", "area of a round pole of the stated diameter"),
            )
        elif name == "pole_area":
            table[name] = _made(value, note.si, fitted, what)
        elif name == "fringe_perimeter":
            status = table["pole_area"]["status"]
            table[name] = _made(
                value, note.si, status, "circumference of a round pole of the area `pole_area`"
            )
        elif name in magnet.derived:
            error = 100.0 * magnet.derived[name]
            table[name] = _made(value, note.si, fitted, f"{what}, within {error:.2g} %")
        elif name in magnet.assumed:
            table[name] = _made(
                value,
                note.si,
                "assumed",
                f"{magnet.assumed[name]}; hardly constrained by the fit{what.removeprefix('fitted')}",
            )
    return table


def _derived_from(sheet: DataSheet, key: str, how: str) -> tuple[str, str]:
    status, source = sheet.origin(key)
    return ("derived" if status == "datasheet" else status), f"{how}; {source}"


def _spring(sheet: DataSheet, magnet: SheetMagnet, current: float) -> dict[str, Any] | None:
    """Build the spring table; None if the data sheet states no spring.

    Raise `InputError` if the spring overcomes the magnet.
    """
    stated = [name for name in ("preload", "stiffness") if f"spring.{name}" in sheet.entries]
    if not stated:
        return None
    pull = law.magnet_force(magnet.part.packed(0.0), 0.0, current)
    # At rest, the break contact carries a part of the preload.
    preload, lifted = sheet.si("spring.preload", 0.0), sheet.si("break_contact.force", 0.0)
    if preload - lifted >= pull:
        raise InputError.of(
            "spring.preload",
            preload,
            f"less than the {pull + lifted:.3g} N of the magnet at full gap and {current:.3g} A",
            written=f"{preload:g}",
            unit="N",
        )
    zero: dict[str, Any] = {"preload": _made(0.0, "N", "assumed", "not stated in the data sheet")}
    zero["stiffness"] = _made(0.0, "N/m", "assumed", "not stated in the data sheet")
    table: dict[str, Any] = {
        "law": "preload",
        **zero,
        **{name: sheet.constant(f"spring.{name}") for name in stated},
    }
    # The preload is negative: the spring pushes the armature toward the backstop.
    table["preload"]["value"] = plain(-float(table["preload"]["value"]))
    return table


def _contacts(sheet: DataSheet) -> dict[str, Any]:
    """Build the contact tables of a hammer file from a data sheet; return the tables by name."""
    tables: dict[str, Any] = {}
    for name, side, place in CONTACTS:
        if f"{name}.force" in sheet.entries:
            status, source = _derived_from(sheet, name, "contact force over its travel")
            key = f"{name}.{place}"
            tables[f"contact.{name.removesuffix('_contact')}"] = {
                "law": "linear",
                "side": side,
                "position": sheet.constant(key),
                "stiffness": _made(sheet.si(f"{name}.force") / _travel(sheet, name), "N/m", status, source),
            }
    return tables


def _travel(sheet: DataSheet, name: str) -> float:
    """Return the distance over which a contact is pressed, m: its overtravel."""
    overtravel = sheet.si("break_contact.overtravel")
    return sheet.si("stroke") - sheet.si("make_contact.gap") if name == "make_contact" else overtravel


def _contact_forces(sheet: DataSheet, x: FloatArray) -> FloatArray:
    """Compute the forces of the contacts at displacements, N, positive toward the backstop."""
    total = np.zeros_like(x)
    for name, side, place in CONTACTS:
        if f"{name}.force" in sheet.entries:
            sign = 1.0 if side == "front" else -1.0
            depth = np.maximum(sign * (x - sheet.si(f"{name}.{place}")), 0.0)
            total += sign * sheet.si(f"{name}.force") / _travel(sheet, name) * depth
    return total


def _restitution(sheet: DataSheet) -> dict[str, Any]:
    if "stop.restitution" in sheet.entries:
        return sheet.constant("stop.restitution")
    return _made(RESTITUTION, "1", "assumed", "steel on steel, with a thin film between the surfaces")


def _pack(sheet: DataSheet, magnet: SheetMagnet, current: float) -> dict[str, Any]:
    """Build the table of the pack, which models the struck object as a spring with a dashpot."""
    place = "target" if "target" in sheet.entries else "stroke"
    table: dict[str, Any] = {"law": "dashpot", "front": sheet.constant(place)}
    if "stop.stiffness" in sheet.entries:
        return {**table, **{name: sheet.constant(f"stop.{name}") for name in ("stiffness", "damping")}}
    front = sheet.si(place)
    work = _work(sheet, magnet, front, current)
    left = magnet.part.closed_at - front + magnet.part.residual_gap
    stiffness = 2.0 * work / (INDENTATION * left) ** 2
    why = (
        f"the magnet's work of {1e3 * work:.3g} mJ indents the struck object by a quarter of the remaining"
        f" gap, {1e6 * left:.3g} um"
    )
    restitution = _restitution(sheet)
    damping = 2.0 * damping_ratio(restitution["value"]) * math.sqrt(stiffness * sheet.si("mass"))
    table["stiffness"] = _made(stiffness, "N/m", "assumed", why)
    table["damping"] = _made(
        damping, "N s/m", "assumed", f"the armature rebounds with {restitution['value']:g} of its speed"
    )
    return table


def _work(sheet: DataSheet, magnet: SheetMagnet, front: float, current: float) -> float:
    """Compute the work [J] of magnet, spring and contacts from rest to `front` [m], at constant current."""
    c = magnet.part.packed(0.0)
    x = np.linspace(0.0, front, _GRID)
    pull = np.array([law.magnet_force(c, place, current) for place in x.tolist()])
    held = sheet.si("spring.preload", 0.0) + sheet.si("spring.stiffness", 0.0) * x + _contact_forces(sheet, x)
    work = float(np.trapezoid(pull - held, x))
    if work <= 0.0:
        raise InputError.of(
            "spring.stiffness",
            sheet.si("spring.stiffness", 0.0),
            f"a spring that the magnet overcomes over the whole stroke at {current:.3g} A",
            written=f"{sheet.si('spring.stiffness', 0.0):g}",
            unit="N/m",
        )
    return work


def damping_ratio(restitution: float) -> float:
    """Return the damping ratio of a spring-dashpot contact with a given coefficient of restitution.

    The contact ends when its force falls to zero, before the spring is relaxed.
    """

    def returned(ratio: float) -> float:
        root = math.sqrt(1.0 - ratio * ratio)
        angle = math.pi - math.atan2(2.0 * ratio * root, 1.0 - 2.0 * ratio * ratio)
        return math.exp(-ratio / root * angle) - restitution

    # Critical damping gives a restitution of exp(-2). Smaller values would need overcritical damping, which
    # is not modelled.
    if restitution <= math.exp(-2.0) or restitution >= 1.0:
        return float(restitution < 1.0)
    return bisect(returned, 0.0, 1.0 - 1e-12)


def _waveform(sheet: DataSheet, magnet: SheetMagnet, current: float) -> dict[str, Any]:
    """Build the waveform table: the driver of the data sheet, or by default a pulse of the rail voltage."""
    from printhammer.drive.waveforms.shapes import SHAPES

    table: dict[str, Any] = {"shape": sheet.driver.get("shape", "rail"), "voltage": sheet.constant("rail")}
    if table["shape"] not in SHAPES:
        raise InputError.of(
            "driver.shape",
            table["shape"],
            f"one of {', '.join(SHAPES)}",
            written=shown(table["shape"]),
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
        # Twice the sum of the coil's time constant and of the flight time under the mean force.
        work = _work(sheet, magnet, sheet.si("stroke"), current)
        flight = math.sqrt(2.0 * sheet.si("mass") * sheet.si("stroke") ** 2 / work)
        width = 2.0 * (magnet.inductance / sheet.si("resistance") + flight)
        why = "twice the time constant of the coil at full gap and the flight under the mean force"
        table["width"] = _made(float(f"{1e3 * width:.2g}"), "ms", "assumed", why)
    return table
