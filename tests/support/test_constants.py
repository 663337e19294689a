"""Declared constants: listing, bounds, sentences."""

from pathlib import Path
from typing import Literal

import pytest
from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, model_validator

from printhammer.errors import InputError
from printhammer.support.constants import expected, folder_of, invalid, options, quantities, quantity, shown


class Sample(BaseModel):
    model_config = ConfigDict(extra="forbid")

    length: float = quantity("m", "L", "length of the sample", gt=0)
    share: float | None = quantity("1", "p", "share of water", ge=0, le=1, default=None)
    load: float = quantity("A", "I", "load", also=("N",), default=0.0)
    way: Literal["up", "down"] = "up"
    wet: bool = False

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> "Sample":
        if self.length == 7.0:
            raise InputError(f"{folder_of(info)}: seven")
        if self.length == 8.0:
            raise ValueError("expected something else than eight")
        return self


def told(context: object = None, **fields: object) -> str:
    with pytest.raises(ValidationError) as caught:
        Sample.model_validate(fields, strict=True, context=context)
    written = {"length": "3 in"} if fields.get("length") == -3.0 else None
    return str(invalid(caught.value, Sample, "sample.", written))


def test_quantities_and_options_are_told_apart() -> None:
    found = quantities(Sample)
    assert list(found) == ["length", "share", "load"]
    assert (found["length"].si, found["length"].symbol, found["length"].required) == ("m", "L", True)
    assert (found["share"].ge, found["share"].le, found["share"].required) == (0, 1, False)
    assert tuple(found["load"].also) == ("N",)
    assert list(options(Sample)) == ["way", "wet"]


def test_sentences_name_key_value_and_expectation() -> None:
    assert told() == "sample.length is missing: expected length of the sample (m)"
    assert told(length=-3.0) == "sample.length = 3 in: expected more than 0 m"
    assert told(length=float("inf")) == "sample.length = inf: expected more than 0 m"
    assert told(length="x").startswith("sample.length = 'x': expected more than 0 m")
    assert told(length=1.0, share=2.0) == "sample.share = 2.0: expected 0 or more and 1 or less"
    assert told(length=1.0, load=None) == "sample.load = None: expected a finite number in A"
    assert told(length=1.0, way="left") == "sample.way = 'left': expected 'up' or 'down'"
    assert told(length=1.0, wet=1) == "sample.wet = 1: expected true or false"
    assert told(length=1.0, dry=1).startswith("sample.dry = 1 is not known: expected one of length, share")
    assert told(length=8.0) == "sample: expected something else than eight"


def test_a_validator_that_names_its_file_is_heard(tmp_path: Path) -> None:
    assert told(context={"folder": tmp_path}, length=7.0) == f"{tmp_path}: seven"
    assert told(length=7.0) == ".: seven"


def test_long_and_odd_values_stay_on_one_line() -> None:
    assert shown("a\nb") == r"'a\nb'"
    assert shown("a\nb", quotes=False) == r"'a\nb'"
    assert shown("in", quotes=False) == "in"
    assert len(shown("x" * 1000)) == 80
    assert expected(quantities(Sample)["length"]) == "more than 0 m"
