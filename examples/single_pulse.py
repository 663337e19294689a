"""
One pulse
=========

The shipped hammer, fired once: release, flight, one indentation of ribbon and
paper, return, and settle-out on the backstop. This is the situation of figure 3 of
Hendriks (1983).
"""

import matplotlib.pyplot as plt

import printhammer as ph

hammer = ph.load("hendriks-1983")
print(hammer.title)

# %%
# A drive consists of a waveform and its firing times. By default, there is one firing
# at time 0, and the run ends 4 ms after the last firing. The run begins at rest, with
# the armature compressing the backstop.

drive = ph.PulseTrain(hammer.waveform)
motion = ph.simulate(hammer, drive)
print(motion)

# %%
# Each firing has a dot, its mark on the paper. All values are in SI units: seconds,
# metres, newtons, joules.

dot = motion.dots[0]
print(f"flight time     {1e6 * dot.flight_time:8.2f} us")
print(f"impact speed    {dot.impact_speed:8.3f} m/s")
print(f"peak force      {dot.peak_force:8.2f} N")
print(f"indentation     {1e6 * dot.indentation:8.2f} um")
print(f"contact time    {1e6 * dot.contact_time:8.2f} us")
print(f"loading work    {1e3 * dot.loading_work:8.4f} mJ")
print(f"net loss        {1e3 * dot.net_loss:8.4f} mJ")

# %%
# The displacement is measured from an arbitrary origin, as in the paper; the grey
# lines are the surfaces of backstop and pack and, above, the platen.

figure, (above, below) = plt.subplots(2, 1, sharex=True, height_ratios=(4, 1))
above.plot(1e3 * motion.t, 1e6 * motion.x, color="C0")
surfaces = {
    "backstop": hammer.position,
    "pack": hammer.front,
    "platen": hammer.platen,
}
for name, place in surfaces.items():
    above.axhline(1e6 * place, color="0.6", linewidth=0.8, zorder=0)
    above.text(4.0, 1e6 * place, name, ha="right", va="bottom", color="0.4", fontsize=8)
above.set(
    ylabel="displacement (µm)",
    title="One pulse",
    xlim=(0.0, 4.0),
    ylim=(30.0, 400.0),
)
below.plot(1e3 * motion.t, motion.current, color="C1")
below.set(xlabel="time (ms)", ylabel="current (A)")
figure.align_ylabels()

# %%
# Every contact with pack or backstop is listed with the velocities at its start and
# end, the depth, the peak force and the loss. The first contact is the armature at
# rest on the backstop, from which the run starts; the last contact is still open.

for contact in motion.contacts:
    left = "open" if contact.v_out is None else f"{contact.v_out:+.3f} m/s"
    print(f"{contact.surface:8s}  at {1e6 * contact.t_in:6.2f} us", end="")
    print(f"  in {contact.v_in:+.3f} m/s  out {left:>10s}", end="")
    print(f"  depth {1e6 * contact.depth:5.2f} um  peak {contact.peak_force:6.2f} N")

# %%
# The output grid does not show how well a contact is resolved. The motion can be
# evaluated at any time, by the integrator itself instead of an interpolation between
# grid points. The figure shows the first impact on the backstop, which lasts 35
# microseconds, while the grid has a point every few microseconds.

impact = next(c for c in motion.contacts if c.surface == "backstop" and not c.initial)
times = [impact.t_in + k * (impact.t_out - impact.t_in) / 400 for k in range(-80, 481)]
forces = motion.forces_at(times)
microseconds = [1e6 * (t - impact.t_in) for t in times]
figure, axes = plt.subplots()
axes.plot(microseconds, forces["backstop"], label="Hertz force, equation (6)")
axes.plot(microseconds, forces["damping"], label="viscoelastic force, equation (7)")
axes.plot(
    microseconds,
    forces["total"],
    color="0.2",
    linestyle="--",
    label="sum of all forces",
)
axes.set(
    xlabel="time since touch (µs)",
    ylabel="force (N)",
    title="First impact on the backstop",
)
axes.legend()

# %%
# The method `plot` draws the motion, with both unit systems on its axes as in the
# paper. It returns a Matplotlib figure, which can be saved or modified.

picture = motion.plot(until="2 ms")

plt.show()
