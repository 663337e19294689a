import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused
from tests.hammers import CRUDE

import printhammer
from printhammer.hammer.equilibrium import (
    Equilibrium,
    equilibria,
    equilibrium_picture,
    holding_margin,
    positive_intervals,
    release_current,
    rest_state,
)
from printhammer.hammer.statics import spacing
from printhammer.parts import BackstopPart, MagnetPart, PackPart, SpringPart
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.magnet.table import TableMagnet
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.parts.pack.power import PowerPack
from printhammer.parts.pack.rigid import RigidFront
from printhammer.parts.spring.linear import LinearSpring, PreloadSpring


@dataclass(frozen=True)
class Bench:
    """A hammer composed of parts."""

    name: str = "bench"
    mass: float = 4e-4
    magnet: MagnetPart | None = None
    spring: SpringPart | None = None
    pack: PackPart | None = None
    backstop: BackstopPart | None = None
    platen: float | None = None

    @property
    def origin(self) -> float:
        return self.backstop.position if self.backstop is not None else 0.0


MAGNET = InverseRootMagnet(F0=2.5, Am=0.44, Bm=0.093)
SPRING = LinearSpring(Bs=14.3, As=4.66e-4)
PACK = PowerPack(stiffness=260.0, front=203e-6, thickness=178e-6)
HERTZ = HertzBackstop(position=51e-6, stiffness=1.2e9, damping=4e8)
HAMMER = Bench(magnet=MAGNET, spring=SPRING, pack=PACK, backstop=HERTZ, platen=381e-6)


def net(hammer: Bench, x: float, current: float = 0.0) -> float:
    """Force of magnet, linear spring and Hertz contact, evaluated directly."""
    assert isinstance(hammer.magnet, InverseRootMagnet)
    assert isinstance(hammer.spring, LinearSpring)
    assert isinstance(hammer.backstop, HertzBackstop)
    b = hammer.backstop.position
    force = hammer.magnet.F0 - (hammer.magnet.Am - hammer.magnet.Bm * current) ** 2 / math.sqrt(x)
    force += hammer.spring.Bs - hammer.spring.Bs / hammer.spring.As * (x - b)
    return float(force + hammer.backstop.stiffness * max(b - x, 0.0) ** 1.5)


def test_the_armature_rests_compressing_the_backstop() -> None:
    rest = rest_state(HAMMER)
    assert 45e-6 < rest < 51e-6
    assert abs(net(HAMMER, rest)) < 1e-12
    (unstable, stable) = equilibria(HAMMER)
    assert stable == Equilibrium(rest, True, stable.frequency, "backstop")
    assert (unstable.stable, unstable.frequency) == (False, None)
    assert unstable.x < 1e-6


def test_a_current_releases_the_armature_to_the_paper() -> None:
    release = release_current(HAMMER)
    assert net(HAMMER, 51e-6, release) == pytest.approx(0.0, abs=1e-12)
    surfaces = [point.surface for point in equilibria(HAMMER, 1.01 * release) if point.stable]
    assert surfaces == ["pack"]
    held = [point.surface for point in equilibria(HAMMER, 0.99 * release) if point.stable]
    assert held == ["backstop", "pack"]


def test_a_pack_with_memory_has_no_frequency_and_one_without_has() -> None:
    pressed = [point for point in equilibria(HAMMER, 1.5) if point.stable]
    assert [point.frequency for point in pressed] == [None]
    soft = replace(HAMMER, pack=DashpotPack(stiffness=1e5, damping=0.1, front=203e-6))
    (point,) = [point for point in equilibria(soft, 1.5) if point.stable]
    assert point.surface == "pack"
    slope = 0.5 * (0.44 - 0.093 * 1.5) ** 2 * point.x**-1.5 - 14.3 / 4.66e-4 - 1e5
    assert point.frequency == pytest.approx(math.sqrt(-slope / 4e-4) / (2.0 * math.pi), rel=1e-10)


def test_the_margin_is_the_force_that_holds_the_armature() -> None:
    rest = rest_state(HAMMER)
    pressing = float(holding_margin(HAMMER, rest))
    assert pressing == pytest.approx(1.2e9 * (51e-6 - rest) ** 1.5, rel=1e-12)
    x = np.linspace(60e-6, 180e-6, 12).reshape(3, 4)
    margin = holding_margin(HAMMER, x)
    assert margin.shape == (3, 4)
    np.testing.assert_allclose(margin, [[-net(HAMMER, place) for place in row] for row in x], rtol=1e-12)
    assert np.isnan(holding_margin(HAMMER, [-1e-6, 0.0])).all()


def test_no_positive_interval_where_the_magnet_recaptures_from_everywhere() -> None:
    assert positive_intervals(HAMMER) == []


