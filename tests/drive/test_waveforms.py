import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.drive import tables
from printhammer.drive.segments import table
from printhammer.drive.waveforms.shapes import (
    DECAY_TIMES,
    SHAPES,
    HalfSine,
    Rectangle,
    Sampled,
    Sine,
    Trapezoid,
    Waveform,
)
from printhammer.errors import InputError

durations = st.floats(1e-7, 1e-2)
spans = st.one_of(st.just(0.0), durations)
amplitudes = st.floats(-10.0, 10.0)
waveforms = st.one_of(
    st.builds(HalfSine, amplitude=amplitudes, width=durations),
    st.builds(Rectangle, amplitude=amplitudes, width=durations, rise=spans, decay=spans),
    st.builds(Trapezoid, amplitude=amplitudes, rise=spans, width=durations, fall=spans),
)


@given(waveforms)
def test_table_starts_at_zero_ascends_and_ends_with_the_support(waveform: Waveform) -> None:
    segments = waveform.segments()
    assert segments.shape[1] == 6
    assert segments[0, 0] == 0.0
    assert np.all(np.diff(segments[:, 0]) > 0.0)
    assert not segments[-1, 1:].any()
    assert segments[-1, 0] == waveform.support
    assert not segments.flags.writeable


@given(waveforms)
def test_value_is_zero_outside_the_support_and_bounded_by_the_peak(waveform: Waveform) -> None:
    end = waveform.support
    inside = waveform.value(np.linspace(0.0, end, 500))
    assert np.abs(inside).max() <= waveform.peak * (1.0 + 1e-12)
    assert not waveform.value([-1.0, -1e-12, end, 2.0 * end, np.inf, -np.inf]).any()
    assert np.isnan(waveform.value(math.nan))
    amplitude = abs(waveform.amplitude)  # type: ignore[attr-defined]
    assert waveform.peak <= amplitude * (1.0 + 1e-12)


@given(waveforms, st.floats(-3.0, 3.0))
def test_scaling_scales_every_value(waveform: Waveform, factor: float) -> None:
    tau = np.linspace(0.0, waveform.support, 50)
    np.testing.assert_allclose(
        waveform.scaled(factor).value(tau), factor * waveform.value(tau), rtol=1e-12, atol=1e-12
    )


def test_value_is_right_continuous_at_every_edge() -> None:
    sharp = Rectangle(amplitude=2.0, width=1e-3, rise=0.0, decay=0.0)
    assert sharp.value([0.0, np.nextafter(1e-3, 0.0), 1e-3]).tolist() == [2.0, 2.0, 0.0]
    assert len(sharp.segments()) == 2


def test_rectangle_is_zero_by_definition_once_a_millionth_of_a_millionth_is_left() -> None:
    rectangle = Rectangle(amplitude=1.0, width=1e-3, rise=1e-5, decay=2e-5)
    end = 1e-3 + DECAY_TIMES * 2e-5
    assert rectangle.support == end
    assert rectangle.value(np.nextafter(end, 0.0)) == pytest.approx(1e-12, rel=1e-9)
    assert rectangle.value(end) == 0.0


def test_a_rise_of_a_subnormal_number_is_a_sharp_edge() -> None:
    assert Rectangle(amplitude=1.0, width=1.0, rise=5e-324, decay=5e-324).value(0.5) == 1.0
    assert Trapezoid(amplitude=1.0, rise=5e-324, width=1.0, fall=5e-324).value(0.5) == 1.0


def test_an_edge_that_rounding_swallows_leaves_no_empty_segment() -> None:
    rows = [(0.0, 0, 1.0, 0, 0, 0), (1.0, 0, 2.0, 0, 0, 0), (1.0, 0, 3.0, 0, 0, 0)]
    assert table(rows, 2.0)[:, :3].tolist() == [[0.0, 0.0, 1.0], [1.0, 0.0, 3.0], [2.0, 0.0, 0.0]]


def test_sine_never_ends() -> None:
    sine = Sine(amplitude=2.0, frequency=100.0, phase=0.25, quantity="force")
    assert sine.support == math.inf
    assert sine.peak == pytest.approx(2.0)
    tau = np.array([0.0, 1e-3, 12.345])
    np.testing.assert_allclose(sine.value(tau), 2.0 * np.sin(200.0 * math.pi * tau + 0.25), rtol=1e-12)


def test_shapes_are_the_words_of_a_file() -> None:
    pulses = {"half-sine", "rectangle", "trapezoid", "sampled"}
    drivers = {"rail", "chopper", "peak-and-hold", "capacitor", "bridge"}
    assert set(SHAPES) == pulses | drivers
    assert all(shape.shape == word for word, shape in SHAPES.items())


