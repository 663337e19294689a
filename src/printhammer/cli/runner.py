"""The one way in which every verb runs.

A verb is a function of its options, and of a `Job` where it asks for one, declared with `verb`. The runner
reads the options, checks before any work that every file can be written and writes over none, loads the
hammer, and has compiling announced; the verb computes and returns an `Answer`; the runner shows it, writes
the files, complains, and sets the exit status.

How the verbs of chaos are told what is fired for ever: by period or rate, or by a drive file.
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
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Firing

Shown = TypeVar("Shown")

INTERRUPTED: Final = 130
_FORCE: Final = "write_over"
_WITH_PARTS: Final = ("HAMMER", "SPEC")
"""What stands for the files that may name a law from elsewhere."""
PICTURES: Final = (".svg", ".png", ".pdf")
"""Endings of the names of pictures."""


@dataclass(frozen=True)
class Content:
    """What a file holds: a picture where its name ends as one's does, else what `save` writes."""

    save: Callable[[Path], Any] | None = None
    """Writes any file that is no picture; None where the work itself has written it."""
    plot: Callable[[], Any] | None = None
    """Returns a matplotlib figure."""

    @classmethod
    def text(cls, content: Callable[[], str]) -> Content:
        """Return content that is a text, made when it is written."""
        from printhammer.support.files import write_file

        return cls(lambda path: write_file(path, content()))

    @classmethod
    def of(cls, result: Any, **options: Any) -> Content:
        """Return a result as content; `options` go to its `plot`."""
        return cls(result.save, lambda: result.plot(**options))

    def write(self, path: Path) -> None:
        """Write a file; InputError if it cannot be written."""
        from printhammer.support.files import write_file

        ending = path.suffix.lower()
        if self.plot is not None and ending in PICTURES:
            from printhammer.figures.elements.save import picture

            write_file(path, picture(self.plot(), ending[1:]))
        elif self.save is not None:
            self.save(path)


@dataclass(frozen=True)
class Answer:
    """What a verb has to say at its end."""

    shown: Sequence[RenderableType] = ()
    """What is still to be shown; text is markup."""
    note: str = ""
    """Line below the name of the hammer."""
    files: Mapping[str, Content] = field(default_factory=dict)
    """What the files of an option hold."""
    complaints: Sequence[str] = ()
    """Why the exit status is 1."""
    failed: bool = False
    """Whether it is 1 without a complaint."""
    interrupted: bool = False
    """Whether Ctrl-C ended the work, of which this much was done."""


class Job:
    """One call of a verb."""

    def __init__(
        self, declared: Mapping[str, Files], wanted: Mapping[str, list[Path]], *, force: bool = False
    ) -> None:
        self.hammer: Hammer | None = None
        """The hammer that is worked on."""
        self.declared, self.wanted = declared, dict(wanted)
        """Options that name files to write, and these files, by the name of the option."""
        self.inputs: list[Path] = []
        """Files that are read."""
        self.force = force
        """Whether files that are there may be written over."""
        self.screen = console()
        """The standard output."""
        self.seconds = 0.0
        """How long the last work took whose progress was shown."""
        self._headed = False

    @property
    def outputs(self) -> list[Path]:
        """All files to write."""
        return [path for paths in self.wanted.values() for path in paths]

    def check(self, *inputs: Path) -> None:
        """Make sure, before any work, that all files can be written, are new, and are none that is read.

        Errors as for `check_endings`, `check_outputs` and `check_new`.
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
        """Make sure, before any work, that no file is there yet, unless with --force; else InputError."""
        for path in paths:
            if not self.force and (path.exists() or path.is_symlink()):
                raise InputError(
                    f"{path}: expected a new file, this one is there; --force writes over it", file=path
                )

    def counting(self, name: str, *, remaining: bool = True) -> AbstractContextManager[terminal.Counted]:
        """Show a bar during work that is counted, and note its time; see `progress.counting`."""
        return self._timed(terminal.counting(name, remaining=remaining))

    def telling(self, first: str = "…") -> AbstractContextManager[Callable[[str], None]]:
        """Show a line during work whose end is not known, and note its time; see `progress.telling`."""
        return self._timed(terminal.telling(first))

    @contextmanager
    def _timed(self, shown: AbstractContextManager[Shown]) -> Iterator[Shown]:
        begin = perf_counter()
        try:
            with shown as tell:
                yield tell
        finally:
            self.seconds = perf_counter() - begin

    def show(self, *parts: RenderableType, note: str = "") -> None:
        """Print at once, below the name of the hammer; text is markup."""
        if not self._headed and self.hammer is not None:
            self.screen.print(heading(self.hammer))
            if note:
                self.screen.print(f"[dim]{note}[/dim]", soft_wrap=True)
            self.screen.print()
        self._headed = True
        for part in parts:
            self.screen.print(part, soft_wrap=isinstance(part, str))

    def wrote(self, path: Path | str) -> None:
        """Tell that a file was written."""
        self.screen.print(f"[dim]wrote[/dim] {escape(str(path))}", soft_wrap=True)

    def end(self, answer: Answer) -> int:
        """Show, write and complain; return the exit status."""
        if answer.shown or answer.note:
            self.show(*answer.shown, note=answer.note)
        for name, content in answer.files.items():
            for path in self.wanted.get(name, []):
                content.write(path)
                self.wrote(path)
        for complaint in answer.complaints:
            complain(complaint)
        if answer.interrupted:
            return INTERRUPTED
        return int(bool(answer.complaints) or answer.failed)


@dataclass(frozen=True)
class Verb:
    """A verb of the command line."""

    name: str
    """What it is called, such as "strobe" or "fit magnet"."""
    example: str
    """A command line that runs; it stands in the help."""
    call: Callable[..., int]
    """What typer calls, with texts; returns the exit status."""
    options: Mapping[str, Option]
    """Options with their declarations, by the names of the parameters."""
    files: Mapping[str, Files]
    """Options that name files to write."""


def verb(
    name: str, example: str, passed: Mapping[str, Option] | None = None, **files: Files
) -> Callable[[Callable[..., Answer]], Verb]:
    """Make a function the verb `name`, with an example of a command line that runs.

    The function has options as defaults of its parameters, and gets the `Job` too where it has a parameter
    `job`. Options that are `passed` are those that the library takes under the same name: the function gets
    those that are given as further keywords, to pass them on; the others have the defaults of the library.
    `files` name files to write, in the order of writing; a verb that writes new ones has the option --force.
    One that reads a hammer or a spec has the option --part, as has one that names it among those passed.
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
            return job.end(function(**words))

        # What typer looks at.
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
    """Check the files, read the options, load the hammer; return the values of the options."""
    job.check(
        *(
            Path(path)
            for name, option in options.items()
            if option.is_input and texts[name] is not None
            for path in (texts[name] if isinstance(texts[name], list) else [texts[name]])
        )
    )
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
            job.check(*tables_beside(Path(texts[name]), job.hammer.magnet, job.hammer.waveform))
            announce_compiling()
    return values


