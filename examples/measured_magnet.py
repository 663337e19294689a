"""
A magnet from a measured force table
====================================

Equation (3) of the paper is a fit to measured forces. The table itself can replace
the fit: forces on a grid of displacements and currents, read from a CSV file and
interpolated by a bicubic spline, which is smooth enough for the integrator. In this
example, the table is computed from equation (3), so that the result can be compared
with the exact law.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
folder = Path(tempfile.mkdtemp())


def write_table(path: Path, columns: int) -> None:
    """Write a force table, with denser displacements where the force is steep."""
    magnet = hammer.magnet
    lines = ["displacement [um],current [A],force [N]"]
    for x in np.geomspace(25.4e-6, 420e-6, columns):
        for current in np.linspace(0.0, 2.0, 5):
            force = magnet.F0 - (magnet.Am - magnet.Bm * current) ** 2 / np.sqrt(x)
            lines.append(f"{1e6 * x:.9g},{current:g},{force:.9g}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


table = folder / "forces.csv"
write_table(table, 25)
print("\n".join(table.read_text(encoding="utf-8").splitlines()[:4]))

# %%
# The table replaces the magnet; the other parts are unchanged.

measured = hammer.replace("magnet", {"law": "table", "file": str(table)})
drive = ph.PulseTrain(hammer.waveform, at=["0 us", "700 us"])
exact = ph.simulate(hammer, drive, duration="2 ms", points=2001)
spline = ph.simulate(measured, drive, duration="2 ms", times=exact.t)

figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(3, 2))
above.plot(1e3 * exact.t, 1e6 * exact.x, label="equation (3)")
above.plot(1e3 * spline.t, 1e6 * spline.x, "--", label="table of 25 displacements")
above.set(ylabel="displacement (µm)", title="A magnet from a table")
above.legend()
below.plot(1e3 * exact.t, 1e9 * (spline.x - exact.x), color="C1")
below.set(xlabel="time (ms)", ylabel="difference (nm)")

# %%
# The error of the spline decreases with the fourth power of the spacing of its
# points; it is shown for the first 600 us.

counts = (13, 25, 49, 97)
largest = []
for count in counts:
    write_table(folder / f"forces-{count}.csv", count)
    other = hammer.replace(
        "magnet", {"law": "table", "file": str(folder / f"forces-{count}.csv")}
    )
    motion = ph.simulate(other, drive, duration="600 us", times=exact.t)
    largest.append(np.abs(motion.x - exact.x[: len(motion.t)]).max())
    print(f"{count:3d} displacements: largest difference {1e9 * largest[-1]:.4f} nm")

# %%
# Tables are not extrapolated. A run that leaves the table ends with the status "range
# left": in this run, the armature is thrown at the backstop so fast that it moves
# beyond the table.

thrown = ph.simulate(measured, drive, state=(hammer.front, -6.0), duration="1 ms")
print(thrown.status, "-", thrown.message)

plt.show()
