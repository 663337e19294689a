"""State of a studio page: hammer, changes, drive, and displayed views.

The browser sends the state, keeps it in its history and writes it into the address; the server stores none.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import SHAPES, Sampled, Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, part, scalar
from printhammer.studio import bounds
from printhammer.studio.states.coil import by_voltage, open_constants, span_of
from printhammer.studio.states.shelf import Shelf
from printhammer.support.constants import quantities

if TYPE_CHECKING:
    from printhammer.drive.base import Overlap

VIEWS: Final = ("motion", "forces", "loops", "phase", "sketch", "map", "strobe", "energy", "line")
"""Names of the views that a studio page can display."""

START: Final[Mapping[str, Any]] = {
    "text": "",
    "constants": {},
    "waveform": None,
    "rate": 1200.0,
    "pulses": 9,
    "pattern": "",
    "overlap": "add",
    "low": 500.0,
    "high": 2000.0,
    "line": "",
    "views": [],
}
"""Entries of the opening state of a page, except for the hammer; `state.js` adds the views and a line."""


class ProtocolError(Exception):
    """Message that the page never sends; it ends the connection, with its text as the reason."""


class State(Declared):
    """Settings of a studio page, as the user has made them; all numbers in SI."""

    hammer: str = part("name of a hammer that the studio offers; not looked at where `text` is given")
    text: str = part("text of a hammer file that was dropped, or empty")
    constants: tuple[tuple[str, float], ...] = part("constants that are changed, by dotted key, sorted")
    waveform: tuple[tuple[str, Any], ...] | None = part(
        "the pulse that is fired, ``shape`` and its constants; None for the hammer's own"
    )
    rate: float = scalar("Hz", "firing rate")
    pulses: int = part("number of firings")
    pattern: str = part('instead of all pulses: which of the slots are fired, such as "1101"')
    overlap: Overlap = part('"add" or "replace"')
    low: float = scalar("Hz", "lowest rate of the map")
    high: float = scalar("Hz", "highest rate of the map")
    line: str = part("text that is printed")
    views: tuple[str, ...] = part("views that are shown, see `VIEWS`")
    shelf: Shelf = part(
        "where hammers are looked up by name; no part of what the page sends",
        default_factory=Shelf,
        compare=False,
        repr=False,
    )

    @cached_property
    def base(self) -> Hammer:
        """Hammer without the user's changes."""
        return dropped_hammer(self.text) if self.text else self.shelf.hammer(self.hammer)

    @cached_property
    def changed(self) -> Hammer:
        """Hammer with the user's changes of its constants.

        Raises
        ------
        InputError
            A constant is unknown or too far from its value in the hammer, or the hammer would be invalid.
        """
        base = self.base
        for key, value in self.constants:
            check_constant(base, key, value)
        return base.replace(self.settings, source="set in the studio") if self.settings else base

    @cached_property
    def settings(self) -> dict[str, float]:
        """Constants that differ from the hammer file, by dotted key.

        Coil constants that the file leaves open are included if, and only if, a voltage drives the coil.
        """
        driven = by_voltage(self.base.waveform if self.waveform is None else self._set_waveform)
        further = open_constants(self.base)
        kept = {key: value for key, value in self.constants if driven or key not in further}
        if driven and "coil.resistance" in further:
            kept = {key: constant.si for key, (constant, _) in further.items()} | kept
        return kept

    @cached_property
    def fired(self) -> Waveform:
        """Waveform of every firing.

        Raises
        ------
        InputError
            The hammer has no waveform, or the waveform is invalid.
        """
        if self.waveform is None:
            if self.changed.waveform is None:
                raise InputError(
                    f"the hammer {self.base.name!r} has no [waveform]",
                    key="waveform",
                    expected="one set in the editor",
                )
            return self.changed.waveform
        return self._set_waveform

    @cached_property
    def _set_waveform(self) -> Waveform:
        fields = dict(self.waveform or ())
        shape = fields.pop("shape")
        if shape == Sampled.shape:
            return Sampled.from_samples(fields["times"], fields["values"], quantity=fields["quantity"])
        return SHAPES[shape](**fields)

    @property
    def slots(self) -> str:
        """Fired slots: the pattern, or as many slots as there are pulses."""
        return self.pattern or "1" * self.pulses

    @cached_property
    def drive(self) -> PulseTrain:
        """Drive that the state describes."""
        if not self.pattern:
            return PulseTrain(self.fired, rate=self.rate, pulses=self.pulses, overlap=self.overlap)
        times = [slot / self.rate for slot, mark in enumerate(self.pattern) if mark == "1"]
        return PulseTrain(self.fired, at=times, overlap=self.overlap)


