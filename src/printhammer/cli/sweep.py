"""The verb `sweep`: many hammers under many drives, into a store that can be gone on with."""

from __future__ import annotations

import time
from pathlib import Path  # noqa: TC003 (typer reads the annotations)
from typing import Annotated

import typer

from printhammer.cli.numbers import whole

EXAMPLE = (
    "Example: printhammer sweep --example > sweep.toml && printhammer sweep sweep.toml --out results.zarr"
)


def sweep(
    spec: Annotated[Path | None, typer.Argument(metavar="SPEC", help="A spec file, TOML.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Store of the results (Zarr), new or gone on with.")
    ] = None,
    threads: Annotated[
        str | None, typer.Option(metavar="N", help="Threads (default: as many as there are cores).")
    ] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Work on a dask cluster: address of its scheduler.")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Say what would be done and how much room it takes; do nothing.")
    ] = False,
    example: Annotated[bool, typer.Option("--example", help="Print a spec to begin with.")] = False,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON schema of specs.")] = False,
) -> None:
    """Run a sweep over any constants, drives and initial states.

    Whatever ends it, the same command goes on where it ended. A member that fails is a row with a status.
    """
    if example or schema:
        typer.echo(_schema() if schema else _example(), nl=False)
        return
    from printhammer.cli.saving import say_written
    from printhammer.cli.sweep_screen import Telling, show_plan, show_results
    from printhammer.cli.terminal import announce_compiling, console
    from printhammer.errors import InputError
    from printhammer.sweep.plan import make_plan
    from printhammer.sweep.spec import read_spec

    if spec is None:
        raise InputError("SPEC is missing, expected a spec file; --example prints one")
    if threads is not None and dask is not None:
        raise InputError("--threads is given beside --dask, expected one or the other")
    screen = console()
    if check:
        show_plan(make_plan(read_spec(spec)), screen)
        return
    if out is None:
        raise InputError("--out is missing, expected a folder for the results")
    from printhammer.sweep import sweep as run_sweep

    announce_compiling()
    began = time.monotonic()
    with Telling() as telling:
        found = run_sweep(spec, out, threads=whole(threads, "threads"), dask=dask, progress=telling.tell)
    show_results(found, telling.new, time.monotonic() - began, screen)
    say_written(screen, out)


def _example() -> str:
    from importlib.resources import files

    return files("printhammer").joinpath("sweep", "example.toml").read_text(encoding="utf-8")


def _schema() -> str:
    import json

    from printhammer.sweep.tables import schema

    return json.dumps(schema(), indent=2) + "\n"
