"""
Two tests for chaos
===================

The example tests whether a train is chaotic. The Lyapunov exponents measure how fast
neighbouring motions diverge. The 0-1 test uses the series of states alone. The two
tests are otherwise independent, so that their agreement is significant.
"""

import printhammer as ph

hammer = ph.load("hendriks-1983")

for period in ("1.25 ms", "1.20 ms", "1.15 ms"):
    found = ph.lyapunov(hammer, period=period, firings=500, transient=500)
    largest, error = found.exponents[0], found.standard_errors[0]
    print(f"{period}: {largest:+.3f} ± {error:.3f} per firing, {found.growth}")
    print(f"         {found.zero_one.phrase}: {found.zero_one.verdict}")
estimates = found.plot()

# %%
# A positive exponent is the rate at which initially close motions diverge. The other
# exponent is far below zero: a small rectangle of states at one firing is stretched
# to a thin strip at the next, and the dimension of the attractor is hardly more than
# one.
#
# In the 0-1 test, the series of states drives a point in a plane. If the series is
# chaotic, the point performs a random walk, and its mean square displacement grows
# with time.

walk = found.zero_one.plot()

# %%
# A recurrence plot shows when the motion returns to an earlier state. Diagonal lines
# are intervals during which the motion repeats an earlier interval, until the two
# diverge.

returns = ph.recurrence(found.points, rate=0.05).plot()

# %%
# The audible part of this motion is a train of impacts on the paper. Each interval
# between impacts is plotted against the preceding interval: although the intervals
# are irregular, a simple rule generates them.

dots = ph.section(hammer, surface="pack", period="1.15 ms", touches=2000, transient=500)
train = ph.impact_train(dots)
print(f"intervals vary by {100 * train.variation:.1f} %")
intervals = train.plot()

# %%
# The armature strikes the backstop several times per period. At these contacts,
# velocity and time since the firing determine the state.

impacts = ph.section(hammer, period="1.15 ms", touches=2000, transient=500).plot()
