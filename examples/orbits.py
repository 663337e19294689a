"""
Periodic orbits
===============

A train from rest shows where it ends, and nothing else. Beside that there are motions
that repeat as well, but from which the smallest change leads away. A search finds both
kinds, with the factors by which small changes grow in one period: the multipliers.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
found = ph.orbits(hammer, period="1.05 ms", longest=2, starts=100)
print(found.message)
for orbit in found:
    print(orbit.name, orbit.multipliers)

# %%
# Two orbits are stable: which of them a train ends on is decided by how it begins. The
# edge between what leads to one and to the other runs through a saddle.

found.plot()

# %%
# What an orbit does in a period is known with it: contacts, dots, energies. The coil's
# work is what pack and backstop take.

for orbit in found:
    energy = orbit.energy
    print(
        f"{orbit.name}: {orbit.printed} dot, {orbit.backstop_contacts} touches of the"
        f" backstop, coil {1e3 * energy.coil_work:.4f} mJ,"
        f" pack {1e3 * energy.pack_loss:.4f} mJ,"
        f" backstop {1e3 * energy.backstop_loss:.4f} mJ"
    )

# %%
# A strange train has no stable orbit, but many unstable ones: it goes along one of them
# for a while, leaves it, and comes near another. Their states lie on the attractor
# or beside it.

strange = ph.orbits(hammer, period="1.15 ms", longest=6, starts=100)
print(strange.message)
strange.plot(points=2000)

# %%
# How fast the unstable ones lose their neighbours, per firing, beside the largest
# exponent of the train, which is an average over what it comes near.

exponent = ph.strobe(hammer, period="1.15 ms", points=1).verdict.exponent
rates = [np.log(abs(orbit.multipliers[0])) / orbit.firings for orbit in strange]
figure, panel = plt.subplots()
panel.plot([orbit.firings for orbit in strange], rates, "o", markerfacecolor="none")
panel.axhline(exponent, color="C1", label="largest exponent of the train")
panel.set(
    xlabel="firings of the orbit",
    ylabel="growth per firing",
    title="Unstable orbits of a strange train",
    ylim=(0.0, None),
)
panel.legend()

plt.show()
