"""
How fast may a hammer print?
============================

Two numbers decide what a wire prints at a rate: how hard each dot is struck, and
when. Both depend on the preceding dots, since the armature has not settled when it is
fired again. The safe rate is the largest rate up to which every pattern of eight
slots from rest, and a cycle in which all such patterns follow each other, is printed
within limits: force within 10 % and flight time within 50 µs of a single pulse, and
no second contact.
"""

# %%
# The rates are simulated one after the other, also beyond the first rate that fails,
# to show how the dots begin to differ. The bands reach from the largest negative to
# the largest positive deviation of a dot.

import printhammer as ph

hammer = ph.load("hendriks-1983")
safe = ph.safe_rate(hammer, first=600, last=1100, step=25, stop=False, tolerance=5e-7)
picture = safe.plot()
print(f"safe up to {safe.rate:g} Hz. {safe.failure.text}")

# %%
# Beyond the safe rate there are good and bad rates. For the worst rate, the quality
# report shows which dots are outside the limits, and which tolerances the flight
# times satisfy: the paper mentions 200 µs peak to peak for dot matrix printing, and a
# few tens of microseconds for engraved characters.

worst = safe.rates[(safe.force_high - safe.force_low).argmax()]
report = ph.quality(hammer, worst)
picture = report.plot()
good = (report.fault < 0).sum()
print(f"{good} of {len(report.fault)} dots within limits at {worst:g} Hz")
print(f"flight times differ by {1e6 * report.flight_time_spread.peak_to_peak:.0f} µs")
print("good enough for dot matrix printing:", report.dot_matrix)
print("good enough for engraved characters:", report.engraved)
print(f"the backstop takes {1e3 * report.backstop_loss:.2f} mJ a dot")

# %%
# No hammer matches its drawing exactly. The last lines evaluate, at one rate, 32
# random hammers whose constants are within 1 % of the design.

hammers = ph.tolerance_yield(hammer, 825, number=32, spreads=0.01)
picture = hammers.plot()
print(f"{100 * hammers.share:.0f} % of the hammers print well at {hammers.rate:g} Hz")
