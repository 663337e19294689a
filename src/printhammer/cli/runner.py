"""Runner of the verbs: parses the options, calls the verb, and outputs its `Answer`.

A verb is a function declared with `verb`; its parameters are its options and, optionally, a `Job`. The runner
parses the options, checks before the computation that every output file is new and writable, loads the
hammer, and announces compilation. The verb computes and returns an `Answer`. The runner prints the answer,
writes the files, prints warnings, and sets the exit status. `firing_of` parses the periodic drive of the
verbs that analyse chaos: period, rate, or drive file.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final, TypeVar

from rich.console import RenderableType
from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli import terminal
from printhammer.cli.options import FORCE, PART, Files, Option
from printhammer.cli.screen import heading
from printhammer.cli.terminal import complain, console, say, warn
from printhammer.errors import InputError, PrinthammerError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Firing

Shown = TypeVar("Shown")

INTERRUPTED: Final = 130  # Exit status 128 + SIGINT, as shells report it
_FORCE: Final = "write_over"
_WITH_PARTS: Final = ("HAMMER", "SPEC")
"""Placeholders of arguments whose files may use laws registered with --part."""
PICTURES: Final = (".svg", ".png", ".pdf")
"""File endings of pictures."""


@dataclass(frozen=True)
class Content:
    """Content of an output file: a picture for the file endings of pictures, else the output of `save`."""

    save: Callable[[Path], Any] | None = None
    """Writer of a file other than a picture; None if the computation has already written the file."""
    plot: Callable[[], Any] | None = None
    """Function that returns a matplotlib figure."""

    @classmethod
    def text(cls, content: Callable[[], str]) -> Content:
        """Return text content that is composed only when the file is written."""
        from printhammer.support.files import write_file

        return cls(lambda path: write_file(path, content()))

    @classmethod
    def of(cls, result: Any, **options: Any) -> Content:
        """Build the content from a result: data, or the picture of `result.plot` with `options`."""
        return cls(result.save, lambda: result.plot(**options))

    def write(self, path: Path) -> None:
        """Write the content to a file; raise InputError if the file cannot be written."""
        from printhammer.support.files import write_file

        ending = path.suffix.lower()
        if self.plot is not None and ending in PICTURES:
            from printhammer.figures.elements.save import picture

            write_file(path, picture(self.plot(), ending[1:]))
        elif self.save is not None:
            self.save(path)


@dataclass(frozen=True)
class Answer:
    """Answer of a verb: text for the terminal, content of files, and exit status."""

    shown: Sequence[RenderableType] = ()
    """Rich renderables to show on the terminal; text is parsed as Rich markup."""
    note: str = ""
    """Remark shown in a line below the name of the hammer."""
    files: Mapping[str, Content] = field(default_factory=dict)
    """Content of the output files, by option name."""
    complaints: Sequence[str] = ()
    """Reasons for exit status 1, printed on the standard error."""
    failed: bool = False
    """Whether the exit status is 1 even without a warning."""
    interrupted: bool = False
    """Whether Ctrl-C stopped the computation; the answer then covers what was computed until then."""


class Job:
    """State of one call of a verb: hammer, files and console."""

    def __init__(
        self, declared: Mapping[str, Files], wanted: Mapping[str, list[Path]], *, force: bool = False
    ) -> None:
        self.hammer: Hammer | None = None
        """Loaded hammer; None if the verb loads no hammer."""
        self.declared, self.wanted = declared, dict(wanted)
        """Declarations of the output options, and the requested files, both by option name."""
        self.inputs: list[Path] = []
        """Input files, which no output may overwrite."""
        self.force = force
        """Whether existing files may be overwritten."""
        self.screen = console()
        """Console of the standard output, for results."""
        self.seconds = 0.0
        """Duration, s, of the last computation with a progress display."""
        self._headed = False

    @property
    def outputs(self) -> list[Path]:
        """All requested output files."""
        return [path for paths in self.wanted.values() for path in paths]

    def check(self, *inputs: Path) -> None:
        """Check, before the computation, that all output files are writable, new, and not input files.

        Raises the errors of `check_endings`, `check_outputs` and `check_new`.
        """
        from printhammer.results.files import need_for
        from printhammer.support.files import check_outputs

        for name, paths in self.wanted.items():
            option = self.declared[name]
            endings = (*option.endings, *(PICTURES if option.pictures else ()))
            check_endings(paths, endings, name if option.argument else f"--{name}")
        self.inputs += inputs
        for path in self.outputs:
            need_for(path)
        # A Zarr store is a folder.
        stores = {
            path: path / "zarr.json"
            for path in self.outputs
            if path.suffix.lower() == ".zarr" and path.is_dir()
        }
        check_outputs([stores.get(path, path) for path in self.outputs], self.inputs)
        for name, paths in self.wanted.items():
            if not self.declared[name].continued:
                self.check_new(paths)

    def check_new(self, paths: Iterable[Path]) -> None:
        """Raise InputError if an output file exists, unless --force is set."""
        for path in paths:
            if not self.force and (path.exists() or path.is_symlink()):
                raise InputError(
                    f"{path}: expected a new file, but the file exists; --force overwrites", file=path
                )

    def progress_bar(self, name: str, *, remaining: bool = True) -> AbstractContextManager[terminal.Counted]:
        """Show a progress bar and record the duration; see `terminal.progress_bar`."""
        return self._timed(terminal.progress_bar(self.worded(name), remaining=remaining))

    def status_line(self, first: str = "…") -> AbstractContextManager[Callable[[str], None]]:
        """Show a status line and record the duration; see `terminal.status_line`."""
        return self._timed(terminal.status_line(first))

    @contextmanager
    def _timed(self, shown: AbstractContextManager[Shown]) -> Iterator[Shown]:
        begin = perf_counter()
        try:
            with shown as tell:
                yield tell
        finally:
            self.seconds = perf_counter() - begin

    def show(self, *parts: RenderableType, note: str = "") -> None:
        """Print renderables at once, below the name of the hammer; text is parsed as Rich markup."""
        if not self._headed and self.hammer is not None:
            self.screen.print(heading(self.hammer))
            if note:
                self.screen.print(f"[dim]{note}[/dim]", soft_wrap=True)
            self.screen.print()
        self._headed = True
        for part in parts:
            self.screen.print(part, soft_wrap=isinstance(part, str))

    def worded(self, said: Shown) -> Shown:
        """Replace the noun "dot" in texts or a summary with the hammer's noun, such as "closing"."""
        from printhammer.results.summary import worded

        named: Shown = said if self.hammer is None else worded(said, self.hammer.strike)
        return named

    def wrote(self, path: Path | str) -> None:
        """Print the name of a file that was written."""
        self.screen.print(f"[dim]wrote[/dim] {escape(str(path))}", soft_wrap=True)

    def end(self, answer: Answer) -> int:
        """Show the answer, write its files, print its warnings; return the exit status."""
        if answer.shown or answer.note:
            self.show(*self.worded(list(answer.shown)), note=self.worded(answer.note))
        for name, content in answer.files.items():
            for path in self.wanted.get(name, []):
                content.write(path)
                self.wrote(path)
        for complaint in answer.complaints:
            complain(self.worded(complaint))
        if answer.interrupted:
            return INTERRUPTED
        return int(bool(answer.complaints) or answer.failed)


