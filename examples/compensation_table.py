"""
A compensation table
====================

If a hammer is fired before it has come to rest, it prints too hard or too soft, too
early or too late. "Driving current waveforms ought to respond to the phase of the
hammer motion and the pattern to be printed" (Hendriks, 1983, discussion). Firmware
knows the pattern: a compensation table tells it when to fire, and for how long.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
rate = 1300.0
table = ph.tune(hammer, rate=rate, history=1)

# %%
# The same pattern is printed with one pulse for all dots, and with the table.

slots = np.array([0, 1, 2, 3, 5, 6, 8, 11, 12, 13])
drives = {
    "open loop": ph.PulseTrain(hammer.waveform, at=1e-3 + slots / rate),
    "table": table.drive(hammer, slots.tolist(), rate),
}
figure, axes = plt.subplots(2, 1, sharex=True, sharey=True)
single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform)).dots[0]
for axis, (name, drive) in zip(axes, drives.items(), strict=True):
    motion = ph.simulate(hammer, drive)
    axis.axhspan(90, 110, color="0.9")
    axis.vlines(slots, 0, 100, color="0.7", linewidth=0.8)
    for dot in motion.dots:
        if dot.struck:
            arrival = dot.fired_at + dot.flight_time - 1e-3 - single.flight_time
            axis.plot(arrival * rate, 100 * dot.peak_force / single.peak_force, "C0o")
    axis.set(ylabel="force (%)", title=name)
axes[0].set_ylim(60, 150)
axes[-1].set_xlabel("place of the dot (slots)")

# %%
# The table that the firmware receives has later and narrower pulses for dots that are
# fired while the hammer rises from the backstop.

picture = table.plot()

# %%
# A table has no sensor. The report shows its gain, and its loss if the hammer differs
# slightly from the hammer for which the table was tuned.

cases = (ph.Perturbation(), ph.Perturbation(current=0.03), ph.Perturbation(current=0.1))
report = ph.judge_table(hammer, table, perturbations=cases)
picture = report.plot()
for name, share in zip(report.hammers, report.good.mean(axis=(2, 3)).T, strict=True):
    print(f"{name:15}  open loop {share[0]:6.1%}  table {share[1]:6.1%}")
