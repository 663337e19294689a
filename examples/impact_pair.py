"""
Rattle between two stops
========================

A gear that rattles in its play, or a ball in a shaken box, is an impact pair: a mass
without a spring between two rigid stops (A. Heiman, A. Bajaj and P. Sherman, J. Sound
Vib. 124 (1988) 55). The orbit that hits each stop once in a period is its own mirror
image, until a pitchfork, where two orbits with unequal times between impacts take over.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

pair = ph.load("impact-pair")
period = 2.0 * math.pi


def force(amplitude):
    """Return a force with the time course of a cosine, of angular frequency 1."""
    return ph.SineForce(amplitude, 1.0 / period, phase="90 deg")


# %%
# Both ends of the stable symmetric orbits are known in closed form.

e = pair.backstop.restitution
kappa = 0.5 * math.pi * (1.0 + e) / (1.0 - e)
c = 4.0 * kappa / math.pi**2
exact = {
    "fold": 1.0 / math.hypot(1.0, kappa),
    "pitchfork": math.hypot(1.0, c) / (kappa - c),
}
starts = {
    "fold": (0.0174, (-0.20737, 0.6449)),
    "pitchfork": (0.827, (-0.35599, 0.39041)),
}
for kind, (phase, state) in starts.items():
    amplitude = exact[kind] * (1.005 if kind == "fold" else 0.995)
    branch = ph.continuation(
        pair,
        "drive.amplitude",
        (0.98 * exact[kind], 1.015 * exact[kind]),
        drive=force(amplitude),
        state=state,
        phase=phase,
    )
    (event,) = branch.events
    print(f"{event.kind} at A = {event.value:.9f}, in closed form {exact[kind]:.9f}")

# %%
# Below the pitchfork the impacts alternate every half period. Above it, the mass spends
# longer on one way than on the other.

figure, (left, right) = plt.subplots(1, 2, width_ratios=(3, 2))
times = np.linspace(0.0, 2.0 * period, 801)
for amplitude in (0.7, 0.85):
    drive = ph.SineForce(amplitude, 1.0 / period)
    motion = ph.simulate(pair, drive, duration=62.0 * period)
    first, second = np.diff([contact.t_in for contact in motion.contacts][-3:])
    print(f"A = {amplitude}: impacts after {first:.3f} and {second:.3f}")
    x = motion.curves_at(times + 60.0 * period)[0]
    left.plot(times / period, x, label=f"A = {amplitude}")

# %%
# The figure shows both motions, and the fraction of the period between an impact at the
# lower stop and the next impact at the upper stop. The start at the other stop, with
# the opposite force, leads to the mirror image.

for side, color in ((-1.0, "C0"), (1.0, "C1")):
    fractions = []
    amplitudes = np.linspace(0.6, 0.95, 36)
    for amplitude in amplitudes:
        drive = ph.SineForce(-side * amplitude, 1.0 / period)
        motion = ph.simulate(pair, drive, duration=80.0 * period, state=(side, 0.0))
        last = {contact.surface: contact.t_in for contact in motion.contacts}
        fractions.append((last["pack"] - last["backstop"]) / period % 1.0)
    right.plot(amplitudes, fractions, ".", color=color)
right.axvline(exact["pitchfork"], color="0.7", linewidth=0.8, zorder=0)
left.set(xlabel="time (periods)", ylabel="displacement (m)")
left.legend(loc="upper center")
right.set(
    xlabel="amplitude of the force (N)", ylabel="fraction of the period on the way up"
)

plt.show()
