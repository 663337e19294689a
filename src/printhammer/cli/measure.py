"""The verb `measure`: synthetic measurements of a hammer, as a laboratory would hand them in."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import whole
from printhammer.cli.run import HAMMER, HammerArgument

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.identify.bench.laboratory import Measurement

EXAMPLE: Final = (
    "Example: printhammer measure magnet hendriks-1983 --out magnet.csv --noise 'force=1 %' --outliers '2 %'"
)

ALL: Final = "all"
_SENSORS: Final = "Sensors (default: an ordinary bench)"
_BENCH: Final = "Bench"
_LISTS: Final = {"displacements": "m", "currents": "A", "peaks": "m", "speeds": "m/s"}
_TIMES: Final = ("duration", "before")


def _sensor(flag: str, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=_SENSORS)


def _bench(flag: str, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=_BENCH)


def measure(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="magnet, spring, pack, backstop, motion, or all of them.")
    ],
    hammer: HammerArgument = HAMMER,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table to write, CSV; a folder for all.")
    ] = None,
    noise: Annotated[
        list[str] | None,
        _sensor(
            "--noise",
            "AMOUNT",
            "Standard deviation, such as 'force=0.1 N', 'force=0.5 %' of full scale, or '0.2 um' for all"
            " lengths; may be given repeatedly.",
        ),
    ] = None,
    resolution: Annotated[
        list[str] | None, _sensor("--resolution", "AMOUNT", "Step of the readings, in the same form.")
    ] = None,
    offset: Annotated[
        list[str] | None, _sensor("--offset", "AMOUNT", "Reading at zero, in the same form.")
    ] = None,
    sampling_rate: Annotated[
        str | None, _sensor("--sampling-rate", "RATE", "Of a record of motion (1 MHz).")
    ] = None,
    bandwidth: Annotated[
        str | None, _sensor("--bandwidth", "RATE", "Of its sensors, first-order low-pass (200 kHz), or none.")
    ] = None,
    outliers: Annotated[
        str | None, _sensor("--outliers", "SHARE", "Of readings that are wrong, such as '2 %' (0).")
    ] = None,
    exact: Annotated[
        bool,
        typer.Option("--exact", help="Begin with sensors without any error.", rich_help_panel=_SENSORS),
    ] = False,
    displacements: Annotated[
        str | None, _bench("--displacements", "LIST", "Where the armature is held, '60 um, 100 um'.")
    ] = None,
    currents: Annotated[str | None, _bench("--currents", "LIST", "Currents in the coil, '0 A, 1 A'.")] = None,
    peaks: Annotated[
        str | None, _bench("--peaks", "LIST", "Largest indentations of the load cycles.")
    ] = None,
    speeds: Annotated[
        str | None, _bench("--speeds", "LIST", "Impact speeds on the backstop, '0.2 m/s, 1 m/s'.")
    ] = None,
    duration: Annotated[
        str | None, _bench("--duration", "TIME", "Of the record after the firing (4 ms).")
    ] = None,
    before: Annotated[
        str | None, _bench("--before", "TIME", "Of the record before the firing (100 us).")
    ] = None,
    seed: Annotated[str | None, typer.Option(metavar="N", help="Of the random numbers (0).")] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that are there.")] = False,
) -> None:
    """Measure a hammer in a synthetic laboratory, with the errors of real sensors.

    The tables are those that `printhammer fit` reads; what was done stands in their comments.
    """
    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import announce_compiling, console, load_checked
    from printhammer.identify.bench.laboratory import measure as measured

    kinds, paths = _places(kind, out, Path(hammer), force)
    chosen = {
        "noise": noise,
        "resolution": resolution,
        "offset": offset,
        "sampling_rate": sampling_rate,
        "bandwidth": bandwidth,
        "outliers": outliers,
        "exact": exact or None,
    }
    bench = {
        "displacements": displacements,
        "currents": currents,
        "peaks": peaks,
        "speeds": speeds,
        "duration": duration,
        "before": before,
    }
    settings, options = _settings(kinds, chosen), _options(kinds, bench)
    number = whole(seed, "seed") or 0
    loaded = load_checked(hammer)
    if kind == ALL:
        kinds = _possible(kinds, loaded)
    announce_compiling()
    done = {one: measured(one, loaded, sensor=settings[one], seed=number, **options[one]) for one in kinds}
    if kind == ALL and out is not None:
        from printhammer.support.outputs import make_folder

        make_folder(out)
    screen = console()
    for one, table in done.items():
        table.write(paths[one])
        screen.print(_told(table), soft_wrap=True)
        say_written(screen, paths[one])


def _places(kind: str, out: Path | None, hammer: Path, force: bool) -> tuple[list[str], dict[str, Path]]:
    """Return what is to be measured, and the files to write."""
    from printhammer.errors import InputError
    from printhammer.identify.bench.laboratory import KINDS
    from printhammer.support.outputs import check_outputs

    if kind not in (*KINDS, ALL):
        raise InputError(f"KIND = {kind!r}, expected one of {', '.join((*KINDS, ALL))}")
    if out is None:
        what = "a folder" if kind == ALL else "a file"
        raise InputError(f"--out is missing, expected {what} for the measurements")
    if kind != ALL:
        if out.suffix.lower() != ".csv":
            raise InputError(f"--out {out}: expected a name that ends in .csv")
        paths = {kind: out}
        check_outputs(paths.values(), [hammer])
    else:
        if out.exists() and not out.is_dir():
            raise InputError(f"--out {out}: expected a folder, this is a file")
        paths = {one: out / f"{one}.csv" for one in KINDS}
        if out.is_dir():
            check_outputs(paths.values(), [hammer])
    for path in paths.values():
        if path.exists() and not force:
            raise InputError(f"--out {path}: expected a new file, this one is there; --force writes over it")
    return list(paths), paths


def _settings(kinds: list[str], chosen: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the settings of the sensors of each kind; a setting must belong to one of them."""
    from printhammer.errors import InputError
    from printhammer.identify.bench.laboratory import SENSORS, SI
    from printhammer.identify.bench.sensor_settings import PARTS, applicable, by_quantity

    known = {name: SI[name] for kind in kinds for name in SENSORS[kind].channels}
    recorded = [kind for kind in kinds if SENSORS[kind].sampling_rate is not None]
    given = {name: value for name, value in chosen.items() if value is not None}
    for part in PARTS:
        if part in given:
            given[part] = by_quantity(given[part], part, known)
    for name in ("sampling_rate", "bandwidth"):
        if name in given and not recorded:
            flag = name.replace("_", "-")
            raise InputError(f"--{flag} {given[name]} is given with {kinds[0]}, expected it with motion only")
    return {kind: applicable(SENSORS[kind], given) for kind in kinds}


