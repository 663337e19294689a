"""Results of the reconstruction: base rates, predictions, search, family, schemes of the 1983 paper.

Five JSON files in the folder `data` beside this module, each with ``"format": 1``; any of them may be absent.
All values are SI.

A `Share` is a fraction with its binomial confidence interval.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from importlib.resources.abc import Traversable
from math import sqrt
from pathlib import Path
from statistics import NormalDist
from typing import Annotated, Any, Final, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from printhammer.claims.judging import KINDS, claims
from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.support.constants import shown

CONFIDENCE: Final = 0.95  # Confidence level of the intervals; conventional

_Z: Final = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)


class Share(Declared):
    """Fraction of hammers for which a statement holds: `holds` of `measured`."""

    measured: int = part("number of hammers, at least one")
    holds: int = part("number of hammers for which the statement holds")

    @property
    def rate(self) -> float:
        """Fraction of the measured hammers for which the statement holds, from 0 to 1."""
        return self.holds / self.measured

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson 95 % interval of the fraction; E. B. Wilson, J. Amer. Statist. Assoc. 22 (1927) 209.

        The interval consists of the probabilities p with ``|rate - p| <= z sqrt(p (1 - p) / n)``. It lies
        within 0 to 1, and its width is not zero even if the statement holds for none or all hammers.
        """
        n, p = self.measured, self.rate
        middle = p + _Z**2 / (2.0 * n)
        half = _Z * sqrt(p * (1.0 - p) / n + (_Z / (2.0 * n)) ** 2)
        scale = 1.0 + _Z**2 / n
        # The ends are exact if none or all hold.
        low = 0.0 if self.holds == 0 else (middle - half) / scale
        high = 1.0 if self.holds == n else (middle + half) / scale
        return low, high

    def as_dict(self) -> dict[str, Any]:
        """Return the fraction as an entry of `claims.json`: counts, rate and interval."""
        low, high = self.interval
        return {"rate": self.rate, "low": low, "high": high, "measured": self.measured, "holds": self.holds}


_Count = Annotated[int, Field(ge=0)]
_Some = Annotated[int, Field(ge=1)]
_Number = Annotated[float, Field(allow_inf_nan=False)]


def _known(name: str) -> str:
    if name not in claims():
        raise ValueError("expected the name of a claim of the paper")
    return name


_ClaimName = Annotated[str, AfterValidator(_known)]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class _Counted(_Table):
    measured: _Count = Field(description="the number of hammers")
    holds: _Count = Field(description="the number of hammers for which the claim holds")

    @model_validator(mode="after")
    def _possible(self) -> _Counted:
        if self.holds > self.measured:
            raise ValueError("expected no more hammers for which it holds than were measured")
        return self


class _Predicted(_Counted):
    kind: Literal["stated", "typical", "shape"] = Field(description=f"one of {', '.join(KINDS)}")


class _Panel(_Counted):
    holds: _Count = Field(
        alias="as_printed", description="the number of hammers with the verdict of the paper"
    )


class BaseRates(_Table):
    """Fraction of random plausible hammers for which each claim holds."""

    format: Literal[1] = Field(description="1, the version of the format")
    hammers: _Some = Field(description="the number of random hammers")
    seed: int = Field(description="the seed of the random hammers")
    space: dict[str, Annotated[list[Any], Field(min_length=3, max_length=3)]] = Field(
        description="the lowest and highest value of each constant, and their unit"
    )
    claims: dict[_ClaimName, _Counted] = Field(description="the counts of each claim")
    poincare_panels: dict[str, _Panel] = Field({}, description="the counts of each panel of Fig. 11")

    def share(self, name: str) -> Share | None:
        """Return the fraction of random hammers for which a claim holds; None for a claim not measured."""
        return _share(self.claims.get(name))

    @property
    def panels(self) -> dict[str, Share]:
        """Fraction of random hammers that reproduce the paper's classification, by panel of Fig. 11."""
        shares = {name: _share(panel) for name, panel in self.poincare_panels.items()}
        return {name: share for name, share in shares.items() if share is not None}


