"""
Continuation of periodic orbits
===============================

Continuation shows which periodic motions, stable or unstable, exist at each value of
a parameter. The first example is a ball on a vibrating table, with a closed-form
solution; the second is the print hammer.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

gravity, restitution, frequency = 9.80665, 0.8, 50.0
ball = ph.Hammer.build(
    "1 g",
    name="ball on a table",
    spring={"law": "preload", "preload": "-9.80665 mN", "stiffness": "0 N/m"},
    backstop={"law": "rigid", "position": "0 m", "restitution": restitution},
)

# %%
# In the frame of a table that moves as A sin(w t), the ball is subject to its weight
# and the force m A w^2 sin(w t). The ratio of the amplitude of this force to the
# weight, Gamma, is the dimensionless acceleration of the table. The orbit with one
# impact per period appears in a fold, and doubles its period, at
#
# .. math::
#
#    \Gamma_1 = \pi \frac{1 - e}{1 + e}, \qquad
#    \Gamma_2^2 = \Gamma_1^2 + \left( 2\, \frac{1 + e^2}{(1 + e)^2} \right)^2 .

weight = 1e-3 * gravity
fold = math.pi * (1.0 - restitution) / (1.0 + restitution)
doubling = math.hypot(fold, 2.0 * (1.0 + restitution**2) / (1.0 + restitution) ** 2)

# %%
# The ball strikes the table at the same height each time, so its flight is known in
# closed form. Its state half a period after phase 0 of the table is the initial
# guess.

gamma, omega = 0.8, 2.0 * math.pi * frequency
height, angle = gamma * gravity / omega**2, math.acos(fold / gamma)
speed, t = 0.5 * gravity / frequency, 0.5 / frequency - angle / omega
state = (
    height * math.sin(angle) + speed * t - 0.5 * gravity * t**2,
    speed - gravity * t + height * omega,
)
branch = ph.continuation(
    ball,
    "drive.amplitude",
    (0.2 * weight, 1.2 * weight),
    drive=ph.SineForce(gamma * weight, frequency),
    state=state,
    phase=0.5,
)
print(branch.message)
for event, exact in zip(
    sorted(branch.events, key=lambda event: event.value), (fold, doubling), strict=True
):
    found = event.value / weight
    print(f"{event.kind:16s} at Gamma = {found:.12f}, exactly {exact:.12f}")

# %%
# Beyond the doubling, the motion repeats after two periods. This branch is followed
# as well.

(born,) = [event for event in branch.events if event.kind == "period doubling"]
twice = branch.doubled(born)
print(twice.message)


def draw(axes, one, x, y, color):
    """Draw a branch, solid where it is stable and dashed where it is unstable."""
    for stable, style in ((True, "-"), (False, "--")):
        axes.plot(np.where(one.stable == stable, x, np.nan), y, style, color=color)


figure, axes = plt.subplots()
draw(axes, branch, branch.values / weight, 1e3 * branch.x, "C0")
draw(axes, twice, twice.values / weight, 1e3 * twice.x, "C1")
for event in branch.events:
    place = event.value / weight, 1e3 * event.state[0]
    axes.plot(*place, "o", color="0.2", markersize=4)
axes.set(
    xlabel="Gamma",
    ylabel="height at the section (mm)",
    title="Solid: stable. Dashed: unstable",
)

# %%
# For the print hammer, around 1.3 ms between firings, the branch of period 1 doubles
# and turns back at folds, between which several motions coexist. `period_1.plot()`
# draws this branch, too.

hammer = ph.load("hendriks-1983")
period_1 = ph.continuation(hammer, "period", ("1.23 ms", "1.36 ms"), period="1.25 ms")
print(period_1.message)
for event in period_1.events:
    print(f"{1e3 * event.value:.6f} ms  {event.message}")

figure, axes = plt.subplots()
draw(axes, period_1, 1e3 * period_1.values, period_1.v, "C0")
for event in period_1.events:
    axes.plot(1e3 * event.value, event.state[1], "o", color="0.2", markersize=4)
axes.set(xlabel="period (ms)", ylabel="velocity at the firing (m/s)")

# %%
# Each orbit of a branch includes its dots and energies. Motions that coexist at the
# same rate print at different times.

figure, axes = plt.subplots()
draw(axes, period_1, 1e3 * period_1.values, 1e6 * period_1.flight_time, "C0")
axes.set(xlabel="period (ms)", ylabel="flight time (µs)")

plt.show()
