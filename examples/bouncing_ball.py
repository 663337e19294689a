"""
A bouncing ball
===============

A hammer requires neither magnet nor pack. A mass, a constant force as its spring and
a rigid backstop describe a ball that bounces on the floor: infinitely many bounces in
a finite time, with a closed-form solution.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

gravity, restitution = 9.80665, 0.8
ball = ph.Hammer.build(
    "1 g",
    name="ball",
    spring={"law": "preload", "preload": "-9.80665 mN", "stiffness": "0 N/m"},
    backstop={"law": "rigid", "position": "0 m", "restitution": restitution},
    waveform={"shape": "half-sine", "amplitude": "1.5 N", "width": "2 ms"},
)

# %%
# The amplitude has the unit of a force, so the pulse acts on the ball itself: the
# ball is struck from below, flies up, and falls back.

motion = ph.simulate(ball, ph.PulseTrain(ball.waveform), duration="4 s", points=4001)
print(motion)
figure, axes = plt.subplots()
axes.plot(motion.t, 1e3 * motion.x)
axes.set(
    xlabel="time (s)",
    ylabel="height (mm)",
    title="A ball that is struck once",
    xlim=(0.0, 4.0),
    ylim=(0.0, None),
)

# %%
# Between bounces the motion is a parabola, so bounce n follows from the first bounce:
# the speed is multiplied by e at each bounce, a flight lasts 2 v / g, and all flights
# together last 2 e v / (g (1 - e)).

bounces = [c for c in motion.contacts if not c.initial]
first = bounces[0]
n = np.arange(len(bounces))
speeds = -first.v_in * restitution**n
times = first.t_in + 2.0 * -first.v_in / gravity * restitution * (
    1.0 - restitution**n
) / (1.0 - restitution)
end = first.t_in + 2.0 * -first.v_in / gravity * restitution / (1.0 - restitution)
print(f"{len(bounces)} bounces resolved, the last one at {bounces[-1].t_in:.12f} s")
print(f"end of all bounces by the formula          {end:.12f} s")
late = np.array([c.t_in for c in bounces]) - times
fast = np.array([c.v_in for c in bounces]) / -speeds - 1.0
print(f"largest error of the time of a bounce      {np.abs(late).max():.1e} s")
print(f"largest relative error of a speed          {np.abs(fast).max():.1e}")

# %%
# The heights of the bounces decrease by the square of e until they are below the
# resolution of the run; from then on the ball rests on the floor.

figure, axes = plt.subplots()
axes.semilogy(
    n,
    [c.v_in**2 / (2.0 * gravity) for c in bounces],
    "o",
    markersize=4,
    label="run",
)
axes.semilogy(
    n, speeds**2 / (2.0 * gravity), linewidth=0.8, color="0.3", label="formula"
)
axes.set(
    xlabel="bounce",
    ylabel="height before it (m)",
    title="Infinitely many bounces in a finite time",
)
axes.legend()

# %%
# The energy ledger shows that all the work of the pulse is lost in the bounces.

ledger = motion.energy
print(f"work of the blow    {1e3 * ledger.drive_work:.9f} mJ")
print(f"loss in the bounces {1e3 * ledger.backstop_loss:.9f} mJ")

# %%
# On a vibrating table the ball can bounce forever. In the frame of the table, the
# force m A w^2 sin(w t) acts on the ball in addition to its weight. Orbits with one
# impact per period strike the table at the phase p with Gamma cos p = pi (1 - e) / (1
# + e), where Gamma = A w^2 / g, so there are two such orbits, or none below a fold.
# One of them is stable until a multiplier reaches -1, where Gamma sin p = 2 (1 + e^2)
# / (1 + e)^2.

table = ph.load("bouncing-ball")
weight, restitution = -table.spring.preload, table.backstop.restitution
frequency, omega = 50.0, 2.0 * np.pi * 50.0
fold = np.pi * (1.0 - restitution) / (1.0 + restitution)
doubling = np.hypot(fold, 2.0 * (1.0 + restitution**2) / (1.0 + restitution) ** 2)


def half_way(gamma, sign):
    """Return height and velocity, half a period after phase 0 of the table."""
    p = sign * np.arccos(fold / gamma)
    height, leaves = gamma * gravity / omega**2, 0.5 * gravity / frequency
    t = (np.pi - p) / omega
    x = height * np.sin(p) + leaves * t - 0.5 * gravity * t**2
    return x, leaves - gravity * t + height * omega


branch = ph.continuation(
    table,
    "drive.amplitude",
    (0.3 * weight, 1.3 * weight),
    drive=ph.SineForce(0.8 * weight, frequency),
    state=half_way(0.8, 1.0),
    phase=0.5,
)
for event in branch.events:
    exact = fold if event.kind == "fold" else doubling
    print(f"{event.kind}: Gamma = {event.value / weight:.12f}, formula {exact:.12f}")

# %%
# The program follows the branch around the fold and locates both points; the closed
# form is drawn over the branch.

figure, axes = plt.subplots()
gamma, height = branch.values / weight, 1e3 * branch.x[:, 0]
axes.plot(gamma, np.where(branch.stable, height, np.nan), label="stable")
axes.plot(gamma, np.where(branch.stable, np.nan, height), label="unstable")
few = np.linspace(fold, gamma.max(), 25)
for sign in (1.0, -1.0):
    label = "formula" if sign > 0.0 else None
    some = [1e3 * half_way(value, sign)[0] for value in few]
    axes.plot(few, some, "o", color="0.3", markersize=3, label=label)
for event in branch.events:
    axes.axvline(event.value / weight, color="0.7", linewidth=0.8, zorder=0)
axes.set(
    xlabel="acceleration of the table over that of gravity",
    ylabel="height at half a period (mm)",
    title="Bouncing once a period",
)
axes.legend()

plt.show()
