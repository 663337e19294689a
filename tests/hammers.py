"""Hammers and drives for tests, and the deviation of a motion from the reference.

Helpers only; assertions are in the tests that use them.
"""

import dataclasses
import functools
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from tests.oracle.integrator import ReferenceRun, reference

import printhammer as ph
from printhammer.derivatives import flow
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sampled, Trapezoid, Waveform
from printhammer.kernel.compile import specialise
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.base import Part
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.parts.pack.power import PowerPack
from printhammer.parts.spring.linear import LinearSpring, PreloadSpring

CRUDE = Path(__file__).parent / "data" / "hendriks-1983.toml"
"""A first, crude reconstruction, whose numbers tests may rely on: the shipped hammer is not meant to stay."""

MASS = 0.4e-3
STOP = 50.8e-6
FRONT = 203.2e-6
STROKE = FRONT - STOP
THICKNESS = 177.8e-6
DRAWS = int(os.environ.get("PRINTHAMMER_DRAWS", "1"))
"""Factor of the number of random devices in slow tests; 4 for the numbers of the decision notes."""
TRUTH = 1e-14
"""Tolerance of a reference that is taken for the truth."""
SLOW = 1e-4
"""Speed, m/s, below which touches are not counted one by one."""

MAGNETS: dict[str, Part | None] = {"inverse-root": InverseRootMagnet(F0=2.47, Am=0.437, Bm=0.0931), "": None}
SPRINGS: dict[str, Part | None] = {
    "linear": LinearSpring(Bs=14.3, As=466e-6),
    "preload": PreloadSpring(preload=-4.0, stiffness=3e4),
    "": None,
}
PACKS: dict[str, Part | None] = {
    "power": PowerPack(stiffness=259.0, front=FRONT, thickness=THICKNESS),
    "curve": PowerPack(stiffness=259.0, front=FRONT, thickness=THICKNESS, reloading="unloading-curve"),
    "dashpot": DashpotPack(stiffness=3e5, damping=6.0, front=FRONT),
    "dashpot-pull": DashpotPack(stiffness=3e5, damping=6.0, front=FRONT, pull=True),
    "": None,
}
BACKSTOPS: dict[str, Part | None] = {
    "hertz": HertzBackstop(position=STOP, stiffness=1.156e9, damping=4.175e8),
    # Damped so that it would pull at the speeds that occur.
    "hertz-no-pull": HertzBackstop(position=STOP, stiffness=1.156e9, damping=2.5e9, pull=False),
    "elastomer": ElastomerBackstop(position=STOP, stiffness=8e8, relaxation_time=8e-6),
    "elastomer-pull": ElastomerBackstop(position=STOP, stiffness=8e8, relaxation_time=8e-6, pull=True),
    "rigid": RigidBackstop(position=STOP, restitution=0.6),
    "": None,
}


def made_of(mass: float = MASS, **parts: Part | dict[str, str] | None) -> ph.Hammer:
    """A hammer with these parts only."""
    return ph.Hammer.build(mass, **{role: part for role, part in parts.items() if part is not None})


def hertz(stiffness: float = 1.156e9, damping: float = 0.0, position: float = STOP) -> HertzBackstop:
    """A backstop of equations (6) and (7)."""
    return HertzBackstop(position=position, stiffness=stiffness, damping=damping)


def power(stiffness: float = 259.0, front: float = FRONT, thickness: float = THICKNESS) -> PowerPack:
    """A pack of equation (5)."""
    return PowerPack(stiffness=stiffness, front=front, thickness=thickness)


def rigid(restitution: float, position: float = STOP) -> RigidBackstop:
    """A rigid backstop."""
    return RigidBackstop(position=position, restitution=restitution)


def preload(force: float, stiffness: float = 0.0) -> PreloadSpring:
    """A spring that exerts `force` at the backstop."""
    return PreloadSpring(preload=force, stiffness=stiffness)


def shelf(force: float = -4.0, mass: float = MASS) -> ph.Hammer:
    """A mass under a constant force between pack and backstop: its flight is a parabola."""
    return made_of(mass, spring=preload(force), pack=power(), backstop=hertz(damping=4.175e8))


def idle(quantity: str = "force") -> ph.PulseTrain:
    """A drive that fires once, with no effect."""
    return ph.PulseTrain(Rectangle(amplitude=0.0, width=1e-6, rise=0.0, decay=0.0, quantity=quantity))


