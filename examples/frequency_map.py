"""
Frequency-time map
==================

A frequency-time map shows bursts of nine pulses at many firing rates: time to the
right, rate upward, displacement as colour. In Hendriks (1983), figure 9 shows how the
performance of an actuator degrades at high rates.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
chart = ph.frequency_map(hammer, np.linspace(500.0, 2500.0, 401), times=600)

figure, axes = plt.subplots()
picture = axes.pcolormesh(
    1e3 * chart.time, chart.rate, 1e6 * chart.displacement, rasterized=True
)
bar = figure.colorbar(picture, label="displacement (µm)")
for place in (hammer.position, hammer.front):
    bar.ax.axhline(1e6 * place, color="white")
axes.set(
    xlabel="time from the first firing (ms)",
    ylabel="rate (Hz)",
    title="Nine pulses; white on the scale: backstop and pack",
)

# %%
# Each bright band is one excursion into the pack. At low rates there are nine equal
# excursions. At higher rates their times vary, and some are missing: lost dots. From
# about 2.2 kHz on, the armature no longer returns to the backstop.
#
# The map is an xarray.Dataset, from which further quantities can be computed.

lost = ~chart.struck
first = chart.rate[lost.any("firing")].values[0]
print(f"lost dots: {int(lost.sum())} of {lost.size}, first at {first:.0f} Hz")
for name in ("flight_time", "peak_force"):
    slow = chart[name].sel(rate=500.0)
    print(f"{name} at 500 Hz: {float(slow.min()):.4g} to {float(slow.max()):.4g}")

# %%
# The next figure shows flight times and forces against rate, with a point for each
# firing. According to the abstract of the paper, the first effects are variations of
# flight time and print force.

figure, (above, below) = plt.subplots(2, 1, sharex=True)
later = chart.isel(firing=slice(1, None))
above.plot(chart.rate, 1e6 * later.flight_time, ".", color="C0", markersize=1.5)
above.set(ylabel="flight time (µs)", title="Second to ninth dot")
below.plot(chart.rate, later.peak_force, ".", color="C1", markersize=1.5)
below.axhline(chart.peak_force[0, 0], color="0.6", linewidth=0.8)
below.set(xlabel="rate (Hz)", ylabel="peak force (N)")

plt.show()
