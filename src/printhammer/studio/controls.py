"""Description of a hammer for the page, with a control for each constant."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any, Final, get_args

from printhammer.drive.waveforms.drivers import DRIVERS, Rail
from printhammer.drive.waveforms.shapes import SHAPES, Sine, Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import Range
from printhammer.parts.base import PARTS, Part
from printhammer.parts.coil import Winding
from printhammer.parts.spring.terms import Term
from printhammer.studio.coil import open_constants, rail_of, span_of
from printhammer.studio.terms import contacts_of, frictions_of
from printhammer.support.constants import Constant, quantities
from printhammer.units import from_si

SHOWN: Final = {
    "m": ("um", "mil"),
    "kg": ("g", "oz"),
    "s": ("us", "us"),
    "N": ("N", "lbf"),
    "J": ("mJ", "in lbf"),
    "m/s": ("m/s", "in/s"),
    "Hz": ("Hz", "Hz"),
    "N/m": ("N/mm", "lbf/in"),
    "Pa": ("GPa", "ksi"),
    "m^2": ("mm^2", "mil^2"),
    "H": ("mH", "mH"),
    "Wb": ("mWb", "mWb"),
    "F": ("uF", "uF"),
    "degC": ("degC", "degC"),
    "rad": ("deg", "deg"),
}
"""Display units of a quantity, metric and inch-pound, by SI unit; the SI unit itself if not listed."""

_INCHES: Final = {"um": "mil", "mm": "in", "m": "in"}
"""Inch unit shown in place of a metric unit of length."""

_SLOW: Final = 2e-3
"""Pulse width above which the page shows times in ms, s; arbitrary."""

_WIDE: Final = 1e-3
"""Stroke above which the page shows lengths in mm, m; arbitrary."""

_SHARE: Final = 0.2
"""Pulse width as a fraction of the initial period of a device with long pulses; arbitrary."""

_METRES: Final = {"kg": ("kg", "lb"), "N/m": ("N/m", "lbf/in"), "J": ("J", "in lbf")}
"""Units of a device whose lengths are shown in m, such as an oscillator in dimensionless form."""

EQUATIONS: Final = {
    "mass": "m x'' = Fm + Fs + Fp + Fb + Fe",
    "magnet.inverse-root": "Fm = F0 - (Am - Bm I)² / √x   (3)",
    "spring.linear": "Fs = Bs - (Bs/As)(x - b)   (4)",
    "pack.power": "Fp = -(AiEp) r^2.7, unloading -(AiEp) rmax^-8.3 r^11, r = (x - xp)/d   (5)",
    "coil.winding": "dλ/dt = u - R i, R = R20 (1 + 0.00393 (T - 20 °C))",
    "backstop.hertz": "Fb = k δ^1.5 (6), Fe = -l v δ^1.5 (7), δ = b - x",
}
"""Equations of the laws of the paper; other laws show the first line of their module docstring."""


def _half_sine(amplitude: float, width: float, quantity: str) -> dict[str, Any]:
    return {"shape": "half-sine", "amplitude": amplitude, "width": width, "quantity": quantity}


# Period chosen such that a hop of the ball lasts about one period.
_HOPS: Final = {"waveform": _half_sine(0.5, 3e-4, "force"), "rate": 50.0, "low": 20.0, "high": 100.0}
# Two pushes, separated by the free period of 2 pi s.
_PUSHES: Final = {
    "waveform": _half_sine(10.0, 0.02, "force"),
    "rate": 10.0,
    "pattern": "1" + 62 * "0" + "1",
    "low": 10.0,
    "high": 20.0,
}


def _shaken(amplitude: float, angular: float, phase: float, low: float, high: float) -> dict[str, Any]:
    """Build the initial page state of an oscillator under a sinusoidal force.

    The force has the amplitude `amplitude` [N], the phase `phase` [rad] and the angular frequency `angular`
    [rad/s]. `low` and `high` are the ends of the frequency axis of the map, rad/s.
    """
    wave = {"shape": "sine", "amplitude": amplitude, "phase": phase, "quantity": "force"}
    rates = {"rate": angular, "low": low, "high": high}
    return {"waveform": wave, "pulses": 20} | {
        name: float(f"{value / (2.0 * math.pi):.6g}") for name, value in rates.items()
    }


SINE: Final = ("amplitude", "phase")
"""Constants of a sinusoidal force that the page can change; the firing rate sets the frequency."""

_QUARTER: Final = 0.5 * math.pi

OPENINGS: Final[dict[str, dict[str, Any]]] = {
    "bouncing-ball": _HOPS,
    "tufillaro-1992": _HOPS,
    "linear-impact-oscillator": _shaken(1.0, 2.8, _QUARTER, 1.5, 5.0),
    "resonant-grazing": _shaken(3.1, 2.0, -_QUARTER, 1.2, 4.0),
    "shaw-holmes-1983": _shaken(1.0, 2.8, _QUARTER, 1.5, 5.0),
    "dankowicz-schilder-2013": _shaken(0.12, 1.0, -_QUARTER, 0.6, 2.0),
    "duffing-holmes": _shaken(0.3, 1.0, _QUARTER, 0.5, 2.0),
    "den-hartog-1931": _shaken(0.5, 0.7, _QUARTER, 0.5, 2.0),
    "impact-pair": _shaken(0.5, 1.0, 0.0, 0.6, 1.5),
    "shaw-1985": _shaken(1.5, 1.5, _QUARTER, 0.8, 3.0),
    "housner-1963": _PUSHES,
    "braille-embosser": {"rate": 20.0, "pulses": 3, "low": 10.0, "high": 60.0},
    "dot-peen": {"rate": 40.0, "pulses": 5, "low": 10.0, "high": 160.0},
    "pinball-coil": {"rate": 10.0, "pulses": 3, "low": 10.0, "high": 20.0, "line": ""},
    "pinball-flipper": {"rate": 10.0, "pulses": 1, "low": 10.0, "high": 12.0, "line": ""},
    "pot-magnet": {"rate": 10.0, "pulses": 1, "low": 10.0, "high": 20.0, "line": ""},
    "relay-5v": {"rate": 20.0, "pulses": 3, "low": 10.0, "high": 40.0, "line": ""},
}
"""Initial page states of the shipped hammers that are slower or stronger than printers."""


def describe(hammer: Hammer) -> dict[str, Any]:
    """Return the description of a hammer for the page: constants with range, unit, equation, source.

    Returns
    -------
    dict
        `name`, `title`, `note`, `strike`, `struck`, `mover` and `views` of the file, `constants` (a list),
        `open` (coil constants that the file leaves open), `rail` (default rail driver, or None), `combined`
        (controls that change several constants), `waveform` (shape and constants, or None), `start` (entries
        of the initial state that differ from the default), `places` (positions), `contacts` (name, side and
        position), `frictions` (keys of kinetic and static friction where both are stated), `sprung`
        (whether a spring, force or contact acts), and `rigid` and `rigid_front` (whether backstop and front
        are rigid).
    """
    spans = [(constant, span_of(hammer, constant)) for constant in hammer.constants.values()]
    return {
        "name": hammer.name,
        "title": hammer.title,
        "note": hammer.note,
        "constants": [_control(hammer, constant, span) for constant, span in spans if span is not None],
        "open": [_control(hammer, constant, span) for constant, span in open_constants(hammer).values()],
        "rail": rail_of(hammer),
        "combined": combined_of(hammer),
        "waveform": None if hammer.waveform is None else fields_of(hammer.waveform),
        "start": opening_of(hammer),
        "places": {"backstop": hammer.position, "front": hammer.front, "platen": hammer.platen},
        "contacts": contacts_of(hammer),
        "frictions": frictions_of(hammer),
        "strike": hammer.strike,
        "struck": hammer.struck,
        "mover": hammer.mover,
        "views": list(hammer.views),
        "sprung": hammer.spring is not None,
        "rigid": hammer.backstop is not None and hammer.backstop.rigid,
        "rigid_front": hammer.pack is not None and hammer.pack.rigid,
    }


def _control(hammer: Hammer, constant: Constant, span: Range) -> dict[str, Any]:
    section = constant.key.rpartition(".")[0] or "armature"
    entry = hammer.terms.get(section)
    kind = _law_of(hammer, section)
    return {
        "key": constant.key,
        "section": "armature" if entry is None and kind is None else section,
        "symbol": constant.symbol,
        "meaning": constant.meaning,
        "value": constant.si,
        "unit": constant.si_unit,
        "low": span.low,
        "high": span.high,
        "log": span.logarithmic,
        "status": constant.status,
        "source": constant.source,
        "equation": equation_of(constant.key.partition(".")[0], kind) if entry is None else _head_of(entry),
    }


def _law_of(hammer: Hammer, section: str) -> type[Part] | None:
    """Return the part class of the law that the file states; None for a section that is not a part."""
    part = hammer.parts.get(section)
    if part is None:
        return Winding if section == "coil" else None
    # With forces and contacts, the part of the hammer is a sum.
    return PARTS.get((section, hammer.laws.get(section, "")), type(part))


def _head_of(entry: Term) -> str:
    """Return the first line of the docstring of a force or contact, without its full stop."""
    return (type(entry).__doc__ or "").partition("\n")[0].removesuffix(".")


def opening_of(hammer: Hammer) -> dict[str, Any]:
    """Return the initial page settings of a hammer that has no pulse or is unlike a print hammer."""
    opening = OPENINGS.get(hammer.name)
    if hammer.waveform is not None:
        return _slow_opening(hammer.waveform) if opening is None else opening
    quantity = "current" if "magnet" in hammer.parts else "force"
    return {"waveform": _half_sine(1.0, 3e-4, quantity), **(opening or {})}


def _slow_opening(waveform: Waveform) -> dict[str, Any]:
    """Return the initial rates of a device with long pulses, which overlap at the rates of print hammers."""
    width = getattr(waveform, "width", None) or 0.0
    if width <= _SLOW:
        return {}
    rate = float(f"{_SHARE / width:.1g}")
    return {"rate": rate, "pulses": 3, "low": 0.5 * rate, "high": 3.0 * rate}


def equation_of(section: str, part: type[Part] | None) -> str:
    """Return the equation of the law of a part class, or else the first line of its module's docstring."""
    if part is None:
        return EQUATIONS.get(section, "")
    text = import_module(part.__module__).__doc__ or ""
    return EQUATIONS.get(f"{section}.{part.law}", text.strip().partition("\n")[0])


