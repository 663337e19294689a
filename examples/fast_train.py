"""
A fast train that loses dots
============================

At low rates, every dot is like the first. At rates for which the settle-out is
incomplete, flight times and forces begin to differ, and at some rates dots are lost:
in this example, every second dot.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
slow = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate="500 Hz", pulses=9))
fast = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate="1 kHz", pulses=9))

figure, axes = plt.subplots(2, 1)
for panel, motion, name in zip(axes, (slow, fast), ("500 Hz", "1 kHz"), strict=True):
    panel.plot(1e3 * motion.t, 1e6 * motion.x, linewidth=0.9)
    panel.axhline(1e6 * hammer.front, color="0.6", linewidth=0.8, zorder=0)
    for dot in motion.dots:
        colour = "C2" if dot.struck else "C3"
        panel.plot(
            1e3 * dot.fired_at, 30.0, "^", color=colour, markersize=4, clip_on=False
        )
    panel.set(ylabel="displacement (µm)", title=name, ylim=(30.0, 320.0))
axes[0].set_title("Nine pulses at 500 Hz; triangles: firings, green struck, red lost")
axes[1].set_title("Nine pulses at 1 kHz")
axes[1].set_xlabel("time (ms)")

# %%
# The table has one line for each firing. The first pack contact between a firing and
# the next makes the dot; further pack contacts count as extra contacts.

for dot in fast.dots:
    if dot.struck:
        flight = 1e6 * dot.flight_time
        print(
            f"{dot.index}: flight time {flight:6.1f} us, force {dot.peak_force:5.2f} N"
        )
    else:
        print(f"{dot.index}: lost")

# %%
# The next figure shows nine-pulse bursts at many rates. According to the abstract of
# the paper, flight times and forces vary first, then strict periodicity is lost.

rates = np.arange(400.0, 2001.0, 25.0)
lost = np.zeros(len(rates))
spread = np.full(len(rates), np.nan)
for i, rate in enumerate(rates):
    motion = ph.simulate(
        hammer, ph.PulseTrain(hammer.waveform, rate=rate, pulses=9), points=2
    )
    flights = [dot.flight_time for dot in motion.dots if dot.struck]
    lost[i] = sum(not dot.struck for dot in motion.dots)
    spread[i] = max(flights) - min(flights)

figure, (above, below) = plt.subplots(2, 1, sharex=True)
above.semilogy(rates, 1e6 * spread, ".-", markersize=3, linewidth=0.5)
above.set(ylabel="spread of the\nflight times (µs)", title="Nine-pulse bursts")
below.bar(rates, lost, width=18.0, color="C3")
below.set(xlabel="rate (Hz)", ylabel="lost dots of nine")

plt.show()
