"""Rules for every verb: its help, its example, and errors of one sentence for bad input."""

import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import typer

import printhammer as ph
from printhammer.cli.main import MODULES, groups_of, program_of, verb_of
from printhammer.cli.options import Files, read_plain, read_whole
from printhammer.cli.runner import Verb

NAMES = list(MODULES)
VERBS = [verb_of(name) for name in NAMES]
PROGRAM: Any = typer.main.get_command(program_of())
# Required arguments of each verb, so that a test reaches the bad option.
NEEDED = {
    "curve": ("--second", "backstop.damping"),
    "figure": ("3",),
    "measure": ("magnet",),
    "fit magnet": ("t.csv",),
    "fit solenoid": ("t.csv", "--turns", "100"),
    "fit spring": ("t.csv",),
    "fit pack": ("t.csv",),
    "fit motion": ("t.csv",),
    "fit coil": ("t.csv",),
}
# Examples that take more than a few seconds, with options that shorten those whose length tells nothing.
LONG = {
    "basins": "",
    "bifurcation": "--values 4",
    "continue": "",
    "curve": "",
    "orbits": "--longest 1 --starts 20 --follow 0",
    "energy": "--dots 1",
    "tune": "--history 1",
    "sweep": "",
}
# Examples that are part of other tests, or take minutes.
ELSEWHERE = {
    "paper": "takes minutes; test_paper.py writes the whole report",
    "studio": "opens a browser; test_studio.py",
    "fit solenoid": "test_fit_solenoid.py runs it",
    "fit coil": "reads a hammer on a voltage that no other verb writes; test_fit_coil.py",
    "warm": "test_warm.py runs it",
    "feedback": "control/feedback/test_comparison.py runs it, with a controller that another test needs",
    "learn": "chooses among 400 hammers; test_learn.py, and its page, with fewer",
}
# The example that a shell runs; the redirections of other examples are followed in this process.
IN_A_SHELL = "fit spring"


def words_of(verb: Verb, *more: object) -> list[object]:
    return [*verb.name.split(), *NEEDED.get(verb.name, ()), *more]


@pytest.mark.parametrize("module", sorted(set(MODULES.values())))
def test_every_declared_verb_is_listed(module: str) -> None:
    values = vars(import_module(f"printhammer.cli.verbs.{module}")).values()
    declared = sorted(value.name for value in values if isinstance(value, Verb))
    assert declared == sorted(name for name, home in MODULES.items() if home == module)


