"""
A bouncing ball
===============

A hammer needs neither magnet nor pack. A mass, a constant force as its spring and a
rigid backstop make the ball that bounces on the floor: infinitely many bounces in a
finite time, for which there are closed formulas.
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
# The amplitude has the unit of a force, so the pulse acts on the ball itself: it is
# struck from below, flies, and comes back.

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
# Between bounces the motion is a parabola, so bounce n follows from the first one:
# the speed is multiplied by e each time, a flight lasts 2 v / g, and all flights
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
# The heights of the bounces fall by the square of e until the rest is below what
# the run resolves; from there on the ball rests on the floor.

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
# The ledger: all the work of the blow is lost in the bounces.

ledger = motion.energy
print(f"work of the blow    {1e3 * ledger.drive_work:.9f} mJ")
print(f"loss in the bounces {1e3 * ledger.backstop_loss:.9f} mJ")

plt.show()
