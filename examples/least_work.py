"""
Least work
==========

"Subsequent dots would be printed by keeping the actuator moving as in a parametric
oscillator (swing). In the limit, the only energy to be expended should be the energy
absorbed by the ribbon/paper pack" (Hendriks, 1983, discussion). In this example, the
coil brakes the armature on its way back, holds it off the backstop, throws it again,
and lands it softly at the end.
"""

import matplotlib.pyplot as plt

import printhammer as ph

hammer = ph.load("hendriks-1983")
burst = ph.least_work(hammer, rate="1 kHz", dots=2)

# %%
# The figure shows displacement, current, and the power of the coil, filled where the
# coil supplies energy and where the armature returns energy. From rest to rest, the
# net work equals the energy that the pack absorbs; the positive work, which matters
# for a supply that recovers no energy, is close to the lower bound for any current.

burst.plot()

# %%
# The energy ledger confirms these values. For the first dot, the armature has to be
# lifted off the backstop, so the work per dot decreases with the length of the burst.

print(f"adequate dots       {burst.adequate} of {burst.count}")
print(f"absorbed by pack    {1e3 * burst.ledger.pack_loss:.4f} mJ")
print(f"lost at backstop    {1e3 * burst.ledger.backstop_loss:.4f} mJ")
print(f"net work            {burst.net_ratio:.4f} of what the pack absorbs")
print(f"   of single pulses {burst.single_ratio:.4f}")
print(f"positive work       {burst.positive_ratio:.4f}")
print(f"   of any current   {burst.bound_ratio:.4f} at least")

# %%
# The swing is sensitive, since it is planned, not controlled. With a different supply
# voltage, the armature deviates from the planned motion.

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
