from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.errors import refused
from tests.hammers import hertz, made_of, power, preload

import printhammer as ph
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.printing.dots.judging import PRESETS
from printhammer.printing.dots.strategy import FIRST_SLOT, open_loop
from printhammer.printing.page import page as page_module
from printhammer.printing.page.page import Page, darkness, head_of, print_page
from printhammer.printing.page.pattern import Pattern

TIGHT = 1e-12
RATE = 1500.0
FIELDS = (
    "line",
    "wire",
    "slot",
    "run",
    "lost",
    "fault",
    "arrival_deviation",
    "flight_time",
    "peak_force",
    "indentation",
    "extra_contacts",
    "extra_of",
    "extra_arrival",
    "extra_force",
    "status",
)


def noise(seed: int = 5, wires: int = 9, slots: int = 14, share: float = 0.6) -> Pattern:
    return Pattern("noise", np.random.default_rng(seed).random((wires, slots)) < share)


@pytest.fixture(scope="module")
def page(hammer: ph.Hammer) -> Page:
    """A page with lost dots and extra contacts, short enough that its runs are not yet chaotic."""
    return print_page(hammer, noise(), RATE, tolerance=TIGHT)


def slots_of(page: Page, line: int, wire: int) -> np.ndarray:
    return page.slot[(page.line == line) & (page.wire == wire)]


def test_every_wire_is_a_run_of_its_own(hammer: ph.Hammer, page: Page) -> None:
    assert page.lost.any()
    assert page.extra_contacts.any()
    for wire in range(9):
        slots = slots_of(page, 0, wire)
        np.testing.assert_array_equal(slots, np.flatnonzero(page.pattern.dots[0, wire]))
        drive = ph.PulseTrain(hammer.waveform, at=FIRST_SLOT + slots / RATE)
        motion = ph.simulate(hammer, drive, tolerance=TIGHT, points=2)
        mine = (page.line == 0) & (page.wire == wire)
        np.testing.assert_array_equal(page.lost[mine], [not dot.struck for dot in motion.dots])
        counts = [dot.extra_contacts for dot in motion.dots]
        np.testing.assert_array_equal(page.extra_contacts[mine], counts)
        for name in ("flight_time", "peak_force"):
            theirs = [getattr(dot, name) if dot.struck else np.nan for dot in motion.dots]
            np.testing.assert_allclose(getattr(page, name)[mine], theirs, rtol=1e-5, atol=1e-9)


def test_a_dot_is_where_the_carriage_is_at_touch(hammer: ph.Hammer, page: Page) -> None:
    # From the contacts of a motion, and not through deviations.
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), tolerance=TIGHT, points=2).dots[0]
    speed = RATE * page.head.pitch
    across, down = page.places
    for wire in (0, 4):
        drive = ph.PulseTrain(hammer.waveform, at=FIRST_SLOT + slots_of(page, 0, wire) / RATE)
        motion = ph.simulate(hammer, drive, tolerance=TIGHT, points=2)
        mine = page.wire == wire
        touches = [np.nan if d.flight_time is None else d.fired_at + d.flight_time for d in motion.dots]
        places = (np.array(touches) - single.flight_time - FIRST_SLOT) * speed
        np.testing.assert_allclose(across[mine], places, atol=1e-9)
        assert (down[mine] == wire * page.head.wire_pitch).all()


def test_extra_contacts_are_those_of_the_motion(hammer: ph.Hammer, page: Page) -> None:
    assert page.extra_of.size == page.extra_contacts.sum()
    for wire in np.unique(page.wire[page.extra_of]).tolist():
        _check_extra_contacts(hammer, page, wire)


@pytest.mark.slow
def test_several_extra_contacts_of_one_firing() -> None:
    # A force that lasts holds the armature near a hard pack, where it bounces.
    push = Rectangle(amplitude=5.0, width=5e-3, rise=0.0, decay=0.0, quantity="force")
    pushed = made_of(
        spring=preload(-4.0), pack=power(stiffness=5e4), backstop=hertz(damping=4.175e8), waveform=push
    )
    found = print_page(pushed, Pattern("few", np.array([[1, 0, 1, 1]])), 150.0, tolerance=TIGHT)
    assert found.extra_contacts.tolist() == [2, 2, 2]
    assert found.extra_of.size == found.extra_contacts.sum()
    _check_extra_contacts(pushed, found, 0)


