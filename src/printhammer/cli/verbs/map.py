"""The verb `map`: displacement against time and firing rate, computed, or beside a measured one."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import PICTURES, Answer, Content, Job, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_BURST: Final = "Bursts"
_FEW: Final = 6
_count = partial(opt.whole, panel=_BURST)


@verb(
    "map",
    "printhammer map hendriks-1983 --from '500 Hz' --to '2 kHz' --rates 64 --times 256",
    {
        "pulses": _count("Firings at each rate.", default=9),
        "overlap": opt.overlapping(_BURST),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("Data"),
)
def map_(
    job: Job,
    hammer: Hammer = opt.FIRED,
    lowest: float | None = opt.quantity(
        "Hz", "RATE", "Lowest rate (500 Hz).", flag="--from", panel=_BURST, positive=True
    ),
    highest: float | None = opt.quantity(
        "Hz", "RATE", "Highest rate (2 kHz).", flag="--to", panel=_BURST, positive=True
    ),
    rates: int | None = _count("Number of rates (512)."),
    times: int | None = _count("Number of times (512)."),
    measured: Path | None = opt.source(
        "Displacement records to compare with, CSV or NetCDF; rates and times are then theirs unless given."
    ),
    figure: str | None = opt.choice("8|9", "Which figure of the paper a picture is like (9)."),
    **passed: Any,
) -> Answer:
    """Fire bursts at many rates and map the displacement against time and rate, as Figs. 8 and 9.

    Ends with status 1 where a run stopped before its end; its rate is named.
    """
    from printhammer.maps.frequency import frequency_map, summary_of
    from printhammer.maps.measured import load_measured_map
    from printhammer.results.files import save_dataset

    drawn = _number_of(figure, job.outputs, measured)
    beside = None if measured is None else load_measured_map(measured)
    grid, moments = _axes(beside, lowest, highest, rates, times)
    with job.counting("rates") as tell:
        chart = frequency_map(hammer, grid, times=moments, progress=tell, **passed)
    return Answer(
        render(summary_of(chart, beside)),
        note=f"computed in {job.seconds:.2g} s",
        files={"out": Content(partial(save_dataset, chart), partial(_drawn, hammer, chart, beside, drawn))},
        complaints=_complaints(chart),
    )


def _number_of(figure: str | None, outputs: list[Path], measured: Path | None) -> int:
    """Return the number of the figure that is drawn."""
    if figure is None:
        return 9
    if not any(path.suffix.lower() in PICTURES for path in outputs):
        raise InputError(f"--figure {figure}: expected a picture among the files of --out", key="--figure")
    if measured is not None:
        raise InputError(
            f"--figure {figure} is given beside --measured {measured}",
            key="--figure",
            expected="one or the other",
        )
    return int(figure)


def _axes(
    beside: xr.Dataset | None, low: float | None, high: float | None, rates: int | None, times: int | None
) -> tuple[FloatArray, FloatArray | int]:
    """Return the rates, Hz, and the times, s, or their number; those of a measured map unless given."""
    import numpy as np

    from printhammer.maps.frequency import HIGHEST, LOWEST, MOST_CELLS, RATES, TIMES

    moments: FloatArray | int = TIMES if times is None else times
    if beside is not None and times is None:
        known = beside["time"].values
        moments = known[known >= 0.0]
        if len(moments) < 2:
            raise InputError(
                f"--measured {beside.attrs['source']}: {len(moments)} times from the first firing on",
                key="--measured",
                expected="at least 2",
            )
    if beside is not None and low is None and high is None and rates is None:
        return beside["rate"].values, moments
    low, high = LOWEST if low is None else low, HIGHEST if high is None else high
    count = RATES if rates is None else rates
    if not 1 <= count <= MOST_CELLS:
        raise InputError(f"--rates {count}: expected a whole number from 1 to {MOST_CELLS}", key="--rates")
    if high < low or (high == low and count > 1):
        raise InputError(
            f"--from {low:.9g} Hz and --to {high:.9g} Hz: expected the second to be the higher one",
            key="--from",
        )
    return np.linspace(low, high, count), moments


def _complaints(chart: xr.Dataset) -> list[str]:
    """Name the runs that did not reach their end."""
    from printhammer.maps.layout import failed_rates

    complaints = []
    for status, rates in failed_rates(chart).items():
        named = ", ".join(f"{rate:.6g} Hz" for rate in rates[:_FEW])
        more = f" and {len(rates) - _FEW} more" if len(rates) > _FEW else ""
        count = f"{len(rates)} of {chart['rate'].size}"
        complaints.append(f"{status}: {count} runs did not reach their end, at {named}{more}")
    return complaints


def _drawn(hammer: Hammer, chart: xr.Dataset, beside: xr.Dataset | None, number: int) -> Figure:
    from printhammer.figures import FIGURES

    if beside is None:
        return FIGURES[number].draw(hammer, chart=chart)
    from printhammer.figures.paper.maps import compare_maps

    return compare_maps(chart, beside)
