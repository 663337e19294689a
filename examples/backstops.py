"""
Three backstops
===============

The paper describes two kinds of backstop: a hard backstop, on which the hammer
settles out with many rebounds of decreasing height, and an elastomer, with few
rebounds. A third model, a rigid surface with a coefficient of restitution, is often
used if the source of the loss is unknown. Each backstop is a part; the kernel is
compiled once for each.
"""

import matplotlib.pyplot as plt

import printhammer as ph

hard = ph.load("hendriks-1983")

# %%
# The settle-out begins when the armature returns from the paper. Its state at this
# instant is computed from a single pulse, and the three hammers start from this
# state, without current.

pulse = ph.simulate(hard, ph.PulseTrain(hard.waveform))
printing = next(c for c in pulse.contacts if c.surface == "pack")
state = (hard.front, printing.v_out)
print(f"return speed {-printing.v_out:.3f} m/s")

# %%
# The rigid backstop has the restitution of the first rebound from the hard backstop.
# The elastomer is a viscoelastic Hertz contact; it must be stiff enough to withstand
# the pull of this magnet, which grows as the armature moves behind the backstop
# position. An elastomer of 8e7 N/m^1.5, which deforms by 25 um at 10 N, is too soft,
# and the program reports this.

first = next(c for c in pulse.contacts if c.surface == "backstop" and not c.initial)
restitution = -first.v_out / first.v_in
rigid = hard.replace(
    "backstop",
    {"law": "rigid", "position": hard.position, "restitution": restitution},
)
elastomer = hard.replace(
    "backstop",
    {
        "law": "elastomer",
        "position": hard.position,
        "stiffness": 2e8,
        "relaxation_time": "10 us",
    },
)
try:
    ph.rest_state(elastomer.replace("backstop.stiffness", 8e7))
except ph.InputError as error:
    print(error)

# %%
# A drive whose only firing is after the end of the run applies no pulse.

never = ph.PulseTrain(hard.waveform, at=["1 s"])
hammers = {"hard": hard, "rigid": rigid, "elastomer": elastomer}
motions = {
    name: ph.simulate(hammer, never, state=state, duration="1 ms")
    for name, hammer in hammers.items()
}

figure, axes = plt.subplots(3, 1, sharex=True, sharey=True, figsize=(6.8, 5.0))
for panel, (name, motion) in zip(axes, motions.items(), strict=True):
    panel.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    panel.plot(1e6 * motion.t, 1e6 * (motion.x - hard.position))
    panel.set(ylabel=f"{name}\nx − b (µm)")
axes[0].set_title("Settle-out on three backstops")
axes[-1].set_xlabel("time since the return from the paper (µs)")

# %%
# On the rigid surface, infinitely many bounces occur in a finite time, after which
# the armature rests. The run counts the bounces that it can resolve and continues. A
# rigid contact has neither depth nor a finite force; its peak force is None.

for name, motion in motions.items():
    touches = [c for c in motion.contacts if c.surface == "backstop"]
    strongest = max(
        (c.peak_force for c in touches if c.peak_force is not None), default=None
    )
    force = "not finite" if strongest is None else f"{strongest:.1f} N"
    depth = 1e6 * max(c.depth for c in touches)
    print(f"{name:10s} {len(touches):3d} touches, deepest {depth:5.1f} um, {force}")

plt.show()