def block(amplitude: float, width: float, start: float = 0.0, quantity: str = "force") -> ph.PulseTrain:
    """One pulse with vertical edges."""
    waveform = Rectangle(amplitude=amplitude, width=width, rise=0.0, decay=0.0, quantity=quantity)
    return ph.PulseTrain(waveform, at=[start])


def waveforms(amplitude: float, quantity: str) -> dict[str, Waveform]:
    """One waveform of every shape."""
    a, q = amplitude, quantity
    times = np.array([0.0, 20.0, 60.0, 150.0, 260.0, 330.0, 400.0]) * 1e-6
    record = np.array([0.0, 0.7, 1.0, 0.8, 0.9, 0.4, 0.0]) * a
    return {
        "rectangle": Rectangle(amplitude=a, width=352e-6, rise=10.7e-6, decay=24.3e-6, quantity=q),
        "sharp": Rectangle(amplitude=a, width=352e-6, rise=0.0, decay=0.0, quantity=q),
        "half-sine": HalfSine(amplitude=1.5 * a, width=400e-6, quantity=q),
        "trapezoid": Trapezoid(amplitude=a, rise=50e-6, width=250e-6, fall=80e-6, quantity=q),
        "long": Trapezoid(amplitude=1.6 * a, rise=50e-6, width=1.8e-3, fall=80e-6, quantity=q),
        "sampled": Sampled.from_samples(times, record, quantity=q),
        "sampled-linear": Sampled.from_samples(times, record, quantity=q, interpolation="linear"),
    }


def drives(quantity: str) -> dict[str, ph.PulseTrain | ph.SineForce]:
    """One drive of every kind: currents that lift the armature off any backstop, or comparable forces."""
    amplitude = 1.2 if quantity == "current" else 14.0
    shapes = waveforms(amplitude, quantity)
    found: dict[str, ph.PulseTrain | ph.SineForce] = {
        "single": ph.PulseTrain(shapes["rectangle"]),
        "train": ph.PulseTrain(shapes["rectangle"], period=0.9e-3, pulses=3),
        "overlap": ph.PulseTrain(shapes["rectangle"], period=0.25e-3, pulses=8),
        "replace": ph.PulseTrain(shapes["rectangle"], period=0.3e-3, pulses=8, overlap="replace"),
        "sharp": ph.PulseTrain(shapes["sharp"], period=1.3e-3, pulses=2),
        "half-sine": ph.PulseTrain(shapes["half-sine"], period=1.1e-3, pulses=2),
        "trapezoid": ph.PulseTrain(shapes["trapezoid"], period=1.2e-3, pulses=2),
        "sampled": ph.PulseTrain(shapes["sampled"], period=1.2e-3, pulses=2),
        "sampled-linear": ph.PulseTrain(shapes["sampled-linear"], period=1.2e-3, pulses=2),
        "hold": ph.PulseTrain(shapes["long"]),
    }
    if quantity == "force":
        found["sine"] = ph.SineForce(12.0, 1350.0, 0.4)
    return found


def crude() -> ph.Hammer:
    """The hammer of `CRUDE`."""
    return _crude()


@functools.cache
def _crude() -> ph.Hammer:
    return ph.load(CRUDE)


@dataclasses.dataclass
class Draw:
    """Hammers drawn around the crude hammer; `redrawn` counts the rejected draws."""

    rng: np.random.Generator
    spread: float = 0.2
    drawn: int = 0
    redrawn: int = 0

    def __call__(self) -> ph.Hammer:
        """Draw until a hammer passes its own validation without a warning."""
        constants = crude().constants
        ends = math.log(1.0 - self.spread), math.log(1.0 + self.spread)
        while True:
            factors = np.exp(self.rng.uniform(*ends, len(constants)))
            changes = {key: c.si * f for (key, c), f in zip(constants.items(), factors, strict=True)}
            try:
                hammer = crude().replace(changes)
                odd = hammer.warnings()
            except ph.InputError:
                odd = ["refused"]
            if not odd:
                self.drawn += 1
                return hammer
            self.redrawn += 1


@dataclasses.dataclass(frozen=True)
class Comparison:
    """A motion and its reference, up to the horizon.

    Attributes
    ----------
    motion, truth
        Both runs.
    error : float
        Largest difference of the displacements up to the horizon, in units of `scale`.
    horizon : float
        Time up to which the comparison is meaningful, s.
    """

    motion: ph.Motion
    truth: ReferenceRun
    error: float
    horizon: float

    def touches(self, surface: str) -> tuple[list[float], list[float]]:
        """Return the times of all touches before the horizon, of motion and reference, s.

        The last bounces on a rigid backstop, below 0.1 mm/s, are omitted, since both stop counting there.
        """
        mine = [
            c.t_in
            for c in self.motion.contacts
            if c.surface == surface and not c.initial and abs(c.v_in) > SLOW
        ]
        theirs = [
            event.time
            for event in self.truth.events
            if event.kind == f"{surface}-touch" and abs(event.v) > SLOW
        ]
        # A touch at the horizon itself may fall on either side of it.
        end = self.horizon * (1.0 - 1e-6)
        return [t for t in mine if t < end], [t for t in theirs if t < end]