def check_constant(base: Hammer, key: str, value: float) -> None:
    """Check that a hammer has a constant, and that a new value is within the range of its control.

    Raises
    ------
    InputError
        The constant is unknown, or the value is out of range.
    """
    span = span_of(base, key, bounds.SPAN)
    if span is None:
        named = (*base.constants, *open_constants(base))
        known = ", ".join(name for name in named if not name.startswith("waveform."))
        raise InputError(f"constants.{key} is not known", key=f"constants.{key}", expected=f"one of {known}")
    if not span.low <= value <= span.high:
        unit = (base.constants.get(key) or open_constants(base)[key][0]).si_unit
        raise InputError(
            f"{key} = {value:.9g} {unit}", key=key, value=value, expected=f"{span.low:.6g} to {span.high:.6g}"
        )


@lru_cache(maxsize=8)
def dropped_hammer(text: str) -> Hammer:
    """Parse the text of a dropped hammer file, which may not refer to other files.

    Raises
    ------
    InputError
        The text is not a hammer file, or refers to a table.
    """
    # The parse time of a key with many dots grows with the square of their number.
    if any(part.count(".") > bounds.MOST_DOTS for part in re.split(r"[\n,=\[\]{}]", text)):
        most = bounds.MOST_DOTS
        raise InputError(
            f"dropped file: expected a TOML file, without keys of more than {most} dots",
            file="dropped file",
            key="dots",
        )
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"dropped file: expected a TOML file ({' '.join(str(error).split())})", file="dropped file"
        ) from None
    for name, section in document.items():
        if isinstance(section, Mapping) and "file" in section:
            raise InputError(
                f"dropped file: {name}.file names another file, which the studio does not read",
                file="dropped file",
                key=f"{name}.file",
            )
    hammer = Hammer.from_toml(text, name="dropped file")
    hammer.check()
    return hammer


def read_state(content: Any, shelf: Shelf | None = None) -> State:
    """Parse a state from a message.

    Parameters
    ----------
    content
        Content of the message.
    shelf : Shelf, optional
        Hammers that the studio offers; by default the shipped hammers.

    Raises
    ------
    ProtocolError
        A key is missing, unknown, of the wrong kind or out of bounds: the page would never send it.
    """
    table = _table(content, "state", set(READERS))
    missing = set(READERS) - set(table)
    if missing:
        raise ProtocolError(f"state.{min(missing)} is missing")
    entries = {key: read(table[key]) for key, read in READERS.items()}
    return State(**entries, shelf=shelf or Shelf())


def _table(content: Any, where: str, known: set[str]) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise ProtocolError(f"{where} is expected to be a table")
    for key in content:
        if key not in known:
            raise ProtocolError(f"{where} has the unknown key {key[:40]!r}")
    return content


def _text(content: Any, where: str, most: int) -> str:
    if not isinstance(content, str) or len(content) > most:
        raise ProtocolError(f"{where} is expected to be a text of at most {most} characters")
    return content


def _number(content: Any, where: str, low: float = -math.inf, high: float = math.inf) -> float:
    if isinstance(content, bool) or not isinstance(content, int | float):
        raise ProtocolError(f"{where} is expected to be a number")
    try:
        value = float(content)
    except OverflowError:
        value = math.inf
    if not (math.isfinite(value) and low <= value <= high):
        raise ProtocolError(f"{where} is expected to be a finite number from {low:g} to {high:g}")
    return value


def _count(content: Any) -> int:
    if isinstance(content, bool) or not isinstance(content, int) or not 1 <= content <= bounds.MOST_PULSES:
        raise ProtocolError(f"pulses is expected to be a whole number from 1 to {bounds.MOST_PULSES}")
    return content


