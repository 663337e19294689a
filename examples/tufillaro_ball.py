"""
A ball that doubles its period
==============================

N. B. Tufillaro, T. Abbott and J. Reilly (*An Experimental Approach to Nonlinear
Dynamics and Chaos*, 1992) let a ball bounce on the cone of a loudspeaker, at 60 Hz.
The amplitudes at which its period doubles are published to seven digits.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

ball, frequency = ph.load("tufillaro-1992"), 60.0
weight, restitution = -ball.spring.preload, ball.backstop.restitution
omega, gravity = 2.0 * math.pi * frequency, weight / ball.mass


def centimetres(force):
    """Return the amplitude of the table, cm, for a force amplitude in its frame."""
    return 100.0 * np.asarray(force) / (ball.mass * omega**2)


# %%
# With one impact per period, the ball strikes the table at a phase that follows from
# the law of impact; half a period after phase 0 of the table, the ball is in flight.

gamma = 1.3
meets = math.acos(math.pi * (1.0 - restitution) / (1.0 + restitution) / gamma)
height, leaves = gamma * gravity / omega**2, 0.5 * gravity / frequency
later = (math.pi - meets) / omega
state = (
    height * math.sin(meets) + leaves * later - 0.5 * gravity * later**2,
    leaves - gravity * later + height * omega,
)
branches = [
    ph.continuation(
        ball,
        "drive.amplitude",
        (weight, 1.75 * weight),
        drive=ph.SineForce(gamma * weight, frequency),
        state=state,
        phase=0.5,
    )
]

# %%
# Each period doubling starts a branch, which is followed to the next doubling.

printed, amplitudes = (0.01053531, 0.01150345, 0.01170804), []
for known in printed:
    kind = "period doubling"
    event = next(event for event in branches[-1].events if event.kind == kind)
    amplitudes.append(float(centimetres(event.value)))
    print(f"{amplitudes[-1]:.8f} cm, printed {known:.8f} cm")
    branches.append(branches[-1].doubled(event))
first, second, third = amplitudes
print(f"ratio of the ways: {(second - first) / (third - second):.4f}")

# %%
# The ratio of successive intervals tends to Feigenbaum's constant 4.669.

figure, axes = plt.subplots()
for number, branch in enumerate(branches):
    x = 1e3 * branch.x
    stable = np.where(branch.stable[:, np.newaxis], x, np.nan)
    axes.plot(centimetres(branch.values), x, ":", color=f"C{number}")
    axes.plot(centimetres(branch.values), stable, "-", color=f"C{number}")
for amplitude in amplitudes:
    axes.axvline(amplitude, color="0.7", linewidth=0.8, zorder=0)
axes.set(
    xlabel="amplitude of the table (cm)",
    ylabel="height at half a period (mm)",
    title="Solid: stable. Dotted: unstable",
    xlim=(0.0100, 0.0121),
)

plt.show()
