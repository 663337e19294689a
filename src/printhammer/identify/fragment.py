"""Fits as text: TOML for a hammer file, and lines for the screen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.identify.result import Fit, FittedConstant

LAWS: Final = {"magnet": "inverse-root", "spring": "linear", "pack": "power", "backstop": "hertz"}
"""Laws whose constants are fitted, by role."""

_REPLACED: Final = {
    # A stiffness found takes the place of the bodies, a damping that of the rebound.
    "backstop.stiffness": (
        *("radius1", "radius2", "youngs_modulus1", "youngs_modulus2", "poisson_ratio1", "poisson_ratio2"),
    ),
    "backstop.damping": ("restitution", "restitution_speed"),
}


def constants(fit: Fit) -> dict[str, dict[str, str | float]]:
    """Return the constants that a hammer file has, each as a table of the file, with status and source."""
    return {
        key: {
            "value": constant.value,
            "unit": constant.unit,
            "status": "derived",
            "source": source(fit, constant),
        }
        for key, constant in fit.constants.items()
        if constant.in_file
    }


def source(fit: Fit, constant: FittedConstant) -> str:
    """Return the source of a constant, such as "fitted to magnet.csv, standard error 0.02 N"."""
    files = " and ".join(fit.source)
    how = constant.how or f"fitted to {files}"
    error = constant.standard_error
    return f"{how}, standard error {error:.2g} {constant.unit}" if error else how


def fragment(fit: Fit) -> str:
    """Return the constants as TOML text for a hammer file, with comments on what they hold for."""
    from printhammer.hammer.edit import changed_text

    files = f", fitted to {' and '.join(fit.source)}" if fit.source else ""
    remarks = [f"Constants of a hammer file{files}"]
    remarks += [f"taken as known: {name} = {value}" for name, value in fit.given.items()]
    remarks += fit.indistinct
    if fit.rejected:
        remarks.append(f"the data reject the law: {fit.rejected}")
    found = constants(fit)
    sections = {key.rpartition(".")[0]: None for key in found}
    laws = [(f"{section}.law", LAWS[section]) for section in sections if section in LAWS]
    comments = "".join(f"# {' '.join(remark.split())}\n" for remark in remarks)
    # Tables come last, or the constants at the top would become theirs.
    return changed_text(comments, sorted([*laws, *found.items()], key=lambda edit: "." in edit[0]))


def covariance_table(fit: Fit) -> str:
    """Return the covariance as CSV: a row and a column for each constant, SI, units in comments."""
    lines = [f"# unit of {key}: {fit.constants[key].unit}" for key in fit.keys]
    lines.append(",".join(["constant", *fit.keys]))
    for key, row in zip(fit.keys, fit.covariance, strict=True):
        lines.append(",".join([key, *(repr(float(entry)) for entry in row)]))
    return "\n".join(lines) + "\n"


def into(fit: Fit, hammer: Hammer) -> Hammer:
    """Return a hammer with the constants of a fit.

    Raises
    ------
    InputError
        The hammer has another law for the part, or takes as different what the fit took as known.
    """
    found = constants(fit)
    sections = {key.rpartition(".")[0] for key in found} & set(LAWS)
    for section in sorted(sections):
        part = hammer.parts.get(section)
        if part is None or part.law != LAWS[section]:
            law = "is missing" if part is None else f"has the law {part.law!r}"
            raise InputError(f"{hammer.path}: the {section} {law}, expected the law {LAWS[section]!r}")
    for key, text in fit.given.items():
        _agrees(hammer, key, text)
    gone = [f"{key.rpartition('.')[0]}.{name}" for key in found for name in _REPLACED.get(key, ())]
    taken = {key: None for key in gone if key in hammer.constants}
    return hammer.replace({**taken, **found})


def report(fit: Fit) -> list[str]:
    """Return what there is to say of a fit, line by line."""
    lines = []
    for constant in fit.constants.values():
        low, high = constant.interval
        lines.append(
            f"{constant.key} = {constant.value:.6g} {constant.unit}, standard error"
            f" {constant.standard_error:.2g}, 95 % interval {low:.6g} to {high:.6g}"
        )
    used = int((~fit.outliers).sum())
    if used:
        lines.append(
            f"{used} data, {fit.degrees_of_freedom:g} degrees of freedom, residual scale"
            f" {fit.residual_scale:.3g} {fit.axes[1][1]}, condition number {fit.condition_number:.3g}"
        )
    if fit.outliers.any():
        lines.append(outliers(fit))
    if math.isfinite(fit.p_value):
        lines.append(f"test of the law: p = {fit.p_value:.3g}")
    if fit.rejected:
        lines.append(f"the data reject the law: {fit.rejected}")
    return [*lines, *fit.indistinct, *fit.remarks]


def outliers(fit: Fit, most: int = 20) -> str:
    """Say which rows were left out; of several files, also to which series each belongs."""
    rows = [int(row) for row in np.flatnonzero(fit.outliers)]
    told = f"{len(rows)} outlier{'s' if len(rows) > 1 else ''} left out"
    if not len(fit.lines):
        return told
    listed = [str(fit.lines[row]) for row in rows[:most]]
    if len(fit.source) > 1:
        listed = [
            f"{line} ({fit.series_names[fit.series[row]]})" for line, row in zip(listed, rows, strict=False)
        ]
    more = ", …" if len(rows) > most else ""
    return f"{told}: line{'s' if len(rows) > 1 else ''} {', '.join(listed)}{more}"


def _agrees(hammer: Hammer, key: str, text: str) -> None:
    """Refuse a hammer whose constant is another than the one that the fit took as known."""
    from printhammer.units import parse

    known = hammer.constants.get(key)
    if known is None:
        return
    value = parse(text, known.si_unit)
    if not math.isclose(value, known.si, rel_tol=1e-9, abs_tol=0.0):
        written = f"{key} = {known.value!r} {known.unit}"
        raise InputError(f"{hammer.path}: {written}, expected {text}, which the fit took as known")
