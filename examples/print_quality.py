"""
How fast may it print?
======================

Two numbers decide what a wire prints at a rate: how hard each dot is struck, and when.
Both depend on the dots before, since the armature has not settled when it is fired
again. The safe rate is the largest rate up to which every pattern of eight slots from
rest, and a cycle in which all such patterns follow each other, is printed within
limits: the force of a single pulse within 10 %, its flight time within 50 µs, no second
contact.
"""

# %%
# The rates are run one after the other, and beyond the first that fails, to see how the
# dots drift apart. Bands reach from the worst dot on one side to the worst dot on the
# other.

import printhammer as ph

hammer = ph.load("hendriks-1983")
safe = ph.safe_rate(hammer, first=600, last=1100, step=25, stop=False, tolerance=5e-7)
picture = safe.plot()
print(f"safe up to {safe.rate:g} Hz. {safe.failure.text}")

# %%
# Beyond the safe rate there are good and bad rates. Of the worst of them the quality
# report tells which dots are off, and what tolerances the flight times would keep: the
# paper tells of 200 µs from peak to peak for dot matrix printing, and of a few tens of
# microseconds for engraved characters.

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
# No hammer is like its drawing. Here 32 hammers are drawn whose constants are all
# within 1 % of those of the design, and tried at one rate.

hammers = ph.tolerance_yield(hammer, 825, number=32, spreads=0.01)
picture = hammers.plot()
print(f"{100 * hammers.share:.0f} % of the hammers print well at {hammers.rate:g} Hz")
