import string

from printhammer.printing.dots.strategy import KINDS, LEAD_IN, TEXT, long_patterns, row_of_dots


def test_kinds_follow_each_other_and_only_the_cycle_has_a_lead_in() -> None:
    patterns = long_patterns()
    assert list(dict.fromkeys(pattern.kind for pattern in patterns)) == list(KINDS)
    assert [pattern.judged_from for pattern in patterns if pattern.judged_from] == [LEAD_IN]
    assert all(pattern.slots == tuple(sorted(set(pattern.slots))) for pattern in patterns)


def test_the_longest_row_has_a_dot_in_each_of_200_slots() -> None:
    assert row_of_dots() == tuple(range(200))
    assert {slots[1] - slots[0] for kind, slots, _from in long_patterns() if kind == "row"} == {1, 2, 3}


def test_the_text_has_every_letter_and_digit_on_every_wire() -> None:
    assert set(string.ascii_lowercase + string.digits) <= set(TEXT.lower())
    wires = [pattern.slots for pattern in long_patterns() if pattern.kind == "text"]
    assert len(wires) == 9
    assert max(slots[-1] for slots in wires) < 6 * len(TEXT)
