"""
The energy ledger
=================

The energy ledger lists the work of the coil, the energy absorbed by ribbon, paper and
backstop, and the stored energy. Every term is integrated separately along the run; no
term is computed as a difference of others, so that the sum of all terms is a check on
the whole run.
"""

import matplotlib.pyplot as plt

import printhammer as ph

hammer = ph.load("hendriks-1983")
drive = ph.PulseTrain(hammer.waveform)
motion = ph.simulate(hammer, drive)

# %%
# From rest to rest, kinetic and stored energy return to their initial values, and the
# work of the coil equals the energy absorbed by the contacts.

ledger = motion.energy
for name in ("coil_work", "pack_loss", "backstop_loss", "kinetic", "stored"):
    print(f"{name:14s} {1e3 * getattr(ledger, name):10.6f} mJ")
share = abs(ledger.residual) / ledger.throughput
print(f"{'residual':14s} {ledger.residual:10.1e} J, {share:.0e} of the throughput")

# %%
# The same losses, contact by contact: where rebounds follow in ever shorter
# intervals, small losses add up to a high power.

contacts = [c for c in motion.contacts if not c.initial]
figure, axes = plt.subplots()
colours = {"pack": "C2", "backstop": "C0"}
labels = [f"{c.surface}\n{1e6 * c.t_in:.0f} µs" for c in contacts]
losses = [1e3 * c.loss for c in contacts]
bars = axes.bar(labels, losses, color=[colours[c.surface] for c in contacts])
axes.bar_label(bars, [f"{loss:.2g}" for loss in losses], fontsize=8)
axes.set(ylabel="loss (mJ)", title="What each contact took, and when it began")

# %%
# The force of the pack against displacement: the area of the loop is the net loss,
# the area below its upper branch the loading work. Loading follows r to the power
# 2.7, unloading the power 11.

dot = motion.dots[0]
touch = next(c for c in contacts if c.surface == "pack")
times = [touch.t_in + k * (touch.t_out - touch.t_in) / 600 for k in range(601)]
x, _ = motion.at(times)
force = -motion.forces_at(times)["pack"]
figure, axes = plt.subplots()
axes.fill(1e6 * (x - hammer.front), force, alpha=0.2)
axes.plot(1e6 * (x - hammer.front), force)
axes.set(
    xlabel="indentation (µm)",
    ylabel="force on the pack (N)",
    title=f"Work {1e3 * dot.loading_work:.3f} mJ, loss {1e3 * dot.net_loss:.3f} mJ",
)

# %%
# The residual decreases with the tolerance of the run. At the default of 2e-11, it is
# below a billionth of the throughput.

tolerances = [10.0**-k for k in range(5, 14)]
residuals = []
for tolerance in tolerances:
    run = ph.simulate(hammer, drive, tolerance=tolerance, points=2)
    residuals.append(abs(run.energy.residual) / run.energy.throughput)
figure, axes = plt.subplots()
axes.loglog(tolerances, residuals, "o-")
axes.invert_xaxis()
axes.set(
    xlabel="tolerance",
    ylabel="|residual| / throughput",
    title="Closure of the ledger",
)

plt.show()
