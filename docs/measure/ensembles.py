"""Measure the errors of ensemble members against the reference, up to the horizon, for several tolerances.

The members have forty rates from 500 to 2000 Hz, nine pulses each, and 512 output times. The table shows
the largest error of the displacement of a member up to its horizon, as a fraction of the stroke, for
states in double precision and for figures in single precision.
"""

from __future__ import annotations

import numpy as np
from measured import MOTION, Cell, Column, write
from tests.oracle.integrator import horizon, reference

import printhammer as ph
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.problem import TOLERANCE

PULSES = 9
GRID = np.linspace(0.0, 17e-3, 512)


def main() -> None:
    """Measure the table."""
    hammer = ph.load("hendriks-1983")
    drives = [
        ph.PulseTrain(hammer.waveform, rate=rate, pulses=PULSES) for rate in np.linspace(500.0, 2000.0, 40)
    ]
    ends = [float(drive.times[-1]) + 1e-3 for drive in drives]
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
    peak = single.peak_after(0)
    if peak is None:
        raise SystemExit("the hammer does not move")
    stroke = peak[1] - hammer.origin
    times, exact = [], []
    for drive, end in zip(drives, ends, strict=True):
        inside = GRID[: np.searchsorted(GRID, end, side="right")]
        until = horizon(hammer, drive, end, inside, stroke=stroke)
        inside = inside[inside <= until]
        times.append(inside)
        exact.append(reference(hammer, drive, float(inside[-1]), tolerance=1e-14, times=inside).x)
    rows: list[list[Cell]] = []
    for tolerance in (1e-6, DISPLAY_TOLERANCE, 1e-7, 1e-8, 1e-9, 2e-10, TOLERANCE):
        found = ph.Ensemble(hammer, drives, ends, tolerance=tolerance).run(strobes=times, times=GRID)
        cells: list[Cell] = [tolerance]
        for values in (found.strobes.x, found.x):
            errors = [
                np.abs(row[: len(truth)] - truth).max() / stroke
                for row, truth in zip(values, exact, strict=True)
            ]
            cells += [float(np.median(errors)), float(np.percentile(errors, 95.0))]
        rows.append(cells)
    columns = [Column(name="tolerance", format=".0e")]
    columns += [
        Column(name=f"{kind}, {share}", format=".1e")
        for kind in ("states", "picture")
        for share in ("median", "95 %")
    ]
    settings = {"members": len(drives), "pulses": PULSES, "times": GRID.size}
    write("ensembles", columns, rows, settings, (*MOTION, "tests/oracle"))


if __name__ == "__main__":
    main()