@dataclass(frozen=True)
class Verb:
    """Verb of the command line: function, options, and example."""

    name: str
    """Name, such as "strobe" or "fit magnet"."""
    example: str
    """Runnable command line for the help."""
    call: Callable[..., int]
    """Function that typer calls with texts; returns the exit status."""
    options: Mapping[str, Option]
    """Declarations of the options, by parameter name."""
    files: Mapping[str, Files]
    """Declarations of the options that name output files."""


def verb(
    name: str, example: str, passed: Mapping[str, Option] | None = None, **files: Files
) -> Callable[[Callable[..., Answer]], Verb]:
    """Decorate a function as the verb `name`, with a runnable example.

    The function declares its options as default values of its parameters; a parameter `job` receives the
    `Job`. `passed` declares options by the parameter names of the library function that the verb calls; the
    verb receives, as keywords, only the options that the user sets. `files` declares the options for output
    files, in the order of writing. The runner adds --force to verbs that write new files, and --part to verbs
    that read a hammer or a spec file or have `part` in `passed`.
    """

    def made(function: Callable[..., Answer]) -> Verb:
        signature = inspect.signature(function)
        own = [name for name, each in signature.parameters.items() if isinstance(each.default, Option)]
        on = dict(passed or {})
        with_parts = on.pop("part", None) is not None
        options: dict[str, Option] = {**{name: signature.parameters[name].default for name in own}, **on}
        new = [
            *(each for each in files.values() if not each.continued),
            *(o for o in options.values() if o.writes),
        ]
        if with_parts or any(option.hammer or option.metavar in _WITH_PARTS for option in options.values()):
            options["part"] = PART
        every = {**options, **files, **({_FORCE: FORCE} if new else {})}

        def call(**texts: Any) -> int:
            wanted = {option: _listed(texts.pop(option)) for option in files}
            job = Job(files, wanted, force=texts.pop(_FORCE, False))
            values = _values(job, options, texts)
            words = {name: values[name] for name in own}
            words |= {name: values[name] for name in on if values[name] is not None}
            if "job" in signature.parameters:
                words["job"] = job
            try:
                answer = function(**words)
            except PrinthammerError as error:
                error.args = (job.worded(str(error)),)
                raise
            return job.end(answer)

        # Typer derives the help and the options from docstring, signature and annotations.
        typed: Any = call
        typed.__doc__ = function.__doc__
        typed.__signature__ = inspect.Signature(
            [
                inspect.Parameter(
                    option,
                    inspect.Parameter.KEYWORD_ONLY,
                    default=inspect.Parameter.empty if each.default is ... else each.typer_default(),
                    annotation=each.annotation(option),
                )
                for option, each in every.items()
            ]
        )
        typed.__annotations__ = {option: each.annotation(option) for option, each in every.items()}
        return Verb(name, example, call, options, files)

    return made