def test_waveforms_are_values() -> None:
    one = HalfSine(amplitude=1.0, width=1e-3)
    assert one == HalfSine(amplitude=1.0, width=1e-3)
    assert one != HalfSine(amplitude=1.0, width=1e-3, quantity="force")
    record = Sampled.from_samples([0.0, 1.0], [0.0, 1.0])
    assert record == Sampled.from_samples([0.0, 1.0], [0.0, 1.0])
    assert record != Sampled.from_samples([0.0, 1.0], [0.0, 2.0])
    with pytest.raises(ValueError, match="frozen"):
        one.amplitude = 2.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("shape", "constants", "key"),
    [
        (HalfSine, {"amplitude": 1.0}, "width"),
        (HalfSine, {"amplitude": 1.0, "width": 0.0}, "width"),
        (HalfSine, {"amplitude": 1.0, "width": -1.0}, "width"),
        (HalfSine, {"amplitude": math.nan, "width": 1.0}, "amplitude"),
        (HalfSine, {"amplitude": 1.0, "width": math.inf}, "width"),
        (HalfSine, {"amplitude": 1.0, "width": 1.0, "widht": 1.0}, "widht"),
        (Rectangle, {"amplitude": 1.0, "width": 1.0, "rise": -1.0, "decay": 0.0}, "rise"),
        (Trapezoid, {"amplitude": 1.0, "width": 1.0, "rise": 0.0, "fall": "x"}, "fall"),
        (Sine, {"amplitude": 1.0, "frequency": 0.0}, "frequency"),
    ],
)
def test_a_bad_constant_is_one_sentence(
    shape: type[Waveform], constants: dict[str, object], key: str | None
) -> None:
    with refused(key):
        shape(**constants)


@pytest.mark.parametrize("interpolation", ["pchip", "linear"])
def test_a_record_passes_through_its_samples_and_never_beyond_its_neighbours(interpolation: str) -> None:
    t = np.array([1.0, 2.0, 3.5, 4.0, 7.0]) * 1e-4
    y = np.array([0.0, 1.0, 0.8, 0.9, 0.0])
    record = Sampled.from_samples(t, y, interpolation=interpolation)  # type: ignore[arg-type]
    np.testing.assert_allclose(record.value(t[:-1]), y[:-1], atol=1e-15)
    assert record.value([0.0, 0.99e-4, 7e-4, 8e-4]).tolist() == [0.0] * 4
    for k in range(4):
        between = record.value(np.linspace(t[k], t[k + 1], 50, endpoint=False))
        assert between.min() >= min(y[k], y[k + 1]) - 1e-15
        assert between.max() <= max(y[k], y[k + 1]) + 1e-15
    assert record.peak == pytest.approx(1.0, rel=1e-14)


def test_a_cubic_record_is_smooth_and_a_linear_one_straight() -> None:
    t, y = np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 1.0, 2.0, 0.5])
    smooth = Sampled.from_samples(t, y)
    h = 1e-7
    for knot in (1.0, 3.0):
        left = (smooth.value(knot) - smooth.value(knot - h)) / h
        right = (smooth.value(knot + h) - smooth.value(knot)) / h
        assert left == pytest.approx(right, abs=1e-5)
    straight = Sampled.from_samples(t, y, interpolation="linear")
    assert straight.value(2.0) == pytest.approx(1.5, rel=1e-15)


def test_the_content_of_a_record_is_its_samples() -> None:
    record = Sampled.from_samples([0.0, 1.0], [0.5, 0.25], quantity="force")
    assert {name: array.tolist() for name, array in record.content().items()} == {
        "times": [0.0, 1.0],
        "values": [0.5, 0.25],
    }
    assert record.quantity == "force"
    assert record.unit == "N"
    assert HalfSine(amplitude=1.0, width=1.0).content() == {}


@pytest.mark.parametrize(
    ("times", "values", "key"),
    [
        ([], [], "time"),
        ([0.0], [1.0], "time"),
        ([0.0, 1.0], [1.0], "time"),
        ([0.0, 1.0, 1.0], [1.0, 2.0, 3.0], "times"),
        ([0.0, 2.0, 1.0], [1.0, 2.0, 3.0], "times"),
        ([-1.0, 2.0], [1.0, 2.0], "time"),
        ([0.0, math.nan], [1.0, 2.0], "time"),
        ([0.0, 1.0], [1.0, math.inf], "value"),
        (["a", "b"], [1.0, 2.0], "samples"),
    ],
)
def test_bad_samples_are_one_sentence(times: list[float], values: list[float], key: str) -> None:
    with refused(key):
        Sampled.from_samples(times, values)


