"""
A printed line
==============

This example prints a text as dots of nine wires, with a hammer on each wire and a
carriage that moves one column per slot. A dot with a shorter or longer flight than
the others is misplaced, a weak dot is grey, and a lost dot is missing.
"""

import matplotlib.pyplot as plt
import numpy as np

import printhammer as ph

hammer = ph.load("hendriks-1983")
text = "Bounce and chaotic motion in impact print hammers"
page = ph.print_page(hammer, text, rate="1.5 kHz")
figure = page.plot()

# %%
# The page lists every requested dot, with its outcome.

on = page.printed
error = 1e6 * page.placement_error[on]
print(f"{page.line.size} dots wanted, {on.sum()} printed, {page.lost.sum()} lost")
print(f"carriage {page.speed:.3f} m/s, single pulse {page.nominal.force:.1f} N")
print(f"placement error {error.std():.1f} um, worst {np.abs(error).max():.1f} um")
print(f"darkness {page.darkness[on].min():.2f} to {page.darkness[on].max():.2f}")
for fault, count in page.fault_counts.items():
    print(f"  {fault:15s}{count:5d}")

# %%
# The faster the carriage, the less the hammers have settled when they are fired
# again. Simulating a page takes a fraction of a second, so that many rates can be
# compared.

pattern = page.pattern
rates = np.arange(600.0, 2001.0, 50.0)
pages = [ph.print_page(hammer, pattern, rate) for rate in rates]
lost = [100 * one.lost.mean() for one in pages]
spread = [1e6 * np.std(one.arrival_deviation[one.printed]) for one in pages]
light = [100 * (one.printed & (one.force_ratio < 0.9)).mean() for one in pages]

figure, (above, below) = plt.subplots(2, 1, sharex=True)
above.plot(rates, spread, ".-")
above.set(ylabel="spread of arrival (µs)", title="The same text at other rates")
below.plot(rates, lost, ".-", label="lost")
below.plot(rates, light, ".-", label="force below 90 %")
below.set(xlabel="slots per second (Hz)", ylabel="dots (%)", ylim=(0.0, None))
below.legend()

# %%
# A pattern can also be read from a file, for instance a bitmap, and saved to a file.
# This pattern is the letter A as nine rows of six slots.

letter = ph.Pattern.from_text("A")
for row in letter.dots[0]:
    print("".join("#" if dot else "." for dot in row))

plt.show()
