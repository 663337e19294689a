"""Rooms: the layout of the package's modules in folders, and the absence of import cycles."""

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "src" / "printhammer"
MAX_MODULES = 16
MAX_FAMILY = 2
TOP = {"__init__", "__main__", "errors", "units"}

FOLDERS = sorted({path.parent for path in PACKAGE.rglob("*.py")})
Graph = dict[str, set[str]]


def dotted(path: Path) -> str:
    parts = ("printhammer", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {dotted(path): path for path in PACKAGE.rglob("*.py")}


def imported(tree: ast.AST) -> Iterator[str]:
    """Yield the imports of a module: at its top, in functions, for types only, by name in `import_module`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called == "import_module":
                yield str(node.args[0].value)


def module_of(name: str) -> str:
    return name if name in MODULES else name.rpartition(".")[0]


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def graph() -> Graph:
    edges: Graph = {}
    for name, path in MODULES.items():
        targets = {module_of(target) for target in imported(tree_of(path))}
        edges[name] = {target for target in targets if target in MODULES and target != name}
    return edges


def circles(edges: Graph) -> list[set[str]]:
    """Return the sets of modules that reach each other; Tarjan's algorithm (1972)."""
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    components: list[set[str]] = []

    def visit(name: str) -> None:
        order[name] = lowest[name] = len(order)
        stack.append(name)
        for target in sorted(edges[name]):
            if target not in order:
                visit(target)
                lowest[name] = min(lowest[name], lowest[target])
            elif target in stack:
                lowest[name] = min(lowest[name], order[target])
        if lowest[name] == order[name]:
            start = stack.index(name)
            components.append(set(stack[start:]))
            del stack[start:]

    for name in sorted(edges):
        if name not in order:
            visit(name)
    return [component for component in components if len(component) > 1]


def test_only_few_modules_have_no_room() -> None:
    assert {path.stem for path in PACKAGE.glob("*.py")} <= TOP


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_no_folder_is_too_full(folder: Path) -> None:
    assert len(list(folder.glob("*.py"))) <= MAX_MODULES


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_modules_of_one_family_have_a_folder(folder: Path) -> None:
    families = Counter(path.stem.strip("_").partition("_")[0] for path in folder.glob("*.py"))
    assert {family: count for family, count in families.items() if count > MAX_FAMILY} == {}


def test_no_imports_run_in_a_circle() -> None:
    assert circles(graph()) == []


@pytest.mark.parametrize(
    ("edges", "expected"),
    [
        ({"a": {"b"}, "b": set()}, []),
        ({"a": {"b"}, "b": {"a"}, "c": {"a"}}, [{"a", "b"}]),
        ({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"e"}, "e": {"d"}}, [{"a", "b", "c"}, {"d", "e"}]),
    ],
)
def test_circles_are_found(edges: Graph, expected: list[set[str]]) -> None:
    assert sorted(circles(edges), key=sorted) == expected


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("from a.b import c", {"a.b.c"}),
        ("def f():\n    import a.b", {"a.b"}),
        ("if TYPE_CHECKING:\n    from a import b", {"a.b"}),
        ("import_module('a.b').plot()", {"a.b"}),
    ],
)
def test_all_kinds_of_imports_count(code: str, expected: set[str]) -> None:
    assert set(imported(ast.parse(code))) == expected


STUB = PACKAGE / "__init__.pyi"
ENTRIES = {"printhammer", "printhammer.__main__", "printhammer.cli.main"}
ENTRIES |= {
    f"printhammer.{name}" for name in re.findall(r"^from \.(\S+) import", STUB.read_text("utf-8"), re.M)
}
WORD = re.compile(r"\.?[a-z_][\w.]*")


def packages_of(name: str) -> list[str]:
    steps = name.split(".")
    return [".".join(steps[:count]) for count in range(1, len(steps))]


def named(name: str) -> set[str]:
    """Return the modules named in texts, seen from the package of a module, folders of f-strings, or above.

    A word alone is the name of a module there; with dots it may end in the name of a function.
    """
    path = MODULES[name]
    text = path.read_text(encoding="utf-8")
    home = name if path.stem == "__init__" else name.rpartition(".")[0]
    if "walk_packages" in text:
        return {module for module in MODULES if module.startswith(f"{home}.")}
    words = {
        node.value
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and WORD.fullmatch(node.value)
    }
    above = [*packages_of(home), home]
    folders = {f"{base}.{word.strip('.')}" for base in above for word in words if word.endswith(".")}
    near = {home, *(folders & set(MODULES))}
    found = set(words)
    for word in words:
        found |= {f"{base}.{word}" for base in ({*near, *above} if "." in word else near)}
    return {part for word in found for part in (word, word.rpartition(".")[0]) if part in MODULES} - {home}


def test_every_module_is_reached_from_a_verb_or_a_public_name() -> None:
    reached: set[str] = set()
    waiting = list(ENTRIES)
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += {*graph()[name], *packages_of(name), *named(name)} - reached
    assert set(MODULES) - reached == set()


def test_the_graph_sees_imports() -> None:
    assert "printhammer.hammer.hammer" in graph()["printhammer.run.simulate"]


ORACLE = Path(__file__).parent / "oracle"


@pytest.mark.parametrize("path", sorted(ORACLE.glob("*.py")), ids=lambda path: path.stem)
def test_the_oracle_shares_no_code_with_the_package(path: Path) -> None:
    """Apart from types of arguments, the oracle uses arrays and numbers only."""
    names = {name.partition(".")[0] for name in imported(ast.parse(path.read_text(encoding="utf-8")))}
    allowed = sys.stdlib_module_names | {"numba", "numpy", "scipy", "tests"}
    assert names <= allowed
