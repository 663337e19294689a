"""Standard errors and correlations of the constants of a hammer, as stored in its file.

A fit writes these errors with its constants, and the next fit uses them as priors. The table
``[uncertainty]`` of the file has the entries ``constants``, their ``standard_errors`` with units, the
``correlation`` of each constant with the preceding constants, and ``records``, the fingerprints of the
records of motion to which the constants were fitted.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from printhammer.errors import InputError, located
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import Constant, shown

UNCERTAINTY: Final = "uncertainty"
"""Name of the table of standard errors in a hammer file."""

ENTRIES: Final = {
    "constants": "dotted keys of the constants that are not known exactly",
    "standard_errors": "standard error of each constant, text with its unit",
    "correlation": "correlations of each constant but the first with the preceding constants",
    "records": "fingerprints of the records of motion to which the constants were fitted",
}
_NEGATIVE: Final = -1e-9
"""Smallest eigenvalue accepted for a correlation matrix, to allow for rounding errors; arbitrary."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance of the constants of a hammer."""

    keys: tuple[str, ...]
    """Dotted keys of the uncertain constants."""
    covariance: FloatArray
    """Covariance matrix, SI, shape (n, n)."""
    records: tuple[str, ...] = ()
    """Fingerprints of the records of motion used to fit the constants."""

    def error(self, key: str) -> float:
        """Return the standard error of a constant, SI; 0 for an exactly known constant."""
        return float(np.sqrt(self.covariance.diagonal()[self.keys.index(key)])) if key in self.keys else 0.0

    def without(self, gone: Container[str]) -> Uncertainty:
        """Return a copy without the constants `gone`: the marginal covariance of the remaining constants."""
        rows = [row for row, key in enumerate(self.keys) if key not in gone]
        keys = tuple(self.keys[row] for row in rows)
        return Uncertainty(keys, self.covariance[np.ix_(rows, rows)], self.records)

    def table(self, units: Mapping[str, str]) -> dict[str, Any] | None:
        """Return the table ``[uncertainty]`` of a hammer file; None if every constant is exact.

        `units` contains the SI unit of each constant, by key.
        """
        errors = np.sqrt(self.covariance.diagonal())
        exact = [key for key, error in zip(self.keys, errors.tolist(), strict=True) if not error > 0.0]
        if exact:
            return self.without(exact).table(units)
        if not self.keys:
            return None
        correlation = self.covariance / np.outer(errors, errors)
        return {
            "constants": list(self.keys),
            "standard_errors": [
                f"{e!r} {units[key]}" for key, e in zip(self.keys, errors.tolist(), strict=True)
            ],
            "correlation": [correlation[row, :row].tolist() for row in range(1, len(self.keys))],
            "records": list(self.records),
        }


def read_uncertainty(table: Any, constants: Mapping[str, Constant]) -> Uncertainty:
    """Parse the table [uncertainty] of a hammer file; `constants` are the constants of the hammer.

    Raises
    ------
    InputError
        A name is not a constant of the hammer, a standard error is not a positive quantity of its dimension,
        or the correlations do not form a positive semidefinite matrix.
    """
    if not isinstance(table, Mapping):
        raise InputError.of(UNCERTAINTY, table, f"a table [{UNCERTAINTY}]", written=shown(table))
    unknown = [name for name in table if name not in ENTRIES]
    if unknown:
        raise InputError(
            f"the key {UNCERTAINTY}.{unknown[0]} is not known",
            key=f"{UNCERTAINTY}.{unknown[0]}",
            expected=f"one of {', '.join(ENTRIES)}",
        )
    keys, errors, records = (_texts(table, name) for name in ("constants", "standard_errors", "records"))
    for row, key in enumerate(keys):
        if key not in constants or key in keys[:row]:
            why = "the hammer has no such constant" if key not in constants else "which is listed twice"
            raise InputError(
                f"{UNCERTAINTY}.constants: {key!r}, {why}",
                key=f"{UNCERTAINTY}.constants",
                expected="each constant of the hammer at most once",
            )
    if len(errors) != len(keys):
        raise InputError(
            f"{UNCERTAINTY}.standard_errors has {len(errors)} entries",
            key=f"{UNCERTAINTY}.standard_errors",
            expected=f"{len(keys)}, one per constant",
        )
    sizes = np.array([_error(key, text, constants[key]) for key, text in zip(keys, errors, strict=True)])
    return Uncertainty(keys, _correlation(table, len(keys)) * np.outer(sizes, sizes), records)


def _texts(table: Mapping[str, Any], name: str) -> tuple[str, ...]:
    values = table.get(name, [])
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise InputError.of(f"{UNCERTAINTY}.{name}", values, "a list of strings", written=shown(values))
    return tuple(values)


def _error(key: str, text: str, constant: Constant) -> float:
    from printhammer.units import parse

    with located(f"{UNCERTAINTY}: the standard error of {key} = {text}", key=UNCERTAINTY):
        size = parse(text, constant.si_unit)
    if not 0.0 < size < float("inf"):
        raise InputError(
            f"{UNCERTAINTY}: the standard error of {key} is {text}", key=UNCERTAINTY, expected="more than 0"
        )
    return size


def _correlation(table: Mapping[str, Any], count: int) -> FloatArray:
    """Return the correlation matrix; the identity matrix if the table states no correlations."""
    matrix = np.eye(count)
    rows = table.get("correlation", [])
    wanted = (
        f"expected {max(count - 1, 0)} rows of 1, 2, ... numbers, the lower triangle of a correlation matrix"
    )
    if not isinstance(rows, list) or len(rows) not in (0, max(count - 1, 0)):
        raise InputError(
            f"{UNCERTAINTY}.correlation = {shown(rows)}: {wanted}",
            key=f"{UNCERTAINTY}.correlation",
            value=rows,
        )
    for number, row in enumerate(rows, 1):
        if not _numbers(row, number):
            raise InputError(
                f"{UNCERTAINTY}.correlation, row {number} = {shown(row)}: {wanted}",
                key=f"{UNCERTAINTY}.correlation",
                value=row,
            )
        matrix[number, :number] = matrix[:number, number] = row
    if count and not np.linalg.eigvalsh(matrix)[0] > _NEGATIVE:
        raise InputError(
            f"{UNCERTAINTY}.correlation is not a correlation matrix: {wanted}",
            key=f"{UNCERTAINTY}.correlation",
        )
    return matrix


def _numbers(row: Any, count: int) -> bool:
    if not isinstance(row, Sequence) or isinstance(row, str) or len(row) != count:
        return False
    return all(
        isinstance(entry, (int, float)) and not isinstance(entry, bool) and abs(entry) <= 1.0 + 1e-9
        for entry in row
    )
