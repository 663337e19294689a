"""
Write your own part
===================

A new law is one small file outside the package: plain scalar functions for the force
and the energy, a class with the constants, and a line that registers it. The law can
then be used in hammer files, in checks and in the kernel like the laws of the
program, and runs equally fast.
"""

from pathlib import Path

import cubic_spring
import matplotlib.pyplot as plt
import numpy as np
from scipy.special import ellipk

import printhammer as ph

# %%
# This is the whole file. Importing it has registered the law.

print(Path(cubic_spring.__file__).read_text(encoding="utf-8"))

# %%
# The paper compares its hammer with Duffing's equation, which a mass on this spring
# obeys: m x'' + K x + D x^3 = 0.

oscillator = ph.Hammer.build(
    "1 kg",
    name="duffing",
    spring={"law": "hardening", "stiffness": "1 N/m", "cubic": "1 N/m^3"},
)
print(oscillator.to_toml())

# %%
# The period of its free oscillations decreases with the amplitude. The exact period
# is an elliptic integral, T = 4 K(m) / sqrt(1 + a^2) with m = a^2 / (2 (1 + a^2)).

still = ph.SineForce("0 N", "1 Hz")
amplitudes = np.geomspace(0.1, 10.0, 25)
periods = []
for amplitude in amplitudes:
    motion = ph.simulate(
        oscillator, still, state=(amplitude, 0.0), duration=100.0, points=2
    )
    tops, _ = motion.maxima
    periods.append((tops[-1] - tops[0]) / (len(tops) - 1))
exact = (
    4.0
    * ellipk(amplitudes**2 / (2.0 * (1.0 + amplitudes**2)))
    / np.sqrt(1.0 + amplitudes**2)
)

figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(3, 2))
above.loglog(amplitudes, periods, "o", markersize=4, label="run")
above.loglog(amplitudes, exact, linewidth=0.9, color="0.3", label="elliptic integral")
above.set(ylabel="period (s)", title="A Duffing oscillator from a part of one's own")
above.legend()
below.loglog(
    amplitudes,
    np.abs(np.array(periods) / exact - 1.0) + 1e-17,
    "o-",
    markersize=3,
    color="C1",
)
below.set(xlabel="amplitude (m)", ylabel="relative error")

# %%
# A hammer file that names the law can be read once the part is registered. A wrong
# key is an error, as in any other part.

try:
    oscillator.replace("spring.qubic", "1 N/m^3")
except ph.InputError as error:
    print(error)

plt.show()
