"""
A rocking block
===============

A slender block that is tilted and released rocks from edge to edge, faster and faster
as it comes to rest: G. W. Housner (Bull. Seism. Soc. Am. 53 (1963) 403). Reflected at
the upright position, the block is equivalent to a mass on a spring of negative
stiffness in front of a rigid stop.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

block = ph.load("housner-1963")
print(block.note)

# %%
# In units of the time 1/p and of the angle at which the block tips over, the block is
# released at 0.9, without a drive.

start, still = 0.9, ph.SineForce("0 N", "1 Hz")
motion = ph.simulate(block, still, state=(start, 0.0), duration=20.0, points=2001)
impacts = np.array([contact.t_in for contact in motion.contacts if not contact.initial])
times, angles = motion.maxima

# %%
# Housner's formulas give the time to the first impact, and the largest angle after n
# impacts, each of which leaves the fraction r of the energy.

share = block.backstop.restitution**2
n = np.arange(1, 9)
exact = 1.0 - np.sqrt(1.0 - share**n * (1.0 - (1.0 - start) ** 2))
print(f"first impact at {impacts[0]:.12f}, formula {math.acosh(1 / (1 - start)):.12f}")
print(f"largest difference of the angles {np.abs(angles[:8] - exact).max():.1e}")

# %%
# Without the reflection, every second swing is to the other side.

side = 1.0 - 2.0 * (np.searchsorted(impacts, motion.t, side="right") % 2)
figure, (above, below) = plt.subplots(2, 1)
above.plot(motion.t, side * motion.x)
above.plot(times[:8], exact * (-1.0) ** n, "o", color="0.3", markersize=4)
above.set(ylabel="angle / tipping angle", xlabel="p t", title="Free rocking")
gaps = np.diff(impacts)[:15]
below.plot(np.arange(1, len(gaps) + 1), gaps, "o-", markersize=4)
below.set(xlabel="swing", ylabel="p x duration")

# %%
# The block tips over beyond an unstable equilibrium: a block released beyond this
# angle falls.

over = ph.simulate(block, still, state=(1.01, 0.0), duration=6.0, points=200)
print(f"let go at 1.01 it has turned by {over.x[-1]:.1f} after 6 units of time")

plt.show()
