"""
What a better backstop would gain
=================================

The paper concludes that "passive damping methods should be improved, probably
requiring a breakthrough in materials". In this example, the backstop is replaced, and
the current is adjusted such that a single pulse prints with the same force as before.
The materials then differ only in how the hammer settles, and in the rate at which it
may be fired.
"""

# %%
# The study compares three hard backstops with different damping and two elastomers,
# which deform by some micrometres and creep back. The safe rate is computed on a
# coarse grid.

import printhammer as ph

hammer = ph.load("hendriks-1983")
damping = hammer.backstop.damping
stop = hammer.backstop.position


def elastomer(stiffness, relaxation_time):
    """Return the constants to replace for an elastomer backstop."""
    return {
        "backstop": {
            "law": "elastomer",
            "position": stop,
            "stiffness": stiffness,
            "relaxation_time": relaxation_time,
        }
    }


materials = [
    ph.Material("as it is", "as it is", {}),
    ph.Material("hard", "half the damping", {"backstop.damping": 0.5 * damping}),
    ph.Material("hard", "twice the damping", {"backstop.damping": 2 * damping}),
    ph.Material("hard", "four times the damping", {"backstop.damping": 4 * damping}),
    ph.Material("elastomer", "soft elastomer", elastomer(8e7, 100e-6)),
    ph.Material("elastomer", "stiff elastomer", elastomer(8e8, 30e-6)),
]
found = ph.damping_study(hammer, materials, first=300, step=100)
found.plot()

# %%
# For any material, the backstop absorbs the energy that the pack does not absorb:
# damping saves no energy, but it saves time. The fewer rebounds, the sooner the next
# dot may be fired.

for number, material in enumerate(materials):
    print(
        f"{material.label:24s} settles in {1e3 * found.settle_out[number]:.2f} ms,"
        f" {found.rebounds[number]:.0f} rebounds,"
        f" safe up to {found.safe_rate[number]:g} Hz"
    )
best = found.best
print(f"best: {materials[best].label}, at {found.peak_current[best]:.2f} A")
