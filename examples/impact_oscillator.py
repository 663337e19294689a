"""
The linear impact oscillator
============================

The standard system of nonsmooth dynamics, built from replaceable parts: a mass on a
linear spring, driven by a sinusoidal force, in front of a rigid stop. Between impacts
its motion is known in closed form, so that the run can be compared with the exact
solution.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

omega, stop, restitution = 2.6, -0.1, 0.8
oscillator = ph.Hammer.build(
    "1 kg",
    name="linear impact oscillator",
    spring={"law": "preload", "preload": -1.0 * stop, "stiffness": "1 N/m"},
    backstop={"law": "rigid", "position": stop, "restitution": restitution},
)

# %%
# The deflection of a spring is measured from the backstop, b of equation (4). For
# this spring to be relaxed at x = 0, its force at the stop, the preload, is -1 N/m
# times the position of the stop.

drive = ph.SineForce("1 N", frequency=omega / (2.0 * math.pi), phase="90 deg")
motion = ph.simulate(oscillator, drive, state=(0.0, 0.0), duration=60.0, points=6001)
print(motion.status, len(motion.contacts), "impacts")

# %%
# The exact solution of x'' + x = cos(omega t) from a state (t0, x0, v0) is the sum of
# a forced and a free oscillation. The next impact is the first zero of x - b after
# t0, bracketed on a fine grid and refined by bisection to the last bit. These
# functions are a complete oracle for this system, and share no code with the program.

gain = 1.0 / (1.0 - omega**2)


def exact(t, t0, x0, v0):
    """Return the exact displacement and velocity at times t, from (t0, x0, v0) on."""
    a = x0 - gain * math.cos(omega * t0)
    b = v0 + gain * omega * math.sin(omega * t0)
    x = a * np.cos(t - t0) + b * np.sin(t - t0) + gain * np.cos(omega * t)
    v = b * np.cos(t - t0) - a * np.sin(t - t0) - gain * omega * np.sin(omega * t)
    return x, v


def next_impact(start):
    """Return the time and velocity of the first impact after a start (t0, x0, v0)."""
    grid = start[0] + np.linspace(1e-9, 20.0, 40_001)
    below = np.flatnonzero(exact(grid, *start)[0] < stop)
    low, high = (grid[below[0] - 1] if below[0] else start[0]), grid[below[0]]
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (low, middle) if exact(middle, *start)[0] < stop else (middle, high)
    return high, exact(high, *start)[1]


pieces = [(0.0, 0.0, 0.0)]
while True:
    at, speed = next_impact(pieces[-1])
    if at > motion.end:
        break
    pieces.append((at, stop, -restitution * speed))

starts = np.array([piece[0] for piece in pieces])
which = np.searchsorted(starts, motion.t, side="right") - 1
x_exact = np.array(
    [exact(t, *pieces[i])[0] for t, i in zip(motion.t, which, strict=True)]
)

# %%
# The two curves coincide; their difference grows slowly, since errors made at one
# impact propagate to the next.

figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(3, 2))
above.plot(motion.t, motion.x, label="printhammer")
above.plot(motion.t, x_exact, "--", color="0.2", linewidth=0.9, label="exact")
above.axhline(stop, color="0.6", linewidth=0.8, zorder=0)
above.set(ylabel="displacement (m)", title="Linear impact oscillator", xlim=(0.0, 60.0))
above.legend(loc="upper right", ncols=2)
below.semilogy(motion.t, np.abs(motion.x - x_exact) + 1e-18, linewidth=0.7, color="C1")
below.set(xlabel="time (s)", ylabel="difference (m)")

impacts = np.array([contact.t_in for contact in motion.contacts])
print(f"largest difference of the motion    {np.abs(motion.x - x_exact).max():.1e} m")
apart = np.abs(impacts - starts[1:]).max()
print(f"largest difference of impact times  {apart:.1e} s")

# %%
# A tighter tolerance reduces the difference.

finer = ph.simulate(
    oscillator,
    drive,
    state=(0.0, 0.0),
    duration=60.0,
    times=motion.t,
    tolerance=1e-13,
)
print(f"at the tolerance 1e-13              {np.abs(finer.x - x_exact).max():.1e} m")

# %%
# In the phase plane, the velocity jumps at the stop.

_, v = motion.at(motion.t)
jump = np.flatnonzero(np.diff(which)) + 1
figure, axes = plt.subplots(figsize=(5.2, 4.2))
axes.plot(np.insert(motion.x, jump, np.nan), np.insert(v, jump, np.nan), linewidth=0.6)
axes.axvline(stop, color="0.6", linewidth=0.8)
axes.set(xlabel="displacement (m)", ylabel="velocity (m/s)", title="Phase plane")

plt.show()
