"""The verb `map`: displacement against time and firing rate, optionally beside a measured map."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import PICTURES, Answer, Content, Job, away_from_rest, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_BURST: Final = "Bursts"
_FEW: Final = 6  # Largest number of rates named in a warning; arbitrary
_count = partial(opt.whole, panel=_BURST)


@verb(
    "map",
    "printhammer map hendriks-1983 --from '500 Hz' --to '2 kHz' --rates 64 --times 256",
    {
        "pulses": _count("Number of firings at each rate.", default=9),
        "overlap": opt.overlapping(_BURST),
        "tolerance": opt.TOLERANCE,
        "threads": opt.THREADS,
    },
    out=opt.results("the displacement map"),
)
def map_(
    job: Job,
    hammer: Hammer = opt.FIRED,
    lowest: float | None = opt.quantity(
        "Hz",
        "RATE",
        "Lowest rate (default: 500 Hz; lower for a slow device).",
        flag="--from",
        panel=_BURST,
        positive=True,
    ),
    highest: float | None = opt.quantity(
        "Hz",
        "RATE",
        "Highest rate (default: 2 kHz; lower for a slow device).",
        flag="--to",
        panel=_BURST,
        positive=True,
    ),
    rates: int | None = _count("Number of rates (default: 512)."),
    times: int | None = _count("Number of points on the time axis of the map (default: 512)."),
    measured: Path | None = opt.source(
        "Measured map to compare with (CSV or NetCDF); its rates and times become the defaults for the"
        " computed map."
    ),
    columns: str | None = opt.text(
        "COLUMNS",
        "Column numbers (from 1) of the measured table, with factors, e.g. 'time=1, 500 Hz=2*50 um/V'"
        " (default: from the file TABLE.toml beside the table, else from its heading).",
    ),
    figure: str | None = opt.choice("8|9", "Figure of the paper whose style the plot follows (default: 9)."),
    **passed: Any,
) -> Answer:
    """Map the displacement against time and firing rate, as in Figs. 8 and 9 of the paper.

    The exit status is 1 if a run stopped early; the message names its rate.
    """
    from printhammer.maps.frequency import frequency_map, summary_of
    from printhammer.maps.measured import load_measured_map
    from printhammer.results.files import save_dataset

    drawn = _number_of(figure, job.outputs, measured)
    if columns is not None and measured is None:
        raise InputError(
            f"--columns {columns} is given", key="--columns", expected="--columns with --measured only"
        )
    beside = None if measured is None else load_measured_map(measured, columns=columns)
    grid, moments = _axes(hammer, beside, lowest, highest, rates, times)
    with job.progress_bar("rates") as tell:
        chart = frequency_map(hammer, grid, times=moments, progress=tell, **passed)
    return Answer(
        [*render(summary_of(chart, beside)), *away_from_rest(hammer)],
        note=f"computed in {job.seconds:.2g} s",
        files={"out": Content(partial(save_dataset, chart), partial(_drawn, hammer, chart, beside, drawn))},
        complaints=_complaints(chart),
    )


def _number_of(figure: str | None, outputs: list[Path], measured: Path | None) -> int:
    """Return the number of the figure of the paper whose style the picture follows."""
    if figure is None:
        return 9
    if not any(path.suffix.lower() in PICTURES for path in outputs):
        raise InputError(f"--figure {figure}: expected a picture among the files of --out", key="--figure")
    if measured is not None:
        raise InputError(
            f"--figure {figure} with --measured {measured}",
            key="--figure",
            expected="only one of these options",
        )
    return int(figure)


def _axes(
    hammer: Hammer,
    beside: xr.Dataset | None,
    low: float | None,
    high: float | None,
    rates: int | None,
    times: int | None,
) -> tuple[FloatArray, FloatArray | int]:
    """Return the rates [Hz], and the times [s] or the number of times; a measured map supplies defaults."""
    import numpy as np

    from printhammer.maps.frequency import MOST_CELLS, RATES, TIMES, default_rates

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
    if low is None or high is None:
        lowest, highest = default_rates(hammer, count=2).tolist()
        low, high = lowest if low is None else low, highest if high is None else high
    count = RATES if rates is None else rates
    if not 1 <= count <= MOST_CELLS:
        raise InputError(f"--rates {count}: expected a whole number from 1 to {MOST_CELLS}", key="--rates")
    if high < low or (high == low and count > 1):
        raise InputError(
            f"--from {low:.9g} Hz and --to {high:.9g} Hz: expected --to above --from",
            key="--from",
        )
    return np.linspace(low, high, count), moments


def _complaints(chart: xr.Dataset) -> list[str]:
    """Return one warning for each status with which runs stopped early; the warning names their rates."""
    from printhammer.maps.frequency import failed_rates

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
