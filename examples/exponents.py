"""
Chaos, asked twice
==================

Is a train chaotic? The Lyapunov exponents follow how neighbouring motions part. The
0-1 test looks at the series of states alone. The two share nothing else, so that it
means something if they agree.
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
# A positive exponent is the rate at which motions part that begin alike. The other one
# is far below zero: what is a small rectangle of states at one firing is a thread at
# the next, and the dimension of the attractor is hardly more than one.
#
# The series of states walks a point about in a plane. If it is chaotic the point
# walks off at random, and the square of its distance grows with time.

walk = found.zero_one.plot()

# %%
# When does the motion come back to where it was? Diagonal lines are stretches during
# which it repeats what it did before, until it has forgotten.

returns = ph.recurrence(found.points, rate=0.05).plot()

# %%
# What is heard of all this is a train of impacts on the paper. Each interval is drawn
# against the one before: however irregular they are, a simple rule makes them.

dots = ph.section(hammer, surface="pack", period="1.15 ms", touches=2000, transient=500)
train = ph.impact_train(dots)
print(f"intervals vary by {100 * train.variation:.1f} %")
intervals = train.plot()

# %%
# The backstop is met several times each period. Velocity, and time since the firing,
# are all of the state there.

impacts = ph.section(hammer, period="1.15 ms", touches=2000, transient=500).plot()