def _check_extra_contacts(hammer: ph.Hammer, page: Page, wire: int) -> None:
    slots = slots_of(page, 0, wire)
    drive = ph.PulseTrain(hammer.waveform, at=FIRST_SLOT + slots / page.rate)
    motion = ph.simulate(hammer, drive, tolerance=TIGHT, points=2)
    pack = [contact for contact in motion.contacts if contact.surface == "pack"]
    latest = np.searchsorted(drive.times, [contact.t_in for contact in pack], side="right") - 1
    # The first contact after a firing is its dot.
    extra = [number for number in range(1, len(pack)) if latest[number] == latest[number - 1]]
    assert extra
    expected = [
        (pack[number].t_in - drive.times[latest[number]] - page.nominal.flight_time, pack[number].peak_force)
        for number in extra
    ]
    mine = page.wire[page.extra_of] == wire
    np.testing.assert_allclose(page.extra_arrival[mine], [late for late, _force in expected], atol=1e-9)
    np.testing.assert_allclose(page.extra_force[mine], [force for _late, force in expected], rtol=1e-4)
    across, _down = page.extra_places
    places = page.slot[page.extra_of][mine] * page.head.pitch + page.extra_arrival[mine] * page.speed
    np.testing.assert_allclose(across[mine], places)


def test_a_dot_by_itself_is_that_of_the_single_pulse(hammer: ph.Hammer) -> None:
    found = print_page(hammer, Pattern("dot", np.array([[False], [True], [False]])), 1200.0, tolerance=TIGHT)
    assert found.status.tolist() == ["ok"]
    assert (found.run_line.tolist(), found.run_wire.tolist()) == ([0], [1])
    assert found.placement_error[0] == pytest.approx(0.0, abs=1e-12)
    assert found.force_ratio[0] == pytest.approx(1.0, rel=1e-9)
    assert found.darkness[0] == pytest.approx(0.9, rel=1e-9)
    assert found.good.all()


@pytest.mark.slow
def test_a_slow_device_prints_the_last_dot_of_every_wire() -> None:
    """HAMMER has 107 dots in the font of nine wires; the window of a fast device omitted seven of them."""
    embosser = ph.load("braille-embosser")
    pattern = Pattern.from_text("HAMMER")
    assert pattern.wanted == int(pattern.dots.sum()) == 107
    found = print_page(embosser, pattern, 20.0)
    assert found.printed.all()
    assert not found.lost.any()
    # Each dot by itself is that of a single run: the device is at rest long before the next slot.
    (dot,) = ph.simulate(embosser, ph.PulseTrain(embosser.waveform)).dots
    assert dot.flight_time is not None
    np.testing.assert_allclose(found.flight_time, dot.flight_time, rtol=1e-3)


def test_darkness_follows_the_force() -> None:
    np.testing.assert_allclose(darkness([0.0, 1.0, 2.0]), [0.0, 0.9, 0.99])


def test_a_wire_without_a_dot_has_no_run_and_every_line_starts_from_rest(hammer: ph.Hammer) -> None:
    line = noise(5, 4, 30)
    dots = np.zeros((3, 5, 30), bool)
    dots[0, 1:] = dots[2, 1:] = line.dots[0]
    found = print_page(hammer, Pattern("lines", dots), RATE)
    assert set(zip(found.run_line.tolist(), found.run_wire.tolist(), strict=True)) == {
        (line, wire) for line in (0, 2) for wire in range(1, 5)
    }
    first, last = (found.line == line for line in (0, 2))
    for name in FIELDS[2:11]:
        values = getattr(found, name)
        np.testing.assert_array_equal(values[first], values[last])
    _across, down = found.intended
    np.testing.assert_allclose(down[last] - down[first], 2 * found.head.line_pitch)