class Predictions(_Table):
    """Counts of hammers, fitted to the stated claims alone, for which each other claim holds."""

    format: Literal[1] = Field(description="1, the version of the format")
    seed: int = Field(description="the seed of the search")
    candidates: _Some = Field(description="the number of hammers tried")
    hammers: _Count = Field(description="the number of hammers selected")
    stated_held: list[_ClaimName] = Field(description="the stated claims that all selected hammers satisfy")
    claims: dict[_ClaimName, _Predicted] = Field(description="the counts of each claim")

    def share(self, name: str) -> Share | None:
        """Return the fraction of fitted hammers for which a claim holds; None for a claim not measured."""
        return _share(self.claims.get(name))


class Searched(_Table):
    """One search for a hammer: target claims, seed, and number of hammers tried."""

    aim: Literal["stated", "all", "panels", "buzz", "claims"] = Field(
        description="the claims that the search aimed at"
    )
    seed: int = Field(description="the seed of the search")
    candidates: _Count = Field(description="the number of hammers tried")


class BestFor(_Table):
    """Hammer that satisfies one claim most closely."""

    value: dict[str, Any] = Field(description="the values measured with the hammer")
    holds: bool = Field(description="whether the claim holds for the hammer")
    constants: dict[str, _Number] = Field(description="its constants by file key, SI")
    costs: list[_ClaimName] = Field(description="the claims that fail for it instead")


class Failing(_Table):
    """Claim that fails for the shipped hammer, with measured value, reason and best hammer."""

    value: dict[str, Any] = Field(description="the values measured with the shipped hammer")
    why: str = Field(description="the reason why the claim fails")
    best: BestFor | None = Field(None, description="the best hammer for this claim")


class Search(_Table):
    """Record of the searches that found the shipped hammer."""

    format: Literal[1] = Field(description="1, the version of the format")
    shipped: str = Field(description="the fingerprint of the shipped hammer")
    searches: list[Searched] = Field(min_length=1, description="each search, in the order of their logs")
    core_hours: Annotated[_Number, Field(ge=0.0)] = Field(description="the computation time, in core hours")
    tolerance: Annotated[_Number, Field(gt=0.0)] = Field(description="the tolerance of the simulations")
    waveform: str = Field(description="the shape of the waveforms")
    gauge: str = Field(description="the rule that fixed the common scale of masses and forces")
    failing: dict[_ClaimName, Failing] = Field(description="the claims that fail for the shipped hammer")


class FamilyMember(_Table):
    """Hammer of the family: constants, verdicts on the claims, and derived quantities."""

    name: str = Field(description="its name")
    constants: dict[str, _Number] = Field(description="its constants by file key, SI")
    verdicts: dict[_ClaimName, Literal["holds", "fails"]] = Field(description="its verdict on each claim")
    panels: Annotated[int, Field(ge=0)] = Field(description="the number of panels of Fig. 11 as printed")
    conclusions: dict[str, _Number | None] = Field(
        description="quantities that follow for the hammer, by name, SI"
    )


class Conclusion(_Table):
    """Conclusion about the hammers of the reconstructed family, and whether all members agree."""

    low: _Number | None = Field(description="the lowest value in the family")
    high: _Number | None = Field(description="the highest value in the family")
    robust: bool = Field(description="whether it holds for all of them")
    text: str = Field(description="the conclusion in a sentence")


class Family(_Table):
    """Distinct hammers that satisfy the claims about as well as the shipped hammer does."""

    format: Literal[1] = Field(description="1, the version of the format")
    hammers: list[FamilyMember] = Field(min_length=1, description="the hammers")
    conclusions: dict[str, Conclusion] = Field(
        description="the conclusions, each with its range over the hammers"
    )


class FamilyPanels(_Table):
    """Number of the twelve panels of Fig. 11 that agree with the paper, for one hammer of the family."""

    exact: _Count = Field(description="the number with the verdict of the paper, with the default integrator")
    computed: _Count = Field(
        description="the number with the verdict of the paper, with the Runge-Kutta method of 1983"
    )
    same: _Count = Field(description="the number of panels with the same verdict by both integrators")


class Change(_Table):
    """Fraction of panels of Fig. 11 that two computations classify differently."""

    first: str = Field(description="the first computation, such as 'exact'")
    second: str = Field(description="the other")
    panels: _Some = Field(description="the number of panels")
    differ: _Count = Field(description="the number of panels with another verdict")
    share: _Number = Field(description="the fraction of panels with another verdict")
    share_error: _Number | None = Field(
        description="two standard errors of that fraction, with the panels of a hammer as one sample"
    )
    periodic_to_strange: _Count = Field(
        description="the number of panels periodic in the first computation, strange in the second"
    )
    strange_to_periodic: _Count = Field(
        description="the number of panels strange in the first computation, periodic in the second"
    )


