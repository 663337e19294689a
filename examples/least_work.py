"""
Least work
==========

"Subsequent dots would be printed by keeping the actuator moving as in a parametric
oscillator (swing). In the limit, the only energy to be expended should be the energy
absorbed by the ribbon/paper pack" (Hendriks, 1983, discussion). Here the coil brakes
the armature on its way back, waits with it off the backstop, throws it again, and lets
it down at the end.
"""

import matplotlib.pyplot as plt

import printhammer as ph

hammer = ph.load("hendriks-1983")
burst = ph.least_work(hammer, rate="1 kHz", dots=2)

# %%
# Displacement, current, and the power of the coil: filled where the coil gives, and
# where the armature gives back. From rest to rest the net work is what the pack
# absorbs; the positive work, which counts for a supply that takes nothing back, comes
# close to what no current can do without.

burst.plot()

# %%
# The ledger proves it. The first dot has to be lifted off the backstop, so the
# longer the burst, the less a dot costs.

print(f"adequate dots       {burst.adequate} of {burst.count}")
print(f"absorbed by pack    {1e3 * burst.ledger.pack_loss:.4f} mJ")
print(f"lost at backstop    {1e3 * burst.ledger.backstop_loss:.4f} mJ")
print(f"net work            {burst.net_ratio:.4f} of what the pack absorbs")
print(f"   of single pulses {burst.single_ratio:.4f}")
print(f"positive work       {burst.positive_ratio:.4f}")
print(f"   of any current   {burst.bound_ratio:.4f} at least")

# %%
# The swing is fragile: it is planned, not controlled. With another supply voltage the
# armature is no longer where the plan has it.

check = burst.under_supply([-0.03, -0.01, -0.003, 0.0, 0.003, 0.01, 0.03])
figure, axes = plt.subplots()
axes.plot(100.0 * check.changes, check.weakest, "o-")
axes.axhline(burst.force, color="0.6", linewidth=0.8)
axes.set(
    xlabel="change of the current (%)",
    ylabel="weakest dot, force over single pulse",
    title="A plan is not a controller",
)

plt.show()
