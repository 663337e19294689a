"""
Two pulses
==========

A second pulse during the settle-out acts on the armature at some phase of its
rebounds. In Hendriks (1983), figure 6 shows that 40 microseconds are decisive: if the
second pulse is fired 660 microseconds after the first, its dot is lost; at 700
microseconds, its dot is stronger than the first.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
delays = ("660 us", "700 us")
motions = {}
for delay in delays:
    drive = ph.PulseTrain(hammer.waveform, at=["0 us", delay])
    motions[delay] = ph.simulate(hammer, drive, duration="2 ms")

# %%
# The currents of overlapping pulses would add; here, the first pulse has ended when
# the second begins.

figure, axes = plt.subplots()
for delay, motion in motions.items():
    axes.plot(1e3 * motion.t, 1e6 * motion.x, label=f"second pulse at {delay}")
for place in (hammer.position, hammer.front, hammer.platen):
    axes.axhline(1e6 * place, color="0.7", linewidth=0.8, zorder=0)
axes.set(
    xlabel="time (ms)",
    ylabel="displacement (µm)",
    title="Two pulses",
    xlim=(0.0, 2.0),
    ylim=(30.0, 400.0),
)
axes.legend(loc="center right")

# %%
# The output lists the dots, and the state of the armature at the second firing. A dot
# is lost if no pack contact begins between its firing and the next firing.

for delay, motion in motions.items():
    first, second = motion.dots
    _, x, v = motion.strobe
    way = 1e6 * (x[1] - hammer.position)
    print(f"{delay}: at the second firing x - b = {way:+.2f} um, v = {v[1]:+.3f} m/s")
    if second.struck:
        ratio = second.peak_force / first.peak_force
        flight = 1e6 * second.flight_time
        print(f"        {ratio:.3f} times the peak force, flight time {flight:.1f} us")
    else:
        largest = 1e6 * motion.peak_after(1)[1]
        print(f"        lost, largest displacement {largest:.1f} um")

# %%
# The next figure repeats this for a range of delays. Each run is independent and
# takes milliseconds, so that a simple loop suffices. Gaps in the curves are lost
# dots.

swept = np.arange(500e-6, 1500e-6, 5e-6)
peaks = np.full(len(swept), np.nan)
flights = np.full(len(swept), np.nan)
for i, delay in enumerate(swept):
    run = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=[0.0, delay]), points=2)
    dot = run.dots[1]
    if dot.struck:
        peaks[i], flights[i] = dot.peak_force, dot.flight_time

figure, (above, below) = plt.subplots(2, 1, sharex=True)
above.plot(1e6 * swept, peaks, ".", markersize=4)
above.axhline(motions["660 us"].dots[0].peak_force, color="0.6", linewidth=0.8)
above.set(
    ylabel="peak force (N)",
    title="The second dot against the delay; grey: the first dot",
)
below.plot(1e6 * swept, 1e6 * flights, ".", markersize=4, color="C1")
below.axhline(1e6 * motions["660 us"].dots[0].flight_time, color="0.6", linewidth=0.8)
below.set(xlabel="delay of the second pulse (µs)", ylabel="flight time (µs)")

plt.show()