@pytest.mark.parametrize(("words", "homes"), [("run --help", {"run"}), ("fit coil --help", {"fit"})])
def test_a_verb_imports_its_own_module_alone(words: str, homes: set[str]) -> None:
    code = f"""
import sys
from printhammer.cli.main import main
try:
    main({words.split()})
except SystemExit:
    homes = [name for name in sys.modules if name.startswith("printhammer.cli.verbs.")]
    print(*homes, file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {name.rpartition(".")[2] for name in done.stderr.split()} == homes


def printed(cli: Callable[..., Any], words: list[str]) -> str:
    """Return the example as the help shows it, ready to copy."""
    done = cli(*words, "--help")
    assert done.status == 0
    lines = done.out.partition("Example: ")[2].splitlines()
    return "\n".join(line.strip() for line in lines).strip()


def commands_of(shown: str) -> list[list[str]]:
    """Split the commands of an example into words, as a shell does."""
    assert all(line.endswith("\\") for line in shown.splitlines()[:-1])
    return [shlex.split(part) for part in shown.replace("\\\n", "").split(" && ")]


@pytest.mark.parametrize("verb", VERBS, ids=NAMES)
def test_help_carries_an_example_that_can_be_read(cli: Callable[..., Any], verb: Verb) -> None:
    shown = printed(cli, verb.name.split())
    assert shown.replace("\\\n", "") == verb.example
    for words in commands_of(shown):
        assert words.pop(0) == "printhammer"
        command = PROGRAM
        while hasattr(command, "commands"):
            command = command.commands[words.pop(0)]
        if ">" not in words:
            command.make_context(verb.name, words)


@pytest.mark.parametrize("group", [name for name, (_help, example) in groups_of(NAMES).items() if example])
def test_a_group_has_the_example_of_a_verb(cli: Callable[..., Any], group: str) -> None:
    assert printed(cli, [group]).replace("\\\n", "") in {verb.example for verb in VERBS}


def examples() -> Iterator[Any]:
    for verb in VERBS:
        if verb.name not in ELSEWHERE:
            yield pytest.param(verb, id=verb.name, marks=[pytest.mark.slow] if verb.name in LONG else [])


@pytest.mark.parametrize("verb", list(examples()))
def test_the_example_in_the_help_runs(
    cli: Callable[..., Any], verb: Verb, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shown = printed(cli, verb.name.split())
    if verb.name == IN_A_SHELL:
        program = f"{shlex.quote(sys.executable)} -m printhammer "
        shell = re.sub(r"(^|&& )printhammer ", lambda found: found[1] + program, shown, flags=re.MULTILINE)
        done = subprocess.run(shell, shell=True, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert done.stdout
    else:
        for _program, *command in commands_of(shown):
            words, redirected = (command[:-2], command[-1]) if ">" in command else (command, "")
            # The last value of an option counts.
            outcome = cli(*words, *LONG.get(verb.name, "").split())
            assert outcome.status == 0, outcome.err
            assert outcome.out
            if redirected:
                Path(redirected).write_text(outcome.out, "utf-8")
    assert {path.name for path in tmp_path.iterdir()} == written_by(verb)


def written_by(verb: Verb) -> set[str]:
    """Return the files that an example writes, by their names in it."""
    words = verb.example.split()
    names = [words[k + 1] for k, word in enumerate(words) if word in ("--out", ">")]
    names += re.findall(r"[\w.]+\.jsonl?\b", verb.example)
    return {Path(name).parts[0] for name in names}


def test_the_examples_run_one_after_the_other_in_one_folder() -> None:
    """Every example writes its own files; the tables of the bench are overwritten."""
    written = [name for verb in VERBS for name in written_by(verb) if name not in ("build", "lab")]
    assert len(set(written)) == len(written)


@pytest.mark.parametrize("verb", VERBS, ids=NAMES)
def test_an_option_that_is_none_is_refused(refused: Callable[..., None], verb: Verb) -> None:
    refused(*words_of(verb, "--no-such-option", "1"), said="--no-such-option")


def numbers() -> Iterator[Any]:
    for verb in VERBS:
        for name, option in verb.options.items():
            if option.read in (read_whole, read_plain):
                flag = option.flag or f"--{name.replace('_', '-')}"
                yield pytest.param(verb, flag, id=f"{verb.name} {flag}")


@pytest.mark.parametrize(("verb", "flag"), list(numbers()))
def test_what_is_no_number_is_refused(refused: Callable[..., None], verb: Verb, flag: str) -> None:
    refused(*words_of(verb, flag, "many"), said=f"{flag} = 'many'")


def outputs() -> Iterator[Any]:
    for verb in VERBS:
        for name, files in verb.files.items():
            if not files.argument:
                yield pytest.param(verb, f"--{name}", id=f"{verb.name} --{name}")


@pytest.mark.parametrize(("verb", "flag"), list(outputs()))
def test_a_file_that_cannot_be_written_is_refused(
    refused: Callable[..., None], verb: Verb, flag: str, tmp_path: Path
) -> None:
    files = verb.files[flag.removeprefix("--")]
    name = f"result{(*files.endings, '.png')[0]}"
    if files.endings or files.pictures:
        refused(*words_of(verb, flag, "result.txt"), said=f"{flag} result.txt")
    refused(*words_of(verb, flag, f"nowhere/{name}"), said=f"nowhere/{name}")
    if files.many:
        refused(*words_of(verb, flag, name, flag, name), said=(name, "twice"))
    (tmp_path / name).mkdir()
    refused(*words_of(verb, flag, name), said=(name, "folder"))


HAMMERED = [verb for verb in VERBS if any(option.hammer for option in verb.options.values())]


def hammer_words(verb: Verb, path: object) -> list[object]:
    (option,) = [option for option in verb.options.values() if option.hammer]
    return [path] if option.argument else ["--hammer", path]


@pytest.mark.parametrize("verb", HAMMERED, ids=[verb.name for verb in HAMMERED])
def test_a_hammer_that_is_none_is_refused(refused: Callable[..., None], verb: Verb, tmp_path: Path) -> None:
    refused(*words_of(verb, *hammer_words(verb, "nobody.toml")), said=("nobody.toml", "no such file"))
    (tmp_path / "bad.toml").write_text("mass = = 3", "utf-8")
    refused(*words_of(verb, *hammer_words(verb, "bad.toml")), said=("bad.toml", "TOML"))


@pytest.mark.parametrize("verb", HAMMERED, ids=[verb.name for verb in HAMMERED])
def test_a_hammer_is_never_written_over(refused: Callable[..., None], verb: Verb, tmp_path: Path) -> None:
    for name, files in verb.files.items():
        ending = (*files.endings, ".png")[0]
        path = tmp_path / f"hammer{ending}"
        ph.load("hendriks-1983").save(path)
        words = words_of(verb, *hammer_words(verb, path))
        # An output without a flag is one of those words.
        written = [path if word == "new.json" else word for word in words]
        refused(*written, *([] if files.argument else [f"--{name}", path]), said="that is not an input file")


FIRED = [verb for verb in HAMMERED if any(option.hammer == "fired" for option in verb.options.values())]


@pytest.mark.parametrize("verb", FIRED, ids=[verb.name for verb in FIRED])
def test_a_hammer_without_a_waveform_is_not_fired(
    refused: Callable[..., None], verb: Verb, tmp_path: Path
) -> None:
    path = tmp_path / "bare.toml"
    ph.load("hendriks-1983").replace("waveform", None).save(path)
    refused(*words_of(verb, *hammer_words(verb, path)), said=("bare.toml", "has no [waveform] to fire"))


def places() -> Iterator[Any]:
    for verb in VERBS:
        for name, files in verb.files.items():
            if not files.continued:
                yield pytest.param(verb, name, files, id=f"{verb.name} {name}")


@pytest.mark.parametrize(("verb", "name", "files"), list(places()))
def test_a_file_that_is_there_is_not_written_over(
    refused: Callable[..., None], verb: Verb, name: str, files: Files, tmp_path: Path
) -> None:
    path = "new.json" if files.argument else f"result{(*files.endings, '.png')[0]}"
    (tmp_path / path).write_text("mine", "utf-8")
    flagged = [] if files.argument else [f"--{name}", path]
    refused(
        *words_of(verb, *flagged),
        said=f"{path}: expected a new file, but the file exists; --force overwrites",
    )


@pytest.mark.parametrize(
    "verb", [verb for verb in VERBS if verb.files or "out" in verb.options], ids=lambda v: v.name
)
def test_force_is_offered_where_new_files_are_written(cli: Callable[..., Any], verb: Verb) -> None:
    shown = cli(*verb.name.split(), "--help").out
    assert ("Overwrite" in shown) == (verb.name != "sweep")


def test_the_readings_of_a_figure_are_those_of_the_library() -> None:
    from printhammer.run.scheme_runs import READINGS

    (metavar,) = (verb.options["reading"].metavar for verb in VERBS if verb.name == "figure")
    assert metavar is not None
    assert sorted(metavar.split("|")) == sorted(READINGS)