def test_intervals_in_which_the_armature_is_driven_to_the_paper() -> None:
    weak = replace(HAMMER, magnet=MAGNET.model_copy(update={"Am": 0.40}), backstop=replace_position(30e-6))
    ((low, high),) = positive_intervals(weak)
    for end in (low, high):
        assert net(weak, end) == pytest.approx(0.0, abs=1e-11)
    assert net(weak, 0.5 * (low + high)) > 0.0
    assert net(weak, 0.5 * (low + 30e-6)) < 0.0
    assert net(weak, 0.5 * (high + 381e-6)) < 0.0


def replace_position(position: float) -> HertzBackstop:
    return HertzBackstop(position=position, stiffness=1.2e9, damping=4e8)


def test_an_interval_may_end_with_the_stroke() -> None:
    away = Bench(spring=PreloadSpring(preload=-1.0, stiffness=-1e4), backstop=HERTZ, platen=381e-6)
    ((low, high),) = positive_intervals(away)
    assert low == pytest.approx(51e-6 + 1e-4, rel=1e-14)
    assert high == 381e-6
    paper = replace(away, platen=None, pack=PACK)
    assert positive_intervals(paper) == [(low, 203e-6 + 178e-6)]
    assert positive_intervals(replace(away, backstop=None)) == []
    assert positive_intervals(replace(away, platen=51e-6)) == []


def test_on_a_rigid_backstop_the_armature_rests_at_its_position() -> None:
    hammer = replace(HAMMER, backstop=RigidBackstop(position=51e-6, restitution=0.5))
    assert rest_state(hammer) == 51e-6
    assert equilibria(hammer) == [Equilibrium(51e-6, True, None, "backstop")]
    assert [point.surface for point in equilibria(hammer, 1.5)] == ["pack"]


def test_on_an_elastomer_the_armature_rests_deeper() -> None:
    soft = ElastomerBackstop(position=51e-6, stiffness=5e8, relaxation_time=1e-5)
    hammer = replace(HAMMER, backstop=soft)
    rest = rest_state(hammer)
    assert rest < rest_state(HAMMER)
    assert 5e8 * (51e-6 - rest) ** 1.5 == pytest.approx(float(holding_margin(hammer, rest)), rel=1e-12)


def test_a_hammer_without_a_backstop_rests_where_its_spring_lets_it() -> None:
    hammer = Bench(spring=PreloadSpring(preload=2.0, stiffness=1e4))
    assert rest_state(hammer) == pytest.approx(2e-4, rel=1e-15)
    (point,) = equilibria(hammer)
    assert (point.stable, point.surface) == (True, None)
    assert point.frequency == pytest.approx(math.sqrt(1e4 / 4e-4) / (2.0 * math.pi), rel=1e-12)


def test_a_spring_may_hold_the_armature_off_its_backstop() -> None:
    stop = RigidBackstop(position=-1e-3, restitution=0.8)
    hammer = Bench(spring=PreloadSpring(preload=10.0, stiffness=1e4), backstop=stop)
    assert rest_state(hammer) == pytest.approx(0.0, abs=1e-18)
    touching = Bench(spring=PreloadSpring(preload=0.0, stiffness=1e4), backstop=stop)
    assert rest_state(touching) == -1e-3
    assert [point.stable for point in equilibria(touching)] == [True]


def test_a_spring_may_press_the_armature_on_the_paper() -> None:
    pack = DashpotPack(stiffness=1e5, damping=0.0, front=1e-4)
    rest = rest_state(Bench(spring=PreloadSpring(preload=3.0, stiffness=0.0), pack=pack))
    assert rest == pytest.approx(1e-4 + 3e-5, rel=1e-14)


def test_an_armature_may_latch_at_either_of_two_rigid_stops() -> None:
    """An unstable spring presses the armature against both stops, on either side of its equilibrium."""
    front = RigidFront(front=381e-6, restitution=0.3)
    back = RigidBackstop(position=51e-6, restitution=0.3)
    hammer = Bench(spring=PreloadSpring(preload=-1.0, stiffness=-1e4), backstop=back, pack=front)
    first, middle, last = equilibria(hammer)
    assert first == Equilibrium(51e-6, True, None, "backstop")
    assert (middle.stable, middle.surface) == (False, None)
    assert middle.x == pytest.approx(151e-6, rel=1e-13)
    assert last == Equilibrium(381e-6, True, None, "pack")
    assert equilibria(hammer, within=(100e-6, 380e-6)) == [middle]
    assert equilibria(replace(hammer, spring=PreloadSpring(preload=-4.0, stiffness=-1e4))) == [first]


def test_a_spring_of_negative_stiffness_has_an_unstable_equilibrium() -> None:
    hammer = Bench(spring=PreloadSpring(preload=-1.0, stiffness=-1e4), backstop=HERTZ, platen=381e-6)
    points = equilibria(hammer)
    assert [(point.stable, point.surface) for point in points] == [(True, "backstop"), (False, None)]
    assert points[1].x == pytest.approx(151e-6, rel=1e-13)