def _options(kinds: list[str], bench: dict[str, str | None]) -> dict[str, dict[str, Any]]:
    """Return what is measured where, for each kind; an option must belong to one of them."""
    from inspect import signature

    from printhammer.drive.input import read_number
    from printhammer.errors import InputError
    from printhammer.identify.bench.benches import BENCHES

    accepted = {kind: set(signature(BENCHES[kind]).parameters) for kind in kinds}
    found: dict[str, dict[str, Any]] = {kind: {} for kind in kinds}
    for name, text in bench.items():
        if text is None:
            continue
        owners = [kind for kind in kinds if name in accepted[kind]]
        if not owners:
            right = ", ".join(kind for kind, make in BENCHES.items() if name in signature(make).parameters)
            raise InputError(f"--{name} {text} is given with {kinds[0]}, expected it with {right} only")
        value: Any = (
            text
            if name in _TIMES
            else [read_number(part.strip(), _LISTS[name], f"--{name}") for part in text.split(",")]
        )
        for kind in owners:
            found[kind][name] = value
    return found


def _possible(kinds: list[str], hammer: Hammer) -> list[str]:
    """Return what the hammer has; say what it lacks."""
    from printhammer.cli.terminal import say

    needed = {kind: hammer.waveform if kind == "motion" else hammer.parts.get(kind) for kind in kinds}
    for kind, part in needed.items():
        if part is None:
            what = "waveform" if kind == "motion" else kind
            say(f"{hammer.path}: the hammer has no {what}, {kind} is left out")
    return [kind for kind, part in needed.items() if part is not None]


def _told(table: Measurement) -> str:
    from rich.markup import escape

    rows = len(next(iter(table.values.values())))
    wrong = f", {len(table.outliers)} of them wrong" if len(table.outliers) else ""
    return f"[bold]{table.kind}[/bold]  {escape(table.comments['measured'])}: {rows} rows{wrong}"