def test_the_page_does_not_depend_on_threads_nor_on_pieces(
    hammer: ph.Hammer, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = print_page(hammer, noise(), RATE)
    one = print_page(hammer, noise(), RATE, threads=1)
    told: list[tuple[int, int]] = []
    monkeypatch.setattr(page_module, "_PIECE", 4)
    pieces = print_page(hammer, noise(), RATE, progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (9, 9)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(whole, name), err_msg=name)
        np.testing.assert_array_equal(getattr(pieces, name), getattr(whole, name), err_msg=name)


def test_a_strategy_that_fires_early_moves_the_dots(hammer: ph.Hammer) -> None:
    early = 80e-6

    def ahead(driven: ph.Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> list[Drive]:
        return [drive.with_times(drive.times - early) for drive in open_loop(driven, patterns, rate)]

    pattern = noise(1)
    plain = print_page(hammer, pattern, 700.0, tolerance=TIGHT)
    found = print_page(hammer, pattern, 700.0, strategy=ahead, tolerance=TIGHT)
    assert (plain.strategy, found.strategy) == ("open loop", "ahead")
    both = plain.printed & found.printed
    assert both.any()
    np.testing.assert_allclose(found.flight_time[both], plain.flight_time[both], rtol=1e-6)
    moved = found.placement_error[both] - plain.placement_error[both]
    np.testing.assert_allclose(moved, -early * plain.speed, rtol=1e-4)
    # Ahead by more than the limit, no dot is good.
    assert not found.good.any()


def test_a_strategy_that_gives_too_few_drives_is_refused(hammer: ph.Hammer) -> None:
    with refused("strategy"):
        print_page(hammer, noise(), RATE, strategy=lambda *_given: [])


def test_a_run_that_stops_has_dots_that_were_not_run(hammer: ph.Hammer) -> None:
    # Dots in a row climb higher than one by itself.
    top = print_page(hammer, noise(), RATE)
    bound = hammer.front + 1.02 * top.nominal.indentation
    short = hammer.replace("magnet.range_max", bound)
    found = print_page(short, noise(), RATE)
    stopped = found.status != "ok"
    assert stopped.any()
    assert (~found.run).any()
    assert not found.printed[~found.run].any()
    assert found.fault_counts["not run"] == (~found.run).sum()
    with_stop = set(zip(found.run_line[stopped].tolist(), found.run_wire[stopped].tolist(), strict=True))
    assert {*zip(found.line[~found.run].tolist(), found.wire[~found.run].tolist(), strict=True)} <= with_stop


def test_the_worst_place_is_where_most_is_off(page: Page) -> None:
    for slots in (3, 10, 100):
        line, first = page.worst_place(slots)
        many = min(slots, page.pattern.slots)
        sums = []
        for begin in range(page.pattern.slots - many + 1):
            total = 0.0
            for dot in range(page.slot.size):
                if begin <= page.slot[dot] < begin + many:
                    if page.lost[dot]:
                        total += 1.0
                    else:
                        total += abs(page.placement_error[dot]) / page.head.pitch
                        total += abs(page.force_ratio[dot] - 1.0)
                    total += (page.extra_force[page.extra_of == dot] / page.nominal.force).sum()
            sums.append(total)
        assert (line, first) == (0, int(np.argmax(np.round(sums, 9))))


def test_limits_and_heads_are_those_asked_for(hammer: ph.Hammer) -> None:
    thick = head_of(9, pitch=0.5e-3, wire_diameter=0.3e-3, density=2.0)
    found = print_page(hammer, "Hi", "1 kHz", head=thick, limits=PRESETS["engraved"])
    assert found.limits.arrival == 15e-6
    assert found.speed == pytest.approx(0.5)
    np.testing.assert_allclose(found.density, 2.0 * found.force_ratio)
    assert head_of(24).line_pitch == pytest.approx(head_of(9).line_pitch)
    assert head_of(7).wire_pitch == pytest.approx(head_of(9).wire_pitch * 9 / 7)
    # A Braille cell: rows 2.5 mm apart, lines 10 mm.
    braille = head_of(3, wire_pitch=2.5e-3, pitch=0.5e-3, wire_diameter=1.5e-3)
    assert braille.line_pitch == pytest.approx(10e-3)
    assert (braille.wire_pitch, braille.pitch, braille.wire_diameter) == (2.5e-3, 0.5e-3, 1.5e-3)
    assert head_of(24, wire_pitch=1e-3).pitch == 1e-3


@pytest.mark.parametrize(
    ("arguments", "options", "key"),
    [
        (("Hi", 0.0), {}, "rate"),
        (("Hi", "-1 kHz"), {}, "rate"),
        (("Hi", "1 kg"), {}, "rate"),
        (("Hi", "nan"), {}, "rate"),
        (("", 1000.0), {}, "text"),
        (("é", 1000.0), {}, "text"),
        ((5, 1000.0), {}, "pattern"),
        (("Hi", 1000.0), {"head": head_of(24)}, "head"),
        (("Hi", 1000.0), {"tolerance": 1.0}, "tolerance"),
    ],
)
def test_what_makes_no_page_is_refused(
    hammer: ph.Hammer, arguments: tuple[object, object], options: dict[str, object], key: str
) -> None:
    with refused(key):
        ph.print_page(hammer, *arguments, **options)


def test_a_hammer_that_prints_nothing_is_refused(hammer: ph.Hammer) -> None:
    for part in ("waveform", "pack"):
        with refused(part):
            print_page(hammer.replace(part, None), "Hi", RATE)
    with refused("pulse"):
        print_page(hammer.replace("waveform.amplitude", "10 mA"), "Hi", RATE)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf"), True])
def test_a_head_of_impossible_size_is_refused(value: float) -> None:
    for name in ("pitch", "wire_diameter", "density"):
        with refused(name, value):
            head_of(9, **{name: value})


def test_a_dataset_and_files_hold_every_dot(page: Page, tmp_path: Path) -> None:
    chart = page.to_dataset()
    assert chart["x"].dims == ("dot",)
    assert chart["x"].attrs["units"] == "m"
    assert chart.attrs["hammer_fingerprint"] == page.hammer.fingerprint
    assert (chart["fault"].values == "lost").sum() == page.lost.sum()
    assert (chart["fault"].values == "none").sum() == page.good.sum()
    page.save(tmp_path / "page.nc")
    with xr.open_dataset(tmp_path / "page.nc", engine="scipy") as kept:
        np.testing.assert_array_equal(kept["placement_error"], page.placement_error)
        np.testing.assert_array_equal(kept["extra_force"], page.extra_force)
        assert kept.attrs["rate"] == RATE
    page.save(tmp_path / "page.csv")
    rows = pd.read_csv(tmp_path / "page.csv", comment="#")
    assert len(rows) == page.line.size
    np.testing.assert_allclose(rows["flight_time [s]"], page.flight_time, rtol=1e-15)
    assert "placement_error [m]" in page.to_dataframe()
    with refused(None, file="page.txt"):
        page.save(tmp_path / "page.txt")


def test_a_page_without_extra_contacts_is_kept_as_well(hammer: ph.Hammer, tmp_path: Path) -> None:
    found = print_page(hammer, Pattern.from_text("é", 24), 500.0)
    assert found.extra_of.size == 0
    found.save(tmp_path / "page.nc")
    with xr.open_dataset(tmp_path / "page.nc", engine="scipy") as kept:
        assert kept.sizes["extra"] == 0
        assert kept.attrs["pattern"] == "é"


def test_another_waveform_prints_as_a_hammer_that_has_it(hammer: ph.Hammer) -> None:
    assert hammer.waveform is not None
    other = hammer.waveform.scaled(0.97)
    found = print_page(hammer, noise(slots=6), RATE, waveform=other)
    expected = print_page(hammer.replace("waveform", other), noise(slots=6), RATE)
    assert found.strategy == expected.strategy
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