def compare(
    hammer: ph.Hammer,
    drive: Any,
    duration: float,
    *,
    state: tuple[float, float] | None = None,
    scale: float | None = None,
    sensitive: bool = False,
    whole: bool = False,
    points: int = 401,
    **options: Any,
) -> Comparison:
    """Run kernel and reference on the same problem.

    At the horizon, references of tolerances 1e-12 and 1e-13 differ by 1e-10 of the scale. If the references
    are nearly exact, as between rigid walls, `sensitive` perturbs the start by 1e-12 of the scale
    instead, so that errors have grown a hundredfold at the horizon. `whole` always compares to the end.
    """
    times = np.linspace(0.0, duration, points)
    motion = ph.simulate(hammer, drive, duration=duration, times=times, state=state, **options)
    truth = reference(hammer, drive, duration, state=state, times=times, tolerance=TRUTH)
    span = float(np.nanmax(truth.x) - np.nanmin(truth.x))
    if scale is None:
        both = hammer.position is not None and hammer.front is not None
        scale = max(hammer.front - hammer.position, 1e-3 * span) if both else span or 1.0
    others = [truth]
    if sensitive:
        x0, v0 = truth.x[0], truth.v[0]
        on_edge = x0 in (hammer.position, hammer.front)
        start = (x0 + (0.0 if on_edge else 1e-12 * scale), v0 + 1e-12 * max(np.nanmax(np.abs(truth.v)), 1e-9))
        others = [truth, reference(hammer, drive, duration, state=start, times=times)]
    elif not whole:
        others = [
            reference(hammer, drive, duration, state=state, times=times, tolerance=t) for t in (1e-12, 1e-13)
        ]
    count = min(len(motion.x), *(int(np.isfinite(run.x).sum()) for run in (truth, *others)))
    apart = np.abs(others[0].x[:count] - others[-1].x[:count]) > 1e-10 * scale
    stop = max(int(np.argmax(apart)) if apart.any() else count, 1)
    error = np.abs(motion.x[:stop] - truth.x[:stop]).max() / scale
    return Comparison(motion, truth, float(error), float(times[stop - 1]))


@contextmanager
def interpreted() -> Iterator[None]:
    """Run the kernel as interpreted Python: slow steps, but no compilation for a combination of laws.

    The source code of the functions is the same as for machine code.
    """
    # A module that is first imported in here would keep the plain kernels for good.
    for module in ("kernel.compile.lanes", "run.ahead"):
        import_module(f"printhammer.{module}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(specialise, "specialise", _plain)
        patch.setattr(flow, "variational", _plain_variational)
        yield


@functools.cache
def _plain(laws: Any) -> specialise.Kernel:
    # What is lowered needs these compiled; imported for the first time in here, they would be plain for good.
    import_module("printhammer.kernel.compile.lower")
    for name in (
        "methods.crossing",
        "methods.hermite",
        "methods.landing",
        "single.stretch",
        "variational.slopes",
    ):
        import_module(f"printhammer.kernel.{name}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba.config, "DISABLE_JIT", True)
        return specialise._specialised.__wrapped__(laws)


@functools.cache
def _plain_variational(plain: specialise.Kernel, *, forced: bool) -> specialise.Kernel:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba.config, "DISABLE_JIT", True)
        return specialise._built.__wrapped__(plain, forced)


def magnet_table(folder: Path) -> dict[str, str]:
    """A measured table for `made_of`: the force of equation (3) at a grid of points."""
    magnet = MAGNETS["inverse-root"]
    assert isinstance(magnet, InverseRootMagnet)
    rows = ["displacement [m],current [A],force [N]"]
    for x in np.linspace(20e-6, 520e-6, 26):
        for current in np.linspace(-0.5, 3.5, 17):
            force = magnet.F0 - (magnet.Am - magnet.Bm * current) ** 2 / math.sqrt(x)
            rows.append(f"{x:.17g},{current:.17g},{force:.17g}")
    path = folder / "force.csv"
    path.write_text("\n".join(rows) + "\n")
    return {"law": "table", "file": str(path)}