def combined_of(hammer: Hammer) -> list[dict[str, Any]]:
    """Return the controls that change several constants at once, as on the terminal of the 1983 paper.

    Two of platen position, pack front and pack thickness are independent, since the pack lies on the platen:
    the platen distance moves platen and front; the forms thickness moves the front toward the hammer.
    """
    keys = hammer.constants
    if not {"platen", "pack.front", "pack.thickness"} <= set(keys):
        return []
    distance, front = (keys[key].si - hammer.origin for key in ("platen", "pack.front"))
    thickness = keys["pack.thickness"].si
    distance_text = "platen from backstop; the pack moves with it"
    thickness_text = "thickness of ribbon and paper on the platen; the front moves toward the hammer"
    spans = (distance - 0.8 * front, 1.4 * distance), (0.3 * thickness, thickness + 0.8 * front)
    moves = {"platen": 1.0, "pack.front": 1.0}, {"pack.thickness": 1.0, "pack.front": -1.0}
    controls = [
        ("platen distance", distance_text, distance, spans[0], moves[0]),
        ("forms thickness", thickness_text, thickness, spans[1], moves[1]),
    ]
    return [
        {"key": key, "meaning": text, "value": value, "unit": "m", "low": low, "high": high, "moves": moved}
        for key, text, value, (low, high), moved in controls
    ]


