"""The verb `sweep`: many hammers under many drives, saved in a store that can be resumed."""

from __future__ import annotations

import json
import math
import sys
import time
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Job, announce_compiling, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


@verb("sweep", "printhammer sweep --example > sweep.toml && printhammer sweep sweep.toml --out results.zarr")
def sweep(
    job: Job,
    spec: Path | None = opt.argument("SPEC", "Specification file of the sweep (.toml).", type=Path),
    out: Path | None = opt.folder(
        "Output folder of the result store (.zarr), new or to be resumed; or a .csv file for the table, in"
        " which case the store has the same name with .zarr.",
        writes=False,
    ),
    threads: int | None = opt.THREADS,
    dask: str | None = opt.text("ADDRESS", "Address of the scheduler of a Dask cluster that runs the sweep."),
    check: bool = opt.switch(
        "Show the plan of the sweep and the required disk space, without running the sweep."
    ),
    example: bool = opt.switch("Print an example specification file."),
    schema: bool = opt.switch("Print the JSON schema of specification files."),
) -> Answer:
    """Run a sweep over any constants, drives and initial states.

    The same command resumes an interrupted sweep. A failed run becomes a row with its status.
    """
    if schema:
        from printhammer.sweep import tables

        typer.echo(json.dumps(tables.schema(), indent=2))
        return Answer()
    if example:
        text = files("printhammer").joinpath("sweep", "example.toml").read_text(encoding="utf-8")
        typer.echo(text, nl=False)
        return Answer()
    from printhammer.sweep.plan import make_plan
    from printhammer.sweep.spec import read_spec

    if spec is None:
        raise InputError("SPEC is missing", key="SPEC", expected="a spec file; --example prints one")
    if threads is not None and dask is not None:
        raise InputError(
            "--threads is given with --dask", key="--threads", expected="only one of these options"
        )
    if check:
        return Answer(render(make_plan(read_spec(spec)).summary()))
    if out is None:
        raise InputError("--out is missing", key="--out", expected="a folder for the results")
    from printhammer.sweep import sweep as run_sweep

    announce_compiling()
    began = time.monotonic()
    with SweepProgress() as shown:
        result = run_sweep(spec, out, threads=threads, dask=dask, progress=shown.tell)
    job.show(ended(result, shown.new, time.monotonic() - began))
    job.wrote(out)
    return Answer()


def ended(result: xr.Dataset, new: float, seconds: float) -> str:
    """Format the outcome of a sweep: the number of members with each status, and of those not yet at rest.

    The text also states that this process has computed `new` members in `seconds`.
    """
    from collections import Counter

    from printhammer.sweep.outputs import STATUSES

    counts = Counter(result["status"].values.ravel().tolist())
    each = ", ".join(
        f"[{'yellow' if code else 'green'}]{count} {STATUSES[code]}[/]"
        for code, count in sorted(counts.items())
    )
    how = f"{new:.0f} of them now, in {duration_text(seconds)}" if new else "all of them computed before"
    lines = [f"{result['status'].size} members: {each}; {how}"]
    if unsettled := int(result["unsettled"].sum()):
        verb = "is" if unsettled == 1 else "are"
        lines.append(
            f"[yellow]{unsettled}[/] of them {verb} not at rest at the end of the run (column unsettled):"
            " later contacts are not counted; if they still move, a duration in the spec sets longer runs"
        )
    return "\n".join(lines)


_LINE_EVERY: Final = 10.0  # Interval between progress lines, s; arbitrary


class SweepProgress:
    """Progress of a sweep on standard error: a bar on a terminal, else a line every ten seconds.

    Attributes
    ----------
    new : float
        Number of members computed by this process.
    """

    def __init__(self) -> None:
        self.new = 0.0
        self._began = self._told = time.monotonic()
        self._bar = (
            Progress(
                BarColumn(),
                TextColumn("{task.description}"),
                console=Console(stderr=True, highlight=False),
                transient=True,
            )
            if sys.stderr.isatty()
            else None
        )
        self._task = None if self._bar is None else self._bar.add_task("…", total=None)

    def __enter__(self) -> Self:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def tell(self, done: float, before: int, members: int) -> None:
        """Update the progress display: members done, members done before this run, and total members."""
        now = time.monotonic()
        if self.new <= 0.0 and done <= before:
            # Exclude compiling and the connection to a cluster from the rate.
            self._began = now
        self.new = done - before
        text = progress_text(done, before, members, now - self._began)
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=text, completed=done, total=members)
        elif now - self._told >= _LINE_EVERY:
            self._told = now
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()


def progress_text(done: float, before: int, members: int, seconds: float) -> str:
    """Format the progress of a sweep: members done, rate, and time left.

    `before` members were done before this run, which has taken `seconds`.
    """
    text = f"{int(done)} of {members} members"
    new = done - before
    if new <= 0.0 or seconds <= 0.0:
        return text
    rate = new / seconds
    return f"{text}, {rate:.3g}/s, {duration_text((members - done) / rate)} left"


def duration_text(seconds: float) -> str:
    """Format a duration in at most two units, such as "2 h 5 min"."""
    whole = math.ceil(seconds)
    days, hours, minutes = whole // 86400, whole // 3600 % 24, whole // 60 % 60
    if days:
        return f"{days} d {hours} h"
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {whole % 60} s" if minutes else f"{whole} s"
