"""The verb `measure`: synthetic measurements of a hammer, in the format of laboratory tables."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Job, verb
from printhammer.cli.terminal import say
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

ALL: Final = "all"
_LISTS: Final = {"displacements": "m", "currents": "A", "peaks": "m", "speeds": "m/s"}
_TEXTS: Final = ("duration", "before", "locked")
_SENSORS: Final = "Sensors (default: typical laboratory sensors)"
_sensor = partial(opt.text, panel=_SENSORS)
_bench = partial(opt.text, panel="Bench")


@verb(
    "measure",
    "printhammer measure magnet hendriks-1983 --out magnet.csv --noise 'force=1 %' --outliers '2 %'",
    {
        "noise": _sensor(
            "AMOUNT",
            "Standard deviation of readings: 'force=0.1 N', 'force=0.5 %' of full scale, or '0.2 um' for all"
            " lengths; repeatable.",
            many=True,
        ),
        "resolution": _sensor(
            "AMOUNT", "Quantisation step of readings, in the format of --noise.", many=True
        ),
        "offset": _sensor("AMOUNT", "Zero offset of readings, in the format of --noise.", many=True),
        "sampling_rate": _sensor("RATE", "Sampling rate of records of motion or current (default: 1 MHz)."),
        "bandwidth": _sensor(
            "RATE",
            "Bandwidth of motion and current sensors, a first-order low-pass (default: 200 kHz), or 'none'.",
        ),
        "outliers": _sensor("SHARE", "Fraction of readings that are outliers, e.g. '2 %' (default: 0)."),
        "displacements": _bench("LIST", "Displacements at which the armature is held, e.g. '60 um, 100 um'."),
        "currents": _bench("LIST", "Currents in the coil, e.g. '0 A, 1 A'."),
        "peaks": _bench("LIST", "Peak indentations of the load cycles, e.g. '20 um, 60 um'."),
        "speeds": _bench("LIST", "Impact speeds on the backstop, e.g. '0.2 m/s, 1 m/s'."),
        "duration": _bench(
            "TIME", "Duration of a record after the firing (default: 4 ms, longer for a slow device)."
        ),
        "before": _bench("TIME", "Duration of a record before the firing (default: 100 us)."),
        "locked": _bench(
            "LENGTH", "Displacement at which the armature is locked in a record of the current."
        ),
    },
)
def measure(
    job: Job,
    kind: str = opt.argument(
        "KIND", "Kind of measurement: magnet, spring, pack, backstop, motion, current, or all.", default=...
    ),
    hammer: Hammer = opt.HAMMER,
    out: Path | None = opt.folder("Output file (.csv), or output folder if KIND is all.", metavar="FILE"),
    exact: bool = opt.switch(
        "Use error-free sensors, except for the errors set by other options.", panel=_SENSORS
    ),
    seed: int = opt.whole("Seed of the random number generator.", default=0),
    **passed: Any,
) -> Answer:
    """Generate synthetic measurements of a hammer, with the errors of real sensors.

    `printhammer fit` reads the tables; their comments record the bench and the sensors.
    """
    from printhammer.identify.bench.laboratory import measure as measured

    kinds, paths = _output_files(kind, out, job)
    bench = {name: passed.pop(name) for name in (*_LISTS, *_TEXTS) if name in passed}
    settings = _settings(kinds, {**passed, **opt.given(exact=exact or None)})
    options = _options(kinds, bench)
    if kind == ALL:
        kinds = _possible(kinds, hammer)
    tables = {
        each: measured(each, hammer, sensor=settings[each], seed=seed, **options[each]) for each in kinds
    }
    if kind == ALL and out is not None:
        from printhammer.support.files import make_folder

        make_folder(out)
    for each, table in tables.items():
        table.write(paths[each])
        rows = len(next(iter(table.values.values())))
        wrong = f", {len(table.outliers)} of them with gross errors" if len(table.outliers) else ""
        text = f"[bold]{table.kind}[/bold]  {escape(table.comments['measured'])}: {rows} rows{wrong}"
        job.screen.print(text, soft_wrap=True)
        job.wrote(paths[each])
    return Answer()


def _output_files(kind: str, out: Path | None, job: Job) -> tuple[list[str], dict[str, Path]]:
    """Check the output path; return the requested kinds of measurement, and the file of each kind."""
    from printhammer.identify.bench.laboratory import KINDS
    from printhammer.support.files import check_outputs

    if kind not in (*KINDS, ALL):
        raise InputError.of("KIND", kind, f"one of {', '.join((*KINDS, ALL))}")
    if out is None:
        what = "a folder" if kind == ALL else "a file"
        raise InputError("--out is missing", key="--out", expected=f"{what} for the measurements")
    if kind != ALL:
        if out.suffix.lower() != ".csv":
            raise InputError(f"--out {out}: expected a name that ends in .csv", key="--out")
        paths = {kind: out}
        check_outputs(paths.values(), job.inputs)
    else:
        if out.exists() and not out.is_dir():
            raise InputError(f"--out {out}: expected a folder, not a file", key="--out")
        paths = {each: out / f"{each}.csv" for each in KINDS}
        if out.is_dir():
            check_outputs(paths.values(), job.inputs)
    job.check_new(paths.values())
    return list(paths), paths


def _settings(kinds: list[str], settings: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the sensor settings of each kind; raise InputError for a setting that applies to no kind."""
    from printhammer.identify.bench.laboratory import SENSORS, SI
    from printhammer.identify.bench.sensor import PARTS, applicable, by_quantity

    known = {name: SI[name] for kind in kinds for name in SENSORS[kind].channels}
    recorded = [kind for kind in kinds if SENSORS[kind].sampling_rate is not None]
    for part in PARTS:
        if part in settings:
            settings[part] = by_quantity(settings[part], part, known)
    for name in ("sampling_rate", "bandwidth"):
        if name in settings and not recorded:
            flag = name.replace("_", "-")
            raise InputError(
                f"--{flag} {settings[name]} is given with {kinds[0]}",
                key=f"--{flag}",
                expected="this option with motion or current only",
            )
    return {kind: applicable(SENSORS[kind], settings) for kind in kinds}


