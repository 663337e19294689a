"""Arguments that are objects: an argument of another class is rejected by its name."""

from typing import Any

import pytest
from tests.errors import refused

import printhammer as ph

HAMMER = ph.load("hendriks-1983")
TRAIN = ph.PulseTrain(HAMMER.waveform, rate="1 kHz", pulses=2)


@pytest.mark.parametrize(
    ("call", "key", "value"),
    [
        (lambda: ph.simulate("hendriks-1983", TRAIN), "hammer", "hendriks-1983"),
        (lambda: ph.simulate(HAMMER, HAMMER.waveform), "drive", HAMMER.waveform),
        (lambda: ph.simulate(TRAIN, HAMMER), "hammer", TRAIN),
        (lambda: ph.simulate(hammer=HAMMER, drive="fire"), "drive", "fire"),
        (lambda: ph.frequency_map("hendriks-1983"), "hammer", "hendriks-1983"),
        (lambda: ph.frequency_map(HAMMER, waveform=TRAIN), "waveform", TRAIN),
        (lambda: ph.strobe(HAMMER.waveform, rate="1 kHz"), "hammer", HAMMER.waveform),
        (lambda: ph.safe_rate("impact-wire"), "hammer", "impact-wire"),
        (lambda: ph.judge_table(HAMMER, "table.json"), "table", "table.json"),
        (lambda: ph.rest_state("hendriks-1983"), "hammer", "hendriks-1983"),
        (lambda: ph.equilibria(TRAIN), "hammer", TRAIN),
        (lambda: ph.release_current(HAMMER.waveform), "hammer", HAMMER.waveform),
        (lambda: ph.holding_margin("hendriks-1983", 1e-4), "hammer", "hendriks-1983"),
        (lambda: ph.bifurcation_curve(TRAIN, "mass", (1.0, 2.0)), "source", TRAIN),
        (lambda: ph.measure("magnet", "hendriks-1983"), "hammer", "hendriks-1983"),
        (lambda: ph.load(HAMMER), "name_or_path", HAMMER),
        (lambda: ph.load(None), "name_or_path", None),  # type: ignore[arg-type]
        (lambda: ph.load_table(HAMMER), "path", HAMMER),
        (lambda: ph.sweep(HAMMER, "out.zarr"), "spec", HAMMER),
        (lambda: ph.sweep("spec.toml", HAMMER), "out", HAMMER),
        (lambda: ph.thermal_limit(None, ["10 Hz"]), "ambient", None),  # type: ignore[arg-type]
        (lambda: ph.thermal_limit(["15 degC"], "10 Hz"), "rate", "10 Hz"),
    ],
)
def test_wrong_objects_are_named(call: Any, key: str, value: object) -> None:
    with refused(key, value):
        call()


def test_a_state_takes_text_with_units() -> None:
    state = (HAMMER.position, 0.25)
    text = (f"{HAMMER.position * 1e6} um", "0.25 m/s")
    motion, other = (ph.simulate(HAMMER, TRAIN, state=each) for each in (state, text))
    assert motion.dots[0].flight_time == pytest.approx(other.dots[0].flight_time, rel=1e-9)
    for wrong in (("100 um", "1 s"), ("100 um", None), ("100 um",), ("a", "b")):
        with refused("state"):
            ph.simulate(HAMMER, TRAIN, state=wrong)


def test_a_map_takes_text_with_units() -> None:
    chart = ph.frequency_map(HAMMER, ["700 Hz", 900.0, "1.1 kHz"], pulses=2, times=["0 s", "1 ms"])
    assert chart["rate"].values.tolist() == [700.0, 900.0, 1100.0]
    assert chart["time"].values.tolist() == [0.0, 1e-3]
    with refused("rates"):
        ph.frequency_map(HAMMER, ["700 um"])
