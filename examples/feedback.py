"""
Feedback
========

"Driving current waveforms ought to respond to the phase of the hammer motion and the
pattern to be printed" (Hendriks, 1983, discussion). In this example, a controller
that knows the nominal hammer, and measures the displacement of the real hammer with
20 microseconds of delay and 1 % noise, throws the armature, pushes it into the pack,
catches it on its way back and brakes it before the backstop.
"""

import matplotlib.pyplot as plt

import printhammer as ph

hammer = ph.load("hendriks-1983")
found = ph.feedback(hammer, rate="1.6 kHz")

# %%
# The comparison includes all patterns of eight slots from rest, and pairs of dots at
# all distances. In open loop, the force and the time of the second dot depend on the
# phase of the rebound.

found.plot()

# %%
# In a single run, the controller evaluates the samples shortly before each touch. It
# then decides when the push for the dot ends, and how the armature reaches the next
# dot: by a short swing, or via the backstop, where a brake pulse makes it land
# softly.

found.plot_run()

# %%
# The last lines show the number of patterns with all forces within 10 %, all arrivals
# within 50 us, and neither lost dots nor extra contacts, and the peak current.

for number, name in enumerate(found.strategies):
    passed, peak = found.passed[number], found.peak_current[number]
    print(f"{name:10}  {passed.sum():3d} of {passed.size} patterns, peak {peak:.2f} A")

plt.show()
