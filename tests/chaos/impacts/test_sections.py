"""Sections: touches equal those of the motion, in bounded memory, for any number of threads."""

from collections.abc import Callable

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import Section, sections
from printhammer.run import simulate

PERIOD = 1.05e-3


def same(one: Section, other: Section) -> bool:
    names = ("t", "v", "firing", "since", "t_out", "v_out", "status", "first", "last")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


@pytest.mark.parametrize("surface", ["backstop", "pack"])
def test_touches_are_those_of_the_motion(hammer: "ph.Hammer", surface: str) -> None:
    found = ph.section(hammer, surface=surface, period=PERIOD, touches=30, transient=4)
    drive = ph.PulseTrain(hammer.waveform, period=PERIOD, pulses=found.last + 2)
    motion = ph.simulate(hammer, drive, points=2)
    expected = [
        contact
        for contact in motion.contacts
        if contact.surface == surface and not contact.initial and contact.t_in >= 4 * PERIOD
    ][:30]
    np.testing.assert_array_equal(found.t, [contact.t_in for contact in expected])
    np.testing.assert_array_equal(found.v, [contact.v_in for contact in expected])
    np.testing.assert_array_equal(found.t_out, [contact.t_out for contact in expected])
    np.testing.assert_array_equal(found.v_out, [contact.v_out for contact in expected])
    np.testing.assert_array_equal(found.firing - 1, [contact.firing for contact in expected])
    np.testing.assert_allclose(found.since, found.t - PERIOD * (found.firing - 1), atol=1e-15)
    assert (found.v < 0.0).all() if surface == "backstop" else (found.v > 0.0).all()
    assert found.ok
    assert found.remark == ""
    assert (found.first, found.last) == (5, found.firing[-1])


def test_stretches_change_nothing(hammer: "ph.Hammer", monkeypatch: pytest.MonkeyPatch) -> None:
    whole = ph.section(hammer, period=PERIOD, touches=200)
    # Some of the pauses fall into contacts.
    for length in (40, 58, 64):
        monkeypatch.setattr(simulate, "_STRETCH", length)
        assert same(ph.section(hammer, period=PERIOD, touches=200), whole)
    # Too short for what comes between two pauses: longer ones are tried.
    monkeypatch.setattr(simulate, "_STRETCH", 1)
    assert same(ph.section(hammer, period=PERIOD, touches=200), whole)


def test_too_few_touches_are_told(hammer: "ph.Hammer") -> None:
    # It hangs up: the backstop is not reached at all.
    found = ph.section(hammer, period="0.45 ms", touches=20, transient=500, firings=50)
    assert found.ok
    assert len(found.t) == 0
    assert found.remark == "0 of 20 touches of the backstop from firing 501 to 551"
    assert found.per_firing == 0.0


def test_a_slow_train_prints_once_each_firing(hammer: "ph.Hammer") -> None:
    found = ph.section(hammer, surface="pack", period="6 ms", touches=50, transient=5)
    assert found.per_firing == 1.0
    np.testing.assert_allclose(found.since, found.since[0], rtol=1e-9)
    np.testing.assert_array_equal(np.diff(found.firing), 1)


def test_a_run_that_stops_has_a_status(hammer: "ph.Hammer") -> None:
    found = ph.section(hammer.replace("magnet.range_max", "250 um"), period="1 ms", touches=10)
    assert found.status == "range left"
    assert "range left" in found.remark
    assert len(found.t) < 10


def test_sections_do_not_depend_on_company_or_threads(hammer: "ph.Hammer") -> None:
    periods = [1.3e-3, 1.05e-3, 0.8e-3]
    together = sections(hammer, periods, touches=60, threads=2)
    for period, found in zip(periods, together, strict=True):
        assert same(found, ph.section(hammer, period=period, touches=60))
    assert [found.period for found in together] == periods
    assert same(together[1], sections([hammer] * 3, periods, touches=60, threads=1)[1])


def test_a_dataset_holds_units_and_provenance(hammer: "ph.Hammer") -> None:
    found = ph.section(hammer, rate="1 kHz", touches=5)
    chart = found.to_dataset()
    assert dict(chart.sizes) == {"touch": 5}
    assert chart["since"].attrs["units"] == "s"
    assert chart.attrs["surface"] == "backstop"
    assert chart.attrs["hammer_fingerprint"] == hammer.fingerprint


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (ph.section, "period"),
        (lambda h: ph.section(h, period=1e-3, drive=ph.SineForce(1.0, 100.0)), "drive"),
        (lambda h: ph.section(h, period=1e-3, surface="floor"), "surface"),
        (lambda h: ph.section(h.replace("backstop", None), period=1e-3, state=(1e-4, 0.0)), "surface"),
        (lambda h: ph.section(h, period=1e-3, touches=0), "touches"),
        (lambda h: ph.section(h, period=1e-3, transient=-1), "transient"),
        (lambda h: ph.section(h, period=1e-3, firings=0), "firings"),
        (lambda h: ph.section(h, period=1e-3, transient=9_999_999), "firings"),
        (lambda h: ph.section(h, period=1e-3, tolerance=0.0), "tolerance"),
        (lambda h: ph.section(h.replace("waveform", None), period=1e-3), "waveform"),
        (lambda h: sections([h, h], [1e-3] * 3), "hammers"),
    ],
)
def test_bad_input(hammer: "ph.Hammer", call: Callable[["ph.Hammer"], object], key: str) -> None:
    with refused(key):
        call(hammer)
