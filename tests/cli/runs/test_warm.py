"""The verb `warm`."""

from collections.abc import Callable
from typing import Any


def test_every_kind_of_machine_code_is_named_with_its_time(cli: Callable[..., Any]) -> None:
    done = cli("warm", "hendriks-1983")
    assert done.status == 0
    for name in ("runs, their dots and peaks", "maps and sweeps", "strobe points", "exponents"):
        (line,) = (line for line in done.out.splitlines() if line.startswith(name))
        assert float(line.split()[-1]) >= 0.0
