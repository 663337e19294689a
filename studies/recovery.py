"""Recovery of a hammer: simulated measurements, fits of the constants, and a hammer built from the fits.

A hammer is measured on every bench of the synthetic laboratory, its constants are fitted to the tables, and a
hammer is built from them. As the true constants are known, the study shows the accuracy of the fits and the
coverage of their confidence intervals, which predicts the accuracy of a real bench before it is built.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.bench.laboratory import SENSORS, measure
from printhammer.identify.bench.sensor import applicable
from printhammer.identify.shots.motion import fit_motion
from printhammer.identify.static.backstop import Stiffness, fit_backstop
from printhammer.identify.static.magnet import fit_magnet
from printhammer.identify.static.pack import fit_pack
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from printhammer.hammer.hammer import Hammer
    from printhammer.identify.result import Fit, FittedConstant

STEEL: Final = ((200e9, 0.01), (0.3, 0.01))
"""Young's modulus, Pa, and Poisson ratio of both bodies of the backstop, with relative standard errors."""

RADIUS_ERROR: Final = 0.01
"""Relative standard error of the measured radius."""

_TABLES: Final = ("magnet", "spring", "pack", "backstop", "motion")
"""Tables measured in one laboratory."""

_START: Final = 0.2
"""Largest relative error of the guessed mass with which the fit of the motion starts; arbitrary."""


class Recovery(Declared, eq=False):
    """Results of one laboratory: the true hammer, the fits, and the hammer built from the fits."""

    truth: Hammer = part("measured hammer, with the true constants")
    fits: Mapping[str, Fit] = part('fits by kind: "magnet" (with the spring), "pack", "backstop", "motion"')
    constants: Mapping[str, FittedConstant] = part(
        "constants of the final hammer file, from all measurements"
    )
    hammer: Hammer = part("hammer built from the fitted constants")

    def true(self, key: str) -> float:
        """Return the true value of a constant, SI."""
        return true_value(self.truth, key)


def recover(
    hammer: Hammer, seed: int, *, sensor: Mapping[str, Any] | None = None, folder: str | Path | None = None
) -> Recovery:
    """Measure a hammer, fit its constants and build a hammer from them.

    Parameters
    ----------
    hammer : Hammer
        Hammer with the magnet of equation (3), a linear spring, the pack of equation (5), a Hertz backstop
        and a waveform.
    seed : int
        Seed of the laboratory.
    sensor : mapping, optional
        Settings of the sensors, as for `measure`, applied to every table to which they apply.
    folder : path, optional
        Folder in which the tables are saved; by default, the tables are not saved.

    Raises
    ------
    InputError
        The hammer lacks a component, or a fit fails.
    """
    if folder is None:
        with tempfile.TemporaryDirectory() as place:
            return recover(hammer, seed, sensor=sensor, folder=place)
    where = Path(folder)
    paths = {kind: where / f"{kind}.csv" for kind in _TABLES}
    for kind, path in paths.items():
        settings = applicable(SENSORS[kind], sensor or {})
        measure(kind, hammer, sensor=settings, seed=seed).write(path)
    rng = np.random.default_rng(np.random.SeedSequence([seed, len(_TABLES)]))
    fits = {
        "magnet": fit_magnet(paths["magnet"], position=hammer.origin, spring=paths["spring"]),
        "pack": fit_pack(paths["pack"], thickness=true_value(hammer, "pack.thickness")),
        "backstop": fit_backstop(paths["backstop"], stiffness=measured_stiffness(hammer, rng)),
    }
    # Start from a guessed mass, so that the fit of the motion does not start at the truth.
    built = hammer.replace("mass", hammer.mass * (1.0 + _START * float(rng.uniform(-1.0, 1.0))))
    for fit in fits.values():
        built = fit.into(built)
    fits["motion"] = fit_motion([paths["motion"]], built)
    constants = {
        key: constant for fit in fits.values() for key, constant in fit.constants.items() if constant.in_file
    }
    return Recovery(hammer, fits, constants, fits["motion"].into(built))


def measured_stiffness(hammer: Hammer, rng: np.random.Generator) -> Stiffness:
    """Return the stiffness of the backstop computed from measurements of its bodies with random errors.

    The bodies are a steel ball and a steel flat; the radius is chosen such that the true stiffness is that of
    the hammer.
    """
    (modulus, modulus_error), (ratio, ratio_error) = STEEL
    k = true_value(hammer, "backstop.stiffness")
    contact = modulus / (2.0 * (1.0 - ratio * ratio))
    radius = (0.75 * k / contact) ** 2

    def read(true: float, error: float) -> tuple[float, float]:
        return true * (1.0 + error * float(rng.standard_normal())), error * true

    return Stiffness.from_bodies(
        [read(radius, RADIUS_ERROR)],
        [read(modulus, modulus_error), read(modulus, modulus_error)],
        [read(ratio, ratio_error), read(ratio, ratio_error)],
    )


def true_value(hammer: Hammer, key: str) -> float:
    """Return a constant of a hammer, SI, including derived constants, such as l from a rebound."""
    section, _, name = key.rpartition(".")
    if not section:
        return hammer.mass
    part = hammer.parts.get(section)
    if part is None:
        raise InputError(f"{hammer.path}: the hammer has no [{section}], expected one to recover")
    if section == "backstop" and name in ("stiffness", "damping"):
        return float(part.packed(hammer.origin)[0 if name == "stiffness" else 1])
    return float(getattr(part, name))
