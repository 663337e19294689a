"""Lanes against one member at a time: different machine code and steps, the same motion."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from tests import hammers
from tests.errors import refused
from tests.hammers import STOP, STROKE, made_of

import printhammer as ph
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.kernel.lanes.layout import LANES
from printhammer.run.ensemble import Ensemble, EnsembleResult

APART = 2e-8
"""Of the stroke: what two runs may differ by of which each may be off by 1e-8."""
SINGLE = np.finfo(np.float32).eps


def moments_of(ensemble: Ensemble, count: int = 150) -> list[npt.NDArray[np.float64]]:
    """Irregular times, the firings, the end and later times, for every member."""
    return [
        np.unique([*np.linspace(0.0, end, count), *drive.times, end * 1.2])
        for end, drive in zip(ensemble.ends, ensemble.drives, strict=True)
    ]


def both(ensemble: Ensemble, **options: Any) -> tuple[EnsembleResult, EnsembleResult]:
    """The ensemble in lanes, and one member at a time."""
    given: Any = {"dots": True, "strobes": moments_of(ensemble), **options}
    return ensemble.run(engine="lanes", **given), ensemble.run(engine="plain", **given)


def agree(mine: EnsembleResult, plain: EnsembleResult, apart: float = APART) -> None:
    """All results of both, for members without a horizon."""
    np.testing.assert_array_equal(mine.status, plain.status)
    np.testing.assert_allclose(mine.reached, plain.reached, rtol=0.0, atol=1e-10)
    assert mine.strobes is not None
    assert plain.strobes is not None
    assert mine.dots is not None
    assert plain.dots is not None
    np.testing.assert_allclose(mine.strobes.x, plain.strobes.x, rtol=0.0, atol=apart * STROKE)
    for name in ("fired", "struck", "extra_contacts"):
        np.testing.assert_array_equal(getattr(mine.dots, name), getattr(plain.dots, name), err_msg=name)
    for name in ("flight_time", "contact_time"):
        np.testing.assert_allclose(
            getattr(mine.dots, name), getattr(plain.dots, name), rtol=0.0, atol=1e-10, err_msg=name
        )
    for name in ("impact_speed", "peak_force", "indentation"):
        np.testing.assert_allclose(
            getattr(mine.dots, name), getattr(plain.dots, name), rtol=1e-6, atol=1e-9, err_msg=name
        )


def single(count: int, seed: int) -> Ensemble:
    """Many hammers under one pulse, with very different run lengths."""
    draw = hammers.Draw(np.random.default_rng([1986, seed]))
    every = [draw() for _ in range(count)]
    drives = [ph.PulseTrain(hammer.waveform) for hammer in every]
    return Ensemble(every, drives, np.geomspace(2e-5, 4e-3, count))


def test_many_hammers_and_lengths() -> None:
    ensemble = single(LANES + 44, 0)
    assert not ensemble.groups[0].uniform
    agree(*both(ensemble))


def test_branch_and_memory_at_strobes() -> None:
    mine, plain = both(single(60, 1))
    assert mine.strobes is not None
    assert plain.strobes is not None
    same = mine.strobes.branch == plain.strobes.branch
    # At a switch, the last bits of its time decide.
    assert same.mean() > 0.999
    np.testing.assert_allclose(
        mine.strobes.memory[same], plain.strobes.memory[same], rtol=0.0, atol=APART * STROKE
    )


@pytest.mark.parametrize("engine", ["plain", "lanes"])
def test_a_grid_denser_than_the_steps(hammer: ph.Hammer, engine: Any) -> None:
    """Pictures equal strobes at the same times, up to the precision of their numbers."""
    times = np.linspace(0.0, 3e-3, 20_001)
    drives = [ph.PulseTrain(hammer.waveform, at=[0.0, second]) for second in (0.6e-3, 0.66e-3, 0.7e-3)]
    found = Ensemble(hammer, drives, [3e-3, 2.5e-3, 1e-4]).run(
        strobes=[times] * 3, times=times, engine=engine
    )
    assert found.x is not None
    assert found.strobes is not None
    assert (found.steps < len(times) / 10).all()
    np.testing.assert_array_equal(np.isnan(found.x), np.isnan(found.strobes.x))
    allowed = 1e-8 * STROKE + 0.5 * SINGLE * np.abs(found.strobes.x)
    assert np.nanmax(np.abs(found.x - found.strobes.x) / allowed) < 1.0


@pytest.mark.parametrize("size", [1, 2, 15, 16, 17, LANES - 1, LANES, LANES + 1, 4 * LANES + 5])
def test_any_number_of_members(hammer: ph.Hammer, size: int) -> None:
    mine, plain = both(Ensemble(hammer, ph.PulseTrain(hammer.waveform), np.linspace(1e-4, 2e-3, size)))
    agree(mine, plain)


def test_ends_inside_contacts_and_at_firings(hammer: ph.Hammer) -> None:
    second = 0.9e-3
    drive = ph.PulseTrain(hammer.waveform, at=[0.0, second])
    contacts = ph.simulate(hammer, drive, duration=2e-3).contacts
    inside = [t for c in contacts if c.t_out for t in (c.t_in + 1e-6, c.t_peak, c.t_out - 1e-6)]
    edges = [fired + start for fired in (0.0, second) for start in hammer.waveform.segments()[:, 0]]
    ends = np.array([end for end in (*inside, *edges) if 0.0 < end < 1.9e-3])
    assert len(ends) > 10
    mine, plain = both(Ensemble(hammer, drive, ends), times=np.unique([*ends, *np.linspace(0.0, 2e-3, 99)]))
    agree(mine, plain)
    np.testing.assert_array_equal(mine.reached, ends)
    assert mine.x is not None
    np.testing.assert_array_equal(np.isnan(mine.x), np.isnan(plain.x))
    assert mine.dots is not None
    fired = np.searchsorted([0.0, second], ends, side="right")
    np.testing.assert_array_equal(mine.dots.fired.sum(axis=1), fired)


def test_an_end_exactly_at_a_switch_leaves_no_gap(hammer: ph.Hammer) -> None:
    """Runs that end at the instant at which the lanes find a switch, and just before and after it."""
    drive = ph.PulseTrain(hammer.waveform, period=1.05e-3, pulses=3)
    dots = Ensemble(hammer, drive, 6e-3).run(dots=True, engine="lanes").dots
    assert dots is not None
    touches = (dots.fired_at + dots.flight_time)[dots.struck]
    leaves = touches + dots.contact_time[dots.struck]
    ends = np.concatenate([touches, leaves, np.linspace(1e-4, 3e-3, 10)])
    for _ in range(4):
        ends = np.unique([ends, np.nextafter(ends, 0.0)])
    times = ends.copy()
    found = Ensemble(hammer, drive, ends).run(times=times, strobes=[[end] for end in ends], engine="lanes")
    assert found.ok.all()
    assert found.x is not None
    assert found.strobes is not None
    np.testing.assert_array_equal(np.isnan(found.x), times[np.newaxis, :] > ends[:, np.newaxis])
    np.testing.assert_allclose(np.diag(found.x), found.strobes.x[:, 0], rtol=SINGLE)


def test_a_range_left(hammer: ph.Hammer) -> None:
    """Ends just before the highest point, at the highest point, and beyond."""
    drive = ph.PulseTrain(hammer.waveform)
    highest = float(ph.simulate(hammer, drive).maxima[1].max())
    parts = np.array([0.75, 0.9, 1.0 - 1e-3, 1.0 - 1e-6, 1.0 - 1e-9, 1.0 + 1e-9, 1.0 + 1e-6, 1.1])
    several = [hammer.replace({"magnet.range_max": highest * part}) for part in parts]
    mine, plain = both(Ensemble(several, drive, 3e-3))
    agree(mine, plain)
    assert mine.status_names == ["range left"] * 5 + ["ok"] * 3
    # The lower end, where the armature rests on the backstop, or would have to go through it.
    several = [hammer.replace({"magnet.range_min": low}) for low in (20e-6, 35e-6, 40e-6, 45e-6)]
    mine, plain = both(Ensemble(several, drive, 3e-3))
    agree(mine, plain)
    assert mine.status_names[0] == "ok"
    assert "range left" in mine.status_names


def test_a_member_that_settles_in_the_pack_leaves_the_lanes(hammer: ph.Hammer) -> None:
    """A spring strong enough to hold the armature in the pack: its last oscillations never end in lanes."""
    strong = hammer.replace(
        {
            "mass": 4e-4,
            "magnet.F0": 4.8783,
            "magnet.Am": 0.802136,
            "magnet.Bm": 0.0774851,
            "spring.Bs": 75.1243,
            "spring.As": 953.918e-6,
            "pack.stiffness": 222.0,
            "backstop.stiffness": 1.16477e10,
            "backstop.damping": 1.83346e9,
        }
    )
    pulse = Rectangle(amplitude=1.0, width=125.055e-6, rise=40.2539e-6, decay=7.87302e-6)
    ensemble = Ensemble(strong, ph.PulseTrain(pulse), 1.2e-3, tolerance=2e-10)
    mine, plain = both(ensemble, strobes=[[1.2e-3]])
    agree(mine, plain)
    assert mine.strobes is not None
    assert mine.strobes.x[0, 0] > strong.constants["pack.front"].si
    assert abs(mine.strobes.v[0, 0]) < 1e-6
    np.testing.assert_array_equal(mine.steps, plain.steps)


def test_auto_takes_lanes_where_they_are_allowed(hammer: ph.Hammer) -> None:
    rigid = made_of(spring=hammers.preload(-4.0), pack=hammers.power(), backstop=hammers.rigid(0.5))
    drive = ph.PulseTrain(hammer.waveform)
    with hammers.interpreted():
        mixed = Ensemble([hammer, rigid, hammer], drive, 1e-3, states=(STOP + 1e-6, 0.0))
        found = mixed.run(dots=True)
    alone = Ensemble(hammer, drive, 1e-3, states=(STOP + 1e-6, 0.0)).run(dots=True, engine="lanes")
    assert found.ok.all()
    assert found.steps[0] == found.steps[2] == alone.steps[0]


@pytest.mark.slow
@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_every_waveform_in_one_ensemble(overlap: Any) -> None:
    draw = hammers.Draw(np.random.default_rng(12))
    shapes = list(hammers.waveforms(1.2, "current").values())
    drives = [ph.PulseTrain(s, at=[1e-5 * i, 4e-4], overlap=overlap) for i in range(6) for s in shapes]
    ensemble = Ensemble([draw() for _ in drives], drives, 1.6e-3)
    assert len({kinds.shape for kinds in (drive.segments() for drive in drives)}) > 3
    mine, plain = both(ensemble, times=np.linspace(0.0, 1.6e-3, 3000))
    agree(mine, plain)
    assert mine.x is not None
    assert plain.x is not None
    np.testing.assert_allclose(mine.x, plain.x, rtol=SINGLE, atol=3e-8 * STROKE)


@pytest.mark.slow
@pytest.mark.parametrize(
    "parts",
    [
        {"pack": hammers.PACKS["curve"], "backstop": hammers.BACKSTOPS["hertz"]},
        {"pack": hammers.PACKS["power"], "backstop": hammers.BACKSTOPS["elastomer-pull"]},
    ],
    ids=["reloading along the unloading curve", "elastomer"],
)
def test_other_laws(parts: dict[str, Any]) -> None:
    spring, magnet = hammers.SPRINGS["linear"], hammers.MAGNETS["inverse-root"]
    other = made_of(magnet=magnet, spring=spring, **parts)
    shapes = hammers.waveforms(1.2, "current")
    drives = [ph.PulseTrain(shapes["rectangle"], at=[0.0, t]) for t in np.linspace(2e-4, 9e-4, 40)]
    agree(*both(Ensemble(other, drives, 1.4e-3)))


@pytest.mark.slow
def test_forces_as_drives() -> None:
    # Each kind of waveform has a kernel of its own.
    drives = [hammers.drives("force")[name] for name in ("single", "half-sine", "sampled")]
    drives += [ph.SineForce(12.0, rate, 0.4) for rate in np.linspace(400.0, 2000.0, 20)]
    agree(*both(Ensemble(hammers.shelf(), drives, 1e-3, states=(STOP + 2e-5, 0.0))))


@pytest.mark.parametrize(
    "change",
    [{"magnet.Bm": 9.4e7}, {"magnet.Bm": 5.9, "pack.stiffness": 3.5e10}, {"waveform.amplitude": "-330 A"}],
    ids=["magnet", "magnet and pack", "current"],
)
def test_where_a_law_runs_away_the_plain_kernel_tells(hammer: ph.Hammer, change: dict[str, Any]) -> None:
    """Its steps shrink without end: such a member leaves the lanes instead of taking fifty million steps."""
    mad = hammer.replace(change)
    trains = [ph.PulseTrain(one.waveform, rate=500.0, pulses=9) for one in (hammer, mad)]
    mine, plain = both(Ensemble([hammer, mad], trains, 20e-3, tolerance=1e-6))
    assert mine.ok[0]
    assert not mine.ok[1]
    np.testing.assert_array_equal(mine.status, plain.status)
    np.testing.assert_array_equal(mine.steps[1], plain.steps[1])


BORDER = [
    ("magnet.F0", 2.01747, 5e-7),
    ("magnet.F0", 2.01747, 1e-7),
    ("spring.Bs", 8.73, 5e-7),
    ("spring.Bs", 8.73, 1e-6),
]
"""Hammers of which the armature nearly stays in the pack, and tolerances at which it swings there unseen."""


@pytest.mark.parametrize(("key", "value", "tolerance"), BORDER)
def test_near_the_border_of_rest_a_member_that_does_not_get_on_leaves(
    key: str, value: float, tolerance: float
) -> None:
    """Its oscillations are far shorter than its steps, so that a step to the switch never ends on it."""
    hammer = ph.load("hendriks-1983-1").replace({key: value})
    assert hammer.waveform is not None
    drives = ph.PulseTrains.at_rates(hammer.waveform, np.linspace(500.0, 1100.0, 8), 9)
    result = Ensemble(hammer, drives, 0.026, tolerance=tolerance, max_steps=20_000).run(engine="lanes")
    assert result.ok.all()
    assert result.steps.max() < 2000


@pytest.mark.parametrize("engine", ["plain", "lanes"])
def test_a_run_is_given_up_after_its_steps_in_every_engine(hammer: ph.Hammer, engine: Any) -> None:
    drive = ph.PulseTrain(hammer.waveform, rate=900.0, pulses=20)
    ends = [1e-3, 20e-3]
    full = Ensemble(hammer, drive, ends).run(engine=engine)
    most = int(full.steps.max()) // 2
    cut = Ensemble(hammer, drive, ends, max_steps=most).run(engine=engine, dots=True)
    assert cut.status_names == ["ok", "step limit"]
    assert cut.steps[1] == most + 1
    assert cut.reached[1] < ends[1]
    with refused("max_steps"):
        Ensemble(hammer, drive, ends, max_steps=0)
