"""
Poincaré plot
=============

A Poincaré plot shows the state of a hammer at each firing of a long train. In
Hendriks (1983), figure 11 shows such plots at twelve strobe times: single points,
pairs, and strange attractors.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
periods = ("1.35 ms", "1.30 ms", "1.20 ms", "1.15 ms")

figure, axes = plt.subplots(2, 2, sharex=True, sharey=True)
for panel, period in zip(axes.flat, periods, strict=True):
    found = ph.strobe(hammer, period=period, points=200)
    panel.plot(1e6 * found.x, found.v, ".", markersize=3)
    panel.axvline(1e6 * hammer.position, color="0.6", linewidth=0.8)
    panel.set_title(f"{period}: {found.verdict}", fontsize="small")
    print(f"{period}: {found.verdict.evidence}")
axes[0, 0].set(xlim=(38.1, 88.9), ylim=(-0.635, 0.635))
figure.supxlabel("displacement (µm)")
figure.supylabel("velocity (m/s)")

# %%
# The window is the same as in the paper; the vertical line is the backstop. All
# points are drawn, including the first points, on the way from rest to the attractor.
#
# A strange attractor is a thin curve, folded repeatedly. The next figure magnifies
# the attractor and omits the transient:

close = ph.strobe(hammer, period="1.15 ms", points=4000, transient=500, verdict=False)
figure, panel = plt.subplots()
panel.plot(1e6 * close.x, close.v, ",")
panel.set(
    xlabel="displacement (µm)",
    ylabel="velocity (m/s)",
    title="4000 points, 1.15 ms",
)

# %%
# The next figure shows the same attractor at later phases of the period, while the
# armature flies, prints and returns.

figure, panel = plt.subplots()
for phase in (0.0, 0.1, 0.2, 0.6, 0.8):
    late = ph.strobe(
        hammer, period="1.15 ms", points=400, transient=500, phase=phase, verdict=False
    )
    panel.plot(1e6 * late.x, late.v, ".", markersize=1.5, label=f"{phase:g}")
for place in (hammer.position, hammer.front):
    panel.axvline(1e6 * place, color="0.6", linewidth=0.8, zorder=0)
panel.legend(title="phase", markerscale=5)
panel.set(xlabel="displacement (µm)", ylabel="velocity (m/s)", title="Five phases")

# %%
# Two trains with almost equal initial states diverge quickly, by a factor of about
# 1.8 at each firing, until their distance equals the width of the attractor.

near = ph.strobe(
    hammer,
    period="1.15 ms",
    points=80,
    verdict=False,
    state=(ph.rest_state(hammer) + 1e-14, 0.0),
)
first = ph.strobe(hammer, period="1.15 ms", points=80, verdict=False)
figure, panel = plt.subplots()
panel.semilogy(first.firing, 1e6 * np.abs(near.x - first.x), ".-")
panel.set(
    xlabel="firing", ylabel="distance (µm)", title="Two trains, at first 1e-8 µm apart"
)

plt.show()
