"""The circuit of the coil fitted to its current: the true constants lie within the stated errors."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.identify.coil import default_constants
from printhammer.identify.current import probe_current

RAIL = {"shape": "rail", "voltage": "24 V", "width": "2 ms", "decay": "zener", "decay_voltage": "30 V"}
RECORD = {"sampling_rate": "100 kHz", "bandwidth": "20 kHz"}
PLACE = 1e-4


def driven(**coil: str) -> ph.Hammer:
    """A mass on a spring, with a coil on a rail but no magnet."""
    spring = {"law": "preload", "preload": "0 N", "stiffness": "100 N/m"}
    coil = coil or {"resistance": "10 ohm", "inductance": "8 mH"}
    return ph.Hammer.build("1 kg", spring=spring, coil=coil, waveform=RAIL)


def record(hammer: ph.Hammer, path: Path, seed: int = 1, **options: Any) -> Path:
    options = {"sensor": RECORD, "duration": "3 ms", "before": "50 us", "locked": PLACE, **options}
    ph.measure("current", hammer, seed=seed, **options).write(path)
    return path


def test_resistance_and_inductance_are_found_within_their_errors(tmp_path: Path) -> None:
    path = record(driven(), tmp_path / "current.csv")
    text = path.read_text("utf-8")
    assert "# locked: 0.0001 m\n" in text
    assert "# bandwidth: 20 kHz\n" in text
    # The hammer states no coil: where the fit begins is estimated.
    fit = ph.fit("coil", path, hammer=driven().replace("coil", None))
    for name, value in (("coil.resistance", 10.0), ("coil.inductance", 8e-3)):
        constant = fit[name]
        assert abs(constant.value - value) < 3.0 * constant.standard_error
        assert 0.0 < constant.standard_error < 2e-3 * value
    assert not fit.rejected
    assert "[coil]" in fit.fragment()
    assert fit.into(driven().replace("coil", None)).constants["coil.inductance"].status == "derived"


def test_a_shorted_turn_is_found(tmp_path: Path) -> None:
    made = {"resistance": "10 ohm", "inductance": "8 mH", "turn_resistance": "20 ohm", "leakage": "1 mH"}
    path = record(driven(**made), tmp_path / "turn.csv")
    free = ["coil.turn_resistance", "coil.leakage"]
    guess = driven(**{**made, "turn_resistance": "25 ohm", "leakage": "0.8 mH"})
    fit = ph.fit("coil", path, hammer=guess, free=free)
    for name, value in zip(free, (20.0, 1e-3), strict=True):
        assert abs(fit[name].value - value) < 3.0 * fit[name].standard_error < 0.1 * value


def test_the_voltage_of_the_table_drives_the_coil(tmp_path: Path) -> None:
    """A voltage ramp, which no driver produces; the current of a coil on a ramp has a closed form."""
    t = np.linspace(0.0, 3e-3, 31)
    tau, slope = 8e-4, 5e3
    current = slope / 10.0 * (t + tau * np.expm1(-t / tau))
    columns = zip(t.tolist(), current.tolist(), (slope * t).tolist(), strict=True)
    rows = "\n".join(",".join(map(repr, row)) for row in columns)
    path = tmp_path / "ramp.csv"
    path.write_text(f"time [s],current [A],voltage [V]\n{rows}\n", "utf-8")
    fit = ph.fit("coil", path, hammer=driven().replace("waveform", None), locked=PLACE)
    assert fit["coil.resistance"].value == pytest.approx(10.0, rel=1e-5)
    assert fit["coil.inductance"].value == pytest.approx(8e-3, rel=1e-5)


def case(path: Path, heading: str, rows: str) -> Path:
    path.write_text("\n".join([heading, *rows.split()]) + "\n", "utf-8")
    return path


def on_a_rail(resistance: str, inductance: str, voltage: str) -> ph.Hammer:
    coil = {"resistance": resistance, "inductance": inductance}
    return driven(**coil).replace({"waveform.voltage": voltage, "waveform.width": "20 ms"})


def test_a_constant_on_one_row_has_the_noise_of_the_others(tmp_path: Path) -> None:
    """Made with 10 ohm, 0.2 mH and noise of 2 mA: di/dL of the row is 113 to 178 A/H, so 11 to 20 uH."""
    rows = """0,-0.0001 120,2.3976 240,2.3949 360,2.3997 480,2.4020 600,2.4027 720,2.4013 840,2.4030
        960,2.4006 1080,2.4011 1200,2.4004 1320,2.3979 1440,2.3983 1560,2.4008 1680,2.3988 1800,2.4025"""
    path = case(tmp_path / "one.csv", "time [us],current [A]", rows)
    fit = ph.fit("coil", path, hammer=on_a_rail("9 ohm", "0.3 mH", "24 V"), locked=0.0)
    low, high = fit["coil.inductance"].interval
    assert low < 0.2e-3 < high
    assert 10e-6 < fit["coil.inductance"].standard_error < 23e-6
    assert not fit.rejected


def test_a_current_that_dips_rejects_the_law(tmp_path: Path) -> None:
    """A plunger that is released: on a rail, a coil of R and L never loses its current."""
    current = """-0.6 97 91 80.1 68.7 65.2 72.7 84.9 94.1 98.4 99.7 100 100 100 100 100 100 100 100"""
    rows = " ".join(f"{0.25 * k},{value}" for k, value in enumerate(current.split()))
    path = case(tmp_path / "dip.csv", "time [ms],current [mA]", rows)
    fit = ph.fit("coil", path, hammer=on_a_rail("100 ohm", "50 mH", "10 V"), locked=0.0)
    assert fit.rejected
    assert fit.p_value < 1e-3
    assert fit["coil.resistance"].value == pytest.approx(100.0, rel=0.1)
    # What the data do not determine is said, and has no error of 0.
    assert fit["coil.inductance"].held
    assert "coil.inductance" not in fit.keys
    assert fit.outliers.sum() < 4


SWITCHED = """-1.5,0,0.0000 -1,9,0.0000 -0.5,9,0.3318 0,9,0.5902 0.5,9,0.7915 1,9,0.9482 1.5,9,1.0702
    2,9,1.1653 2.5,9,1.2393 3,9,1.2970 3.5,9,1.3419 4,9,1.3769 4.5,9,1.4041 5,9,1.4253 5.5,9,1.4418
    6,9,1.4547 6.5,9,1.4647 7,9,1.4725"""
"""Time, ms, voltage, V, and current, A: 1.5 (1 - exp(-(t + 1 ms) / 2 ms)), so 6 ohm and 12 mH."""


def test_the_switch_lies_where_the_voltage_has_it(tmp_path: Path) -> None:
    hammer = on_a_rail("5 ohm", "5 mH", "9 V")
    path = case(tmp_path / "early.csv", "time [ms],voltage [V],current [A]", SWITCHED)
    fit = ph.fit("coil", path, hammer=hammer, locked=0.0)
    assert fit["coil.resistance"].value == pytest.approx(6.0, rel=1e-4)
    assert fit["coil.inductance"].value == pytest.approx(12e-3, rel=1e-4)
    assert not fit.rejected
    rows = " ".join(",".join(row.split(",")[::2]) for row in SWITCHED.split())
    with refused("time"):
        ph.fit("coil", case(tmp_path / "bare.csv", "time [ms],current [A]", rows), hammer=hammer, locked=0.0)


TIMES = np.arange(-30, 301) * 1e-5


def probed(path: Path, seed: int, *, offset: float = 0.0, gain: float = 1.0, delay: float = 0.0) -> Path:
    """Write a record of a locked coil by a probe with errors and a noise of 2 mA."""
    hammer = driven()
    assert hammer.waveform is not None
    shown = gain * probe_current(hammer, hammer.waveform, TIMES - delay, locked=0.0) + offset
    shown += 2e-3 * np.random.default_rng(seed).standard_normal(TIMES.size)
    np.savetxt(path, np.column_stack([TIMES, shown]), "%.9g", ",", header="time [s],current [A]", comments="")
    return path


@pytest.mark.parametrize(
    ("errors", "stated"),
    [
        ({"offset": 4e-3}, {"offset": "fit"}),
        ({"delay": 1e-5}, {"delay": "0 us +- 20 us"}),
        ({"gain": 1.01}, {"gain": "1 +- 0.01"}),
    ],
)
def test_errors_of_a_probe_that_are_stated_or_fitted(
    errors: dict[str, float], stated: dict[str, str], tmp_path: Path
) -> None:
    path = probed(tmp_path / "shown.csv", 4, **errors)
    guess = driven(resistance="9 ohm", inductance="9 mH")
    fit = ph.fit("coil", path, hammer=guess, locked=0.0, **stated)
    for name, value in (("coil.resistance", 10.0), ("coil.inductance", 8e-3)):
        assert abs(fit[name].value - value) < 3.0 * fit[name].standard_error
    assert not fit.rejected
    ((name, value),) = errors.items()
    assert abs(fit[f"probe.{name}"].value - value) < 3.0 * fit[f"probe.{name}"].standard_error
    assert "probe" not in fit.fragment().split("[coil]")[1]
    # Left unstated it moves a constant by many standard errors: the law is rejected, or the fit says why not.
    plain = ph.fit("coil", path, hammer=guess, locked=0.0)
    assert abs(plain["coil.resistance"].value - 10.0) > 4.0 * plain["coil.resistance"].standard_error or (
        abs(plain["coil.inductance"].value - 8e-3) > 4.0 * plain["coil.inductance"].standard_error
    )
    if name == "gain":
        assert any("gain" in remark for remark in plain.remarks)
    else:
        assert plain.rejected


@pytest.mark.slow
def test_intervals_contain_the_truth_as_often_as_they_say(tmp_path: Path) -> None:
    """For 100 records by a probe with stated errors, 95 +- 3 intervals hold; each record has its own seed."""
    stated = {"offset": "0 mA +- 5 mA", "delay": "0 us +- 10 us", "gain": "1 +- 0.01"}
    counts, rejected = {"coil.resistance": 0, "coil.inductance": 0}, 0
    for seed in range(100):
        offset, delay, gain = np.random.default_rng(1000 + seed).standard_normal(3) * (5e-3, 1e-5, 0.01)
        path = probed(tmp_path / "shown.csv", seed, offset=offset, delay=delay, gain=1.0 + gain)
        fit = ph.fit("coil", path, hammer=driven(resistance="9 ohm", inductance="9 mH"), locked=0.0, **stated)
        rejected += bool(fit.rejected)
        for name, value in (("coil.resistance", 10.0), ("coil.inductance", 8e-3)):
            low, high = fit[name].interval
            counts[name] += low <= value <= high
    assert all(92 <= count <= 98 for count in counts.values()), counts
    assert rejected <= 4


def smoothed(path: Path, seed: int, bandwidth: float) -> Path:
    """Write the rise of 2.4 A behind a low-pass of first order, in closed form, with a noise of 2 mA."""
    times = TIMES[TIMES < 1.99e-3]
    late, rise, tau = np.maximum(times, 0.0), 8e-4, 0.5 / np.pi / bandwidth
    shown = 2.4 * (1.0 - (rise * np.exp(-late / rise) - tau * np.exp(-late / tau)) / (rise - tau))
    shown += 2e-3 * np.random.default_rng(seed).standard_normal(times.size)
    np.savetxt(path, np.column_stack([times, shown]), "%.9g", ",", header="time [s],current [A]", comments="")
    return path


@pytest.mark.slow
def test_a_bandwidth_is_declared_or_rejects_the_law(tmp_path: Path) -> None:
    """From 10 to 300 kHz; 95 % intervals miss 6 of 30 true values once in 300 repetitions."""
    keys, covered, moved, rejected = ("coil.resistance", "coil.inductance"), 0, 0, 0
    for seed in range(15):
        bandwidth = 1e4 * 30.0 ** np.random.default_rng(seed).uniform()
        path = smoothed(tmp_path / "shown.csv", seed, bandwidth)
        declared = ph.fit("coil", path, hammer=driven(), locked=0.0, bandwidth=bandwidth)
        assert not declared.rejected
        plain = ph.fit("coil", path, hammer=driven(), locked=0.0)
        for key, value in zip(keys, (10.0, 8e-3), strict=True):
            low, high = declared[key].interval
            covered += low <= value <= high
        off = [abs(plain[key].value - declared[key].value) / plain[key].standard_error for key in keys]
        if max(off) > 2.0:
            moved, rejected = moved + 1, rejected + bool(plain.rejected)
    assert covered >= 25
    assert moved >= 8
    assert rejected > 0.9 * moved


@pytest.mark.slow
def test_records_of_eight_bits_are_not_rejected(tmp_path: Path) -> None:
    """Fewer than 20 of 24 intervals of 95 % would contain the true value once in 170 repetitions."""
    coarse = {**RECORD, "noise": {"current": "1 mA"}, "resolution": {"current": "10 mA"}}
    covered = rejected = 0
    for seed in range(12):
        path = record(driven(), tmp_path / "bits.csv", seed=seed, sensor=coarse)
        fit = ph.fit("coil", path, hammer=driven(resistance="9 ohm", inductance="9 mH"))
        rejected += bool(fit.rejected)
        for name, value in (("coil.resistance", 10.0), ("coil.inductance", 8e-3)):
            low, high = fit[name].interval
            covered += low <= value <= high
    assert rejected <= 1
    assert covered >= 20


@pytest.mark.slow
@pytest.mark.parametrize(("name", "size"), [("offset", 2e-3), ("delay", 1e-6)])
def test_undeclared_errors_that_move_a_constant_reject_the_law(
    name: str, size: float, tmp_path: Path
) -> None:
    """More than 90 % of the records that an error shifts by over two standard errors are rejected."""
    guess, keys, moved, rejected = driven(), ("coil.resistance", "coil.inductance"), 0, 0
    for seed in range(40):
        error = size * np.exp(np.random.default_rng(seed).uniform(-1.0, 2.0))
        clean, off = (
            ph.fit("coil", probed(tmp_path / "shown.csv", seed, **errors), hammer=guess, locked=0.0)
            for errors in ({}, {name: error})
        )
        if max(abs(off[key].value - clean[key].value) / off[key].standard_error for key in keys) > 2.0:
            moved, rejected = moved + 1, rejected + bool(off.rejected)
    assert moved >= 10
    assert rejected > 0.9 * moved


def test_readings_in_coarse_steps(tmp_path: Path) -> None:
    """Eight bits: the rounding errors of rows on the same level are equal."""
    coarse = {**RECORD, "noise": {"current": "1 mA"}, "resolution": {"current": "10 mA"}}
    path = record(driven(), tmp_path / "bits.csv", sensor=coarse)
    fit = ph.fit("coil", path, hammer=driven(resistance="9 ohm", inductance="9 mH"))
    for name, value in (("coil.resistance", 10.0), ("coil.inductance", 8e-3)):
        assert abs(fit[name].value - value) < 3.0 * fit[name].standard_error
    assert not fit.rejected
    assert len(fit.data) < 306


def test_no_inductance_is_fitted_beside_a_magnet_that_has_its_own() -> None:
    assert default_constants(ph.load("impact-wire")) == ("coil.resistance",)
    assert default_constants(driven()) == ("coil.resistance", "coil.inductance")


@pytest.mark.parametrize(
    ("table", "options", "key"),
    [
        ("time [us],current [A]\n0,0\n2,1\n1,1\n", {}, "time"),
        ("time [us],current [A]\n-2,0\n-1,1\n", {}, "time"),
        ("time [us],current [A]\n0,0\n1,0\n", {}, "current"),
        ("time [us],current [A]\n0,0\n1,1\n", {"free": ["coil.turns"]}, "constant"),
        ("time [us],current [A]\n0,0\n1,1\n", {"free": ["coil.leakage"]}, "coil.leakage"),
        ("time [us],current [A]\n0,0\n1,1\n", {"free": []}, "free"),
        ("time [us],current [A]\n0,0\n1,1\n", {"delay": "2 V"}, "delay"),
        ("time [us],current [A]\n0,0\n1,1\n", {"bandwidth": "0 Hz"}, "bandwidth"),
        ("time [us],current [A]\n0,0\n1,1\n", {}, "rows"),
        (
            "# locked: here\ntime [us],current [A]\n0,0\n1,1\n",
            {},
            "locked",
        ),
    ],
)
def test_bad_input(table: str, options: dict[str, Any], key: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(table, "utf-8")
    with refused(key):
        ph.fit("coil", path, hammer=driven(), **options)


def test_a_hammer_without_a_driver(tmp_path: Path) -> None:
    path = tmp_path / "current.csv"
    path.write_text("time [us],current [A]\n0,0\n1,1\n", "utf-8")
    paper = ph.load("hendriks-1983")
    with refused("waveform"):
        ph.fit("coil", path, hammer=paper)
    with refused("waveform"):
        ph.measure("current", paper)
    with refused("hammer"):
        ph.fit("coil", path)


@pytest.mark.slow
def test_saturation_and_resistance_from_two_places_of_a_locked_armature(tmp_path: Path) -> None:
    circuit: dict[str, Any] = {
        "law": "reluctance",
        "turns": 900,
        "pole_area": "40 mm^2",
        "residual_gap": "0.2 mm",
        "core_reluctance": 4e5,
        "saturation_flux": 1.2e-4,
        "closed_at": "1 mm",
    }
    hammer = driven(resistance="10 ohm").replace({"magnet": circuit, "waveform.width": "6 ms"})
    paths = [
        record(hammer, tmp_path / f"{k}.csv", seed=k, locked=f"{place} mm", duration="8 ms")
        for k, place in enumerate((0.1, 0.8))
    ]
    free = ["coil.resistance", "magnet.saturation_flux", "magnet.core_reluctance"]
    guess = hammer.replace({"magnet.saturation_flux": 1.5e-4, "coil.resistance": 9.0})
    fit = ph.fit("coil", paths, hammer=guess, free=free)
    for name in free:
        constant, value = fit[name], hammer.constants[name].si
        assert abs(constant.value - value) < 3.0 * constant.standard_error < 0.1 * value


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "ohms", "options"),
    [
        ("impact-wire", 6.0, {"duration": "1 ms"}),
        ("dot-peen", 5.0, {"duration": "12 ms"}),
        ("braille-embosser", 6.0, {"duration": "20 ms"}),
    ],
)
def test_a_shipped_magnet_gives_its_resistance(
    tmp_path: Path, name: str, ohms: float, options: dict[str, str]
) -> None:
    """From an initial guess 10 % off; the magnet has its own inductance, so no other is fitted."""
    hammer = ph.load(name)
    path = record(hammer, tmp_path / "locked.csv", sensor={"sampling_rate": "100 kHz"}, **options)
    fit = ph.fit("coil", path, hammer=hammer.replace("coil.resistance", 1.1 * ohms))
    assert list(fit.constants) == ["coil.resistance"]
    assert (
        abs(fit["coil.resistance"].value - ohms) < 3.0 * fit["coil.resistance"].standard_error < 0.05 * ohms
    )
    assert not fit.rejected


def test_a_record_that_determines_no_constant_is_refused(tmp_path: Path) -> None:
    """Samples one second apart show neither the rise of the current nor the current after the pulse."""
    rows = " ".join(f"{k},{value}" for k, value in enumerate((0, 9.99, 10.02, 9.97, 10.01, 9.98, 10, 10.01)))
    path = case(tmp_path / "slow.csv", "time [s],current [mA]", rows)
    with refused("record"):
        ph.fit("coil", path, hammer=on_a_rail("9 ohm", "5 mH", "9 V"), locked=0.0)
