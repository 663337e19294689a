"""
Grazing at resonance
====================

Example 15.2 of H. Dankowicz and F. Schilder, *Recipes for Continuation* (2013), is an
oscillator with a stop, driven at resonance. Its oscillation without impacts reaches
the stop at a forcing of 0.1; the branch of orbits with impacts ends at the same
point.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

oscillator = ph.load("dankowicz-schilder-2013")


def force(amplitude):
    """Return the force of the book, mirrored like the position of the stop."""
    return ph.SineForce(amplitude, 1.0 / (2.0 * math.pi), phase="-90 deg")


# %%
# At resonance the amplitude is A / (c w), so that the branch of oscillations without
# impacts ends at A = 0.1. There, the oscillation touches the stop with zero velocity,
# and the strobe map has no derivative.

free = ph.continuation(
    oscillator, "drive.amplitude", (0.02, 0.5), drive=force(0.05), state=(0.0, -0.5)
)
print(free.message)
(grazing,) = [stop for stop in free.stops if stop.reason == "grazing"]
print(f"grazing at A = {grazing.parameter:.12f}")

# %%
# The book starts from an orbit with one impact at A = 1 and continues it toward
# smaller A. Here, a motion from rest settles to this orbit.

points = ph.strobe(oscillator, drive=force(1.0), points=20, transient=300)
print(points.verdict)
impacts = ph.continuation(
    oscillator,
    "drive.amplitude",
    (0.02, 1.0),
    drive=force(1.0),
    state=(points.x[-1], points.v[-1]),
)
print(impacts.message)
for event in impacts.events:
    print(f"{event.kind} at A = {event.value:.9f}")

# %%
# The figure shows both branches.

figure, axes = plt.subplots()
for branch, color, label in ((free, "C1", "free"), (impacts, "C0", "one impact")):
    for stable, style in ((True, "-"), (False, "--")):
        v = np.where(branch.stable == stable, branch.v[:, 0], np.nan)
        name = label if stable else None
        axes.plot(branch.values, v, style, color=color, label=name)
axes.axvline(0.1, color="0.7", linewidth=0.8, zorder=0)
axes.set(
    xlabel="amplitude of the force (N)",
    ylabel="velocity at the section (m/s)",
    title="Solid: stable. Dashed: unstable. Line: A = c w",
)
axes.legend()

plt.show()
