"""Digests of sources depend on the code, not on docstrings and comments."""

from pathlib import Path

import pytest

from printhammer.kernel.compile.bindings import code_digest

LAW = '"""A law."""\n\n\ndef force(c, x):\n    """Return the force."""\n    return c[0] * x\n'


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize(
    "same",
    [
        "def force(c, x):\n    return c[0] * x\n",
        LAW.replace("Return the force", "Compute the force, N"),
        "# A comment.\n" + LAW.replace("c[0] * x", "(c[0]\n            * x)"),
        LAW.replace("\n", "\r\n"),
    ],
)
def test_words_and_layout_do_not_count(same: str) -> None:
    assert code_digest([same]) == code_digest([LAW])


@pytest.mark.parametrize(
    ("old", "new"),
    [("c[0] * x", "c[1] * x"), ("c[0] * x", "c[0] + x"), ("(c, x)", "(x, c)")],
)
def test_code_counts(old: str, new: str) -> None:
    assert code_digest([LAW.replace(old, new)]) != code_digest([LAW])


def test_order_and_division_count() -> None:
    sources = (["a = 1\n", "b = 2\n"], ["b = 2\n", "a = 1\n"], ["a = 1\n"])
    assert len({code_digest(each) for each in sources}) == 3


def test_the_digest_of_a_text_is_kept(folder: Path) -> None:
    digest = code_digest([LAW])
    (kept,) = folder.rglob("*.digest")
    before = kept.stat().st_mtime_ns
    assert code_digest([LAW]) == digest
    assert kept.stat().st_mtime_ns == before
    kept.write_bytes(b"damaged")
    assert code_digest([LAW]) == digest
