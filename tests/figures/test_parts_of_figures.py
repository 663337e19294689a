"""Axis scales, space for labels, and the points of a curve."""

from typing import TYPE_CHECKING

import numpy as np
import pytest

from printhammer.figures.elements.curves import fired, places, settled_at, shown_until, times_of
from printhammer.figures.elements.marks import freest
from printhammer.figures.elements.scales import scale

if TYPE_CHECKING:
    import printhammer as ph


@pytest.mark.parametrize(
    ("name", "largest", "unit", "other", "value", "shown"),
    [
        ("displacement", 4e-4, "um", "mil", 25.4e-6, 25.4),
        ("displacement", 2e-2, "mm", "in", 25.4e-3, 25.4),
        ("displacement", 20.0, "m", "in", 2.0, 2.0),
        ("time", 4e-3, "ms", "", 4e-3, 4.0),
        ("time", 4.0, "s", "", 4.0, 4.0),
        ("velocity", 1.0, "m/s", "in/s", 1.0, 1.0),
        ("force", 1e3, "N", "lbf", 1e3, 1e3),
    ],
)
def test_scales(name: str, largest: float, unit: str, other: str, value: float, shown: float) -> None:
    found = scale(name, largest)
    assert (found.unit, found.other) == (unit, other)
    assert float(found.shown(value)) == pytest.approx(shown, rel=1e-12)


def test_the_first_free_place_is_taken() -> None:
    points = np.array([[0.5, 0.5], [0.9, 0.9]])
    assert freest(points, (0.2, 0.2), [(0.4, 0.4), (0.1, 0.1), (0.2, 0.1)]) == ((0.1, 0.1), 0)


def test_where_nothing_is_free_the_least_covered_place_is_taken() -> None:
    points = np.array([[0.5, 0.5], [0.55, 0.5], [0.9, 0.9]])
    assert freest(points, (0.2, 0.2), [(0.4, 0.4), (0.8, 0.8)]) == ((0.8, 0.8), 1)


def test_a_curve_is_drawn_at_every_switch_and_extremum(hammer: "ph.Hammer") -> None:
    motion = fired(hammer)
    times = times_of(motion, 0.0, 1e-3)
    wanted = np.concatenate([motion.step_times, motion.maxima[0], [c.t_peak for c in motion.contacts]])
    assert np.isin(wanted[wanted <= 1e-3], times).all()
    assert (np.diff(times) > 0.0).all()
    assert (times[0], times[-1]) == (0.0, 1e-3)


def test_a_picture_ends_after_the_armature_has_settled(hammer: "ph.Hammer") -> None:
    motion = fired(hammer)
    settled = settled_at(motion)
    assert settled <= shown_until(motion) <= motion.end
    after = np.linspace(settled + 1e-6, motion.end, 3001)
    x = motion.at(after)[0]
    stroke = motion.peak_after(0)[1] - hammer.position
    assert np.abs(x - x[-1]).max() <= 0.012 * stroke


def test_places_are_those_that_the_hammer_has(hammer: "ph.Hammer") -> None:
    assert list(places(hammer)) == ["backstop", "pack", "platen"]
    assert list(places(hammer.replace({"pack": None, "platen": None}))) == ["backstop"]
