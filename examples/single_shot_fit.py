"""
Mass and damping from a single shot
===================================

The record of one shot, as a sensor shows it, tells the mass of the armature and the
damping of the backstop, if the static forces are known. The record is cut between
the contacts; each piece is integrated by itself until the constants are so good that
the pieces fit together.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import printhammer as ph

hammer = ph.load("hendriks-1983")
folder = Path(tempfile.mkdtemp())
record = ph.measure(
    "motion",
    hammer,
    seed=3,
    duration=1.6e-3,
    sensor={"noise": {"displacement": "1 um"}},
)
record.write(folder / "shot.csv")

start = hammer.replace({"mass": "1.2 g", "backstop.damping": 3e10})
found = ph.fit("motion", folder / "shot.csv", hammer=start)
for key, constant in found.constants.items():
    true = hammer.constants[key].si
    off = (constant.value - true) / constant.standard_error
    value = f"{constant.value:.6g} {constant.unit}"
    print(f"{key}: {value}, {off:+.1f} standard errors from the truth")

# %%
# What is left over is noise: no contact shows in it.

first = ph.simulate(start, ph.PulseTrain(start.waveform), duration=1.6e-3)
figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(3, 1))
above.plot(
    1e6 * found.abscissa,
    1e6 * found.data,
    ".",
    markersize=2,
    color="0.6",
    label="record",
)
above.plot(
    1e6 * first.t, 1e6 * first.x, "--", linewidth=1.0, label="where the fit began"
)
above.plot(1e6 * found.abscissa, 1e6 * found.fitted, linewidth=1.0, label="fit")
above.axhline(1e6 * hammer.front, color="0.8", linewidth=0.8)
above.axhline(1e6 * hammer.position, color="0.8", linewidth=0.8)
above.set_ylabel("displacement (µm)")
above.legend()
below.plot(1e6 * found.abscissa, 1e6 * found.residuals, ".", markersize=2)
below.set(xlabel="time (µs)", ylabel="residual (µm)")

# %%
# A motion shows forces divided by the mass only. Free them all, and there is no answer:

everything = ["mass", "magnet.F0", "magnet.Am", "magnet.Bm", "spring.Bs"]
everything += ["pack.stiffness", "backstop.stiffness", "backstop.damping"]
try:
    ph.fit("motion", folder / "shot.csv", hammer=start, free=everything)
except ph.InputError as error:
    print(str(error).rpartition("/")[2])

plt.show()
