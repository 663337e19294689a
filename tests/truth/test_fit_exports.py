"""Constants from exports of oscilloscopes: inverted, scaled and delayed columns give the true values.

A locked coil of R and L on a rail V: i = V/R (1 - exp(-R t / L)).
"""

from pathlib import Path

import numpy as np
import pytest
from tests.hammers import CRUDE

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


SCALES = "displacement={}*-50 um/V+120 um, current={}*-10 A/V, delay(displacement)=3 us, delay(current)=2 us"


@pytest.mark.parametrize("scope", ["picoscope", "tektronix"])
def test_a_mass_from_an_export(tmp_path: Path, scope: str) -> None:
    hammer = ph.load(CRUDE)
    shot = ph.measure("motion", hammer, seed=34)
    path = tmp_path / "shot.csv"
    shot.write(path)
    rows = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    assert rows[0] == "time [us],displacement [um],current [A]"
    time, way, amperes = np.array([[float(cell) for cell in row.split(",")] for row in rows[1:]]).T
    # What the two probes show: both inverted, 20 mV/um with an offset and 0.1 V/A, each late.
    volts = np.column_stack(
        [-(np.interp(time - 3.0, time, way) - 120.0) / 50.0, -0.1 * np.interp(time - 2.0, time, amperes)]
    )
    if scope == "picoscope":
        body = "".join(
            f"{1e-3 * t:.6f};{1e3 * a:.5f};{1e3 * b:.5f}\n" for t, (a, b) in zip(time, volts, strict=True)
        )
        path.write_text("Zeit;Kanal A;Kanal B\n(ms);(mV);(mV)\n\n" + body.replace(".", ","))
        columns = "time=1, " + SCALES.format(2, 3)
    else:
        body = "".join(f"{1e-6 * t:.8e},{a:.8e},{b:.8e}\n" for t, (a, b) in zip(time, volts, strict=True))
        path.write_text("Model,MSO54\nHorizontal Units,s,,\nVertical Units,V,V,\n\nTIME,CH1,CH2\n" + body)
        columns = SCALES.format(2, 3)
    start = hammer.replace("mass", 0.85 * hammer.mass)
    found = ph.fit("motion", path, hammer=start, columns=columns, bandwidth="200 kHz")
    assert not found.rejected
    for name in ("mass", "backstop.damping"):
        low, high = found[name].interval
        assert low <= hammer.constants[name].si <= high