class Schemes(_Table):
    """Effect of the integrators of the 1983 paper on the classification of panels and on the claims."""

    format: Literal[1] = Field(description="1, the version of the format")
    shipped: str = Field(description="the fingerprint of the hammer of panels and claims")
    panels: dict[str, list[str]] = Field(description="the verdicts on the panels of Fig. 11, by integrator")
    claims: dict[_ClaimName, Literal["holds", "fails"]] = Field(
        description="the verdicts on claims, where the Runge-Kutta method of 1983 can compute them"
    )
    family: dict[str, FamilyPanels] = Field(description="panels of Fig. 11 of each hammer of the family")
    hammers: _Some = Field(description="the number of random hammers")
    seed: int = Field(description="the seed of the random hammers")
    changes: list[Change] = Field(description="the changes of the verdicts on the panels of random hammers")


FILES: Final[dict[str, type[_Table]]] = {
    "base_rates": BaseRates,
    "predictions": Predictions,
    "search": Search,
    "family": Family,
    "schemes": Schemes,
}
"""Class of each results file, by file name without ".json"."""

_Model = TypeVar("_Model", bound=_Table)


def _file(name: str, model: type[_Model], meaning: str) -> cached_property[_Model | None]:
    def read(results: Results) -> _Model | None:
        return results.read(name, model)

    read.__doc__ = meaning
    return cached_property(read)


@dataclass(frozen=True)
class Results:
    """Results of the reconstruction in a folder; each result is None if its file is absent."""

    folder: Path | Traversable
    base_rates = _file(
        "base_rates", BaseRates, "Base rates: how often each claim holds among random plausible hammers."
    )
    predictions = _file("predictions", Predictions, "Predictions of the search on the stated claims alone.")
    search = _file("search", Search, "Record of the searches that found the shipped hammer.")
    family = _file(
        "family", Family, "Distinct hammers that satisfy the claims about as well as the shipped hammer."
    )
    schemes = _file("schemes", Schemes, "Effect of the integrators of 1983 on verdicts.")

    def check(self) -> None:
        """Read and validate all result files."""
        for name in FILES:
            getattr(self, name)

    def read(self, name: str, model: type[_Model]) -> _Model | None:
        """Read and validate the result file `name`, one of `FILES`; None if the file is absent."""
        path = self.folder / f"{name}.json"
        try:
            text = path.read_text(encoding="utf-8")
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or "not UTF-8"
            raise InputError(f"{path}: the file cannot be read ({reason})", file=path) from None
        try:
            document = json.loads(text, parse_constant=_refuse)
        except ValueError as error:
            raise InputError(f"{path}: expected JSON ({error})", file=path) from None
        try:
            return model.model_validate(document)
        except ValidationError as error:
            raise _fault(error, model).within(path) from None


def shipped_results() -> Results:
    """Return the results of the reconstruction that ship with the package."""
    return Results(files("printhammer").joinpath("report", "reconstruction", "data"))


def _share(counted: _Counted | None) -> Share | None:
    return Share(counted.measured, counted.holds) if counted is not None and counted.measured else None


def _refuse(text: str) -> None:
    raise ValueError(f"{text} is no number of JSON")


def _fault(error: ValidationError, model: type[_Table]) -> InputError:
    """Convert the first validation error to an `InputError` with key, value and expectation."""
    fault = error.errors(include_url=False)[0]
    steps = [step for step in fault["loc"] if step != "[key]"]
    key = "".join(f"[{step + 1}]" if isinstance(step, int) else f".{step}" for step in steps).lstrip(".")
    if fault["type"] == "missing":
        return InputError(f"{key} is missing", key=key)
    if fault["type"] == "extra_forbidden":
        place = f": expected one of {', '.join(model.model_fields)}" if len(steps) == 1 else ""
        return InputError(f"the key {shown(key, quotes=False)} is not known{place}", key=key)
    wanted = fault["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    wanted = wanted if wanted.startswith("expected") else f"expected {wanted}"
    if fault["type"] == "model_type":
        return InputError(f"expected an object for {key or 'the whole file'}", key=key or None)
    if isinstance(fault["input"], dict | list):
        return InputError(f"{key}: {wanted}", key=key, value=fault["input"])
    return InputError(f"{key} = {shown(fault['input'])}: {wanted}", key=key, value=fault["input"])
