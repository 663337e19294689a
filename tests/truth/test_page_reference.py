"""A printed line against the reference integrator: positions of the dots, and lost dots."""

import numpy as np
import pytest
from tests.hammers import CRUDE, TRUTH
from tests.oracle.integrator import reference

import printhammer as ph
from printhammer.printing.dots.strategy import FIRST_SLOT
from printhammer.printing.page.page import Page, print_page
from printhammer.printing.page.pattern import Pattern

RATE = 1500.0
ROWS = ("#.##.#", "######")
FINE = 1e-12


@pytest.fixture(scope="module")
def page() -> Page:
    """Two wires at a rate at which some dots deviate."""
    return print_page(ph.load(CRUDE), Pattern("two wires", marks()), RATE, tolerance=FINE)


def marks() -> np.ndarray:
    return np.array([[mark == "#" for mark in row] for row in ROWS])


def touches(slots: np.ndarray) -> np.ndarray:
    """First pack touch after each firing and before the next firing, s; NaN for a lost dot."""
    hammer = ph.load(CRUDE)
    fired = FIRST_SLOT + slots / RATE
    drive = ph.PulseTrain(hammer.waveform, at=fired)
    truth = reference(hammer, drive, float(fired[-1]) + 2e-3, tolerance=TRUTH)
    times = np.array([event.time for event in truth.events if event.kind == "pack-touch"])
    found = []
    for begin, end in zip(fired, [*fired[1:], np.inf], strict=True):
        inside = times[(times >= begin) & (times < end)]
        found.append(inside[0] if inside.size else np.nan)
    return np.array(found)


@pytest.mark.parametrize("wire", [0, 1])
def test_dots_land_where_the_reference_has_the_carriage(page: Page, wire: int) -> None:
    (single,) = touches(np.array([0]))
    slots = np.flatnonzero(marks()[wire])
    found = touches(slots)
    mine = page.wire == wire
    np.testing.assert_array_equal(page.lost[mine], np.isnan(found))
    # Column by column, and then as much further as the carriage moves between the two touches.
    speed = RATE * page.head.pitch
    places = (found - single) * speed
    np.testing.assert_allclose(page.places[0][mine], places, rtol=0.0, atol=1e-6 * page.head.pitch)
    off = np.abs(places - slots * page.head.pitch)
    assert np.nanmax(off) > 0.01 * page.head.pitch