def _listed(paths: Path | list[Path] | None) -> list[Path]:
    return [paths] if isinstance(paths, Path) else paths or []


def _values(job: Job, options: Mapping[str, Option], texts: dict[str, Any]) -> dict[str, Any]:
    """Check the files, parse the options and load the hammer; return the values by parameter name."""
    from printhammer.support import files

    job.check(
        *(
            Path(path)
            for name, option in options.items()
            if option.is_input and texts[name] is not None
            for path in (texts[name] if isinstance(texts[name], list) else [texts[name]])
        )
    )
    files.listeners.add(say)
    values = dict(texts)
    for path in values.pop("part", None) or []:
        from printhammer.parts.outside import load_parts

        load_parts(path)
    for name, option in options.items():
        if option.read is not None and texts[name] is not None:
            values[name] = option.read(texts[name], option.flag_of(name))
    for name, option in options.items():
        if option.hammer in ("loaded", "fired"):
            values[name] = job.hammer = load_hammer(texts[name], fired=option.hammer == "fired")
            job.check(*tables_beside(Path(texts[name]), *job.hammer.files.values()))
            announce_compiling()
    return values


def load_hammer(name: str, *, fired: bool) -> Hammer:
    """Load a hammer for a simulation and print its warnings.

    Raises InputError if the hammer is unknown or has no rest state, or, if `fired`, has no waveform.
    """
    from printhammer.hammer.hammer import load

    hammer = load(name)
    for warning in hammer.warnings():
        warn(f"{hammer.path}: {warning}")
    if fired and hammer.waveform is None:
        raise InputError(
            f"{hammer.path}: the hammer has no [waveform] to fire",
            file=hammer.path,
            key="waveform",
            expected="one",
        )
    return hammer


