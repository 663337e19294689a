"""
The paper's hammer with a rail driver
=====================================

The paper prescribes the current of its pulse; a driver applies a voltage. With a
resistance, a constant inductance and a rail that is switched on for a time, the
circuit reproduces the current within some per cent of its peak. The agreement
improves with the rail voltage, since the back-EMF of the armature, some volts, is
then a smaller fraction of it.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

import printhammer as ph

hammer = ph.load("hendriks-1983")
pulse = hammer.waveform
t = np.linspace(0.0, 450e-6, 226)
wanted = pulse.value(t)


def behind(voltage, logarithms):
    """Return the hammer with a rail driver, for logarithms of the fitted constants."""
    resistance, inductance, width, decay = np.exp(logarithms)
    return hammer.replace(
        {
            "coil": {"resistance": resistance, "inductance": inductance},
            "waveform": {
                "shape": "rail",
                "voltage": voltage,
                "width": width,
                "decay": "diode",
                "decay_resistance": decay,
            },
        }
    )


def current(device):
    """Return the current of one pulse, A."""
    return ph.simulate(
        device, ph.PulseTrain(device.waveform), duration=500e-6
    ).driven_at(t)


# %%
# Resistance, inductance, on-time and the decay resistor are fitted: first to the mean
# square deviation, then to the largest deviation.


def fitted(voltage):
    """Return the hammer with the best rail driver, and its largest current error."""

    def deviation(logarithms):
        return (current(behind(voltage, logarithms)) - wanted) / wanted.max()

    ohms = voltage / pulse.amplitude
    start = np.log([ohms, ohms * pulse.rise + 1e-3, pulse.width, 5.0 * ohms])
    mean = least_squares(deviation, start, diff_step=1e-5)
    least = least_squares(lambda u: 1e3 * deviation(u) ** 4, mean.x, diff_step=1e-5)
    return behind(voltage, least.x), float(np.abs(deviation(least.x)).max())


devices = {voltage: fitted(voltage) for voltage in (48.0, 100.0, 200.0)}
for voltage, (device, worst) in devices.items():
    coil, rail = device.coil, device.waveform
    print(
        f"{voltage:5.0f} V  {coil.resistance:6.2f} ohm  {1e3 * coil.inductance:6.3f} mH"
        f"  on for {1e6 * rail.width:6.2f} us  decay {rail.decay_resistance:6.1f} ohm"
        f"  within {100 * worst:.2f} % of the peak"
    )

# %%
# The next lines compare the dots, and show how the energy of the supply is
# distributed.

device, _worst = devices[100.0]
motion = ph.simulate(
    device, ph.PulseTrain(device.waveform), points=2001, duration=1.2e-3
)
figure, (above, below) = plt.subplots(2, 1, sharex=True)
above.plot(1e6 * t, wanted, "k--", label="current of the paper's hammer")
above.plot(1e6 * motion.t, motion.current, label="behind a rail of 100 V")
above.set(ylabel="current (A)")
above.legend()
below.plot(1e6 * motion.t, motion.voltage)
below.set(xlabel="time (µs)", ylabel="voltage across the coil (V)")

energy = motion.energy
for name in ("supply_work", "copper_loss", "driver_loss", "coil_work", "field"):
    print(f"{name:12s} {1e3 * getattr(energy, name):9.4f} mJ")
share = energy.electric_residual / energy.throughput
print(f"{'residual':12s} {share:9.1e} of the throughput")
