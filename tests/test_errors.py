"""The fields of errors: composed, located, and preserved between processes."""

import pickle

from tests.errors import refused

from printhammer.errors import InputError, located


def test_a_message_is_composed_of_its_fields() -> None:
    error = InputError.of("rate", -1.0, "a positive number", file="drive.toml", unit="Hz")
    assert str(error) == "drive.toml: rate = -1.0 Hz: expected a positive number"
    assert (error.file, error.key, error.value) == ("drive.toml", "rate", -1.0)
    assert error.expected == "a positive number"
    assert str(InputError.of("rate", -1.0, 3, written="-1 Hz")) == "rate = -1 Hz: expected 3"


def test_places_are_added_from_within() -> None:
    place = refused("train.rate", "x", file="drive.toml")
    with place as caught, located("drive.toml"), located("train", key="train"):
        raise InputError.of("rate", "x", "a number")
    assert str(caught.value) == "drive.toml: train: rate = 'x': expected a number"
    assert caught.value.expected == "a number"


def test_fields_pass_from_process_to_process() -> None:
    error = pickle.loads(pickle.dumps(InputError.of("rate", -1.0, "a positive number", file="drive.toml")))
    assert str(error) == "drive.toml: rate = -1.0: expected a positive number"
    assert (error.file, error.key, error.value, error.expected) == (
        "drive.toml",
        "rate",
        -1.0,
        "a positive number",
    )
