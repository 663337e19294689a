"""Tests of the family that ships with the program, if it exists."""

import itertools

import pytest
from studies.reconstruction.family.choice import at_gauge
from studies.reconstruction.family.family import _judge, family_hammers
from studies.reconstruction.family.robustness import robustness
from studies.reconstruction.judging.judged import STATED
from studies.reconstruction.search.space import template

from printhammer.errors import InputError
from printhammer.report.reconstruction.results import FamilyMember, shipped_results

UNITS = {key: constant.si_unit for key, constant in template().constants.items()}


def members() -> list[FamilyMember]:
    table = shipped_results().family
    return [] if table is None else table.hammers


def gauged(member: FamilyMember) -> dict[str, float]:
    force = member.conclusions["print_force_N"]
    assert force is not None
    return at_gauge(member.constants, UNITS, force)


def test_there_are_twenty_at_least_or_none() -> None:
    if not members():
        with pytest.raises(InputError, match=r"family\.json"):
            family_hammers()
    else:
        assert len(members()) >= 20
        assert len({hammer.fingerprint for hammer in family_hammers()}) == len(members())


def test_every_member_satisfies_what_it_must() -> None:
    for member in members():
        assert member.panels >= 8
        assert {name: member.verdicts[name] for name in STATED} == dict.fromkeys(STATED, "holds")
    for hammer in family_hammers() if members() else []:
        hammer.check()
        assert hammer.warnings() == []


def test_any_two_differ_by_a_tenth_in_three_constants_also_at_the_common_scale() -> None:
    for one, other in itertools.combinations(members(), 2):
        for a, b in ((one.constants, other.constants), (gauged(one), gauged(other))):
            apart = sum(abs(a[key] - b[key]) >= 0.1 * min(abs(a[key]), abs(b[key])) > 0.0 for key in a)
            assert apart >= 3


def test_what_is_said_of_all_follows_from_the_table() -> None:
    table = shipped_results().family
    if table is not None:
        told = robustness([row.conclusions for row in table.hammers], [gauged(row) for row in table.hammers])
        assert set(told) == set(table.conclusions)
        for name, entry in table.conclusions.items():
            found = told[name]
            assert (entry.robust, entry.text) == (found["robust"], found["text"])
            assert (entry.low, entry.high) == pytest.approx((found["low"], found["high"]))


@pytest.mark.golden
@pytest.mark.slow
def test_a_member_judged_again_is_one() -> None:
    for member, hammer in list(zip(members(), family_hammers(), strict=True))[-1:] if members() else []:
        judged = _judge(hammer)
        assert judged["member"]
        assert judged["panels"] == member.panels
        for name, value in judged["conclusions"].items():
            if value is None:
                assert member.conclusions[name] is None
            else:
                assert value == pytest.approx(member.conclusions[name], rel=1e-6)
