"""
Periodic orbits
===============

A train from rest shows only the motion to which it settles. There are also periodic
motions that are unstable: the smallest change leads away from them. A search finds
both kinds, with the factors by which small changes grow in one period: the
multipliers.
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
# Two orbits are stable; the initial state decides to which of them a train settles.
# The boundary between the initial states of the two orbits runs through a saddle.

found.plot()

# %%
# Each orbit includes its contacts, dots and energies in a period. The work of the
# coil equals the energy absorbed by pack and backstop.

for orbit in found:
    energy = orbit.energy
    print(
        f"{orbit.name}: {orbit.printed} dot, {orbit.backstop_contacts} touches of the"
        f" backstop, coil {1e3 * energy.coil_work:.4f} mJ,"
        f" pack {1e3 * energy.pack_loss:.4f} mJ,"
        f" backstop {1e3 * energy.backstop_loss:.4f} mJ"
    )

# %%
# Near a strange train there is no stable orbit, but many unstable orbits: the train
# follows one of them for a while, leaves it, and approaches another. The states of
# these orbits lie on the attractor or near it.

strange = ph.orbits(hammer, period="1.15 ms", longest=6, starts=100)
print(strange.message)
strange.plot(points=2000)

# %%
# The figure compares the growth rates of small changes on the unstable orbits, per
# firing, with the largest exponent of the train, which is an average over the orbits
# that the train approaches.

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