def load_hammer(name: str, *, fired: bool) -> Hammer:
    """Load a hammer that is to be run; print what is odd about it as warnings.

    InputError if there is none, it does not rest at its backstop, or has no waveform to be fired with.
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


def tables_beside(path: Path, *parts: object) -> list[Path]:
    """Return the tables that parts read from a file name, which lie beside that file."""
    names = [getattr(part, "file", None) for part in parts]
    return [path.parent / name for name in names if name]


def announce_compiling() -> None:
    """Have the user told when machine code is made, which takes a while once."""
    from printhammer.run.simulate import announce_compiling as announce

    announce(say)


def check_endings(paths: Iterable[Path], endings: Sequence[str], option: str = "--out") -> None:
    """Make sure that names end as what can be written there, if any end is named; else InputError."""
    for path in paths:
        if endings and path.suffix.lower() not in endings:
            raise InputError(
                f"{option} {path}: expected a name that ends in one of {', '.join(endings)}",
                key=option,
                value=path,
            )


def ended_early(statuses: Iterable[object], total: int | None = None) -> list[str]:
    """Return a complaint about the statuses that are not ok, of `total` runs or as many as there are."""
    every = [str(status) for status in statuses]
    failed = [status for status in every if status != "ok"]
    kinds = ", ".join(sorted(set(failed)))
    return [f"{len(failed)} of {total or len(every)} runs ended early: {kinds}"] if failed else []


def firing_of(
    job: Job, hammer: Hammer, passed: dict[str, Any], example: str = "", *, timed: bool = True
) -> Firing:
    """Take the options that say how a hammer is fired out of those that are passed, for `Regime.of`.

    One of period and rate is asked for, with an example, where `timed`; a drive file stands instead: an
    endless force, or pulses at a constant rate. InputError where the hammer has nothing to fire, the file
    holds anything else, or more is given than is asked for.
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
            opt.need_one(train, f"{example}, or --drive FILE")
        firing: Firing = opt.given(**train)  # type: ignore[assignment]
        return firing
    from printhammer.drive.file import load_drive
    from printhammer.drive.trains import PulseTrain

    opt.refuse(train, f"none beside --drive {file}")
    drive = load_drive(file, hammer.waveform)
    job.check(*tables_beside(file, drive.waveform))
    if math.isinf(drive.waveform.support) and drive.period is not None:
        return {"drive": drive}
    if not isinstance(drive, PulseTrain) or drive.period is None:
        raise InputError(
            f"{file}: expected a force without end, [sine], or pulses at a constant rate, [train]",
            file=file,
            key="drive",
        )
    return {"waveform": drive.waveform, "period": drive.period, "overlap": drive.overlap}
