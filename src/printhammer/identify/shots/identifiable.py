"""What records of motion can and cannot tell: degenerate constants, weak ones, further ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.support.arrays import FloatArray

_DEGENERATE: Final = 1e5
"""Condition number from which on difference quotients no longer tell the columns of a Jacobian apart."""
_TIED: Final = 0.98
"""Correlation of two constants that are hardly told apart."""
_WEAK: Final = 0.1
"""Standard error of a constant, in units of its value, that is weakly determined."""
_SHARE: Final = 0.02
"""Part of a constant in a direction, over the largest, from which on it is named."""


def condition_number(design: FloatArray) -> float:
    """Return the condition number of a Jacobian with columns of unit length; infinite where one is 0."""
    sizes = np.sqrt((design * design).sum(axis=0))
    if not sizes.all():
        return float("inf")
    values, _vectors = singular(design / sizes)
    return float(values[-1] / values[0]) if values[0] > 0.0 else float("inf")


def singular(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return singular values, ascending, and right singular vectors as columns, of a tall matrix.

    From its normal matrix, which is small: good where the condition number is not above 1e7.
    """
    squares, vectors = np.linalg.eigh(matrix.T @ matrix)
    return np.sqrt(np.maximum(squares, 0.0)), vectors


def refuse_degenerate(where: str, design: FloatArray, names: Sequence[str]) -> None:
    """Refuse constants that can change together without any change of the motion.

    `where` names the files; the design is the Jacobian over the standard errors of the data, shape (m, p).

    Raises
    ------
    InputError
        There are such constants; the sentence names them.
    """
    sizes = np.sqrt((design * design).sum(axis=0))
    blind = [name for name, size in zip(names, sizes, strict=True) if size == 0.0]
    if blind:
        raise InputError(f"{where}: nothing in the records depends on {blind[0]}, expected it not to be free")
    values, vectors = singular(design / sizes)
    if values[0] * _DEGENERATE > values[-1]:
        return
    direction = np.abs(vectors[:, 0])
    tied = [name for name, part in zip(names, direction, strict=True) if part > _SHARE * direction.max()]
    listed = tied[0] if len(tied) == 1 else f"{', '.join(tied[:-1])} and {tied[-1]}"
    raise InputError(
        f"{where}: a motion cannot tell apart {listed}: changed together they leave the records as"
        " they are, expected at least one of them to be held"
    )


def tied_constants(names: Sequence[str], values: FloatArray, covariance: FloatArray) -> list[str]:
    """Return one sentence for each pair that is hardly told apart, and for each that is weak."""
    errors = np.sqrt(np.diag(covariance))
    sentences = []
    for i, name in enumerate(names):
        for j in range(i):
            correlation = covariance[i, j] / (errors[i] * errors[j])
            if abs(correlation) > _TIED:
                sentences.append(
                    f"{names[j]} and {name} are hardly told apart: their correlation is {correlation:.4f}"
                )
    for name, value, error in zip(names, values, errors, strict=True):
        if error > _WEAK * abs(value):
            sentences.append(f"{name} is known to {100.0 * error / abs(value):.2g} % only")
    return sentences


def weak(values: FloatArray, covariance: FloatArray) -> list[int]:
    """Return which constants are weakly determined."""
    errors = np.sqrt(np.diag(covariance))
    return [int(i) for i in np.flatnonzero(errors > _WEAK * np.abs(values))]


def would_be_found(
    design: FloatArray, columns: FloatArray, names: Sequence[str], residuals: FloatArray
) -> list[tuple[str, float, float]]:
    """Return what the records would say of further constants, one at a time, were they free too.

    `design`, shape (m, p), and `residuals` are over the standard errors of the data, as are `columns`, shape
    (m, q), of the further constants per relative change. Returned are name, relative standard error, and
    relative change that would fit best, of each.
    """
    basis, _r = np.linalg.qr(design)
    further = []
    for name, column in zip(names, columns.T, strict=True):
        own = column - basis @ (basis.T @ column)
        size = float(own @ own)
        if size > 1e-12 * float(column @ column):
            further.append((name, size**-0.5, float(own @ residuals) / size))
    return further
