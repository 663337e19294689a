"""The extra contacts of an ensemble equal those of the motions of its members."""

from typing import Any

import numpy as np
import pytest
from tests import hammers

import printhammer as ph
from printhammer.kernel.model.dots import DOT, NO_DOT, contact_number
from printhammer.kernel.model.modes import BACKSTOP_SURFACE, PACK_SURFACE
from printhammer.run import ensemble_group
from printhammer.run.ensemble import Ensemble, EnsembleResult


@pytest.fixture(scope="module")
def ensemble(hammer: ph.Hammer) -> Ensemble:
    """Thrown at the paper, the wire returns to the paper twice while a long weak pulse is active."""
    pulses = [hammers.waveforms(current, "current")["long"] for current in (0.2, 0.34, 0.6)]
    drives = [ph.PulseTrain(pulse, at=[0.0, 2.5e-3]) for pulse in pulses]
    return Ensemble(hammer, drives, 6e-3, states=(150e-6, 3.0))


def kept(ensemble: Ensemble, **options: Any) -> EnsembleResult:
    result = ensemble.run(dots=True, extra=True, threads=1, **options)
    assert result.dots is not None
    assert result.extra is not None
    counts = np.zeros_like(result.dots.extra_contacts)
    np.add.at(counts, (result.extra.member, result.extra.firing), 1)
    np.testing.assert_array_equal(counts, result.dots.extra_contacts)
    return result


def entries(result: EnsembleResult) -> dict[str, Any]:
    return {name: values for name, (_note, values) in result.entries().items()}


@pytest.mark.parametrize("engine", ["plain", "lanes"])
def test_extra_contacts_are_those_of_the_motions(ensemble: Ensemble, engine: str) -> None:
    extra = kept(ensemble, engine=engine).extra
    assert extra is not None
    expected = [
        (member, contact.firing, contact.t_in, contact.peak_force)
        for member in range(ensemble.size)
        for contact in ensemble.motion(member).contacts
        if contact.extra
    ]
    assert len(expected) > 3
    members, firings, touches, forces = zip(*expected, strict=True)
    assert extra.member.tolist() == list(members)
    assert extra.firing.tolist() == list(firings)
    exact = 1e-13 if engine == "plain" else 1e-6
    np.testing.assert_allclose(extra.touch, touches, rtol=0.0, atol=0.0 if engine == "plain" else 1e-10)
    np.testing.assert_allclose(extra.peak_force, forces, rtol=exact)


@pytest.mark.parametrize("engine", ["plain", "lanes"])
def test_members_without_enough_room_run_once_more(
    ensemble: Ensemble, engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ample = entries(kept(ensemble, engine=engine, times=np.linspace(0.0, 6e-3, 40)))
    # Room for the dots alone, and for one extra contact.
    for room in (-2, -1):
        monkeypatch.setattr(ensemble_group, "_EXTRA", room)
        short = entries(kept(ensemble, engine=engine, times=np.linspace(0.0, 6e-3, 40)))
        assert list(short) == list(ample)
        for name, values in ample.items():
            np.testing.assert_array_equal(short[name], values, err_msg=name)


def test_dots_are_the_same_with_and_without_extra_contacts(ensemble: Ensemble) -> None:
    with_extra, without = kept(ensemble), ensemble.run(dots=True, threads=1)
    assert without.extra is None
    assert with_extra.dots is not None
    assert without.dots is not None
    for name, values in vars(without.dots).items():
        np.testing.assert_array_equal(getattr(with_extra.dots, name), values, err_msg=name)


def test_the_first_pack_contact_of_a_firing_makes_its_dot() -> None:
    assert contact_number(PACK_SURFACE, False, 3, 0) == DOT
    assert contact_number(PACK_SURFACE, False, 3, 2) == 2
    for surface, initial, fired in (
        (BACKSTOP_SURFACE, False, 3),
        (PACK_SURFACE, True, 3),
        (PACK_SURFACE, False, -1),
    ):
        assert contact_number(surface, initial, fired, 1) == NO_DOT
