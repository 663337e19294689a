"""
A hammer file in inches and pounds
==================================

Units exist only at the interfaces of the program. A hammer file may mix units freely.
Internally, all values are in SI; when the hammer is saved, the file keeps its
comments and units, and replaced constants are written in the units in which they were
specified.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import printhammer as ph

text = """
format = 1
name = "shop-hammer"
title = "A hammer as a workshop would describe it"

# Weighed with the wire.
mass = { value = 0.014, unit = "oz", status = "assumed", source = "shop scale" }
platen = { value = 15, unit = "mil", status = "stated", source = "feeler gauge" }

[spring]
law = "linear"
Bs = { value = 3.2, unit = "lbf", status = "stated", source = "spring balance" }
As = { value = 18.4, unit = "mil", status = "derived", source = "slope over 10 mil" }

[magnet]
law = "inverse-root"
F0 = { value = 0.55, unit = "lbf", status = "derived", source = "fit" }
Am = { value = 2.92, unit = "lbf^0.5 mil^0.25", status = "derived", source = "fit" }
Bm = { value = 0.622, unit = "lbf^0.5 mil^0.25/A", status = "derived", source = "fit" }

[pack]
law = "power"
stiffness = { value = 58, unit = "lbf", status = "assumed", source = "one part" }
front = { value = 8, unit = "mil", status = "stated", source = "feeler gauge" }
thickness = { value = 7, unit = "mil", status = "derived", source = "15 - 8" }

[backstop]
law = "hertz"
position = { value = 2, unit = "mil", status = "stated", source = "drawing" }
# A ball of 1/8 in on a flat, both of steel; e = 0.55 at 75 in/s.
radius1 = { value = 0.0625, unit = "in", status = "stated", source = "ball gauge" }
youngs_modulus1 = { value = 30000, unit = "ksi", status = "stated", source = "steel" }
youngs_modulus2 = { value = 30000, unit = "ksi", status = "stated", source = "steel" }
poisson_ratio1 = { value = 0.29, unit = "1", status = "assumed", source = "steel" }
poisson_ratio2 = { value = 0.29, unit = "1", status = "assumed", source = "steel" }
restitution = { value = 0.55, unit = "1", status = "stated", source = "film" }
restitution_speed = { value = 75, unit = "in/s", status = "stated", source = "film" }

[waveform]
shape = "half-sine"
amplitude = { value = 1.2, unit = "A", status = "stated", source = "probe" }
width = { value = 420, unit = "us", status = "stated", source = "probe" }
"""

folder = Path(tempfile.mkdtemp())
path = folder / "shop-hammer.toml"
path.write_text(text, encoding="utf-8")
hammer = ph.load(path)

# %%
# Each constant stores the value and unit of the file, its SI value, and its source.

for constant in hammer.constants.values():
    given = f"{constant.value:g} {constant.unit}"
    si = f"{constant.si:.5g} {constant.si_unit}"
    print(f"{constant.key:27s} {given:25s} {si:25s} {constant.status}")

# %%
# Stiffness and damping of the backstop follow from the two bodies and from one
# measured rebound.

print(f"k = {hammer.backstop.k:.4g} N/m^1.5, l = {hammer.backstop.l:.4g} N s/m^2.5")

# %%
# `printhammer hammer check` prints these warnings, too.

print(hammer.warnings() or "nothing to warn about")
motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
dot = motion.dots[0]
print(f"peak force  {dot.peak_force / 4.4482216152605:.2f} lbf")
print(f"indentation {dot.indentation / 25.4e-6:.2f} mil")
figure, axes = plt.subplots()
axes.plot(1e3 * motion.t, motion.x / 25.4e-6)
for place in (hammer.position, hammer.front, hammer.platen):
    axes.axhline(place / 25.4e-6, color="0.7", linewidth=0.8, zorder=0)
axes.set(
    xlabel="time (ms)",
    ylabel="displacement (mil)",
    title="The hammer of the workshop, fired once",
)

# %%
# `replace` returns a new hammer and does not change the original. The fingerprint
# depends on the physics only: a constant in a different unit does not change it.

stiffer = hammer.replace(
    "pack.stiffness", "70 lbf", status="stated", source="four-part form"
)
metric = hammer.replace("mass", hammer.mass)
print(
    stiffer.fingerprint == hammer.fingerprint,
    metric.fingerprint == hammer.fingerprint,
)

# %%
# The hammer can be saved and reloaded without loss: the comments are preserved, and
# one line has changed.

stiffer.save(folder / "stiffer.toml")
again = ph.load(folder / "stiffer.toml")
assert again == stiffer
before, after = text.splitlines(), again.to_toml().splitlines()
for old, new in zip(before, after, strict=True):
    if old != new:
        print(f"- {old}\n+ {new}")

# %%
# Invalid input raises an error of one sentence that names the file, the key, the
# value and the expectation.

for wrong in (
    text.replace('"oz"', '"lbf"'),
    text.replace("mass", "mas", 1),
    text.replace("value = 8,", "value = 16,"),
):
    try:
        ph.Hammer.from_toml(wrong, name="shop-hammer.toml")
    except ph.InputError as error:
        print(error)

plt.show()
