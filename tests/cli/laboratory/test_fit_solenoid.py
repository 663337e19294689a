"""The verb `fit solenoid`, from a published table."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import printhammer as ph

TABLE = Path(ph.__file__).parent / "identify" / "static" / "pot-magnet.csv"


def test_the_verb_writes_a_fragment(cli: Callable[..., Any], tmp_path: Path) -> None:
    """The example in the help: the published table that the verb prints, and its fit."""
    shown = cli("fit", "solenoid", "--example")
    assert shown.status == 0
    assert shown.out == TABLE.read_text("utf-8")
    table, out, picture = (tmp_path / f"solenoid.{kind}" for kind in ("csv", "toml", "png"))
    table.write_text(shown.out, "utf-8")
    words = ("--turns", "957", "--current", "1.2 A")
    ended = cli("fit", "solenoid", table, *words, "--out", out, "--out", picture)
    assert ended.status == 0, ended.err
    assert 'law = "reluctance"' in out.read_text("utf-8")
    assert picture.stat().st_size > 0
    assert "magnet.saturation_flux" in ended.out