def fields_of(waveform: Waveform) -> dict[str, Any]:
    """Return shape and constants of a waveform, SI, as entries of a page state."""
    content: dict[str, Any] = getattr(waveform, "content", dict)()
    if content:
        columns = {name: [float(x) for x in values] for name, values in content.items()}
        return {"shape": waveform.shape, **columns, "quantity": waveform.quantity}
    return {"shape": waveform.shape, **waveform.model_dump()}


def units_of(hammer: Hammer) -> dict[str, list[dict[str, Any]]]:
    """Return the units in which the page shows the quantities of a hammer, with factors, by SI unit."""
    return {
        si: [{"name": _signed(name), "factor": from_si(1.0, si, name)} for name in names]
        for si, names in {**SHOWN, **_large(hammer)}.items()
    }


def vocabulary() -> dict[str, Any]:
    """Return the pulse shapes with their constants, the names of the drivers, and the kinds of current decay.

    A kind of decay is the path that the coil current takes after switch-off.
    """
    shapes = {name: [_field(shape, field) for field in quantities(shape)] for name, shape in SHAPES.items()}
    # The frequency of a continuous force is the rate.
    shapes[Sine.shape] = [_field(Sine, field) for field in SINE]
    decays = get_args(Rail.model_fields["decay"].annotation)
    return {"shapes": shapes, "drivers": [shape.shape for shape in DRIVERS], "decays": decays}


def _field(shape: type[Waveform], name: str) -> dict[str, Any]:
    """Describe a constant of a pulse shape for its input field on the page."""
    note = quantities(shape)[name]
    return {
        "name": name,
        "unit": note.si,
        "meaning": note.meaning,
        "positive": note.gt is not None,
        "least": note.gt if note.ge is None else note.ge,
        "start": None if note.required else shape.model_fields[name].default,
        "optional": not note.required and shape.model_fields[name].default is None,
    }


def _large(hammer: Hammer) -> dict[str, tuple[str, str]]:
    """Return larger units of time and length for devices slower and larger than printers."""
    units: dict[str, tuple[str, str]] = {}
    if hammer.waveform is not None and hammer.waveform.quantity == "voltage":
        if getattr(hammer.waveform, "width", 0.0) > _SLOW:
            units["s"] = ("ms", "ms")
        places = [place for place in (hammer.position, hammer.front) if place is not None]
        if max(places, default=0.0) - min(places, default=0.0) > _WIDE:
            units["m"] = ("mm", "in")
    stated = {si: (unit, _INCHES.get(unit, unit)) for si, unit in hammer.shown_units.items()}
    return units | stated | (_METRES if hammer.shown_units.get("m") == "m" else {})


def _signed(unit: str) -> str:
    signs = {"us": "µs", "um": "µm", "uF": "µF", "in lbf": "in·lbf", "degC": "°C", "deg": "°", "^2": "²"}
    for plain, sign in signs.items():
        unit = unit.replace(plain, sign)
    return unit
