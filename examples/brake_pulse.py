"""
Brake pulse
===========

After a dot, the armature falls back and rebounds from the backstop several times. A
second, narrower pulse, fired while the armature falls, lets it land softly: the
drive, instead of the damping, absorbs the energy. A scan over the time and the width
of this brake pulse finds the best one.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
pulse = hammer.waveform
alone = ph.simulate(hammer, ph.PulseTrain(pulse), duration="4 ms")
touch = alone.dots[0].flight_time

# %%
# In a sequence, every firing has its own waveform. The first prints; the second is
# the hammer's own pulse with a different width. All combinations of time and width
# form one ensemble. The criterion is the height of the rebounds after the landing.

delays = np.linspace(touch, 4.0 * touch, 121)
widths = np.linspace(0.02, 1.0, 50) * pulse.width
brakes = [hammer.replace("waveform.width", width).waveform for width in widths]
drives = [ph.PulseSequence([pulse, b], at=[0, t]) for b in brakes for t in delays]

times = np.linspace(0.0, 4e-3, 2001)
x = ph.Ensemble(hammer, drives, times[-1]).run(times=times).x


def rebound(x):
    """Return the largest height above the backstop after the landing, m."""
    landed = np.logical_or.accumulate((x < hammer.position) & (times > touch), -1)
    return np.where(landed, x - hammer.position, 0.0).max(axis=-1)


heights = rebound(x).reshape(len(widths), len(delays))
row, column = np.unravel_index(heights.argmin(), heights.shape)
best, delay = brakes[row], delays[column]

figure, axes = plt.subplots()
shades = axes.pcolormesh(
    1e6 * delays,
    1e6 * widths,
    np.log10(1e6 * heights),
    cmap="viridis_r",
    rasterized=True,
)
axes.plot(1e6 * delay, 1e6 * best.width, "o", mfc="none", mec="white", ms=9)
colours = figure.colorbar(shades, ax=axes, label="highest rebound (µm)")
colours.set_ticks([0, 1, 2], labels=["1", "10", "100"])
axes.set(
    xlabel="brake pulse fired (µs after the first)",
    ylabel="its width (µs)",
    title="How high the armature rebounds",
)

# %%
# The print pulse and the best brake pulse can be combined into a chain, which is a
# waveform like any other, for use in trains, bursts and drive files.

chain = ph.Chain(parts=((0.0, pulse), (float(delay), best)))
braked = ph.simulate(hammer, ph.PulseTrain(chain), duration="4 ms")

figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(2, 1))
for motion, name in ((alone, "single pulse"), (braked, "with a brake pulse")):
    above.plot(1e3 * motion.t, 1e6 * motion.x, label=name)
    below.plot(1e3 * motion.t, motion.current)
    touches = [one for one in motion.contacts if one.surface == "backstop"]
    hard = max(abs(one.v_in) for one in touches)
    print(f"{name:18}  {len(touches):2} touches, the hardest at {hard:.3f} m/s")
for place in (hammer.position, hammer.front):
    above.axhline(1e6 * place, color="0.7", linewidth=0.8, zorder=0)
above.set(ylabel="displacement (µm)", title="A soft landing", xlim=(0.0, 2.0))
above.legend()
below.set(xlabel="time (ms)", ylabel="current (A)")

# %%
# The last figure shows a second dot against the time of its pulse: fired into the
# rebounds of a single pulse, and fired after the soft landing.

gaps = np.linspace(delay + touch, 8.0 * touch, 241)
figure, axes = plt.subplots()
for wave, name in ((pulse, "after a single pulse"), (chain, "after a brake pulse")):
    drives = [ph.PulseSequence([wave, pulse], at=[0.0, gap]) for gap in gaps]
    dots = ph.Ensemble(hammer, drives, gaps[-1] + 1e-3).run(dots=True).dots
    forces = np.where(dots.struck[:, 1], dots.peak_force[:, 1], np.nan)
    axes.plot(1e3 * gaps, forces, label=name)
axes.axhline(alone.dots[0].peak_force, color="0.6", linewidth=0.8)
axes.set(
    xlabel="second dot fired (ms after the first)",
    ylabel="its peak force (N)",
    title="The second dot; grey: the force of the first",
)
axes.legend()

plt.show()
