"""Linking: undefined symbols and unreadable modules are reported in one sentence."""

import llvmlite.binding as llvm
import pytest

from printhammer.kernel.compile import calls, link

TEMPLATE = """
@choice.RIGID = external constant i8
@choice.CHANGING.int = external constant i64
declare i32 @law.spring_force(ptr, ptr, double)
define i32 @entry(ptr %result, ptr %raised, double %x) {
%forced = call i32 @law.spring_force(ptr %result, ptr %raised, double %x)
%value = load i64, ptr %result
%rigid = load i8, ptr @choice.RIGID
%wide = zext i8 %rigid to i64
%count = load i64, ptr @choice.CHANGING.int
%scaled = mul i64 %count, %wide
%sum = add i64 %value, %scaled
store i64 %sum, ptr %result
ret i32 0
}
"""
LAW = """
define i32 @law.spring_force(ptr %result, ptr %raised, double %x) {
%value = fptosi double %x to i64
store i64 %value, ptr %result
ret i32 0
}
define i32 @law.spring_energy(ptr %result, ptr %raised, double %x) { ret i32 0 }
"""
CALLING = calls.calling_code(link.ENTRY, ("f",), link.CALL)
CHOICES = {"RIGID": 1, "CHANGING": 5, "MEMORY": 0}


def bitcode(text: str) -> bytes:
    return bytes(llvm.parse_assembly(text).as_bitcode())


@pytest.mark.parametrize(("rigid", "expected"), [(1, 13), (0, 8)])
def test_laws_and_choices_are_put_in_their_places(rigid: int, expected: int) -> None:
    module = link.link(bitcode(TEMPLATE), [bitcode(LAW)], {**CHOICES, "RIGID": rigid}, CALLING)
    function = calls.caller(link.load(link.emit(module)), ("f",), 1)
    assert function(8.0) == expected
    # All was inlined into the function that is called.
    assert [each.name for each in module.functions if not each.is_declaration] == [link.CALL]


@pytest.mark.parametrize(
    ("laws", "choices", "symbol"),
    [
        ([], CHOICES, "law.spring_force"),
        ([LAW], {"RIGID": 1}, "choice.CHANGING.int"),
        ([LAW], {"CHANGING": 1}, "choice.RIGID"),
    ],
)
def test_what_stays_open_is_named(laws: list[str], choices: dict[str, int], symbol: str) -> None:
    with pytest.raises(link.LinkError, match=f"^{symbol} is left open"):
        link.link(bitcode(TEMPLATE), map(bitcode, laws), choices, CALLING)


def test_what_is_no_module_is_said() -> None:
    for template, law in ((b"BC no bitcode", bitcode(LAW)), (bitcode(TEMPLATE), bitcode(LAW)[:100])):
        with pytest.raises(link.LinkError):
            link.link(template, [law], CHOICES, CALLING)
    assert not link.is_readable(b"BC no bitcode")
    assert link.is_readable(bitcode(LAW))


def test_two_modules_with_the_same_law_are_refused() -> None:
    with pytest.raises(link.LinkError):
        link.link(bitcode(TEMPLATE), [bitcode(LAW), bitcode(LAW)], CHOICES, CALLING)