def _choice(content: Any, where: str, known: tuple[str, ...]) -> Any:
    if content not in known:
        raise ProtocolError(f"{where} is expected to be one of {', '.join(known)}")
    return content


def _pattern(content: Any) -> str:
    pattern = _text(content, "pattern", bounds.MOST_PULSES)
    if pattern and not re.fullmatch(r"[01]*1[01]*", pattern):
        raise ProtocolError("pattern is expected to be of 0 and 1, with at least one 1")
    return pattern


def _constants(content: Any) -> tuple[tuple[str, float], ...]:
    if not isinstance(content, dict) or len(content) > 64:
        raise ProtocolError("constants is expected to be a table of at most 64 numbers")
    return tuple(
        sorted((_text(key, "constants", 60), _number(value, key[:60])) for key, value in content.items())
    )


def _views(content: Any) -> tuple[str, ...]:
    if not isinstance(content, list) or len(content) > len(VIEWS):
        raise ProtocolError("views is expected to be a list of views")
    return tuple(_choice(view, "views", VIEWS) for view in content)


def _waveform(content: Any) -> tuple[tuple[str, Any], ...] | None:
    if content is None:
        return None
    if (
        not isinstance(content, dict)
        or not isinstance(content.get("shape"), str)
        or content["shape"] not in SHAPES
    ):
        raise ProtocolError(f"waveform.shape is expected to be one of {', '.join(SHAPES)}")
    shape = content["shape"]
    if shape == Sampled.shape:
        table = _table(content, "waveform", {"shape", "times", "values", "quantity"})
        quantity = _choice(table.get("quantity"), "waveform.quantity", ("current", "force", "voltage"))
        highest = bounds.LARGEST_VOLTAGE if quantity == "voltage" else bounds.LARGEST_CURRENT
        ends = {"times": bounds.LONGEST_TIME, "values": highest}
        columns = {name: _samples(table.get(name), f"waveform.{name}", ends[name]) for name in ends}
        return (("shape", shape), *columns.items(), ("quantity", quantity))
    fields = quantities(SHAPES[shape])
    made = SHAPES[shape].model_fields
    table = _table(content, "waveform", {"shape", "quantity", *made})
    pairs: list[tuple[str, Any]] = [("shape", shape)]
    for name, note in fields.items():
        if name not in table:
            raise ProtocolError(f"waveform.{name} is missing")
        if table[name] is None and made[name].default is None:
            pairs.append((name, None))
            continue
        unit = "V" if note.also and table.get("quantity") == "voltage" else note.si
        most = bounds.LONGEST_TIME if unit == "s" else bounds.LARGEST.get(unit, bounds.LARGEST_CURRENT)
        pairs.append((name, _number(table[name], f"waveform.{name}", -most, most)))
    if "decay" in made and "decay" not in fields:
        pairs.append(("decay", _choice(table.get("decay"), "waveform.decay", ("diode", "zener", "rail"))))
    if "quantity" in table:
        pairs.append(
            ("quantity", _choice(table["quantity"], "waveform.quantity", ("current", "force", "voltage")))
        )
    return tuple(pairs)


def _samples(content: Any, where: str, most: float) -> tuple[float, ...]:
    if not isinstance(content, list) or len(content) > bounds.MOST_SAMPLES:
        raise ProtocolError(f"{where} is expected to be a list of at most {bounds.MOST_SAMPLES} numbers")
    return tuple(_number(value, where, -most, most) for value in content)


READERS: Final[dict[str, Callable[[Any], Any]]] = {
    "hammer": lambda content: _text(content, "hammer", 100),
    "text": lambda content: _text(content, "text", bounds.LARGEST_FILE),
    "constants": _constants,
    "waveform": _waveform,
    "rate": lambda content: _number(content, "rate", *bounds.RATES),
    "pulses": _count,
    "pattern": _pattern,
    "overlap": lambda content: _choice(content, "overlap", ("add", "replace")),
    "low": lambda content: _number(content, "low", *bounds.RATES),
    "high": lambda content: _number(content, "high", *bounds.RATES),
    "line": lambda content: _text(content, "line", bounds.LONGEST_TEXT),
    "views": _views,
}
"""Parser of each entry of a state; raises `ProtocolError` for values that the page never sends."""
