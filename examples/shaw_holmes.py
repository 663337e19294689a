"""
The impact oscillator with damping
==================================

S. W. Shaw and P. J. Holmes (J. Sound Vib. 90 (1983) 129) analysed a mass on a spring
with viscous damping, a sinusoidal force and a rigid stop. Orbits with one impact per
period lose their stability in a period doubling; further doublings lead to chaos.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

oscillator = ph.load("shaw-holmes-1983")
omega = 2.2


def force(amplitude):
    """Return a force with the time course of a cosine."""
    return ph.SineForce(amplitude, omega / (2.0 * math.pi), phase="90 deg")


# %%
# Starting from a rounded state half a period after an impact, continuation follows
# the branch through the period doubling, and then the orbits of twice the period.

branch = ph.continuation(
    oscillator,
    "drive.amplitude",
    (0.4, 0.5),
    drive=force(0.427),
    state=(0.18637, 0.01023),
    phase=0.4823,
)
(doubling,) = [event for event in branch.events if event.kind == "period doubling"]
print(f"doubling at F = {doubling.value:.12f}, in closed form 0.426985572704")
twice = branch.doubled(doubling)
print(twice.message)

# %%
# To show the influence of damping, the period doubling is followed as the damping
# coefficient increases.

chart = ph.stability_chart(branch, "damping.coefficient", (0.0, 0.2), grid=(0, 0))
(curve,) = chart.curves
for value in (0.0, 0.1, 0.2):
    near = np.argmin(np.abs(curve.second - value))
    print(f"damping {curve.second[near]:.3f}: doubling at F = {curve.first[near]:.9f}")

# %%
# The figure shows the branches, and the period doubling against the damping.

figure, (left, right) = plt.subplots(1, 2, width_ratios=(3, 2))
for one, color in ((branch, "C0"), (twice, "C1")):
    for stable, style in ((True, "-"), (False, "--")):
        x = np.where(one.stable[:, np.newaxis] == stable, one.x, np.nan)
        left.plot(one.values, x, style, color=color)
left.axvline(doubling.value, color="0.7", linewidth=0.8, zorder=0)
left.set(
    xlabel="amplitude of the force (N)",
    ylabel="displacement at the section (m)",
    title="Solid: stable. Dashed: unstable",
)
right.plot(curve.second, curve.first)
right.set(xlabel="damping (N s/m)", ylabel="amplitude of the doubling (N)")

plt.show()
