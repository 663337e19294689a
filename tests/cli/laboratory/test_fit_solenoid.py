"""The verb `fit solenoid`, from a published table."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import printhammer as ph

TABLE = Path(ph.__file__).parent / "identify" / "static" / "pot-magnet.csv"


def test_the_verb_writes_a_fragment(cli: Callable[..., Any], tmp_path: Path) -> None:
    out = tmp_path / "solenoid.toml"
    picture = tmp_path / "solenoid.png"
    ended = cli(
        *("fit", "solenoid", TABLE, "--turns", "957", "--current", "1200 mA"), "--out", out, "--out", picture
    )
    assert ended.status == 0, ended.err
    assert 'law = "reluctance"' in out.read_text("utf-8")
    assert picture.stat().st_size > 0
    assert "magnet.saturation_flux" in ended.out