def _options(kinds: list[str], bench: dict[str, str]) -> dict[str, dict[str, Any]]:
    """Return the bench options of each kind; raise InputError for an option that applies to no kind."""
    from inspect import signature

    from printhammer.drive.input import read_number
    from printhammer.identify.bench.benches import BENCHES

    accepted = {kind: set(signature(BENCHES[kind]).parameters) for kind in kinds}
    options: dict[str, dict[str, Any]] = {kind: {} for kind in kinds}
    for name, text in bench.items():
        owners = [kind for kind in kinds if name in accepted[kind]]
        if not owners:
            right = ", ".join(kind for kind, make in BENCHES.items() if name in signature(make).parameters)
            raise InputError(
                f"--{name} {text} is given with {kinds[0]}",
                key=f"--{name}",
                expected=f"this option with {right} only",
            )
        value: Any = (
            text
            if name in _TEXTS
            else [read_number(part.strip(), _LISTS[name], f"--{name}") for part in text.split(",")]
        )
        for kind in owners:
            options[kind][name] = value
    return options


def _possible(kinds: list[str], hammer: Hammer) -> list[str]:
    """Return the kinds of measurement that the hammer allows; report kinds omitted for lack of a part."""
    waveform = hammer.waveform
    if waveform is None or waveform.unit != "V":
        kinds = [kind for kind in kinds if kind != "current"]
    shots = "motion", "current"
    needed = {kind: waveform if kind in shots else hammer.parts.get(kind) for kind in kinds}
    for kind, part in needed.items():
        if part is None:
            what = "waveform" if kind in shots else kind
            say(f"{hammer.path}: the hammer has no {what}; {kind} is omitted")
    return [kind for kind, part in needed.items() if part is not None]
