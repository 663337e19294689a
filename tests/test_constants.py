"""Every numeric constant of a module states where its value comes from, or that the value is arbitrary.

The statement is a comment before the constant or on its line, or the docstring below; constants on successive
lines may share one. A statement is recognised by its words, such as "arbitrary", "measured", "as in" or a
year, and a definition by the noun of what it defines, such as an index, a code or a version.
"""

import ast
import re
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "src/printhammer"

UNREAD = ("kernel", "run/plain")
"""Rooms whose text is compiled: changing a comment there would recompile the kernel."""

ORIGIN = (
    r"arbitrar(?:y|ily)",
    r"assum(?:ed|ption)",
    r"convention(?:al)?s?",
    r"(?:because|since|so that)",
    r"bounds? the (?:memory|time)",
    r"rounding errors?",
    r"(?:measured|tuned|simulated noise|derived from)",
    r"decision \d+",
    r"(?:in|by) the paper|(?:bursts|section|year) of the paper",
    r"the paper's (?:Figs?|hammer|value)|The paper [(]introduction",
    r"Figs?\. \d+",
    r"(?:19|20)\d\d",
    r"as (?:in|for)",
    r"standard (?:acceleration|IEC)|textbook",
)
"""Words that state where a value comes from; a year belongs to a citation."""

DEFINITION = (
    r"^(?:Integer |Status |Pack branch )?(?:codes?|kinds?|labels?|ind(?:ex|ices)|version|exit status)\b",
    r"^(?:Default )?unit of the times|^(?:First )?row of|^Columns of|^Number of (?:additional )?columns",
    r"^Number of the figure|\bequation \(\d|^Common units by|^Zero offset of a unit",
    r"\bby definition\b|\bbits\b|\bdouble precision\b|\bin a second$|^An inch",
    r"\bgolden ratio\b|\broot of\b",
)
"""Patterns of statements of what a value is by definition."""

REASON = re.compile(rf"\b(?:{'|'.join(ORIGIN)})\b|{'|'.join(DEFINITION)}", re.IGNORECASE)


def is_numeric(value: ast.expr) -> bool:
    """Whether an expression consists of numbers only, or of NumPy functions of numbers."""
    match value:
        case ast.Constant(value=number):
            return isinstance(number, int | float) and not isinstance(number, bool)
        case ast.UnaryOp(operand=operand):
            return is_numeric(operand)
        case ast.BinOp(left=left, right=right):
            return is_numeric(left) and is_numeric(right)
        case ast.Tuple(elts=entries) | ast.List(elts=entries) | ast.Dict(values=entries):
            return bool(entries) and all(map(is_numeric, entries))
        case ast.Call(func=function, args=arguments):
            return ast.unparse(function).startswith("np.") and all(map(is_numeric, arguments))
    return False


def statements(source: str) -> list[tuple[str, str]]:
    """Return name and statement of each numeric constant of a module."""
    lines = source.splitlines()
    body = ast.parse(source).body
    nodes: list[ast.Assign | ast.AnnAssign] = []
    texts: list[str] = []
    for node, below in zip(body, [*body[1:], None], strict=True):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        assert node.end_lineno is not None
        first = node.lineno - 1
        while lines[first - 1].startswith("#"):
            first -= 1
        text = [line.removeprefix("#") for line in lines[first : node.lineno - 1]]
        text += [line.partition("  #")[2] for line in lines[node.lineno - 1 : node.end_lineno]]
        match below:
            case ast.Expr(value=ast.Constant(value=str(docstring))):
                text.append(docstring)
        nodes.append(node)
        texts.append(" ".join(" ".join(text).split()))
    for k in reversed(range(len(nodes) - 1)):
        if not texts[k] and nodes[k + 1].lineno - 1 == nodes[k].end_lineno:
            texts[k] = texts[k + 1]
    for k in range(1, len(nodes)):
        if not texts[k] and nodes[k].lineno - 1 == nodes[k - 1].end_lineno:
            texts[k] = texts[k - 1]
    names = [
        ast.unparse(node.target if isinstance(node, ast.AnnAssign) else node.targets[0]) for node in nodes
    ]
    return [
        (name, text)
        for name, text, node in zip(names, texts, nodes, strict=True)
        if node.value is not None and is_numeric(node.value)
    ]


def test_a_numeric_constant_has_a_reason() -> None:
    modules = {str(path.relative_to(PACKAGE)): path for path in sorted(PACKAGE.rglob("*.py"))}
    stated = {
        f"{name}: {constant}": text
        for name, path in modules.items()
        if not name.startswith(UNREAD)
        for constant, text in statements(path.read_text("utf-8"))
    }
    assert len(stated) > 1000
    assert {name: text for name, text in stated.items() if not REASON.search(text)} == {}


def test_statements_are_read_from_comments_and_docstrings() -> None:
    source = (
        "# Before; arbitrary\nA = 1\nB = -2.0  # On the line\nC, D = 3, (4, 5)\nE = np.linspace(0.0, 1.0)\n"
        '"""Below."""\n\nF = 6\nG = "text"\nH = f(1)\n'
    )
    assert statements(source) == [
        ("A", "Before; arbitrary"),
        ("B", "On the line"),
        ("(C, D)", "Below."),
        ("E", "Below."),
        ("F", ""),
    ]
