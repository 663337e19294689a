"""Rules for the files of the repository that no linter checks."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAX_LINES = 500
MAX_FRAGMENTS = 80
"""Modules of fewer than 60 lines, package files included."""
LOCKS = sorted((ROOT / "requirements").glob("*.txt"))
MACHINE_PATH = re.compile(r"(?<![\w.~/])/(?:home|root|work|opt|mnt|Users)/\w|[A-Z]:\\\\?Users")
SKIPPED_TEST = re.compile(r"\b(?:pytest|mark)\.(?:skip|skipif|xfail|importorskip)\b")


def repository_texts() -> dict[str, str]:
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        check=True,
    ).stdout.decode()
    texts = {}
    for name in filter(None, listing.split("\0")):
        path = ROOT / name
        if path.is_file() and b"\0" not in (content := path.read_bytes()):
            texts[name] = content.decode("utf-8")
    return texts


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    found = repository_texts()
    assert "pyproject.toml" in found
    assert "tests/test_house_rules.py" in found
    return found


def test_no_file_is_too_long(texts: dict[str, str]) -> None:
    lengths = {name: text.count("\n") for name, text in texts.items() if ROOT / name not in LOCKS}
    assert {name: lines for name, lines in lengths.items() if lines > MAX_LINES} == {}


def test_few_modules_are_fragments(texts: dict[str, str]) -> None:
    lengths = [
        text.count("\n") for name, text in texts.items() if re.fullmatch(r"src/printhammer/.*\.py", name)
    ]
    assert sum(length < 60 for length in lengths) <= MAX_FRAGMENTS


def test_no_file_names_a_path_of_one_machine(texts: dict[str, str]) -> None:
    found = {name: match.group() for name, text in texts.items() if (match := MACHINE_PATH.search(text))}
    assert found == {}


@pytest.mark.parametrize(
    ("text", "is_machine_path"),
    [
        ("see " + "/home" + "/ann/data.csv", True),
        ('open("' + "/work" + '/x")', True),
        ("docs" + "/work" + "/x", False),
        ("~" + "/work" + "/x", False),
        ("N/mm", False),
    ],
)
def test_machine_paths_are_recognised(text: str, is_machine_path: bool) -> None:
    assert bool(MACHINE_PATH.search(text)) == is_machine_path


def test_no_test_is_switched_off(texts: dict[str, str]) -> None:
    found = {
        name: match.group()
        for name, text in texts.items()
        if name.startswith("tests/") and (match := SKIPPED_TEST.search(text))
    }
    assert found == {}


@pytest.mark.parametrize("lock", LOCKS, ids=lambda lock: lock.name)
def test_locks_hold_no_address_and_a_hash_for_everything(lock: Path) -> None:
    text = lock.read_text("utf-8")
    assert "://" not in text
    entries = text.replace("\\\n", " ").splitlines()
    assert entries
    pinned = re.compile(r"[a-z0-9-]+==[\w.]+( ; [^:]+?)?\s+(--hash=sha256:[0-9a-f]{64}\s*)+")
    assert [entry for entry in entries if not pinned.fullmatch(entry)] == []


def test_the_locks_agree() -> None:
    names = {"build.txt", "dev.txt", "lock.txt", "oldest.txt", "runtime.txt", "test.txt"}
    assert {lock.name for lock in LOCKS} == names
    pins = {
        lock.name: set(re.findall(r"^([a-z0-9-]+==[\w.]+)", lock.read_text("utf-8"), re.MULTILINE))
        for lock in LOCKS
    }
    assert pins["runtime.txt"] | pins["build.txt"] < pins["test.txt"] < pins["dev.txt"]


def test_sphinx_is_installed_for_the_docs_only() -> None:
    text = (ROOT / "requirements/test.txt").read_text("utf-8")
    assert not re.search(r"^(sphinx|furo|myst-parser|latex2mathml)", text, re.MULTILINE)
