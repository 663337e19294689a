"""The program `printhammer`: its verbs and its exit status.

Exit status: 0 for success; 1 in the cases that the help of a verb names, such as a run that stopped early; 2
for bad input, described in one sentence on standard error; 130 after Ctrl-C.

`MODULES` lists all verbs of the command line, in the order of the help. A command line that begins with the
name of a verb imports the module of this verb alone.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Annotated, Final, NoReturn

import typer

from printhammer import __version__
from printhammer.cli.runner import INTERRUPTED, Verb
from printhammer.cli.terminal import allow_any_text, complain
from printhammer.errors import PrinthammerError

_THRESHOLDS: Final = (50_000, 20, 50)
"""Thresholds of the garbage collector in a process of the command line; arbitrary."""

MODULES: Final = {
    "run": "run",
    "figure": "paper",
    "paper": "paper",
    "map": "map",
    "strobe": "strobe",
    "orbits": "strobe",
    "bifurcation": "bifurcation",
    "basins": "bifurcation",
    "continue": "continuation",
    "curve": "continuation",
    "lyapunov": "strobe",
    "print": "quality",
    "energy": "drives",
    "feedback": "drives",
    "quality": "quality",
    "tune": "tune",
    "learn": "tune",
    "dead-time": "coil",
    "impact-time": "coil",
    "duty": "coil",
    "studio": "studio",
    "sweep": "sweep",
    "measure": "measure",
    "warm": "studio",
    "hammer show": "hammer",
    "hammer check": "hammer",
    "hammer schema": "hammer",
    "hammer list": "hammer",
    "hammer from-datasheet": "hammer",
    "fit magnet": "fit",
    "fit solenoid": "fit",
    "fit spring": "fit",
    "fit pack": "fit",
    "fit backstop": "fit",
    "fit motion": "fit",
    "fit coil": "fit",
}
"""Module in `printhammer.cli.verbs` of each verb.

The first word of a verb with two words is its group, which has a module of the same name, with a help text
`GROUP` and optionally an `EXAMPLE`.
"""

BAD_INPUT: Final = 2  # Exit status, by convention of command lines
_COLUMNS: Final = 76
"""Largest line length of an example in the help, in characters; arbitrary."""

HELP: Final = (
    "A laboratory for impact print hammers: motion, contacts, dots, and the claims of Hendriks (1983)."
)
EXAMPLE: Final = "printhammer run hendriks-1983 --rate '1.2 kHz' --pulses 9"

# Exception of typer for an invalid command line; not every version of typer gives it a public name.
_REFUSED: Final[type[Exception]] = typer.BadParameter.__mro__[2]


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"printhammer {__version__}")
        raise typer.Exit


def _program(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Declare the options of the program itself, such as --version."""


def _shown(example: str | None) -> str | None:
    """Format an example for the help, in lines that can be pasted into a shell."""
    if example is None:
        return None
    lines = ["Example:"]
    for word in re.findall(r"--\S+ '[^']*'|--\S+ [^-&\s]\S*|'[^']*'|\S+", example):
        if len(lines[-1]) + len(word) < _COLUMNS:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return " \\\n".join(lines)


def _module(name: str) -> ModuleType:
    return import_module(f".verbs.{name}", __package__)


def verb_of(name: str) -> Verb:
    """Return the verb with the given name, a key of `MODULES`."""
    values = vars(_module(MODULES[name])).values()
    return next(value for value in values if isinstance(value, Verb) and value.name == name)


def groups_of(names: Iterable[str]) -> dict[str, tuple[str, str | None]]:
    """Return the help text and the example of each group of the named verbs, by group name."""
    groups = dict.fromkeys(name.partition(" ")[0] for name in names if " " in name)
    return {group: (_module(group).GROUP, getattr(_module(group), "EXAMPLE", None)) for group in groups}


def program_of(names: Iterable[str] = MODULES) -> typer.Typer:
    """Build the program with the named verbs, by default with all verbs."""
    names = list(names)
    return build_program("printhammer", HELP, EXAMPLE, map(verb_of, names), groups_of(names))


def build_program(
    name: str, text: str, example: str, verbs: Iterable[Verb], groups: Mapping[str, tuple[str, str | None]]
) -> typer.Typer:
    """Build the typer program `name` from verbs.

    `text` and `example` are the help and the example of the program; `groups` holds help and example of each
    group of verbs, by group name.
    """
    program = typer.Typer(
        name=name,
        help=text,
        epilog=f"Example: {example}",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    program.callback()(_program)
    homes = {"": program}
    for group, (what, shown) in groups.items():
        homes[group] = typer.Typer(help=what, epilog=_shown(shown), no_args_is_help=True)
        program.add_typer(homes[group], name=group)
    for verb in verbs:
        group, _, word = verb.name.rpartition(" ")
        homes[group].command(word, epilog=_shown(verb.example))(verb.call)
    return program


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run a command line, by default the arguments of the process, and exit."""
    if arguments is None:
        # Modules live as long as the process; collecting garbage among them takes 7 % of the time of a run.
        gc.freeze()
        gc.set_threshold(*_THRESHOLDS)
    words = list(sys.argv[1:] if arguments is None else arguments)
    # Help, and the answer to an unknown word, need all verbs.
    known = [name for name in (" ".join(words[:count]) for count in (1, 2)) if name in MODULES]
    run_program(program_of(known or MODULES), "printhammer", words)


def _advice(message: str, error: Exception) -> str:
    """Return a hint to use --hammer if a verb with this option received an extra argument; else empty."""
    command = getattr(getattr(error, "ctx", None), "command", None)
    flags = [flag for option in getattr(command, "params", ()) for flag in option.opts]
    return "; --hammer selects the hammer" if "unexpected extra" in message and "--hammer" in flags else ""


def _is_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error; inside a lock, CPython's KeyboardInterrupt becomes a RuntimeError."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def run_program(program: typer.Typer, name: str, arguments: Sequence[str] | None = None) -> NoReturn:
    """Run a command-line program on arguments, by default sys.argv[1:]; exit with the program's status."""
    allow_any_text()
    try:
        status = program(
            None if arguments is None else list(arguments), prog_name=name, standalone_mode=False
        )
        sys.stdout.flush()
    except PrinthammerError as error:
        complain(str(error))
        sys.exit(BAD_INPUT)
    except _REFUSED as error:
        # Without arguments typer has shown the help, and the message is empty.
        if message := getattr(error, "format_message", str)().strip():
            complain(f"{message.rstrip('.')}{_advice(message, error)} (see --help)")
        sys.exit(BAD_INPUT)
    except OSError as error:
        # For example a path that is too long, or a full disk.
        complain(f"{error.filename or 'the output'}: {error.strerror or error}")
        if error.filename is None:
            # At exit the interpreter would flush the remaining output, and fail again.
            with suppress(OSError, ValueError), Path(os.devnull).open("wb") as nowhere:
                os.dup2(nowhere.fileno(), sys.stdout.fileno())
        sys.exit(BAD_INPUT)
    except (KeyboardInterrupt, RuntimeError) as error:
        if not _is_interrupted(error):
            raise
        status = INTERRUPTED
    if status == INTERRUPTED:
        complain("interrupted")
    sys.exit(status if isinstance(status, int) else 0)
