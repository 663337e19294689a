"""
A hammer idealised to the limit
===============================

P. C. Tung and S. W. Shaw (ASME J. Vib. Acoust. 110 (1988) 193) reduced a print hammer
to the elements that are sufficient for chaos: a rigid mass, a preloaded spring of
negative stiffness for magnet and flexure together, half-sine pulses of force, a
spring and a dashpot for the paper, and a coefficient of restitution for the backstop.
All of these elements exist as parts, so that a hammer file can describe their hammer.
The constants in this file are assumed; none is taken from the article.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

ideal = ph.load("tung-shaw-1988")
paper = ph.load("hendriks-1983")
for name, part in ideal.parts.items():
    print(f"{name:9} {part}")

# %%
# After one pulse, both hammers bounce on the backstop. The idealised hammer bounces
# infinitely often in a finite time, and then is exactly at rest. The backstop of 1983
# is an elastic contact whose force begins smoothly: the armature settles into it, and
# approaches rest only asymptotically.

figure, axes = plt.subplots()
for hammer, colour in ((ideal, "C0"), (paper, "C1")):
    motion = ph.simulate(
        hammer, ph.PulseTrain(hammer.waveform), duration="3 ms", points=6001
    )
    part_of_stroke = (motion.x - hammer.position) / (hammer.front - hammer.position)
    axes.plot(1e3 * motion.t, part_of_stroke, colour, linewidth=1.0, label=hammer.name)
axes.axhline(1.0, color="0.6", linewidth=0.8)
axes.axhline(0.0, color="0.6", linewidth=0.8)
axes.set(
    xlabel="time (ms)",
    ylabel="way from backstop to paper",
    title="One pulse, two hammers",
    xlim=(0.0, 3.0),
)
axes.legend()

# %%
# An armature exactly at rest has forgotten its past. A slow train of the idealised
# hammer therefore starts from the same state at every firing, to the last bit: its
# exponents are minus infinity. The exponents of the hammer of 1983 are finite.

for hammer in (ideal, paper):
    slow = ph.lyapunov(hammer, rate="400 Hz", firings=200, transient=100)
    print(f"{hammer.name}: exponents {slow.exponents} per firing")

# %%
# Faster trains fire before the armature is at rest, between two bounces. Below a
# certain period, the periodic windows become narrow and alternate with strange
# windows, as the number of bounces in a period changes.

overview = ph.bifurcation(ideal, periods=np.linspace(1.1e-3, 1.6e-3, 121), refine=0)
picture = overview.plot()

# %%
# Continuation follows the orbit of one window. The orbit of one firing is born in a
# fold, and loses its stability where a multiplier is -1: there, an orbit of twice the
# period begins. Hendriks found no period doubling in his hammer; in the idealised
# hammer, period doublings are common.

window = ("1.440 ms", "1.468 ms")
branch = ph.continuation(ideal, "period", window, period="1.45 ms")
print(branch.message)
for event in branch.events:
    print(f"{1e3 * event.value:.6f} ms: {event.kind}, multipliers {event.multipliers}")
last = max(
    (event for event in branch.events if event.kind == "period doubling"),
    key=lambda event: event.value,
)
doubled = branch.doubled(last)
print(doubled.message)

# %%
# A bifurcation diagram of trains from rest shows the same doubling, and the motion
# beyond it. Both branches are drawn over the diagram, dotted where they are unstable.

grid = np.linspace(1.444e-3, 1.468e-3, 97)
diagram = ph.bifurcation(ideal, periods=grid, refine=0, firings=600, transient=400)
diagram.plot(orbits=[branch, doubled])

# %%
# Another window has a longer cascade, with orbits of 2, 4, 8 and 16 firings before
# the motion is strange.

cascade = ph.bifurcation(
    ideal,
    periods=np.linspace(1.394e-3, 1.407e-3, 79),
    refine=0,
    firings=1000,
    transient=800,
)
picture = cascade.plot()
print(*sorted({w.period for w in cascade.windows("from rest") if w.period}))

# %%
# Both tests confirm that the motion is chaotic.

strange = ph.lyapunov(ideal, period="1.4667 ms", firings=500, transient=500)
largest, error = strange.exponents[0], strange.standard_errors[0]
print(f"{largest:+.3f} ± {error:.3f} per firing: {strange.growth}")
print(f"{strange.zero_one.phrase}: {strange.zero_one.verdict}")

# %%
# The branch of the doubled orbits ends where these orbits graze the backstop, and
# soon beyond this grazing, trains are strange. With a rigid surface, the strobe map
# has no derivative at a touch with zero velocity; with a contact like that of 1983,
# branches continue through grazings. An abrupt onset of chaos at a grazing is
# therefore an effect of the idealisation.
for stop in doubled.stops:
    print(f"{1e3 * stop.parameter:.6f} ms: {stop.reason}")

plt.show()
