"""
Feedback
========

"Driving current waveforms ought to respond to the phase of the hammer motion and the
pattern to be printed" (Hendriks, 1983, discussion). Here they do: a controller that
knows the nominal hammer, and sees the real one 20 microseconds late and with 1 % noise,
throws the armature, pushes it into the pack, catches it on its way back and brakes it
before the backstop.
"""

import matplotlib.pyplot as plt

import printhammer as ph

hammer = ph.load("hendriks-1983")
found = ph.feedback(hammer, rate="1.6 kHz")

# %%
# All patterns of eight slots from rest, and two dots at all distances. In the open loop
# the second dot comes out as hard and as late as the rebound will have it.

found.plot()

# %%
# One run. The controller looks at the samples shortly before each touch, then decides
# when the push ends that prints the dot, and how the armature gets to the next one: by
# a short swing, or by way of the backstop, where a brake pulse sets it down.

found.plot_run()

# %%
# How many patterns are within 10 % of the force and 50 us of the arrival, without lost
# dots and extra contacts?

for number, name in enumerate(found.strategies):
    passed, peak = found.passed[number], found.peak_current[number]
    print(f"{name:10}  {passed.sum():3d} of {passed.size} patterns, peak {peak:.2f} A")

plt.show()
