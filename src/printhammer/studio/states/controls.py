"""What the page needs to know of a hammer to offer a control for each of its constants."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive.waveforms.shapes import SHAPES, Waveform
from printhammer.hammer.names import range_of
from printhammer.studio import bounds
from printhammer.units import from_si

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

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
}
"""Units in which a quantity is shown, by its SI unit: metric, inch-pound; else the SI unit itself."""

EQUATIONS: Final = {
    "mass": "m x'' = Fm + Fs + Fp + Fb + Fe",
    "magnet.inverse-root": "Fm = F0 - (Am - Bm I)² / √x   (3)",
    "spring.linear": "Fs = Bs - (Bs/As)(x - b)   (4)",
    "pack.power": "Fp = -(AiEp) r^2.7, unloading -(AiEp) rmax^-8.3 r^11, r = (x - xp)/d   (5)",
    "backstop.hertz": "Fb = k δ^1.5 (6), Fe = -l v δ^1.5 (7), δ = b - x",
}
"""Equations of the laws of the paper; the others are told in the first line of their part."""

# A hop lasts about as long as a period.
_HOPS: Final[dict[str, Any]] = {
    "waveform": {"shape": "half-sine", "amplitude": 0.5, "width": 3e-4, "quantity": "force"},
    "rate": 50.0,
    "low": 20.0,
    "high": 100.0,
}
# Two pushes, a free period apart, of 2 pi s.
_PUSHES: Final[dict[str, Any]] = {
    "waveform": {"shape": "half-sine", "amplitude": 10.0, "width": 0.02, "quantity": "force"},
    "rate": 10.0,
    "pattern": "1" + 62 * "0" + "1",
    "low": 10.0,
    "high": 20.0,
}
# The same, hard enough to get to a stop that is a unit of length away.
_BLOWS: Final = {**_PUSHES, "waveform": {**_PUSHES["waveform"], "amplitude": 100.0}}

OPENINGS: Final[dict[str, dict[str, Any]]] = {
    "bouncing-ball": _HOPS,
    "tufillaro-1992": _HOPS,
    "linear-impact-oscillator": _PUSHES,
    "resonant-grazing": _BLOWS,
    "shaw-holmes-1983": _PUSHES,
    "dankowicz-schilder-2013": _BLOWS,
    "duffing-holmes": _BLOWS,
    "housner-1963": _PUSHES,
    "braille-embosser": {"rate": 20.0, "pulses": 3, "low": 10.0, "high": 60.0},
    "dot-peen": {"rate": 40.0, "pulses": 5, "low": 10.0, "high": 160.0},
    "pinball-coil": {"rate": 10.0, "pulses": 3, "low": 10.0, "high": 20.0},
    "pinball-flipper": {"rate": 10.0, "pulses": 1, "low": 10.0, "high": 12.0},
    "pot-magnet": {"rate": 10.0, "pulses": 1, "low": 10.0, "high": 20.0},
    "relay-5v": {"rate": 20.0, "pulses": 3, "low": 10.0, "high": 40.0},
}
"""What those shipped hammers open with whose times and forces are not those of printers."""


def describe(hammer: Hammer) -> dict[str, Any]:
    """Return everything about a hammer that the page shows: constants with range, unit, equation, source.

    Returns
    -------
    dict
        `name`, `title`, `note`, `constants` (a list), `combined` (controls that move several constants),
        `waveform` (shape and constants, or None), `start` (what to fire a hammer with that has none, else
        empty), `places`.
    """
    constants = []
    for key, constant in hammer.constants.items():
        if key.startswith("waveform."):
            continue
        span = range_of(hammer, key, bounds.SPAN)
        section = key.partition(".")[0]
        part = hammer.parts.get(section)
        constants.append(
            {
                "key": key,
                "section": section if part is not None else "armature",
                "symbol": constant.symbol,
                "meaning": constant.meaning,
                "value": constant.si,
                "unit": constant.si_unit,
                "low": span.low,
                "high": span.high,
                "log": span.logarithmic,
                "status": constant.status,
                "source": constant.source,
                "equation": equation_of(section, getattr(part, "law", "")),
            }
        )
    return {
        "name": hammer.name,
        "title": hammer.title,
        "note": hammer.note,
        "constants": constants,
        "combined": combined_of(hammer),
        "waveform": None if hammer.waveform is None else fields_of(hammer.waveform),
        "start": opening_of(hammer),
        "places": {"backstop": hammer.position, "front": hammer.front, "platen": hammer.platen},
    }


def opening_of(hammer: Hammer) -> dict[str, Any]:
    """Return the entries of a state that show a hammer which has no pulse to fire, or other times."""
    if hammer.waveform is not None:
        return OPENINGS.get(hammer.name, {})
    quantity = "current" if "magnet" in hammer.parts else "force"
    pulse = {"shape": "half-sine", "amplitude": 1.0, "width": 3e-4, "quantity": quantity}
    opening: dict[str, Any] = {"waveform": pulse, **OPENINGS.get(hammer.name, {})}
    return opening


def equation_of(section: str, law: str) -> str:
    """Return the equation of a law, or the first line of the part that tells it."""
    known = EQUATIONS.get(f"{section}.{law}" if law else section)
    if known is not None or not law:
        return known or ""
    from printhammer.parts import PARTS

    text = import_module(PARTS[section, law].__module__).__doc__ or ""
    return text.strip().partition("\n")[0]


def combined_of(hammer: Hammer) -> list[dict[str, Any]]:
    """Return the controls of the paper's terminal that move several constants together.

    Of platen, front of the pack and thickness two are free, since the pack lies on the platen: the platen
    distance moves platen and front, the forms thickness moves the front toward the hammer.
    """
    keys = hammer.constants
    if not {"platen", "pack.front", "pack.thickness"} <= set(keys):
        return []
    distance = keys["platen"].si - hammer.origin
    thickness = keys["pack.thickness"].si
    return [
        {
            "key": "platen distance",
            "meaning": "platen from backstop; the pack moves with it",
            "value": distance,
            "unit": "m",
            "low": distance - 0.8 * (keys["pack.front"].si - hammer.origin),
            "high": 1.4 * distance,
            "moves": {"platen": 1.0, "pack.front": 1.0},
        },
        {
            "key": "forms thickness",
            "meaning": "thickness of ribbon and paper on the platen; the front moves toward the hammer",
            "value": thickness,
            "unit": "m",
            "low": 0.3 * thickness,
            "high": thickness + 0.8 * (keys["pack.front"].si - hammer.origin),
            "moves": {"pack.thickness": 1.0, "pack.front": -1.0},
        },
    ]


def fields_of(waveform: Waveform) -> dict[str, Any]:
    """Return shape and constants of a waveform, SI, as a state holds them."""
    content: dict[str, Any] = getattr(waveform, "content", dict)()
    if content:
        columns = {name: [float(x) for x in values] for name, values in content.items()}
        return {"shape": waveform.shape, **columns, "quantity": waveform.quantity}
    return {"shape": waveform.shape, **waveform.model_dump()}


def vocabulary() -> dict[str, Any]:
    """Return what does not depend on the hammer: units with factors, shapes with their constants, bounds."""
    from printhammer.support.constants import quantities

    units = {
        si: [{"name": _signed(name), "factor": from_si(1.0, si, name)} for name in names]
        for si, names in SHOWN.items()
    }
    shapes = {
        name: [
            {"name": field, "unit": note.si, "meaning": note.meaning, "positive": note.gt is not None}
            for field, note in quantities(shape).items()
        ]
        for name, shape in SHAPES.items()
    }
    limits = {
        "pulses": bounds.MOST_PULSES,
        "rates": bounds.RATES,
        "file": bounds.LARGEST_FILE,
        "line": bounds.LONGEST_TEXT,
    }
    return {"units": units, "shapes": shapes, "limits": limits}


def _signed(unit: str) -> str:
    return unit.replace("us", "µs").replace("um", "µm").replace("in lbf", "in·lbf")