def test_the_range_may_be_given() -> None:
    everything = equilibria(HAMMER, 0.5)
    for within, expected in (((60e-6, 381e-6), everything[2:]), ((-1.0, 381e-6), everything)):
        found = equilibria(HAMMER, 0.5, within=within)
        assert [point.x for point in found] == pytest.approx([point.x for point in expected], rel=1e-14)
    with refused("range"):
        equilibria(HAMMER, 0.0, within=(2e-4, 1e-4))


def test_a_measured_table_gives_the_equilibria_of_the_law_it_samples() -> None:
    x = np.linspace(20e-6, 400e-6, 96)
    current = np.linspace(-0.5, 2.0, 26)
    force = 2.5 - (0.44 - 0.093 * current) ** 2 / np.sqrt(x[:, np.newaxis])
    table = replace(HAMMER, magnet=TableMagnet.from_arrays(x.tolist(), current.tolist(), force.tolist()))
    assert rest_state(table) == pytest.approx(rest_state(HAMMER), rel=1e-6)
    assert release_current(table) == pytest.approx(release_current(HAMMER), rel=1e-5)
    for level in (0.0, 0.5, 1.5):
        measured, fitted = (equilibria(hammer, level, within=(30e-6, 381e-6)) for hammer in (table, HAMMER))
        assert [point.x for point in measured] == pytest.approx([point.x for point in fitted], rel=1e-4)
        assert [point.stable for point in measured] == [point.stable for point in fitted]
    with refused("current"):
        equilibria(table, 3.0)


@pytest.mark.parametrize(
    ("hammer", "key"),
    [
        (replace(HAMMER, magnet=MAGNET.model_copy(update={"Am": 0.1})), "rest"),
        (replace(HAMMER, backstop=None), "rest"),
        (Bench(), "rest"),
        (Bench(backstop=HERTZ), "rest"),
        (Bench(spring=PreloadSpring(preload=1.0, stiffness=-1e3)), "rest"),
        (Bench(spring=PreloadSpring(preload=1.0, stiffness=0.0), pack=PACK), "rest"),
        (
            replace(HAMMER, backstop=HertzBackstop(position=51e-6, stiffness=1e3, damping=0.0)),
            "rest",
        ),
    ],
)
def test_a_hammer_without_a_rest_state_says_so_in_one_sentence(hammer: Bench, key: str) -> None:
    with refused(key) as caught:
        rest_state(hammer)
    assert "'bench' has no rest state" in str(caught.value)
    assert "\n" not in str(caught.value)
    picture = equilibrium_picture(hammer)
    assert picture.rest is None
    assert picture.no_rest == str(caught.value)


def test_release_needs_a_magnet_that_can_let_go() -> None:
    with refused("release"):
        release_current(replace(HAMMER, magnet=None))
    with refused("release"):
        release_current(replace(HAMMER, backstop=None))
    with refused("release"):
        release_current(replace(HAMMER, magnet=MAGNET.model_copy(update={"Bm": 0.0})))
    assert release_current(replace(HAMMER, magnet=MAGNET.model_copy(update={"Am": 0.1}))) == 0.0


def test_a_magnet_may_be_released_by_a_negative_current() -> None:
    x, current = [20e-6, 200e-6, 400e-6], [-1.0, -0.5, 0.0, 0.5]
    force = [[-30.0 - 20.0 * level for level in current] for _ in x]
    hammer = replace(HAMMER, magnet=TableMagnet.from_arrays(x, current, force))
    # The net force at the backstop is 14.3 - 30 - 20 I.
    assert release_current(hammer) == pytest.approx(-15.7 / 20.0, rel=1e-12)


def test_the_picture_holds_it_all() -> None:
    picture = equilibrium_picture(HAMMER)
    assert picture.rest == rest_state(HAMMER)
    assert picture.no_rest == ""
    assert picture.equilibria == tuple(equilibria(HAMMER))
    assert picture.release_current == release_current(HAMMER)
    assert picture.positive_intervals == ()
    assert (picture.x[0], picture.x[-1]) == (51e-6, 381e-6)
    np.testing.assert_array_equal(picture.margin, holding_margin(HAMMER, picture.x))
    assert picture.weakest[1] == picture.margin.min() > 0.0
    bare = equilibrium_picture(Bench(spring=PreloadSpring(preload=0.0, stiffness=1.0)))
    assert bare.release_current is None
    assert bare.rest == 0.0


def test_the_shipped_hammer_is_held_and_released() -> None:
    hammer = printhammer.load(CRUDE)
    picture = equilibrium_picture(hammer)
    assert picture.rest == printhammer.rest_state(hammer)
    assert (
        abs(float(-holding_margin(hammer, picture.rest)) + 1.15608224e9 * (50.8e-6 - picture.rest) ** 1.5)
        < 1e-9
    )
    assert picture.positive_intervals == ()
    assert 0.5 < printhammer.release_current(hammer) < 1.0


@given(st.floats(-1e3, 1e3) | st.sampled_from([0.0, -0.0, 5e-324, 2.2250738585072014e-308, 1e-310]))
def test_the_spacing_of_numbers_is_that_of_the_library(x: float) -> None:
    assert spacing(x) == math.ulp(x)
