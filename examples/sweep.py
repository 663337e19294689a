"""
A sweep that can be interrupted
===============================

The firing rates at which dots are lost depend on the position of the paper. A sweep
simulates a grid of both and saves the results in a store; if it is interrupted, the
same call resumes it.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

spec = {
    "format": 1,
    "hammer": "hendriks-1983",
    "drive": {"train": {"pulses": 9}},
    "axis": [
        {"key": "pack.front", "low": "6.5 mil", "high": "10.5 mil", "count": 41},
        {"key": "drive.rate", "low": "500 Hz", "high": "2 kHz", "count": 151},
    ],
    "outputs": {"scalars": ["lost_dots", "flight_time_spread"]},
}

folder = Path(tempfile.mkdtemp())
found = ph.sweep(spec, folder / "results.zarr")
print(found)

# %%
# The result is a Dataset over the axes of the grid. A member whose run ended early
# would have a status other than 0.

lost = found.lost_dots.where(found.status == 0)
spread = (1e6 * found.flight_time_spread).where(found.status == 0)
print(f"{int((found.status == 0).sum())} of {found.status.size} runs got to their end")

rates, fronts = found.rate.values, 1e6 * found.pack_front.values
figure, axes = plt.subplots(
    1, 2, sharex=True, sharey=True, figsize=(8.0, 3.6), layout="constrained"
)
limits = {"vmin": -0.5, "vmax": 9.5, "cmap": plt.get_cmap("cividis", 10)}
picture = axes[0].pcolormesh(rates, fronts, lost, rasterized=True, **limits)
figure.colorbar(picture, ax=axes[0], label="dots lost of nine", ticks=range(10))
picture = axes[1].pcolormesh(
    rates,
    fronts,
    np.log10(spread),
    rasterized=True,
    cmap="cividis",
    vmin=-1.0,
    vmax=3.0,
)
bar = figure.colorbar(picture, ax=axes[1], label="spread of the flight times (µs)")
bar.set_ticks([-1, 0, 1, 2, 3], labels=["0.1", "1", "10", "100", "1000"])
for panel in axes:
    panel.axhline(203.2, color="w", linewidth=0.8)
    panel.set_xlabel("rate (Hz)")
axes[0].set_ylabel("front of the pack (µm)")
figure.suptitle("Nine-pulse bursts; white: the pack front of the paper")

# %%
# The store is a folder of plain Zarr arrays with units and provenance in their
# attributes; ``xarray.open_zarr`` opens it as well. Calling `sweep` again with a
# complete store computes nothing.

again = ph.sweep(spec, folder / "results.zarr")
print(again.identical(found))

plt.show()