def test_a_csv_file_is_read_with_its_units_relative_to_the_folder(tmp_path: Path) -> None:
    (tmp_path / "pulse.csv").write_text("# probe 3\ntime [us], current [mA]\n0,0\n\n100,500\n200,0\n")
    record = Sampled.model_validate({"file": "pulse.csv"}, context={"folder": tmp_path})
    np.testing.assert_allclose(record.times, [0.0, 1e-4, 2e-4], rtol=1e-15)
    np.testing.assert_allclose(record.values, [0.0, 0.5, 0.0], rtol=1e-15)
    assert record.quantity == "current"
    assert Sampled(file=str(tmp_path / "pulse.csv")) == Sampled.model_validate(
        {"file": str(tmp_path / "pulse.csv")}
    )


def test_a_csv_file_of_a_force_makes_a_force_waveform(tmp_path: Path) -> None:
    path = tmp_path / "force.csv"
    path.write_text("time [ms],force [lbf]\n0,0\n1,1\n")
    record = Sampled(file=str(path))
    assert record.quantity == "force"
    assert record.values[1] == pytest.approx(4.4482216152605, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("", "heading"),
        ("\n\n", "heading"),
        ("time [us],current [A]\n", "rows"),
        ("time [us],current [A]\n0,1\n", "time"),
        ("time,current\n0,1\n1,2\n", "time"),
        ("time [us],current []\n0,1\n1,2\n", "current"),
        ("time [us],current [lbf]\n0,1\n1,2\n", "current [lbf]"),
        ("time [mm],current [A]\n0,1\n1,2\n", "time [mm]"),
        ("time [us],power [W]\n0,1\n1,2\n", "power [W]"),
        ("time [us],current [A],force [N]\n0,1,1\n1,2,2\n", "columns"),
        ("time [us]\n0\n1\n", "columns"),
        ("time [us],current [A]\n0,1\n1\n", "line 3"),
        ("time [us],current [A]\n0,1\n1,two\n", "current"),
        ("time [us],current [A]\n0,1\n1,nan\n", "current"),
        ("time [us],current [A]\n0,1\n2,2\n1,3\n", "time"),
        ('time [us],current [A]\n0,"1\n', "line 2"),
    ],
)
def test_a_bad_csv_file_is_one_sentence_that_names_it(tmp_path: Path, text: str, key: str | None) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with refused(key) as caught:
        Sampled(file=str(path))
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_missing_or_not_text_is_one_sentence(tmp_path: Path) -> None:
    with refused(None, file="none.csv"):
        Sampled(file=str(tmp_path / "none.csv"))
    (tmp_path / "noise.csv").write_bytes(bytes(range(128, 256)))
    with refused(None, file="noise.csv"):
        Sampled(file=str(tmp_path / "noise.csv"))
    with refused("file"):
        SHAPES["sampled"]()


@given(st.text(max_size=200))
def test_any_text_is_a_record_or_an_input_error(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("csv") / "any.csv"
    path.write_text("time [us],current [A]\n" + text, encoding="utf-8", errors="surrogatepass", newline="")
    try:
        record = Sampled(file=str(path))
    except InputError as error:
        assert "any.csv" in str(error)  # noqa: PT017
    else:
        assert len(record.times) >= 2


@pytest.mark.parametrize(
    ("amplitude", "quantity", "value"), [("1.5 A", "current", 1.5), ("2 lbf", "force", 2.0 * 4.4482216152605)]
)
def test_the_unit_of_the_amplitude_tells_what_is_driven(amplitude: str, quantity: str, value: float) -> None:
    waveform = HalfSine(amplitude=amplitude, width="350 us")
    assert waveform.quantity == quantity
    assert waveform.amplitude == pytest.approx(value, rel=1e-14)
    assert waveform.width == pytest.approx(350e-6, rel=1e-14)


def test_a_wrong_dimension_is_an_input_error() -> None:
    with refused("width"):
        HalfSine(amplitude=1.0, width="3 lbf")


@given(st.lists(st.tuples(st.floats(1e-9, 1e-2), st.integers(-3, 3)), min_size=2, max_size=30), st.booleans())
def test_the_plain_table_of_a_record_is_that_of_scipy(steps: list[tuple[float, int]], later: bool) -> None:
    times = np.cumsum([step for step, _ in steps])
    times -= 0.0 if later else times[0]
    values = [0.7 * value for _, value in steps]
    expected = Sampled.from_samples(times, values).segments()
    rows = np.empty((len(steps) + 1, 6))
    count = tables.fill_table(tables.SAMPLED, [*times.tolist(), *values], rows)
    np.testing.assert_array_equal(rows[:count], expected)
