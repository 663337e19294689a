"""Kernels in WebAssembly: what a module holds, and that it computes what machine code computes."""

import importlib.util

import llvmlite.binding as llvm
import pytest
from tests.errors import refused

from printhammer.kernel.compile import calls, link
from printhammer.kernel.compile.signatures import signature_of
from printhammer.kernel.compile.web import build

SCALED = """
@table = internal constant [2 x double] [double 2.0, double 3.0]
declare double @pow(double, double)
define i32 @entry(ptr %result, ptr %raised, i8 %b, ptr %o, ptr %p, i64 %n, i64 %size, ptr %data,
                  i64 %l0, i64 %l1, i64 %s0, i64 %s1, double %x) {
%second = getelementptr i8, ptr %data, i64 %s0
%base = load double, ptr getelementptr ([2 x double], ptr @table, i64 0, i64 1)
%power = call double @pow(double %base, double %x)
store double %power, ptr %second
store i64 %n, ptr %result
%place = getelementptr i64, ptr %result, i64 1
%wide = zext i8 %b to i64
store i64 %wide, ptr %place
ret i32 0
}
"""
SIGNATURE = ("b", ("f2", "f"))


def made_object() -> bytes:
    """The object of a function that writes 3 to the power x to the second row of an array."""
    template = bytes(llvm.parse_assembly(SCALED).as_bitcode())
    calling = calls.calling_code(link.ENTRY, SIGNATURE, link.CALL, bare=True)
    return build.emit(link.link(template, [], {}, calling), "run")


def test_an_object_is_one_of_webassembly() -> None:
    content = made_object()
    assert content.startswith(build.MAGIC)
    assert b"pow" in content


def test_a_missing_linker_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "find_spec", lambda name: importlib.util.find_spec(f"{name}_not_here"))
    with refused(key="page"):
        build.join({"run": made_object()}, {})


def test_a_description_names_the_elements_of_named_tuples() -> None:
    which, batch, kept, *_ = build.description_of(signature_of("members", {}))
    assert which == "i1"
    assert batch["firings"] == "f1"
    assert kept["x"] == "s2"
    assert build.description_of(SIGNATURE) == ["b", ["f2", "f"]]


@pytest.mark.parametrize(
    ("number", "encoded"), [(0, b"\0"), (127, b"\x7f"), (128, b"\x80\1"), (624485, b"\xe5\x8e\x26")]
)
def test_lengths_are_encoded_as_the_binary_format_says(number: int, encoded: bytes) -> None:
    assert build._unsigned(number) == encoded
