"""
Duffing's equation with two wells
=================================

The equation x'' = F cos t + x - x³ - 0.2 x' describes a shaken buckled beam, after P.
Holmes (Phil. Trans. R. Soc. Lond. A 292 (1979) 419). This hammer has no contacts, and
a spring with a negative stiffness and a cubic term; its attractor is strange.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

beam = ph.load("duffing-holmes")
force = ph.SineForce(0.3, 1.0 / (2.0 * math.pi), phase="90 deg")

# %%
# The sum of the two exponents is minus the damping coefficient for any motion. The
# published exponents are 0.159 and -0.359 per unit of time.

growth = ph.lyapunov(beam, drive=force, state=(0.1, 0.1), firings=5000, transient=200)
errors = growth.standard_errors / (2.0 * math.pi)
for value, error in zip(growth.per_second, errors, strict=True):
    print(f"{value:.4f} +- {error:.4f}")
print(f"sum {growth.per_second.sum():.12f}")
print(f"dimension {growth.dimension:.3f} +- {growth.dimension_error:.3f}")

# %%
# The states at the beginning of each period of the force lie on the attractor; the
# beam has two rest positions, at the centres of its wells.

states = growth.points
figure, axes = plt.subplots()
axes.plot(states.x, states.v, ",", color="C0")
axes.plot([-1.0, 1.0], [0.0, 0.0], "o", color="0.2", markersize=4)
axes.set(
    xlabel="displacement (m)",
    ylabel="velocity (m/s)",
    title="5000 periods of a strange motion",
)

# %%
# On average, the damping dissipates the energy that the force supplies.

motion = ph.simulate(beam, force, state=(0.1, 0.1), duration=400.0, points=4001)
energy = motion.energy
print(f"work of the force {energy.drive_work:.6f} J")
print(f"taken by damping  {energy.damping_loss:.6f} J")

figure, axes = plt.subplots()
axes.plot(motion.t, motion.x, linewidth=0.7)
axes.set(
    xlabel="time (s)",
    ylabel="displacement (m)",
    title="From well to well",
    xlim=(0.0, 200.0),
    ylim=tuple(1.1 * np.array([motion.x.min(), motion.x.max()])),
)

plt.show()
