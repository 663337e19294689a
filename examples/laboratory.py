"""
A synthetic laboratory
======================

The constants of a hammer are estimated from measurements with noise. In this example,
a hammer is measured on five benches with the sensors of an ordinary laboratory, its
constants are fitted to the tables, and a hammer is built from the fitted constants.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
folder = Path(tempfile.mkdtemp())
tables = {}
for kind in ("magnet", "spring", "pack", "backstop", "motion"):
    tables[kind] = ph.measure(kind, hammer, seed=1983)
    tables[kind].write(folder / f"{kind}.csv")

# %%
# With the armature held at a series of displacements, the force of magnet and spring
# is measured at several currents, and so is the force of the spring alone. Slow load
# cycles show the hysteresis loop of the pack; rebounds show the losses in the
# backstop.

figure, axes = plt.subplots(1, 3, figsize=(10, 3.4))
panel, magnet = axes[0], tables["magnet"]
# Each row has a noisy reading of the current; the set value of the current is exact.
for current in np.unique(magnet.true["current"]):
    rows = magnet.true["current"] == current
    x, force = magnet.values["displacement"][rows], magnet.values["force"][rows]
    panel.plot(1e6 * x, force, ".", markersize=3, label=f"{current:.2g} A")
spring = tables["spring"].values
panel.plot(1e6 * spring["displacement"], spring["force"], "k.", markersize=3)
panel.axhline(0.0, color="0.6", linewidth=0.8)
panel.legend(
    fontsize="x-small",
    title="black: no magnet",
    title_fontsize="x-small",
    loc="lower right",
    ncols=2,
)
panel.set(xlabel="displacement (µm)", ylabel="force (N)", title="Magnet and spring")
panel, pack = axes[1], tables["pack"].values
panel.plot(1e6 * pack["indentation"], pack["force"], ".", markersize=3)
panel.set(xlabel="indentation (µm)", ylabel="force (N)", title="Pack")
panel, backstop = axes[2], tables["backstop"].values
speed, back = backstop["impact speed"], backstop["rebound speed"]
panel.plot(speed, back / speed, ".", markersize=4)
panel.set(xlabel="impact speed (m/s)", ylabel="restitution", title="Backstop")

# %%
# The record of one shot is sampled at 1 MHz behind a first-order low-pass of 200 kHz:
# it lags by 0.8 µs, and therefore by 1 µm where the armature is fast. The fit
# includes this lag.

motion = tables["motion"].values
exact = ph.measure("motion", hammer, sensor={"exact": True}).values
figure, axes = plt.subplots(1, 2, figsize=(10, 3.4))
for panel, (begin, end) in zip(axes, ((-0.1, 2.0), (0.29, 0.36)), strict=True):
    time = 1e3 * motion["time"]
    shown = (time >= begin) & (time <= end)
    style = {"markersize": 1.0 if end > 1.0 else 4.0}
    panel.plot(time[shown], 1e6 * motion["displacement"][shown], ".", **style)
    panel.plot(time[shown], 1e6 * exact["displacement"][shown], linewidth=0.8)
    panel.set(xlabel="time (ms)", ylabel="displacement (µm)")
axes[0].set_title("Record of one shot, and what was there")
axes[1].set_title("Its first contact with the pack")

# %%
# The static constants are fitted first, each from its own table; the record then
# determines the mass, and refines the static constants. Since the true values are
# known here, the intervals can be verified.

fits = [
    ph.fit(
        "magnet", folder / "magnet.csv", hammer=hammer, spring=folder / "spring.csv"
    ),
    ph.fit("pack", folder / "pack.csv", hammer=hammer),
    ph.fit("backstop", folder / "backstop.csv", hammer=hammer),
]
built = hammer.replace("mass", "0.5 g")  # initial guess
for fit in fits:
    built = fit.into(built)
record = ph.fit("motion", folder / "motion.csv", hammer=built)
built = record.into(built)

figure, panel = plt.subplots()
static = {key: one for fit in fits for key, one in fit.constants.items() if one.in_file}
for line, (key, found) in enumerate(record.constants.items()):
    true = hammer.mass if key == "mass" else hammer.constants[key].si
    for constant, shift, colour in (
        (static.get(key), 0.15, "0.6"),
        (found, -0.15, "C0"),
    ):
        if constant is None:
            continue
        low, high = (100.0 * (end / true - 1.0) for end in constant.interval)
        panel.plot([low, high], [line + shift] * 2, color=colour, linewidth=3)
    print(f"{key}: {found.value:.5g} {found.unit}, true {true:.5g}")
panel.axvline(0.0, color="k", linewidth=0.8)
panel.set_yticks(range(len(record.constants)), list(record.constants))
panel.invert_yaxis()
panel.set(
    xlabel="distance from the true value (%)",
    title="95 % intervals: from one table (grey), from all (blue)",
)

# %%
# The hammer built from the fitted constants prints its dot at the same time as the
# measured hammer.

for one in (hammer, built):
    dot = ph.simulate(one, ph.PulseTrain(hammer.waveform)).dots[0]
    print(f"{1e6 * dot.flight_time:.2f} µs, {dot.peak_force:.2f} N")

plt.show()
