"""
Poincaré plot
=============

Fire a hammer again and again, and look at it at the moments of firing. Hendriks
(1983), figure 11, shows what one sees at twelve strobe times: single points, pairs,
and strange attractors.
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
# The window is that of the paper, its vertical line the backstop. All points are
# drawn, also the first ones, which lead from rest to where the train ends up.
#
# A strange attractor is a thin curve, folded over and over. Closer up, and without
# the way there:

close = ph.strobe(hammer, period="1.15 ms", points=4000, transient=500, verdict=False)
figure, panel = plt.subplots()
panel.plot(1e6 * close.x, close.v, ",")
panel.set(
    xlabel="displacement (µm)",
    ylabel="velocity (m/s)",
    title="4000 points, 1.15 ms",
)

# %%
# The same attractor, a part of the period later. The armature flies, prints and comes
# back in between.

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
# Two trains that begin almost alike part soon, by a factor of about 1.8 at each firing,
# until they are as far apart as the attractor is wide.

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
