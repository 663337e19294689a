import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import sequences
from tests.errors import refused

from printhammer.drive.file import read_drive
from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import (
    SHAPES,
    TAIL,
    Chain,
    HalfSine,
    Rectangle,
    Sine,
    Trapezoid,
    Waveform,
)

PRINT = Rectangle(amplitude=0.9, width=350e-6, rise=1e-5, decay=2.4e-5)
BRAKE = Trapezoid(amplitude=0.25, rise=0.0, width=2e-4, fall=0.0)


@settings(max_examples=25)
@given(
    st.lists(sequences.simple, min_size=1, max_size=3), st.lists(sequences.offsets, min_size=3, max_size=3)
)
def test_the_value_is_that_of_the_parts(parts: list[Waveform], gaps: list[float]) -> None:
    chain = sequences.chain(parts, gaps)
    assert chain.support == pytest.approx(sum(gaps[: len(parts)]) + sum(part.support for part in parts))
    t = np.random.default_rng(1).uniform(-1e-4, 1.1 * chain.support, 40)
    expected = sum(part.value(t - offset) for offset, part in chain.parts)
    np.testing.assert_allclose(chain.value(t), expected, rtol=1e-9, atol=1e-6)
    assert chain.peak == pytest.approx(max(part.peak for part in parts), rel=1e-12)


@settings(max_examples=25)
@given(sequences.chains)
def test_what_is_written_is_read_back_to_the_last_bit(chain: Chain) -> None:
    drive = PulseTrain(chain, at=[0.0, 1.0])
    again = read_drive(drive.to_toml())
    assert again == drive
    assert again.to_toml() == drive.to_toml()
    assert again.waveform.segments().tolist() == chain.segments().tolist()
    assert pickle.loads(pickle.dumps(chain)) == chain
    assert hash(chain) == hash(Chain(parts=chain.parts))


def test_a_brake_pulse_follows_the_print_pulse() -> None:
    chain = Chain(parts=((0.0, PRINT), ("1.2 ms", BRAKE)))
    assert [offset for offset, _part in chain.parts] == [0.0, 1.2e-3]
    assert chain.value([1.1e-3, 1.2e-3, 1.3e-3, 1.4e-3]).tolist() == [0.0, 0.25, 0.25, 0.0]
    assert (chain.shape, chain.quantity, chain.unit) == ("chain", "current", "A")
    assert chain.peak == PRINT.peak
    assert chain.scaled(2.0) == Chain(parts=((0.0, PRINT.scaled(2.0)), (1.2e-3, BRAKE.scaled(2.0))))
    assert "chain" not in SHAPES


def test_parts_may_meet_and_a_chain_may_hold_chains() -> None:
    inner = Chain(parts=((1e-4, BRAKE), (3e-4, BRAKE)))
    assert inner.value([0.5e-4, 1e-4, 4e-4, 5.1e-4]).tolist() == [0.0, 0.25, 0.25, 0.0]
    outer = Chain(parts=((0.0, inner), (1e-3, inner)))
    assert outer.value([1e-4, 0.7e-3, 1.2e-3]).tolist() == [0.25, 0.0, 0.25]
    assert read_drive(PulseTrain(outer).to_toml()).waveform == outer


def test_a_force_chain() -> None:
    force = HalfSine(amplitude="3 lbf", width="1 ms")
    chain = Chain(parts=((0.0, force), (2e-3, force)))
    assert chain.quantity == "force"
    assert read_drive(PulseTrain(chain).to_toml()).quantity == "force"


def test_a_tail_is_cut_off_where_the_next_part_begins() -> None:
    begins = PRINT.width + PRINT.decay * 8.0
    assert begins < PRINT.support
    chain = Chain(parts=((0.0, PRINT), (begins, BRAKE)))
    before, after = chain.value([np.nextafter(begins, 0.0), begins])
    assert 0.0 < before < TAIL * PRINT.peak
    assert after == 0.25
    with refused("parts[1]"):
        Chain(parts=((0.0, PRINT), (PRINT.width + PRINT.decay * 5.0, BRAKE)))


@pytest.mark.parametrize(
    ("parts", "key"),
    [
        ([], "parts"),
        (3, "parts"),
        ([PRINT], "parts"),
        ([(0.0, PRINT, 1.0)], "parts"),
        ([(0.0, "print")], "parts[0]"),
        ([(-1e-3, PRINT)], "parts[0]"),
        (
            [(0.0, PRINT), (1e-4, BRAKE)],
            "parts[1]",
        ),
        ([(1e-3, BRAKE), (0.0, BRAKE)], "parts[1]"),
        ([(0.0, BRAKE), (0.0, BRAKE)], "parts[1]"),
        ([(0.0, PRINT), ("1 A", BRAKE)], "parts[1]"),
        ([(0.0, PRINT), (math.nan, BRAKE)], "parts[1]"),
        ([(0.0, PRINT), (True, BRAKE)], "parts[1]"),
        ([(0.0, Sine(amplitude=1.0, frequency=1.0))], "parts[0]"),
        (
            [(0.0, PRINT), (1.0, HalfSine(amplitude="1 N", width=1.0))],
            "parts[1]",
        ),
    ],
)
def test_bad_parts_are_refused_in_one_sentence(parts: Any, key: str) -> None:
    with refused(key):
        Chain(parts=parts)


def test_the_quantity_is_that_of_the_parts() -> None:
    with refused("quantity"):
        Chain(parts=((0.0, PRINT),), quantity="force")
    with refused("parts"):
        Chain()


FILE = """format = 1
[train]
rate = "300 Hz"
pulses = 3
[waveform]
shape = "chain"
[[waveform.parts]]
at = "0 us"
shape = "rectangle"
amplitude = "0.9 A"
width = "350 us"
rise = "10 us"
decay = "24 us"
[[waveform.parts]]
at = "1.2 ms"
shape = "trapezoid"
amplitude = "0.25 A"
rise = "0 us"
width = "200 us"
fall = "0 us"
"""


def test_a_file_lists_the_parts() -> None:
    assert read_drive(FILE).waveform == Chain(parts=((0.0, PRINT), ("1.2 ms", BRAKE)))


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('at = "1.2 ms"\n', "", "waveform.parts[1].at"),
        ('at = "1.2 ms"', 'at = "100 us"', "waveform.parts[1]"),
        ('at = "1.2 ms"', "at = 1.2", "waveform.parts[1].at"),
        ('shape = "trapezoid"', 'shape = "bell"', "waveform.parts[1].shape"),
        ('fall = "0 us"', "", "waveform.parts[1].fall"),
        ('shape = "chain"', 'shape = "chain"\nwidth = "1 us"', "waveform.width"),
    ],
)
def test_a_bad_file_is_refused_in_one_sentence(old: str, new: str, key: str) -> None:
    assert old in FILE
    with refused(key):
        read_drive(FILE.replace(old, new, 1))


@pytest.mark.parametrize(
    ("parts", "key"), [("3", "waveform.parts"), ("[]", "waveform.parts"), ("[3]", "waveform.parts[0]")]
)
def test_parts_of_a_file_are_a_list_of_tables(parts: str, key: str) -> None:
    head = FILE.partition("[[")[0]
    with refused(key):
        read_drive(f"{head}parts = {parts}\n")
