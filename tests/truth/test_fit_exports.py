"""Constants of a coil from exports of oscilloscopes: inverted, scaled and delayed columns give the truth.

A locked coil of R and L on a rail V: i = V/R (1 - exp(-R t / L)).
"""

from pathlib import Path

import numpy as np
import pytest

import printhammer as ph

R, L, RAIL = 6.0, 12e-3, 9.0
HAMMER = """format = 1
name = "coil"
mass = { value = 1, unit = "g", status = "stated", source = "made up" }
[coil]
resistance = { value = 5, unit = "ohm", status = "stated", source = "made up" }
inductance = { value = 9, unit = "mH", status = "stated", source = "made up" }
[waveform]
shape = "rail"
voltage = { value = 9, unit = "V", status = "stated", source = "made up" }
width = { value = 40, unit = "ms", status = "stated", source = "made up" }
"""
TIMES = np.arange(-20, 180) * 100e-6
LATE = 250e-6


def current(t: np.ndarray, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0.0, 2e-3, len(t))
    return np.where(t > 0.0, RAIL / R * (1.0 - np.exp(-R * np.maximum(t, 0.0) / L)), 0.0) + noise


def picoscope(seed: int) -> tuple[str, str]:
    # The current clamp is inverted, 0.1 V/A, and late.
    millivolts = -100.0 * current(TIMES - LATE, seed)
    rows = "".join(f"{1e3 * t:.8f};{v:.8f}\n" for t, v in zip(TIMES, millivolts, strict=True))
    text = "Zeit;Kanal A\n(ms);(mV)\n\n" + rows.replace(".", ",")
    return text, "time=1, current=2*-10 A/V, delay(current)=250 us"


def tektronix(seed: int) -> tuple[str, str]:
    # The clamp as above beside the rail through a divider, switched 1.5 ms before the trigger.
    on = -1.5e-3
    volts = -0.1 * current(TIMES - on - LATE, seed)
    rail = np.where(on <= TIMES, 0.9, 0.0)
    rows = "".join(f"{t:.8e},{v:.8e},{u:.6e}\n" for t, v, u in zip(TIMES, volts, rail, strict=True))
    head = "Model,MSO54\nHorizontal Units,s,,\nSample Interval,1e-04,,\nVertical Units,V,V,\n\nTIME,CH1,CH2\n"
    return head + rows, "current=2*-10 A/V, voltage=3*10 V/V, delay(current)=250 us"


@pytest.mark.slow
@pytest.mark.parametrize("made", [picoscope, tektronix])
def test_a_coil_from_an_export(tmp_path: Path, made: object) -> None:
    (tmp_path / "coil.toml").write_text(HAMMER)
    hammer = ph.load(tmp_path / "coil.toml")
    inside = []
    for seed in range(2):
        text, columns = made(seed)  # type: ignore[operator]
        (tmp_path / "trace.csv").write_text(text)
        found = ph.fit("coil", tmp_path / "trace.csv", hammer=hammer, locked="0 mm", columns=columns)
        assert not found.rejected
        for name, truth in (("coil.resistance", R), ("coil.inductance", L)):
            low, high = found[name].interval
            inside.append(low <= truth <= high)
            assert found[name].value == pytest.approx(truth, rel=0.02)
    # Of four intervals of 95 %, two outside have a chance of 1.4 %.
    assert sum(inside) >= 3
