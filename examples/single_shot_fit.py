"""
Mass and damping from a single shot
===================================

The displacement record of one shot determines the mass of the armature and the
damping of the backstop, if the static forces are known. The fit uses multiple
shooting: the record is divided between the contacts, each segment is integrated
separately, and the constants are refined until the segments join.
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
# The residuals are noise, without a trace of the contacts.

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
# A motion depends only on forces divided by the mass. If the mass and all forces are
# free, the fit is undetermined, which is an error:

everything = ["mass", "magnet.F0", "magnet.Am", "magnet.Bm", "spring.Bs"]
everything += ["pack.stiffness", "backstop.stiffness", "backstop.damping"]
try:
    ph.fit("motion", folder / "shot.csv", hammer=start, free=everything)
except ph.InputError as error:
    print(str(error).rpartition("/")[2])

plt.show()
