"""Result of a fit: constants with their uncertainty, and diagnostics of the data and the law."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, Self

import numpy as np

from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.uncertainty import UNCERTAINTY, Uncertainty
from printhammer.results import Column, Declared, Result, column, coordinate, part, scalar
from printhammer.results.result import Entries
from printhammer.results.summary import (
    Cells,
    Facts,
    Grid,
    Summary,
    repeated,
    styled,
)
from printhammer.support.arrays import BoolArray, FloatArray, IntArray
from printhammer.units import from_si

CONFIDENCE: Final = 0.95
"""Confidence level of the intervals; conventional."""

LAWS: Final = {"magnet": "inverse-root", "spring": "linear", "pack": "power", "backstop": "hertz"}
"""Law assumed by each fit, by role; the fit "solenoid" assumes the magnet law `reluctance` instead."""

_BODIES: Final = (
    "radius1",
    "radius2",
    "youngs_modulus1",
    "youngs_modulus2",
    "poisson_ratio1",
    "poisson_ratio2",
)
REPLACED: Final = {
    "backstop.stiffness": [f"backstop.{name}" for name in _BODIES],
    "backstop.damping": ["backstop.restitution", "backstop.restitution_speed"],
}
"""Constants that a fitted constant replaces in a hammer file, by key of the fitted constant."""


HELD: Final = "held, the data do not determine it"
"""Source text of a constant that was held during the fit."""

_SHOWN_IN: Final = {"m": "um", "kg": "g", "s": "us"}
"""Display units of constants in m, kg and s."""


class FittedConstant(Declared):
    """Fitted constant, with its standard error and 95 % interval."""

    key: str = part(
        'dotted key of the hammer file, such as "magnet.F0"; another name where `in_file` is false'
    )
    value: float = part("value, SI")
    standard_error: float = part("standard error, SI")
    interval: tuple[float, float] = part("bounds of the 95 % interval, SI")
    unit: str = part("SI unit")
    in_file: bool = part(
        "whether the constant has a key in a hammer file; combinations of constants, and exponents, do not",
        default=True,
    )
    how: str = part(
        'origin if not the fit to the files, such as "computed from radii and Young\'s moduli"',
        default="",
    )
    held: bool = part(
        "whether the constant was held since the data do not determine it; in this case the interval is the"
        " range of the constant, and the standard error is infinite",
        default=False,
    )

    @classmethod
    def of(
        cls,
        key: str,
        value: float,
        standard_error: float,
        degrees_of_freedom: float,
        unit: str,
        *,
        in_file: bool = True,
        how: str = "",
    ) -> Self:
        """Create a constant with its 95 % interval (Student's t with the given degrees of freedom)."""
        half = student(degrees_of_freedom) * float(standard_error)
        ends = float(value) - half, float(value) + half
        return cls(key, float(value), float(standard_error), ends, unit, in_file, how)

    @property
    def texts(self) -> tuple[str, str, str, str]:
        """Format value, standard error, interval and unit, with as many digits as are significant."""
        unit = _SHOWN_IN.get(self.unit, self.unit)
        value, error, low, high = (
            from_si(number, self.unit, unit) if math.isfinite(number) else number
            for number in (self.value, self.standard_error, *self.interval)
        )
        digits = 6
        if self.held:
            return f"{value:.{digits}g}", "held", "not determined", "" if unit == "1" else unit
        if error > 1e-12 * abs(value):
            digits = 2 + math.floor(math.log10(max(abs(value), error))) - math.floor(math.log10(error))
        centre, least, most = (f"{number:.{digits}g}" for number in (value, low, high))
        return centre, f"{error:.2g}", f"{least} to {most}", "" if unit == "1" else unit


class Profile(Declared, eq=False):
    """Profile likelihood of one constant: weighted sum of squares with the other constants refitted."""

    values: FloatArray = part("values at which the constant is held, SI, ascending, shape (n,)")
    increase: FloatArray = part(
        "increase of the weighted sum of squares over its minimum, in units of the noise variance, with all"
        " other constants refitted; shape (n,)"
    )
    interval: tuple[float, float] = part(
        "bounds of the 95 % interval, where the increase reaches the square of Student's t, SI; infinite"
        " if the increase stays below"
    )


class Fit(Result):
    """Fitted constants with covariance, residuals, test of the law and remarks."""

    kind: str = scalar(
        "", "kind of the fit", more='"magnet", "solenoid", "spring", "pack", "backstop", "motion" or "coil"'
    )
    source: tuple[str, ...] = scalar("", "names of the files", more="without their folders")
    constants: Mapping[str, FittedConstant] = part("constants by key")
    keys: tuple[str, ...] = coordinate(
        "",
        "keys of the constants in the covariance",
        "key",
        name="key",
        more="a constant from which another constant was computed may be missing",
    )
    covariance: FloatArray = column("SI", "covariance of two constants", "key other_key")
    abscissa: FloatArray = column("SI", "abscissa of the datum", "datum")
    data: FloatArray = column("SI", "datum", "datum")
    fitted: FloatArray = column("SI", "fitted law", "datum")
    residuals: FloatArray = column("SI", "datum minus fitted law", "datum")
    axes: tuple[tuple[str, str], tuple[str, str]] = part(
        "name and SI unit of the abscissa and of the data",
        more='such as (("displacement", "m"), ("force", "N"))',
    )
    degrees_of_freedom: float = scalar(
        "1", "number of data used minus fitted parameters", more="fewer if residuals are correlated"
    )
    residual_scale: float = scalar("", "standard deviation of the noise in the data", more="SI")
    weights: FloatArray = column(
        "1", "weight, proportional to 1 / variance", "datum", more="scaled so that the largest is 1"
    )
    outliers: BoolArray = column("1", "whether the datum was excluded as an outlier", "datum")
    condition_number: float = scalar(
        "1",
        "condition number of the Jacobian with normalised columns",
        more="large if constants are hard to distinguish",
    )
    series: IntArray = column(
        "1", "index of the series", "datum", more="a current, a branch or a file in `series_names`"
    )
    series_names: tuple[str, ...] = scalar("", "names of the series, for the legend")
    lines: IntArray = part("line number of each datum in its file", more="empty if data are not rows")
    given: Mapping[str, str] = scalar(
        "",
        "constants taken as known",
        more="dotted key or phrase, mapped to the value with unit",
        default_factory=dict,
    )
    indistinct: tuple[str, ...] = scalar(
        "", "combinations that the data do not determine, one sentence each", default=()
    )
    profiles: Mapping[str, Profile] = part("profiles of weakly determined constants", default_factory=dict)
    rejected: str = scalar("", "reason to reject the law", more="empty if the law holds", default="")
    p_value: float = scalar(
        "1",
        "probability of residuals at least as large if the law holds (p-value)",
        more="NaN without a test",
        default=float("nan"),
    )
    remarks: tuple[str, ...] = scalar("", "remarks", default=())
    slopes: Mapping[str, FloatArray] = part(
        "derivatives of the constants in `keys` with respect to uncertain known constants, by key; SI,"
        " shape (n,)",
        default_factory=dict,
    )
    records: tuple[str, ...] = part("fingerprints of the records of motion", default=())

    @property
    def title(self) -> str:
        """One-line title of the fit."""
        return f"fit of the {self.kind} to {', '.join(self.source)}"

    def summary(self) -> Summary:
        """Tabulate the constants with their uncertainty, and summarise the diagnostics."""
        files = f"  {styled('dim', ' and '.join(self.source))}" if self.source else ""
        scale = f"residual scale {self.residual_scale:.3g} {self.axes[1][1]}"
        several = len(self.keys) > 1
        verdict = styled("poor", "rejected") if self.rejected else styled("good", "not rejected")
        rows = [
            ("data", f"{int((~self.outliers).sum())} used, {scale}" if len(self.data) else None),
            ("robust", self.outlier_lines() if self.outliers.any() else None),
            ("correlation", self._largest_correlation() if several else None),
            ("condition", f"{self.condition_number:.3g}" if several else None),
            ("law", f"{verdict}, p = {self.p_value:.2g}" if math.isfinite(self.p_value) else None),
            ("because", self.rejected or None),
            *repeated("taken as known", (f"{name} = {value}" for name, value in self.given.items())),
            *repeated("not separated", self.indistinct),
            *repeated("notes", self.remarks),
        ]
        texts = list(zip(*(constant.texts for constant in self.constants.values()), strict=True)) or [()] * 4
        heads = ("value", "± error", "95 % interval", "unit")
        columns = [
            Cells("constant", list(self.constants), left=True),
            *(Cells(head, each, left=k > 1) for k, (head, each) in enumerate(zip(heads, texts, strict=True))),
        ]
        return Summary([f"{styled('strong', self.kind)}{files}", Grid(columns), "", Facts(rows)])

    def _largest_correlation(self) -> str:
        size = np.abs(self.correlation - np.eye(len(self.keys)))
        first, second = sorted(int(k) for k in np.unravel_index(int(np.argmax(size)), size.shape))
        return f"{self.correlation[first, second]:.2f} at most, of {self.keys[first]} and {self.keys[second]}"

    def entries(self) -> Entries:
        """Return the columns of the result: one row per datum or per constant, and the covariance."""
        entries = super().entries()
        for name, (meaning, unit) in zip(
            ("abscissa", "data", "fitted", "residuals"), (self.axes[0], *[self.axes[1]] * 3), strict=True
        ):
            note, values = entries[name]
            described = meaning if name in ("abscissa", "data") else f"{meaning}, {note.meaning}"
            entries[name] = replace(note, unit=unit, meaning=described), values
        if self.lines.size:
            entries["line"] = Column("1", "line of the file", ("datum",)), self.lines
        entries["other_key"] = replace(entries["key"][0], dims=("other_key",)), self.keys
        constants = list(self.constants.values())
        for name, unit, meaning, values in (
            ("value", "SI", "value in its own unit", [each.value for each in constants]),
            ("standard_error", "SI", "standard error", [each.standard_error for each in constants]),
            ("low", "SI", "lower end of the 95 % interval", [each.interval[0] for each in constants]),
            ("high", "SI", "upper end of the 95 % interval", [each.interval[1] for each in constants]),
            ("unit", "", "SI unit", [each.unit for each in constants]),
            ("how", "", "origin of the value if not the fit", [each.how for each in constants]),
        ):
            entries[name] = Column(unit, meaning, ("constant",)), values
        key = Column("", "dotted key of the hammer file, or another name", ("constant",), "coordinate")
        return entries | {"constant": (key, list(self.constants))}

    def __getitem__(self, key: str) -> FittedConstant:
        return self.constants[key]

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the constants in `keys`, shape (n, n); 0 where a standard error is 0."""
        errors = np.sqrt(np.diag(self.covariance))
        safe = np.where(errors > 0.0, errors, 1.0)
        correlation: FloatArray = self.covariance / np.outer(safe, safe)
        return correlation

    @property
    def for_file(self) -> dict[str, dict[str, str | float]]:
        """Constants with a key in hammer files, as tables with status and source for `Hammer.replace`."""
        return {
            key: {
                "value": constant.value,
                "unit": constant.unit,
                "status": "assumed" if constant.held else "derived",
                "source": self._source(constant),
            }
            for key, constant in self.constants.items()
            if constant.in_file
        }

    @property
    def _laws(self) -> dict[str, str]:
        if self.kind == "coil":
            # The coil current fits any magnet law.
            return {}
        return {**LAWS, "magnet": "reluctance"} if self.kind == "solenoid" else LAWS

    def _source(self, constant: FittedConstant) -> str:
        """Return the source text of a constant, such as "fitted to magnet.csv, standard error 0.02 N"."""
        how = constant.how or f"fitted to {' and '.join(self.source)}"
        error = constant.standard_error
        return f"{how}, standard error {error:.2g} {constant.unit}" if error and not constant.held else how

    def fragment(self) -> str:
        """Render the constants as TOML for a hammer file, with comments on their validity."""
        from printhammer.hammer.edit import changed_text

        files = f", fitted to {' and '.join(self.source)}" if self.source else ""
        remarks = [f"Constants of a hammer file{files}"]
        remarks += [f"taken as known: {name} = {value}" for name, value in self.given.items()]
        remarks += self.indistinct
        if self.rejected:
            remarks.append(f"the data reject the law: {self.rejected}")
        constants = self.for_file
        sections = {key.rpartition(".")[0]: None for key in constants}
        laws = [(f"{section}.law", self._laws[section]) for section in sections if section in self._laws]
        comments = "".join(f"# {' '.join(remark.split())}\n" for remark in remarks)
        # Tables come last, since a key after a table header would belong to that table.
        return changed_text(comments, sorted([*laws, *constants.items()], key=lambda edit: "." in edit[0]))

    def covariance_table(self) -> str:
        """Render the covariance as CSV: one row and column per constant, SI, with units in comments."""
        lines = [f"# unit of {key}: {self.constants[key].unit}" for key in self.keys]
        lines.append(",".join(["constant", *self.keys]))
        for key, row in zip(self.keys, self.covariance, strict=True):
            lines.append(",".join([key, *(repr(float(entry)) for entry in row)]))
        return "\n".join(lines) + "\n"

    def into(self, hammer: Hammer) -> Hammer:
        """Return a copy of a hammer with the fitted constants.

        Raises
        ------
        InputError
            A law of the hammer differs from the fitted law, or a constant differs from the value taken as
            known.
        """
        known = hammer.constants
        # A held constant at the hammer's own value keeps its source there.
        constants = {
            key: table
            for key, table in self.for_file.items()
            if not (self[key].held and key in known and known[key].si == self[key].value)
        }
        sections = {key.rpartition(".")[0] for key in constants} & set(self._laws)
        for section in sorted(sections):
            part = hammer.parts.get(section)
            if part is None or part.law != self._laws[section]:
                law = "is missing" if part is None else f"has the law {part.law!r}"
                raise InputError(
                    f"{hammer.path}: the {section} {law}",
                    file=hammer.path,
                    key=section,
                    expected=f"the law {self._laws[section]!r}",
                )
        for key, text in self.given.items():
            _check_agreement(hammer, key, text)
        gone = [other for key in constants for other in REPLACED.get(key, ())]
        taken = {key: None for key in gone if key in hammer.constants}
        return hammer.replace(
            {**taken, **constants, UNCERTAINTY: self._uncertainty(hammer, {*gone, *constants})}
        )

    def _uncertainty(self, hammer: Hammer, set_anew: set[str]) -> dict[str, Any] | None:
        """Return the uncertainty table of the updated hammer, for fitted and remaining constants.

        `set_anew` contains the keys of the constants that the fit replaces, fitted constants included.
        """
        own = [key for key, each in self.constants.items() if each.in_file and not each.held]
        before = hammer.uncertainty or Uncertainty((), np.empty((0, 0)))
        rest = before.without(set_anew)
        count = len(own)
        covariance = np.zeros((count + len(rest.keys),) * 2)
        covariance[count:, count:] = rest.covariance
        for i, key in enumerate(own):
            covariance[i, i] = self[key].standard_error ** 2
        rows = [(i, self.keys.index(key)) for i, key in enumerate(own) if key in self.keys]
        here, there = [i for i, _ in rows], [row for _, row in rows]
        covariance[np.ix_(here, here)] = self.covariance[np.ix_(there, there)]
        for known, slope in self.slopes.items():
            if known in rest.keys:
                shared = np.outer(slope[there], rest.covariance[rest.keys.index(known)])
                covariance[np.ix_(here, range(count, len(covariance)))] += shared
        covariance[count:, :count] = covariance[:count, count:].T
        units = {key: constant.si_unit for key, constant in hammer.constants.items()}
        units |= {key: constant.unit for key, constant in self.constants.items()}
        records = (*rest.records, *self.records)
        return Uncertainty((*own, *rest.keys), covariance, records).table(units)

    @property
    def report(self) -> list[str]:
        """Report of the fit, in lines of text."""
        lines = []
        for constant in self.constants.values():
            low, high = constant.interval
            if constant.held:
                lines.append(f"{constant.key} = {constant.value:.6g} {constant.unit}, {HELD}")
                continue
            lines.append(
                f"{constant.key} = {constant.value:.6g} {constant.unit}, standard error"
                f" {constant.standard_error:.2g}, 95 % interval {low:.6g} to {high:.6g}"
            )
        used = int((~self.outliers).sum())
        if used:
            lines.append(
                f"{used} data, {self.degrees_of_freedom:g} degrees of freedom, residual scale"
                f" {self.residual_scale:.3g} {self.axes[1][1]}, condition number {self.condition_number:.3g}"
            )
        if self.outliers.any():
            lines.append(self.outlier_lines())
        if math.isfinite(self.p_value):
            lines.append(f"test of the law: p = {self.p_value:.3g}")
        if self.rejected:
            lines.append(f"the data reject the law: {self.rejected}")
        return [*lines, *self.indistinct, *self.remarks]

    def outlier_lines(self, most: int = 20) -> str:
        """List the line numbers of the excluded rows as text; at most `most` lines or ranges of lines.

        The names of the series are added if there are several files.
        """
        rows = [int(row) for row in np.flatnonzero(self.outliers)]
        count = f"{len(rows)} outlier{'s' if len(rows) > 1 else ''} left out"
        if not len(self.lines):
            return count
        series = [int(self.series[row]) for row in rows]
        # Consecutive rows of a series are listed as a range of lines.
        starts = [
            k for k, row in enumerate(rows) if k == 0 or row != rows[k - 1] + 1 or series[k] != series[k - 1]
        ]
        listed, together = [], 0
        for first, end in zip(starts, [*starts[1:], len(rows)], strict=True):
            line, last = str(self.lines[rows[first]]), str(self.lines[rows[end - 1]])
            if end - first > 2:
                line, together = f"{line} to {last}", together + end - first
            elif end - first == 2:
                line = f"{line}, {last}"
            where = f" ({self.series_names[series[first]]})" if len(self.source) > 1 else ""
            listed.append(f"{line}{where}")
        more = ", …" if len(listed) > most else ""
        stretches = f", {together} of them consecutive" if together else ""
        return f"{count}{stretches}: line{'s' if len(rows) > 1 else ''} {', '.join(listed[:most])}{more}"


def with_error(fit: Fit, key: str, error: float, slopes: list[float]) -> Fit:
    """Return a copy of a fit with the uncertainty of a known constant propagated.

    `key` and `error` are the key and the standard error of the known constant; `slopes` are the derivatives
    of the constants in `Fit.keys` with respect to the known constant. All numbers are SI.
    """
    slope = np.array(slopes)
    constants = dict(fit.constants)
    for each, change in zip(fit.keys, slope.tolist(), strict=True):
        constant, added = fit[each], abs(change) * error
        # The known constant's error is normal, the fit's has Student's t; the half-widths add in quadrature.
        half = math.hypot(0.5 * (constant.interval[1] - constant.interval[0]), student(math.inf) * added)
        constants[each] = replace(
            constant,
            standard_error=math.hypot(constant.standard_error, added),
            interval=(constant.value - half, constant.value + half),
        )
    remark = f"the standard error of {key}, {error:.2g} in SI, is in those of the constants"
    return replace(
        fit,
        constants=constants,
        covariance=fit.covariance + np.outer(slope, slope) * error * error,
        slopes={**fit.slopes, key: slope},
        remarks=(*fit.remarks, remark),
    )


def student(degrees_of_freedom: float) -> float:
    """Return the half-width of a 95 % interval of Student's t, in standard errors."""
    from scipy.special import stdtrit

    return float(stdtrit(degrees_of_freedom, 0.5 + 0.5 * CONFIDENCE))


def _check_agreement(hammer: Hammer, key: str, text: str) -> None:
    """Raise `InputError` if the hammer's constant differs from the value that the fit treated as known.

    `text` is that value with its unit.
    """
    from printhammer.units import parse

    known = hammer.constants.get(key)
    if known is None:
        return
    value = parse(text, known.si_unit)
    if not math.isclose(value, known.si, rel_tol=1e-9, abs_tol=0.0):
        written = f"{key} = {known.value!r} {known.unit}"
        raise InputError(
            f"{hammer.path}: {written}",
            file=hammer.path,
            key=key,
            value=known.value,
            expected=f"{text}, which the fit took as known",
        )
