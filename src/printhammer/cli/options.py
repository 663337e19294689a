"""The options of the verbs: how each is written, what it means, and how its text becomes a value.

A verb declares its options as defaults of its parameters, ``points: int = whole("Number of points.",
default=200)``, and gets the value, not the text. Those that many verbs share are declared here, once, and
mean the same everywhere.

The two unit systems in which the command line shows quantities.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer

from printhammer.errors import InputError


class Units(StrEnum):
    """Unit system of what is shown."""

    SI = "si"
    INCH = "inch"


DATA: Final = (".nc", ".zarr", ".csv", ".parquet", ".json")
"""Endings of the files of every result, those of `printhammer.results.ENDINGS`."""


@dataclass(frozen=True)
class Option:
    """An option or argument of a verb."""

    help: str
    metavar: str | None = None
    """What it means, and what stands for its value in the help."""
    default: Any = None
    """Value where it is not given; an ellipsis if it must be."""
    flag: str | None = None
    """How it is written; by default as the parameter is called."""
    panel: str | None = None
    """Heading in the help under which it stands."""
    type: Any = str
    """What typer makes of its text: str, Path, int, float, bool or an enumeration."""
    read: Callable[[str, str], Any] | None = None
    """Makes the value of its text and its name instead; raises `InputError`."""
    many: bool = False
    """Whether it may be given repeatedly."""
    least: float | None = None
    """Least number that is accepted."""
    argument: bool = False
    """Whether it stands without a flag."""
    is_input: bool = False
    """Whether it names files that are read, which no output may be."""
    writes: bool = False
    """Whether it names a place to write new files to."""
    hammer: Literal["named", "loaded", "fired"] | None = None
    """Of the hammer that is worked on: "named", "loaded" with its warnings shown, or "fired", which has a
    waveform too."""

    def flag_of(self, name: str) -> str:
        """Return how the option of a parameter is written."""
        return self.flag or f"--{name.replace('_', '-')}"

    def annotation(self, name: str) -> Any:
        """Return the annotation from which typer makes the option of a parameter."""
        read = self.read is not None or self.hammer is not None
        type_: Any = str if read else self.type
        type_ = list[type_] if self.many else type_
        texts: dict[str, Any] = {"metavar": self.metavar, "help": self.help, "rich_help_panel": self.panel}
        if self.argument:
            entry = typer.Argument(**texts, show_default=self.hammer is not None)
        else:
            flag = self.flag_of(name)
            both = type_ is bool and self.default and "/" not in flag
            entry = typer.Option(f"{flag}/--no-{flag[2:]}" if both else flag, **texts, min=self.least)
        return Annotated[type_ | None if self.default is None else type_, entry]

    def typer_default(self) -> Any:
        """Return the default as typer shows it: as text where the text is read."""
        if self.read is None or self.default in (None, ...):
            return self.default
        return format(self.default, "g") if isinstance(self.default, float) else str(self.default)


@dataclass(frozen=True)
class Files(Option):
    """An option that names files to write; the runner checks them before any work, and writes them."""

    endings: tuple[str, ...] = ()
    """How names may end beside those of pictures; empty if the end does not matter."""
    pictures: bool = True
    """Whether names may be those of pictures."""
    continued: bool = False
    """Whether the work goes on with a file that is there, and writes nothing over."""


def files(what: str, *endings: str, many: bool = True, **more: Any) -> Files:
    """Return an option for pictures, and files with these endings."""
    return Files(what, "FILE", type=Path, many=many, endings=endings, **more)


def results(what: str, *more: str, **options: Any) -> Files:
    """Return the option `--out` of a verb that has a result: data, a picture, or what else it can be."""
    endings = (*DATA, *more)
    kinds = f"{what} ({', '.join(endings)}; SI)"
    return files(f"{kinds} or picture (.svg, .png, .pdf); may be given repeatedly.", *endings, **options)


def file(what: str, *endings: str, **more: Any) -> Files:
    """Return an option for one file that is no picture, unless `many` are allowed."""
    return files(what, *endings, **{"many": False, "pictures": False, **more})


# What follows stands as a default of parameters of all types, and therefore returns none in particular. Every
# further keyword is an attribute of the option.


def text(metavar: str, what: str, **more: Any) -> Any:
    """Return an option whose text is used as it is, or as typer reads it."""
    return Option(what, metavar, **more)


def argument(metavar: str, what: str, **more: Any) -> Any:
    """Return what stands without a flag."""
    return Option(what, metavar, argument=True, **more)


def bounded(least: float, what: str, *, default: float, **more: Any) -> Any:
    """Return an option that is a number of the type of its default, at least `least`."""
    return Option(what, more.pop("metavar", None), default, type=type(default), least=least, **more)


def choice(choices: str, what: str, **more: Any) -> Any:
    """Return an option for one of several words, such as "add|replace"."""
    words = choices.split("|")

    def read(written: str, name: str) -> str:
        if written not in words:
            raise InputError.of(name, written, " or ".join(words))
        return written

    return Option(what, choices, read=read, **more)


def switch(what: str, *, default: bool = False, **more: Any) -> Any:
    """Return an option that is given or not."""
    return Option(what, default=default, type=bool, **more)


def whole(what: str, **more: Any) -> Any:
    """Return an option that is a whole number."""
    return Option(what, "N", read=read_whole, **more)


def number(what: str, metavar: str = "X", **more: Any) -> Any:
    """Return an option that is a number without unit."""
    return Option(what, metavar, read=read_plain, **more)


def quantity(si: str, metavar: str, what: str, *, positive: bool = False, **more: Any) -> Any:
    """Return an option that is a number, or one above 0, with a unit of the dimension of an SI unit."""

    def read(written: str, name: str) -> float:
        from printhammer.drive.input import read_number, read_positive

        return (read_positive if positive else read_number)(written, si, name)

    return Option(what, metavar, read=read, **more)


def span(what: str, **more: Any) -> Any:
    """Return an option for two ends with their units and a number of values."""
    return Option(what, "LOW, HIGH, N", read=read_span, **more)


def rates_between(what: str, most: int) -> Any:
    """Return an option for two rates and how many they and those between them are, at most `most`."""

    def read(written: str, name: str) -> list[float]:
        import numpy as np

        from printhammer.drive.input import read_positive

        parts = [part.strip() for part in written.split(",")]
        if len(parts) != 3:
            example = "'1.2 kHz, 1.4 kHz, 41'"
            raise InputError(
                f"{name} {written!r}: expected two rates and a number, such as {example}",
                key=name,
                value=written,
            )
        low, high = (read_positive(part, "Hz", name) for part in parts[:2])
        count = read_whole(parts[2], name)
        if not low < high or not 2 <= count <= most:
            raise InputError(
                f"{name} {written!r}: expected the lower rate first, and a number from 2 to {most}",
                key=name,
                value=written,
            )
        return [float(rate) for rate in np.linspace(low, high, count)]

    return Option(what, "LOW, HIGH, N", read=read)


def source(what: str, **more: Any) -> Any:
    """Return an option that names a file that is read, or several."""
    return Option(what, "FILE", type=Path, is_input=True, **more)


def folder(what: str, **more: Any) -> Any:
    """Return an option that names a folder to write to, or what else lies in one place."""
    return Option(what, **{"metavar": "FOLDER", "type": Path, "writes": True, **more})


def read_whole(written: str, name: str) -> int:
    """Read a whole number; InputError if it is none."""
    try:
        return int(written)
    except ValueError:
        raise InputError.of(name, written, "a whole number", said=": expected") from None


def read_plain(written: str, name: str) -> float:
    """Read a number; InputError if it is none."""
    try:
        return float(written)
    except ValueError:
        point = " with a decimal point" if "," in written else ""
        raise InputError.of(name, written, f"a number{point}", said=": expected") from None


def read_share(written: str, name: str) -> float:
    """Read a part such as 0.1 or 10%; InputError if it is none."""
    value = written.strip()
    return read_plain(value.removesuffix("%"), name) / (100.0 if value.endswith("%") else 1.0)


def read_span(written: str, name: str) -> tuple[str, str, int]:
    """Read two ends with their units and a number of values, such as '0 um, 100 um, 64'; else InputError."""
    parts = [part.strip() for part in written.split(",")]
    if len(parts) != 3:
        raise InputError(
            f"{name} {written!r}: expected two ends and a number, such as '30 um, 90 um, 128'",
            key=name,
            value=written,
        )
    return parts[0], parts[1], read_whole(parts[2], name)


def between(span: tuple[str, str, int] | None, si: str, name: str) -> list[float]:
    """Return evenly spaced values of a `span` in an SI unit, none for None; else InputError."""
    import numpy as np

    from printhammer.drive.input import read_number

    if span is None:
        return []
    low, high = (read_number(end, si, name) for end in span[:2])
    if not low <= high or span[2] < 1:
        raise InputError(
            f"{name} {', '.join(map(str, span))!r}: expected the lower end first, and 1 or more", key=name
        )
    return [float(value) for value in np.linspace(low, high, span[2])]


def given(**options: Any) -> dict[str, Any]:
    """Return the options that are not None; the others have the defaults of the library."""
    return {name: value for name, value in options.items() if value is not None}


def need_one(options: Mapping[str, object], example: str) -> None:
    """Make sure that one of `period` and `rate` is given, and one only; else InputError."""
    if (options.get("period") is None) == (options.get("rate") is None):
        raise InputError(f"--period and --rate: expected one of them, such as {example}", key="--period")


def refuse(options: Mapping[str, object], expected: str) -> None:
    """Make sure that none of some options is given; else InputError, which tells what is expected."""
    for name, value in options.items():
        if value is not None:
            raise InputError(f"--{name} is given", key=f"--{name}", expected=expected)


_TRAIN: Final = "Train (one of --period and --rate)"


def overlapping(panel: str = _TRAIN) -> Any:
    """Return the option that says what overlapping pulses do."""
    return choice("add|replace", "Overlapping pulses add up (default), or the latest replaces.", panel=panel)


def _hammer(use: str, *, flag: bool = False) -> Any:
    what = "A hammer file, or the name of a shipped hammer."
    return text("HAMMER", what, default="hendriks-1983", argument=not flag, is_input=True, hammer=use)


PART: Final = source("Python file that registers laws of parts; may be given repeatedly.", many=True)
NAMED, HAMMER, FIRED = _hammer("named"), _hammer("loaded"), _hammer("fired")
HAMMER_OPTION: Final = _hammer("loaded", flag=True)
PERIOD: Final = text("TIME", "Time between firings, such as '1.05 ms'.", panel=_TRAIN)
RATE: Final = text("RATE", "Firings per second, such as '952 Hz'.", panel=_TRAIN)
OVERLAP: Final = overlapping()
TRAIN: Final = {"period": PERIOD, "rate": RATE, "overlap": OVERLAP}
DRIVE: Final = source(
    "A drive file instead: a force without end, or pulses at a constant rate.", panel=_TRAIN
)
FIRED_TRAIN: Final = {**TRAIN, "drive": DRIVE}
LOWEST: Final = text("VALUE", "Least value, with its unit.", flag="--from")
HIGHEST: Final = text("VALUE", "Largest value, with its unit.", flag="--to")
TOLERANCE: Final = number("Error allowed in one step.")
THREADS: Final = whole("Threads (as many as cores).")
UNITS: Final = text("si|inch", "Unit system on the terminal.", default=Units.SI, type=Units)
FORCE: Final = switch("Write over files that are there.", flag="--force")