def tables_beside(path: Path, *names: str | None) -> list[Path]:
    """Return the paths of the tables to which the file `path` refers by `names` relative to its folder.

    Names that are None are ignored.
    """
    return [path.parent / name for name in names if name]


def announce_compiling() -> None:
    """Print a remark to standard error before each compilation of machine code."""
    from printhammer.run.simulate import announce_compiling as announce

    announce(say)


def check_endings(paths: Iterable[Path], endings: Sequence[str], option: str = "--out") -> None:
    """Raise InputError unless each file name has one of the endings; an empty list accepts any ending."""
    for path in paths:
        if endings and path.suffix.lower() not in endings:
            raise InputError(
                f"{option} {path}: expected a name that ends in one of {', '.join(endings)}",
                key=option,
                value=path,
            )


def ended_early(statuses: Iterable[object], total: int | None = None) -> list[str]:
    """Return a list of one warning if any status of a run is not "ok"; else an empty list.

    The warning states the other statuses, and how many of the `total` runs (default: all) have them.
    """
    every = [str(status) for status in statuses]
    failed = [status for status in every if status != "ok"]
    kinds = ", ".join(sorted(set(failed)))
    return [f"{len(failed)} of {total or len(every)} runs ended early: {kinds}"] if failed else []


def away_from_rest(hammer: Hammer) -> list[str]:
    """Return the lines of a note if a single pulse leaves the armature away from rest; else an empty list."""
    from printhammer.run.window import stays_away

    said = stays_away(hammer)
    return ["", f"note: {said}"] if said else []


def period_text(hammer: Hammer, period: float) -> str:
    """Scale a period [s] of the paper's hammer to the time scale of a hammer; return text like "1.05 ms"."""
    from printhammer.run.window import time_scale

    return f"{1e3 * period * time_scale(hammer):.4g} ms"


def rate_text(hammer: Hammer, rate: float) -> str:
    """Scale a rate [Hz] of the paper's hammer to the time scale of a hammer; return text like "952 Hz"."""
    from printhammer.run.window import scaled_rate

    return f"{scaled_rate(hammer, rate):.4g} Hz"


def firing_of(
    job: Job,
    hammer: Hammer,
    passed: dict[str, Any],
    period: float = 1.1e-3,
    more: str = "",
    *,
    timed: bool = True,
) -> Firing:
    """Extract the firing options from `passed`; return them as keywords of `Regime.of`.

    If `timed`, exactly one of period and rate is required; a drive file may replace period and rate: a
    continuous periodic force, or pulses at a constant rate. If none is set, the error message suggests
    `period` [s], scaled to the device, a drive file, and the options in `more`. Raises InputError for a
    hammer without a waveform, any other drive file, or superfluous options.
    """
    file: Path | None = passed.pop("drive", None)
    train = {name: passed.pop(name, None) for name in ("period", "rate", "overlap")}
    if file is None:
        if hammer.waveform is None:
            raise InputError(
                f"{hammer.path}: the hammer has no [waveform] to fire",
                file=hammer.path,
                key="waveform",
                expected="one, or --drive FILE",
            )
        if timed:
            opt.check_one_spacing(
                train, lambda: f"--period {period_text(hammer, period)!r}, or --drive FILE{more}"
            )
        firing: Firing = opt.given(**train)  # type: ignore[assignment]
        return firing
    from printhammer.drive.file import load_drive
    from printhammer.drive.trains import PulseTrain

    opt.check_unset(train, f"--drive {file} without this option")
    drive = load_drive(file, hammer.waveform)
    job.check(*tables_beside(file, getattr(drive.waveform, "file", None)))
    if math.isinf(drive.waveform.support) and drive.period is not None:
        return {"drive": drive}
    if not isinstance(drive, PulseTrain) or drive.period is None:
        raise InputError(
            f"{file}: expected a continuous periodic force, [sine], or pulses at a constant rate, [train]",
            file=file,
            key="drive",
        )
    return {"waveform": drive.waveform, "period": drive.period, "overlap": drive.overlap}
