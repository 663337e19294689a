"""Vague phrases are forbidden in docstrings, comments, help texts and pages.

A phrase is forbidden where a standard term says the same: "in parts of" for "as a fraction of", "Return what"
for the name of the object. Rooms and pages enter `ROOMS` and `PAGES` once they are free of them.
"""

import re
from pathlib import Path

import pytest

from printhammer.cli.main import MODULES, groups_of, verb_of

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src/printhammer"

ROOMS = (
    "chaos",
    "claims",
    "cli",
    "control/axes",
    "control/dead_time",
    "control/duty",
    "control/feedback",
    "control/impact_estimator",
    "control/impact_time",
    "control/learning",
    "control/least_work",
    "control/pulses",
    "control/recorded_impacts",
    "control/table",
    "control/thermal_limit",
    "derivatives",
    "drive",
    "errors",
    "figures",
    "hammer",
    "identify",
    "kernel/lanes",
    "kernel/methods",
    "kernel/model",
    "kernel/single",
    "kernel/variational",
    "maps",
    "parts",
    "printing",
    "report",
    "results",
    "run",
    "studio",
    "support",
    "sweep",
    "units",
)
STUDIES = tuple(sorted((ROOT / "studies").rglob("*.py")))
PAGES = (
    "README.md",
    *(str(page.relative_to(ROOT)) for page in sorted((ROOT / "docs").glob("*.md"))),
    *(str(page.relative_to(ROOT)) for page in sorted((ROOT / "docs/decisions").glob("*.md"))),
    *(str(page.relative_to(ROOT)) for page in sorted((ROOT / "docs/howto").glob("*.md"))),
    *(str(page.relative_to(ROOT)) for page in sorted((ROOT / "docs/tutorials").glob("*.md"))),
)
PHRASES = (
    r"Returns? what\b",
    r"in parts of\b",
    r"None if there is none",
    r"what (?:becomes?|has become|became) of",
    r"in the mean square\b",
    r"less the logarithm",
    r"less by so little",
    r"handed out\b",
    r"what (?:one|it) (?:is|has) (?:to|got)\b",
    r"where none is given",
    r"may be given repeatedly",
    r"by so (?:much|many|little)\b",
    r"all of several",
    r"(?:How|What|Which) \S+ (?:are|is) like\b",
)
FORBIDDEN = re.compile("|".join(PHRASES), re.IGNORECASE)
PRONOUNS = re.compile(
    r"\bthe latter\b|\bthe former (?:or|one)\b|\b(?:if|where) there is (?:none|one)\b|\bwithout one\b"
    r"|\b(?:the|an?|another) (?:\w+ )?one[.,;:)]|(?<!np\.)\bones\b"
)
"""Pronouns in place of a noun, which the reader has to look for in another clause."""

FIRST_WORDS = re.compile(
    r"(?:A|An|The|Of|How|What|When|Where|Which|Whether|Return|With|By|From|Its|Their|Them|It|Only|Other)\b"
)
"""First words of a help text that begins neither with the noun of its option nor with a verb."""


def flowing(text: str) -> str:
    """Return a text without line breaks, so that a phrase is found across two lines or two literals."""
    return " ".join(re.sub(r'"?\s*\n\s*(?:# ?|f?")?', " ", text).split())


def forbidden(path: Path, phrases: re.Pattern[str] = FORBIDDEN) -> list[str]:
    """Return the forbidden phrases in a file, each with its surroundings."""
    text = flowing(path.read_text("utf-8"))
    return [text[max(0, found.start() - 30) : found.end() + 30] for found in phrases.finditer(text)]


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_speaks_plainly(room: str) -> None:
    place = PACKAGE / room
    modules = sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]
    assert modules
    assert {str(module.relative_to(PACKAGE)): said for module in modules if (said := forbidden(module))} == {}


def test_studies_speak_plainly() -> None:
    assert {str(path.relative_to(ROOT)): said for path in STUDIES if (said := forbidden(path))} == {}


def test_pages_speak_plainly() -> None:
    assert {page: said for page in PAGES if (said := forbidden(ROOT / page))} == {}


def test_a_noun_is_named() -> None:
    modules = {str(path.relative_to(PACKAGE)): path for path in sorted(PACKAGE.rglob("*.py"))}
    pages = {page: ROOT / page for page in PAGES if not page.startswith("docs/decisions")}
    read = modules | pages
    assert {name: said for name, path in read.items() if (said := forbidden(path, PRONOUNS))} == {}


def test_a_phrase_is_found_across_lines(tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        '"""Compute the force in\n    parts of the limit."""\nx = ("Return"\n    " what")\n', "utf-8"
    )
    assert len(forbidden(module)) == 2


def test_help_texts_begin_with_a_noun_or_a_verb() -> None:
    helps = {
        f"{verb.name} {name}": option.help
        for verb in map(verb_of, MODULES)
        for name, option in {**verb.options, **verb.files}.items()
    } | {name: text for name, (text, _example) in groups_of(MODULES).items()}
    assert len(helps) > 400
    assert {name: text for name, text in helps.items() if FIRST_WORDS.match(text)} == {}
    assert {name: text for name, text in helps.items() if FORBIDDEN.search(text)} == {}
    assert {name: text for name, text in helps.items() if not re.fullmatch(r"[A-Z].*\.", text)} == {}


def test_heads_of_verbs_are_sentences_with_a_verb_of_the_field() -> None:
    heads = {verb.name: (verb.call.__doc__ or "").strip().split("\n")[0] for verb in map(verb_of, MODULES)}
    assert {name: head for name, head in heads.items() if not re.fullmatch(r"[A-Z].*\.", head)} == {}
    assert {name: head for name, head in heads.items() if re.match(r"(?:Tell|Let|Have|Get)\b", head)} == {}
