"""
Grazing near resonance
======================

A damped oscillator whose rest position is clear of a stop is driven harder until it
touches the stop. If two periods of the force equal two and a half periods of the
natural oscillation, orbits with one impact in two periods of the force follow: the
case for which D. J. W. Simpson and I. Ghosh study resonant grazing (arXiv
2602.22797).
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

oscillator = ph.load("resonant-grazing")
print(oscillator.note)

# %%
# Without impacts, the amplitude is F over the square root of :math:`(1 - \omega^2)^2
# + b^2 \omega^2`. The branch ends where the amplitude equals the distance to the
# stop, one unit of length.

omega, damping, restitution = 0.799, 0.04, 0.9
graze = math.hypot(1.0 - omega**2, damping * omega)


def force(amplitude):
    """Return a force with the time course of a cosine."""
    return ph.SineForce(amplitude, omega / (2.0 * math.pi), phase="90 deg")


swing = ph.continuation(
    oscillator,
    "drive.amplitude",
    (0.34, 0.38),
    drive=force(0.35),
    state=(1.0, 0.0),
)
print(swing.message)
print(f"exactly {graze:.12f}")

# %%
# Orbits with one impact in two periods begin at a smaller amplitude of the force, in
# a fold. The initial guess is their state half a period after an impact, rounded.

amplitude, phase, state = 0.3628362, 0.0091, (1.91021, -0.06294)
impacts = ph.continuation(
    oscillator,
    "drive.amplitude",
    (0.3625, 0.366),
    drive=force(amplitude),
    state=state,
    firings=2,
    phase=phase,
)
print(impacts.message)
for event in impacts.events:
    print(f"{event.kind} at F = {event.value:.12f}")

# %%
# For every orbit, damping shrinks areas by exp(-b T) in the two periods T, and the
# impact by the square of the restitution; the product of these factors is the product
# of both multipliers.

exact = restitution**2 * math.exp(-4.0 * math.pi * damping / omega)
off = np.abs(impacts.multipliers.prod(axis=1).real / exact - 1.0)
print(
    f"product of the multipliers {exact:.10f}, median difference {np.median(off):.1e}"
)

# %%
# From the fold, one branch continues to stable motion with impacts, the other returns
# to the grazing.

figure, axes = plt.subplots()
for stable, style in ((True, "-"), (False, "--")):
    x = np.where(impacts.stable == stable, impacts.x[:, 0], np.nan)
    label = "one impact in two periods" if stable else None
    axes.plot(impacts.values, x, style, color="C0", label=label)
near = swing.values > 0.3625
axes.plot(swing.values[near], swing.x[near, 0], color="C1", label="no impact")
axes.axvline(graze, color="0.7", linewidth=0.8, zorder=0)
axes.set(
    xlabel="amplitude of the force (N)",
    ylabel="displacement at the section (m)",
    title="Solid: stable. Dashed: unstable. Line: grazing",
)
axes.legend()

plt.show()
