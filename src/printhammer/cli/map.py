"""The verb `map`: displacement against time and firing rate, computed, or beside a measured one."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from printhammer.cli.numbers import number, whole
from printhammer.cli.run import HAMMER, HammerArgument, Overlap

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

EXAMPLE: Final = "Example: printhammer map hendriks-1983 --from '500 Hz' --to '2 kHz' --rates 64 --times 256"

_BURST: Final = "Bursts"
_FEW: Final = 6


def _burst(flag: str, metavar: str, text: str) -> Any:
    return typer.Option(flag, metavar=metavar, help=text, rich_help_panel=_BURST)


def map_(
    hammer: HammerArgument = HAMMER,
    lowest: Annotated[str | None, _burst("--from", "RATE", "Lowest rate (500 Hz).")] = None,
    highest: Annotated[str | None, _burst("--to", "RATE", "Highest rate (2 kHz).")] = None,
    rates: Annotated[str | None, _burst("--rates", "N", "Number of rates (512).")] = None,
    times: Annotated[str | None, _burst("--times", "N", "Number of times (512).")] = None,
    pulses: Annotated[str | None, _burst("--pulses", "N", "Firings at each rate (9).")] = None,
    overlap: Annotated[
        Overlap, _burst("--overlap", "add|replace", "Overlapping pulses add up, or the latest replaces.")
    ] = Overlap.ADD,
    tolerance: Annotated[str | None, typer.Option(metavar="X", help="Error allowed in one step.")] = None,
    threads: Annotated[str | None, typer.Option(metavar="N", help="Threads (all cores).")] = None,
    measured: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Displacement records to compare with, CSV or NetCDF; rates and times are then theirs"
            " unless given.",
        ),
    ] = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Data (.nc, .zarr, .csv, .parquet, .json) or picture (.svg, .png, .pdf); repeatable.",
        ),
    ] = None,
    figure: Annotated[
        str | None, typer.Option(metavar="8|9", help="Which figure of the paper a picture is like (9).")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that are there.")] = False,
) -> None:
    """Fire bursts at many rates and map the displacement against time and rate, as Figs. 8 and 9.

    Ends with status 1 where a run stopped before its end; its rate is named.
    """
    from printhammer.cli import run_files
    from printhammer.cli.progress import counting
    from printhammer.cli.saving import write_found
    from printhammer.cli.terminal import announce_compiling, console, load_checked
    from printhammer.drive.trains import PulseTrain
    from printhammer.errors import InputError
    from printhammer.maps.frequency import frequency_map
    from printhammer.maps.measured import load_measured_map
    from printhammer.results.files import save_dataset
    from printhammer.run.problem import TOLERANCE
    from printhammer.support.outputs import check_outputs

    wanted = out or []
    number_of_figure = _checked(wanted, figure, measured, force)
    read = [Path(hammer), *([measured] if measured is not None else [])]
    check_outputs(wanted, read)
    loaded = load_checked(hammer)
    if loaded.waveform is None:
        raise InputError(f"{loaded.path}: the hammer has no [waveform] to fire, expected one")
    check_outputs(wanted, run_files.tables(loaded, Path(hammer), PulseTrain(loaded.waveform), None))
    beside = None if measured is None else load_measured_map(measured)
    grid, moments = _axes(beside, lowest, highest, whole(rates, "rates"), whole(times, "times"))
    announce_compiling()
    screen = console()
    start = perf_counter()
    options: dict[str, Any] = {
        "pulses": 9 if pulses is None else whole(pulses, "pulses"),
        "times": moments,
        "tolerance": TOLERANCE if tolerance is None else number(tolerance, "tolerance"),
        "threads": whole(threads, "threads"),
        "overlap": overlap.value,
    }
    with counting("rates") as tell:
        chart = frequency_map(loaded, grid, progress=tell, **options)
    _show(chart, beside, perf_counter() - start, loaded)
    write_found(
        screen, wanted, partial(_drawn, loaded, chart, beside, number_of_figure), partial(save_dataset, chart)
    )
    if _complaints(chart):
        raise typer.Exit(1)


def _checked(wanted: list[Path], figure: str | None, measured: Path | None, force: bool) -> int:
    """Check the names of the files that are to be written; return the number of the figure that is drawn."""
    from printhammer.cli.saving import PICTURES, check_endings
    from printhammer.errors import InputError
    from printhammer.results.files import ENDINGS

    check_endings(wanted, (*ENDINGS, *PICTURES))
    for path in wanted:
        if path.exists() and not force:
            raise InputError(f"--out {path}: expected a new file, this one is there; --force writes over it")
    if figure is None:
        return 9
    if figure not in ("8", "9"):
        raise InputError(f"--figure {figure}: expected 8 or 9")
    if not any(path.suffix.lower() in PICTURES for path in wanted):
        raise InputError(f"--figure {figure}: expected a picture among the files of --out")
    if measured is not None:
        raise InputError(
            f"--figure {figure} is given beside --measured {measured}, expected one or the other"
        )
    return int(figure)


def _axes(
    beside: xr.Dataset | None,
    lowest: str | None,
    highest: str | None,
    rates: int | None,
    times: int | None,
) -> tuple[FloatArray, FloatArray | int]:
    """Return the rates, Hz, and the times, s, or their number; those of a measured map unless given."""
    import numpy as np

    from printhammer.drive.input import read_positive
    from printhammer.errors import InputError
    from printhammer.maps.frequency import HIGHEST, LOWEST, MOST_CELLS, RATES, TIMES

    moments: FloatArray | int = TIMES if times is None else times
    if beside is not None and times is None:
        known = beside["time"].values
        moments = known[known >= 0.0]
        if len(moments) < 2:
            raise InputError(
                f"--measured {beside.attrs['source']}: {len(moments)} times from the first firing on,"
                " expected at least 2"
            )
    if beside is not None and lowest is None and highest is None and rates is None:
        return beside["rate"].values, moments
    low = LOWEST if lowest is None else read_positive(lowest, "Hz", "--from")
    high = HIGHEST if highest is None else read_positive(highest, "Hz", "--to")
    count = RATES if rates is None else rates
    if not 1 <= count <= MOST_CELLS:
        raise InputError(f"--rates {count}: expected a whole number from 1 to {MOST_CELLS}")
    if high < low or (high == low and count > 1):
        raise InputError(
            f"--from {low:.9g} Hz and --to {high:.9g} Hz: expected the second to be the higher one"
        )
    return np.linspace(low, high, count), moments


def _show(chart: xr.Dataset, beside: xr.Dataset | None, seconds: float, hammer: Hammer) -> None:
    """Tell what was computed: size, dots, the first lost one, the difference from a measured map."""
    import numpy as np
    from rich.markup import escape

    from printhammer.cli.terminal import console, honesty
    from printhammer.maps.frequency import rms_difference
    from printhammer.units import from_si

    screen = console()
    rates, time = chart["rate"].values, chart["time"].values
    screen.print(f"[bold]{escape(hammer.name)}[/bold]  {honesty(hammer)}")
    screen.print(
        f"map       {rates.size} rates from {rates[0]:g} to {rates[-1]:g} Hz, {chart.attrs['pulses']} pulses,"
        f" {time.size} times up to {from_si(float(time[-1]), 's', 'ms'):.4g} ms; computed in {seconds:.2g} s"
    )
    fired = np.isfinite(chart["fired_at"].values)
    lost = fired & ~chart["struck"].values
    text = f"dots      {int(fired.sum())} fired, {int((fired & ~lost).sum())} struck, {int(lost.sum())} lost"
    if lost.any():
        row = int(np.argmax(lost.any(axis=1)))
        text += f"; the first at {rates[row]:.6g} Hz, firing {int(np.argmax(lost[row])) + 1}"
    screen.print(text)
    failed = int((chart["status"].values != 0).sum())
    screen.print(
        f"status    {'ok' if not failed else f'{failed} of {rates.size} runs did not reach their end'}"
    )
    if beside is not None:
        both, difference = rms_difference(chart, beside)
        known = difference[np.isfinite(difference)]
        told = (
            f"RMS {from_si(float(np.median(known)), 'm', 'um'):.3g} µm (median of {known.size} rates),"
            f" {from_si(float(known.max()), 'm', 'um'):.3g} µm at {both[np.nanargmax(difference)]:.6g} Hz"
            if known.size
            else "not known, no rate is in both maps"
        )
        screen.print(f"measured  {beside['rate'].size} rates; difference {told}")


def _complaints(chart: xr.Dataset) -> int:
    """Name the runs that did not reach their end on the standard error; return their number."""
    from printhammer.cli.terminal import complain
    from printhammer.maps.layout import failed_rates

    count = 0
    for status, rates in failed_rates(chart).items():
        named = ", ".join(f"{rate:.6g} Hz" for rate in rates[:_FEW])
        more = f" and {len(rates) - _FEW} more" if len(rates) > _FEW else ""
        complain(
            f"{status}: {len(rates)} of {chart['rate'].size} runs did not reach their end, at {named}{more}"
        )
        count += len(rates)
    return count


def _drawn(hammer: Hammer, chart: xr.Dataset, beside: xr.Dataset | None, number: int) -> Figure:
    from printhammer.figures import FIGURES

    if beside is None:
        return FIGURES[number].draw(hammer, chart=chart)
    from printhammer.figures.map_comparison import compare_maps

    return compare_maps(chart, beside)
