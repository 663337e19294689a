"""The verb `sweep`: many hammers under many drives, into a store that can be continued."""

from __future__ import annotations

import json
import math
import time
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import RenderableType
from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Job, announce_compiling, verb
from printhammer.cli.screen import Column, coloured, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from printhammer.sweep.plan import Plan


@verb(
    "sweep",
    "printhammer sweep --example > sweep.toml && printhammer sweep sweep.toml --out results.zarr",
)
def sweep(
    job: Job,
    spec: Path | None = opt.argument("SPEC", "A spec file, TOML.", type=Path),
    out: Path | None = opt.folder(
        "Store of the results (Zarr): a new one, or one to be continued.", writes=False
    ),
    threads: int | None = opt.THREADS,
    dask: str | None = opt.text("ADDRESS", "Work on a dask cluster: address of its scheduler."),
    check: bool = opt.switch("Say what would be done and how much room it takes; do nothing."),
    example: bool = opt.switch("Print a spec to begin with."),
    schema: bool = opt.switch("Print the JSON schema of specs."),
) -> Answer:
    """Run a sweep over any constants, drives and initial states.

    Whatever ends it, the same command goes on where it ended. A member that fails is a row with a status.
    """
    if schema:
        from printhammer.sweep import tables

        typer.echo(json.dumps(tables.schema(), indent=2))
        return Answer()
    if example:
        text = files("printhammer").joinpath("sweep", "example.toml").read_text(encoding="utf-8")
        typer.echo(text, nl=False)
        return Answer()
    from printhammer.cli.verbs.runs.sweep_progress import Telling
    from printhammer.sweep.plan import make_plan
    from printhammer.sweep.spec import read_spec

    if spec is None:
        raise InputError("SPEC is missing", key="SPEC", expected="a spec file; --example prints one")
    if threads is not None and dask is not None:
        raise InputError("--threads is given beside --dask", key="--threads", expected="one or the other")
    if check:
        return Answer(planned(make_plan(read_spec(spec))))
    if out is None:
        raise InputError("--out is missing", key="--out", expected="a folder for the results")
    from printhammer.sweep import sweep as run_sweep

    announce_compiling()
    began = time.monotonic()
    with Telling() as telling:
        result = run_sweep(spec, out, threads=threads, dask=dask, progress=telling.tell)
    job.show(ended(result, telling.new, time.monotonic() - began))
    job.wrote(out)
    return Answer()


def planned(plan: Plan) -> list[RenderableType]:
    """Return axes, members, blocks and arrays of a sweep."""
    from printhammer.cli.verbs.runs.sweep_progress import size_text

    spec = plan.spec
    axes: tuple[Column[Any], ...] = (
        Column("axis", lambda axis: escape(axis.key), left=True),
        Column("", lambda axis: str(len(axis.values)) if spec.grid else "drawn"),
        Column("from", lambda axis: axis.values.min(), format=".6g"),
        Column("to", lambda axis: axis.values.max(), format=".6g"),
        Column("unit", lambda axis: "" if axis.note.si == "1" else axis.note.si, left=True),
    )
    arrays: tuple[Column[Any], ...] = (
        Column("array", lambda row: row[0].name, left=True),
        Column("shape", lambda row: " × ".join(map(str, row[1])), left=True),
        Column("size", lambda row: size_text(row[2])),
        Column(
            "",
            lambda row: escape(row[0].meaning + (f" [{row[0].unit}]" if row[0].unit else "")),
            left=True,
        ),
    )
    rows = list(plan.table())
    blocks = "1 block" if plan.blocks.number == 1 else f"{plan.blocks.number} blocks"
    return [
        f"[bold]{escape(spec.title or spec.where)}[/bold]  {escape(spec.base.hammer.name)}\n",
        table(axes, spec.axes),
        "",
        table(arrays, rows),
        (
            f"\n{plan.members} members in {blocks} of up to {math.prod(plan.blocks.chunks)};"
            f" {size_text(sum(size for _output, _shape, size in rows))} before compression"
        ),
    ]


def ended(result: xr.Dataset, new: float, seconds: float) -> str:
    """Say how the members of a sweep ended."""
    from collections import Counter

    from printhammer.cli.verbs.runs.sweep_progress import duration_text
    from printhammer.sweep.outputs import STATUSES

    counts = Counter(result["status"].values.ravel().tolist())
    each = ", ".join(
        coloured(code == 0, f"{count} {STATUSES[code]}") for code, count in sorted(counts.items())
    )
    how = f"{new:.0f} of them now, in {duration_text(seconds)}" if new else "all of them done before"
    return f"{result['status'].size} members: {each}; {how}"
