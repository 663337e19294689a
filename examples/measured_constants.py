"""
Constants from measurements
===========================

Like the author of the paper, this example measures forces, load cycles and rebounds,
and fits the constants of the hammer to them. The measurements are made in a synthetic
laboratory, so that the true values are known. The force sensor has a noise of 0.5 %,
the displacement sensor of 0.2 um, and one reading in fifty is an outlier.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
folder = Path(tempfile.mkdtemp())
for kind in ("magnet", "spring", "pack", "backstop"):
    table = ph.measure(kind, hammer, sensor={"outliers": "2 %"}, seed=7)
    table.write(folder / f"{kind}.csv")

# %%
# The combined force of magnet and spring does not distinguish the largest magnetic
# force F0 from the force Bs of the spring. With a separate measurement of the spring,
# both are determined. Outliers are excluded and listed.

fits = [
    ph.fit(
        "magnet", folder / "magnet.csv", spring=folder / "spring.csv", hammer=hammer
    ),
    ph.fit("pack", folder / "pack.csv", hammer=hammer),
    ph.fit("backstop", folder / "backstop.csv", hammer=hammer),
]
for found in fits:
    print("\n".join(found.report), end="\n\n")
fits[0].plot()

# %%
# The figure shows the deviations of the fitted constants from the true values, in
# standard errors. Nineteen of twenty should lie within two standard errors.

made = hammer
names, distances = [], []
for found in fits:
    made = found.into(made)
    for key, constant in found.constants.items():
        if key in hammer.constants:
            names.append(key)
            error = constant.value - hammer.constants[key].si
            distances.append(error / constant.standard_error)

figure, ax = plt.subplots(figsize=(6.4, 3.0), layout="constrained")
ax.axvspan(-1.96, 1.96, color="0.9")
ax.axvline(0.0, color="0.5", linewidth=0.8)
ax.plot(distances, np.arange(len(names)), "o")
ax.set_yticks(np.arange(len(names)), names)
ax.set(xlabel="found less true, in standard errors", xlim=(-4, 4))

# %%
# The hammer with the fitted constants moves like the measured hammer.

drive = ph.PulseTrain(hammer.waveform, at=[0.0])
for name, one in (("measured", hammer), ("made", made)):
    dot = ph.simulate(one, drive).dots[0]
    print(
        f"{name}: flight time {1e6 * dot.flight_time:.2f} us,"
        f" impact speed {dot.impact_speed:.4f} m/s"
    )

plt.show()
