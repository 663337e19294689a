"""Declarations of command-line options: flag, help text, and parser of the value.

A verb declares its options as default values of its parameters,
``points: int = whole("Number of points.", default=200)``, and receives the parsed value. Options that several
verbs share are declared once, below. `Units` names the two unit systems in which the command line shows
quantities.
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
    """Unit system in which quantities are displayed."""

    SI = "si"
    INCH = "inch"


DATA: Final = (".nc", ".zarr", ".csv", ".parquet", ".json")
"""File endings in which every result can be saved, as in `printhammer.results.ENDINGS`."""


@dataclass(frozen=True)
class Option:
    """Declaration of an option or argument of a verb."""

    help: str
    """Help text: begins with the noun of the field or a verb; states unit and default."""
    metavar: str | None = None
    """Placeholder of the value in the help text."""
    default: Any = None
    """Default value; an ellipsis marks a required option."""
    flag: str | None = None
    """Command-line flag; None for a flag derived from the name of the parameter."""
    panel: str | None = None
    """Heading of the help panel that lists the option."""
    type: Any = str
    """Type into which typer converts the text: str, Path, int, float, bool or an enumeration."""
    read: Callable[[str, str], Any] | None = None
    """Parser, called with text and flag instead of the conversion by typer; raises `InputError`."""
    many: bool = False
    """Whether the option is repeatable."""
    least: float | None = None
    """Smallest accepted number."""
    argument: bool = False
    """Whether the value is positional, without a flag."""
    is_input: bool = False
    """Whether the option names input files, which no output may overwrite."""
    writes: bool = False
    """Whether the option names a file or folder that the verb writes."""
    hammer: Literal["named", "loaded", "fired"] | None = None
    """For a hammer: "named" (not loaded), "loaded" (warnings shown) or "fired" (must have a waveform)."""

    def flag_of(self, name: str) -> str:
        """Return the command-line flag that sets a parameter, such as --largest-current."""
        return self.flag or f"--{name.replace('_', '-')}"

    def annotation(self, name: str) -> Any:
        """Return the annotation from which typer builds the option of a parameter."""
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
        """Return the default value for typer; as text if the option has its own parser, `read`."""
        if self.read is None or self.default in (None, ...):
            return self.default
        return format(self.default, "g") if isinstance(self.default, float) else str(self.default)


@dataclass(frozen=True)
class Files(Option):
    """Option for output files, which the runner checks before the computation and writes afterwards."""

    endings: tuple[str, ...] = ()
    """Accepted file endings, in addition to the endings of pictures; if empty, every ending is accepted."""
    pictures: bool = True
    """Whether pictures are accepted."""
    continued: bool = False
    """Whether the computation resumes an existing file instead of overwriting it."""


def files(what: str, *endings: str, many: bool = True, **more: Any) -> Files:
    """Declare an option for output files: pictures, and files with the given endings; `what` is the help."""
    return Files(what, "FILE", type=Path, many=many, endings=endings, **more)


def results(what: str, *more: str, **options: Any) -> Files:
    """Declare an option for output files of a result, such as "the orbits", which `what` names in the help.

    The files are data, pictures, or files with an ending in `more`.
    """
    endings = (*DATA, *more)
    kinds = f"Output file for {what} ({', '.join(endings)}; SI)"
    return files(f"{kinds} or a picture (.svg, .png, .pdf); repeatable.", *endings, **options)


def file(what: str, *endings: str, **more: Any) -> Files:
    """Declare an option for an output file that is not a picture; repeatable with `many=True`."""
    return files(what, *endings, **{"many": False, "pictures": False, **more})


# The functions below return default values for parameters of any type; hence the return type Any. Further
# keywords are attributes of `Option`.


def text(metavar: str, what: str, **more: Any) -> Any:
    """Declare an option whose value is text, which typer converts if the keyword `type` is passed."""
    return Option(what, metavar, **more)


def argument(metavar: str, what: str, **more: Any) -> Any:
    """Declare a positional argument."""
    return Option(what, metavar, argument=True, **more)


def bounded(least: float, what: str, *, default: float, **more: Any) -> Any:
    """Declare a numeric option, of the type of its default value, with the lower bound `least`."""
    return Option(what, more.pop("metavar", None), default, type=type(default), least=least, **more)


def choice(choices: str, what: str, **more: Any) -> Any:
    """Declare an option with a fixed set of values, such as "add|replace"."""
    words = choices.split("|")

    def read(written: str, name: str) -> str:
        if written not in words:
            raise InputError.of(name, written, " or ".join(words))
        return written

    return Option(what, choices, read=read, **more)


def switch(what: str, *, default: bool = False, **more: Any) -> Any:
    """Declare a Boolean flag."""
    return Option(what, default=default, type=bool, **more)


def whole(what: str, **more: Any) -> Any:
    """Declare an integer option."""
    return Option(what, "N", read=read_whole, **more)


def number(what: str, metavar: str = "X", **more: Any) -> Any:
    """Declare an option for a number without a unit."""
    return Option(what, metavar, read=read_plain, **more)


def quantity(si: str, metavar: str, what: str, *, positive: bool = False, **more: Any) -> Any:
    """Declare an option for a quantity with a unit of the dimension of `si`; above 0 if `positive`."""

    def read(written: str, name: str) -> float:
        from printhammer.drive.input import read_number, read_positive

        return (read_positive if positive else read_number)(written, si, name)

    return Option(what, metavar, read=read, **more)


def span(what: str, **more: Any) -> Any:
    """Declare an option for a range: two ends with units, and a number of values."""
    return Option(what, "LOW, HIGH, N", read=read_span, **more)


def rates_between(what: str, most: int) -> Any:
    """Declare an option for evenly spaced rates: lowest, highest, and number of rates (at most `most`)."""

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
    """Declare an option for an input file, or several with `many=True`."""
    return Option(what, "FILE", type=Path, is_input=True, **more)


def folder(what: str, **more: Any) -> Any:
    """Declare an option for an output folder; with another `metavar`, also for an output file."""
    return Option(what, **{"metavar": "FOLDER", "type": Path, "writes": True, **more})


def read_whole(written: str, name: str) -> int:
    """Parse an integer; `name` is the option in error messages."""
    try:
        return int(written)
    except ValueError:
        raise InputError.of(name, written, "a whole number") from None


def read_plain(written: str, name: str) -> float:
    """Parse a number without a unit; `name` is the option in error messages."""
    try:
        return float(written)
    except ValueError:
        point = " with a decimal point" if "," in written else ""
        raise InputError.of(name, written, f"a number{point}") from None


def read_share(written: str, name: str) -> float:
    """Parse a fraction written as 0.1 or 10%."""
    value = written.strip()
    return read_plain(value.removesuffix("%"), name) / (100.0 if value.endswith("%") else 1.0)


def read_span(written: str, name: str) -> tuple[str, str, int]:
    """Parse a range: two ends with units and the number of values, such as '0 um, 100 um, 64'."""
    parts = [part.strip() for part in written.split(",")]
    if len(parts) != 3:
        raise InputError(
            f"{name} {written!r}: expected two ends and a number, such as '30 um, 90 um, 128'",
            key=name,
            value=written,
        )
    return parts[0], parts[1], read_whole(parts[2], name)


def between(span: tuple[str, str, int] | None, si: str, name: str) -> list[float]:
    """Return the evenly spaced values of a range, in the SI unit `si`; an empty list for None.

    `name` is the option in error messages.
    """
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
    """Return the options that are not None; the library supplies the defaults of the other options."""
    return {name: value for name, value in options.items() if value is not None}


def check_one_spacing(options: Mapping[str, object], example: Callable[[], str]) -> None:
    """Raise InputError unless exactly one of the options `period` and `rate` is set.

    The message ends with the text that `example` returns, such as "--period '1.05 ms'".
    """
    if (options.get("period") is None) == (options.get("rate") is None):
        raise InputError(f"--period and --rate: expected one of them, such as {example()}", key="--period")


def check_unset(options: Mapping[str, object], expected: str) -> None:
    """Raise InputError if any of the options is set; the message states what is `expected`."""
    for name, value in options.items():
        if value is not None:
            raise InputError(f"--{name} is given", key=f"--{name}", expected=expected)


_TRAIN: Final = "Train (one of --period and --rate)"


def overlapping(panel: str = _TRAIN) -> Any:
    """Declare the option `--overlap`, the rule for pulses that overlap."""
    return choice(
        "add|replace",
        "Rule for overlapping pulses: add the currents, or use the current of the latest pulse only.",
        panel=panel,
    )


def _hammer(use: str, *, flag: bool = False) -> Any:
    what = "Hammer file, or the name of a shipped hammer."
    return text("HAMMER", what, default="hendriks-1983", argument=not flag, is_input=True, hammer=use)


PART: Final = source("Python file that registers additional laws of hammer parts; repeatable.", many=True)
NAMED, HAMMER, FIRED = _hammer("named"), _hammer("loaded"), _hammer("fired")
HAMMER_OPTION: Final = _hammer("loaded", flag=True)
PERIOD: Final = text("TIME", "Time between firings, e.g. '1.05 ms'.", panel=_TRAIN)
RATE: Final = text("RATE", "Firings per second, e.g. '952 Hz'.", panel=_TRAIN)
OVERLAP: Final = overlapping()
TRAIN: Final = {"period": PERIOD, "rate": RATE, "overlap": OVERLAP}
DRIVE: Final = source(
    "Drive file with a continuous periodic force or a pulse train, instead of --period or --rate.",
    panel=_TRAIN,
)
FIRED_TRAIN: Final = {**TRAIN, "drive": DRIVE}
LOWEST: Final = text("VALUE", "Lowest parameter value, with its unit.", flag="--from")
HIGHEST: Final = text("VALUE", "Highest parameter value, with its unit.", flag="--to")
TOLERANCE: Final = number("Error tolerance of one integration step, relative to stroke and typical speed.")
THREADS: Final = whole("Number of threads (default: number of cores).")
UNITS: Final = text(
    "si|inch", "Unit system of the numbers shown on the terminal.", default=Units.SI, type=Units
)
COLUMNS: Final = text(
    "COLUMNS",
    "Column numbers (from 1) of the quantities, with factor and offset, e.g. 'time=1, current=2*-10 A/V'"
    " (default: from the file TABLE.toml beside the table, else from its heading).",
)
FORCE: Final = switch("Overwrite existing files.", flag="--force")
