"""
A hammer idealised to the limit
===============================

How little does a hammer need in order to bounce into chaos? P. C. Tung and S. W. Shaw
(ASME J. Vib. Acoust. 110 (1988) 193) left a rigid mass, a preloaded spring of negative
stiffness for magnet and flexure together, half-sine pulses of force, a spring and a
dashpot for the paper, and a coefficient of restitution for the backstop. All of these
are parts that can be replaced, and so their hammer is a file. The constants in it are
assumed, none is theirs.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

ideal = ph.load("tung-shaw-1988")
paper = ph.load("hendriks-1983")
for name, part in ideal.parts.items():
    print(f"{name:9} {part}")

# %%
# After one pulse both hammers bounce at the backstop. The idealised one makes
# infinitely many bounces in a finite time, and then rests altogether. The backstop of
# 1983 is a contact that gives way, with forces that begin smoothly: the armature sinks
# into it, and is never entirely at rest.

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
# What is at rest has forgotten how it came there. A slow train of the idealised hammer
# therefore begins anew at every firing, to the last bit: its exponents are minus
# infinity. Those of the hammer of 1983 are finite.

for hammer in (ideal, paper):
    slow = ph.lyapunov(hammer, rate="400 Hz", firings=200, transient=100)
    print(f"{hammer.name}: exponents {slow.exponents} per firing")

# %%
# Faster trains fire before it rests, somewhere between two bounces. Below a certain
# period the regular windows become narrow and alternate with strange ones, as the
# number of bounces that fit into a period changes.

overview = ph.bifurcation(ideal, periods=np.linspace(1.1e-3, 1.6e-3, 121), refine=0)
picture = overview.plot()

# %%
# One of the windows, followed by continuation. The orbit of one firing is born in a
# fold, and loses its stability where a multiplier is -1: an orbit of twice the period
# begins there. Hendriks found no such thing in his hammer; in this one it is common.

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
# Brute force shows the same, and what follows: trains from rest, and over them both
# branches, dotted where they are unstable.

grid = np.linspace(1.444e-3, 1.468e-3, 97)
diagram = ph.bifurcation(ideal, periods=grid, refine=0, firings=600, transient=400)
diagram.plot(orbits=[branch, doubled])

# %%
# Another window has more of it, orbits of 2, 4, 8 and 16 firings, before it is strange.

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
# Strange indeed, by both tests.

strange = ph.lyapunov(ideal, period="1.4667 ms", firings=500, transient=500)
largest, error = strange.exponents[0], strange.standard_errors[0]
print(f"{largest:+.3f} ± {error:.3f} per firing: {strange.growth}")
print(f"{strange.zero_one.phrase}: {strange.zero_one.verdict}")

# %%
# The branch of the doubled orbits ended where they graze the backstop, and soon after
# it trains are strange. A touch without velocity is where the strobe map of a rigid
# surface has no derivative; with a contact such as that of 1983 branches go on through
# grazings. What sets in at once, at a grazing, is made by the idealisation.
for stop in doubled.stops:
    print(f"{1e3 * stop.parameter:.6f} ms: {stop.reason}")

plt.show()
