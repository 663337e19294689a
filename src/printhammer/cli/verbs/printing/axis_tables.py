"""The option `--along` of `tune`: a table for each value of what a firmware knows beside rate and history."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, check_endings
from printhammer.cli.screen import Column, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.control.axes import AxisTables
    from printhammer.hammer.hammer import Hammer

_ROWS = 24


def tuned_along(
    job: Job,
    hammer: Hammer,
    along: str,
    header: dict[str, Any],
    budget: int | None,
    options: dict[str, Any],
    units: Units,
) -> Answer:
    """Tune tables along an axis, such as 'rail 90 V, 110 V, 3'; `header` holds the tick, if any."""
    from printhammer.control.axes import tune_along

    axis, values = _read(along)
    if "rate" not in options or "rates" in options:
        raise InputError(
            "--along is given without --rate", key="--along", expected="one rate, such as --rate 1.3kHz"
        )
    check_endings(job.wanted["out"], (*opt.DATA, ".h"), "--out")
    with job.counting("tuning") as tell:
        made = tune_along(hammer, axis, values, progress=tell, **options)
    if header:
        made = made.quantised(header["tick"])
    made.to_header(budget=budget, **header)
    size = f", {made.size(**header)} bytes in a C header"
    job.show(_table(made, units), note=f"tuned in {job.seconds:.2g} s{size}")
    return Answer(files={"out": Content(partial(_save, made, header))})


def _read(written: str) -> tuple[str, list[float]]:
    """Read an axis and its values; InputError if it is none."""
    from printhammer.control.axes import AXES

    axis, _, rest = written.strip().partition(" ")
    if axis not in AXES:
        raise InputError(f"--along {written!r}: expected one of {', '.join(AXES)} first", key="--along")
    return axis, opt.between(opt.read_span(rest, f"--along {axis}"), AXES[axis].unit, f"--along {axis}")


def _save(made: AxisTables, header: dict[str, Any], path: Path) -> None:
    made.save(path, **header)


def _table(made: AxisTables, units: Units) -> Table:
    """Return the pulse from rest and how far off the entries are, a row for each value."""
    from printhammer.control.axes import AXES

    def worst(row: int) -> float:
        return 100.0 * float(made.tables[row].deviation.max())

    columns: tuple[Column[int], ...] = (
        Column(made.axis, lambda row: made.values[row], unit=AXES[made.axis].unit, format=".6g"),
        Column("width from rest", lambda row: float(made.tables[row].width[0, 0]), "time"),
        Column("advance from rest", lambda row: float(made.tables[row].advance[0, 0]), "time"),
        Column("worst,\nof the limits", worst, "", "%", ".1f"),
    )
    title = f"Tables along the {made.axis} at {made.tables[0].rates[0]:g} Hz"
    return table(columns, range(len(made.values)), units, title=title, most=_ROWS)
