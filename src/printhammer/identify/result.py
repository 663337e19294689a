"""What a fit returns: constants with their uncertainty, and what the data say of the law."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy.typing as npt

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

CONFIDENCE: Final = 0.95
"""Probability with which an interval is meant to contain the constant."""


@dataclass(frozen=True)
class FittedConstant:
    """One constant that a fit has found.

    Attributes
    ----------
    key : str
        Dotted key of the hammer file, such as "magnet.F0"; another name where `in_file` is false.
    value : float
        SI.
    standard_error : float
        SI.
    interval : tuple of float
        Ends of the 95 % interval, SI.
    unit : str
        SI unit.
    in_file : bool
        Whether a hammer file has such a constant; a combination of constants, or an exponent, has no place
        there.
    how : str
        How it was found if not by the fit to the files, such as "computed from radii and Young's moduli".
    """

    key: str
    value: float
    standard_error: float
    interval: tuple[float, float]
    unit: str
    in_file: bool = True
    how: str = ""

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
        """Make a constant with the 95 % interval of Student's t.

        Parameters
        ----------
        key, value, standard_error, unit, in_file, how
            As the attributes.
        degrees_of_freedom : float
            Of the estimate of the noise.

        Returns
        -------
        FittedConstant
            The constant.
        """
        half = student(degrees_of_freedom) * float(standard_error)
        ends = float(value) - half, float(value) + half
        return cls(key, float(value), float(standard_error), ends, unit, in_file, how)


@dataclass(frozen=True, eq=False)
class Profile:
    """How much worse the fit becomes where one constant is held at other values.

    Attributes
    ----------
    values : array, shape (n,)
        Values at which the constant is held, SI, ascending.
    increase : array, shape (n,)
        Increase of the weighted sum of squares over its least value, in units of the noise variance; all
        other constants are fitted again.
    interval : tuple of float
        Ends of the 95 % interval where the increase reaches the square of Student's t, SI; infinite where it
        does not.
    """

    values: FloatArray
    increase: FloatArray
    interval: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Fit:
    """The result of a fit.

    Attributes
    ----------
    kind : str
        What was fitted: "magnet", "spring", "pack", "backstop" or "motion".
    source : tuple of str
        Names of the files, without their folders.
    constants : dict of str to FittedConstant
        By key.
    keys : tuple of str
        Order of `covariance`; a constant from which another one was computed may be missing.
    covariance : array, shape (n, n)
        Of the constants in `keys`, SI.
    abscissa, data, fitted, residuals : array, shape (m,)
        Where each datum was measured, the datum, the law there, and their difference data - fitted, SI.
    axes : tuple of tuple of str
        Name and SI unit of the abscissa and of the data, such as (("displacement", "m"), ("force", "N")).
    degrees_of_freedom : float
        Data used less parameters fitted; less where residuals depend on each other.
    residual_scale : float
        Standard deviation of the noise in the data, SI.
    weights : array, shape (m,)
        Of the data, proportional to 1 / variance; the largest is 1.
    outliers : array of bool, shape (m,)
        Data left out because they lie too far off.
    condition_number : float
        Of the Jacobian with columns of unit length; large where constants cannot be told apart.
    series : array of int, shape (m,)
        To which of `series_names` each datum belongs: a current, a branch, a file.
    series_names : tuple of str
        For the legend.
    lines : array of int, shape (m,)
        Line of the file in which each datum stands; empty where data are no rows.
    given : dict of str to str
        What was taken as known: dotted key or a phrase, to its value with unit.
    indistinct : tuple of str
        One sentence for each thing that the data cannot tell apart.
    profiles : dict of str to Profile
        For constants that are weakly determined.
    rejected : str
        Why the data reject the law; empty where they do not.
    p_value : float
        Probability of data as far from the law as these if the law holds; NaN where it was not tested.
    notes : tuple of str
        Further sentences.
    """

    kind: str
    source: tuple[str, ...]
    constants: Mapping[str, FittedConstant]
    keys: tuple[str, ...]
    covariance: FloatArray
    abscissa: FloatArray
    data: FloatArray
    fitted: FloatArray
    residuals: FloatArray
    axes: tuple[tuple[str, str], tuple[str, str]]
    degrees_of_freedom: float
    residual_scale: float
    weights: FloatArray
    outliers: npt.NDArray[np.bool_]
    condition_number: float
    series: npt.NDArray[np.int64]
    series_names: tuple[str, ...]
    lines: npt.NDArray[np.int64]
    given: Mapping[str, str] = field(default_factory=dict)
    indistinct: tuple[str, ...] = ()
    profiles: Mapping[str, Profile] = field(default_factory=dict)
    rejected: str = ""
    p_value: float = float("nan")
    notes: tuple[str, ...] = ()

    def __getitem__(self, key: str) -> FittedConstant:
        return self.constants[key]

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the constants in `keys`, shape (n, n); 0 where a standard error is 0."""
        errors = np.sqrt(np.diag(self.covariance))
        safe = np.where(errors > 0.0, errors, 1.0)
        found: FloatArray = self.covariance / np.outer(safe, safe)
        return found

    @property
    def for_file(self) -> dict[str, dict[str, str | float]]:
        """The constants that a hammer file has, as tables that `Hammer.replace` takes."""
        from printhammer.identify.fragment import constants

        return constants(self)

    def fragment(self) -> str:
        """Return the constants as TOML text for a hammer file."""
        from printhammer.identify.fragment import fragment

        return fragment(self)

    def into(self, hammer: Hammer) -> Hammer:
        """Return a hammer with the constants replaced by those found.

        Raises
        ------
        InputError
            The hammer has another law for the part, or takes as different what the fit took as known.
        """
        from printhammer.identify.fragment import into

        return into(self, hammer)

    def plot(self) -> Any:
        """Draw data with the law, residuals and correlations (`printhammer.figures.fit.plot`)."""
        # By name, so that no module of physics depends on a picture.
        return import_module("printhammer.figures.fit").plot(self)

    @property
    def report(self) -> list[str]:
        """What there is to say, line by line."""
        from printhammer.identify.fragment import report

        return report(self)


def student(degrees_of_freedom: float) -> float:
    """Return the half-width of a 95 % interval of Student's t, in standard errors."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * CONFIDENCE, degrees_of_freedom))
