import string
from contextlib import suppress
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image
from tests.errors import refused

import printhammer as ph
from printhammer.printing.dots.lettering import ADVANCE, broken, glyphs, lettered
from printhammer.printing.page.pattern import Pattern, pattern_from_toml, pattern_toml

FONTS = Path(mpl.get_data_path()) / "fonts" / "ttf"
PRINTABLE = "".join(chr(code) for code in range(32, 127))
E_ROWS = ["#####", "#....", "#....", "####.", "#....", "#....", "#####", ".....", "....."]


def marked(dots: np.ndarray) -> list[str]:
    return ["".join("#" if dot else "." for dot in row) for row in dots]


def shapes() -> st.SearchStrategy[tuple[int, int, int]]:
    return st.tuples(st.integers(1, 3), st.integers(1, 24), st.integers(1, 12))


patterns = st.builds(
    Pattern,
    st.text(min_size=1, max_size=20).filter(str.strip),
    shapes().flatmap(lambda shape: arrays(np.bool_, shape)).filter(np.any),
)


def test_the_font_has_every_printable_character_of_ascii() -> None:
    font = glyphs()
    assert set(font) == set(PRINTABLE)
    for mark, dots in font.items():
        assert dots.shape == (9, ADVANCE)
        assert not dots[:, -1].any(), "characters would touch"
        assert dots.any() == (mark != " ")
    assert len({dots.tobytes() for dots in font.values()}) == len(font)
    assert marked(font["E"][:, :-1]) == E_ROWS


def test_only_what_hangs_below_the_line_uses_the_two_lowest_wires() -> None:
    hanging = {mark for mark, dots in glyphs().items() if dots[7:].any()}
    assert hanging == set("gjpqy,_")
    for mark in string.ascii_uppercase + string.digits:
        assert glyphs()[mark][:7].any(axis=1).all(), mark


@given(st.text(PRINTABLE, min_size=1, max_size=30).filter(lambda text: text.strip()))
def test_a_text_is_its_characters_side_by_side(text: str) -> None:
    whole = lettered(text, columns=40)
    kept = text.rstrip()
    assert whole.shape == (1, 9, ADVANCE * len(kept))
    for place, mark in enumerate(kept):
        np.testing.assert_array_equal(whole[0, :, ADVANCE * place : ADVANCE * (place + 1)], glyphs()[mark])


@given(st.text("ab \n", min_size=1, max_size=60), st.integers(1, 12))
def test_lines_are_no_longer_than_allowed_and_nothing_but_blanks_gets_lost(text: str, columns: int) -> None:
    lines = broken(text, columns)
    assert all(len(line) <= columns for line in lines)
    assert "".join("".join(lines).split()) == "".join(text.split())
    short = all(len(line.rstrip()) <= columns for line in text.splitlines())
    if short:
        assert lines == [line.rstrip() for line in text.splitlines()]


def test_lines_are_broken_between_words_and_at_line_ends() -> None:
    pattern = Pattern.from_text("one two\n\nthree", columns=4)
    assert pattern.dots.shape == (5, 9, 4 * ADVANCE)
    assert broken("one two\n\nthree", 4) == ["one", "two", "", "thre", "e"]
    assert not pattern.dots[2].any()
    np.testing.assert_array_equal(pattern.dots[4, :, :ADVANCE], glyphs()["e"])


@pytest.mark.parametrize("wires", [18, 24])
@pytest.mark.parametrize("font", [None, FONTS / "DejaVuSerif.ttf", FONTS / "STIXGeneral.ttf"])
def test_a_truetype_font_fills_the_wires(wires: int, font: Path | None) -> None:
    tall = Pattern.from_text(PRINTABLE, wires, font=font, columns=100)
    assert tall.dots.shape[:2] == (1, wires)
    # The next larger size would not fit, so that the characters reach all wires but one or two.
    assert tall.dots.any(axis=(0, 2)).sum() >= wires - 2
    same = Pattern.from_text("aXa", wires, font=font)
    half = Pattern.from_text("a", wires, font=font).slots
    np.testing.assert_array_equal(same.dots[:, :, :half], same.dots[:, :, -half:])


def test_the_default_font_of_more_wires_is_monospaced() -> None:
    widths = {Pattern.from_text(mark, 24).slots for mark in string.ascii_letters}
    assert len(widths) == 1


@pytest.mark.parametrize(
    ("text", "options", "key"),
    [
        ("", {}, "text"),
        (" \n\t ", {}, "text"),
        ("naïve café", {}, "text"),
        ("a\tb", {}, "text"),
        ("".join(chr(code) for code in range(0x400, 0x420)), {}, "text"),
        ("漢a字", {"wires": 24}, "text"),
        ("a", {"columns": 0}, "columns"),
        ("a", {"wires": 0}, "wires"),
        ("a", {"wires": 10_000}, "wires"),
        ("a", {"wires": 24, "font": "nowhere.ttf"}, None),
        ("a", {"wires": 1, "font": FONTS / "DejaVuSans.ttf"}, "wires"),
    ],
)
def test_a_text_that_cannot_be_printed_is_refused(
    text: str, options: dict[str, object], key: str | None
) -> None:
    with refused(key):
        Pattern.from_text(text, **options)


def test_a_file_that_is_no_font_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "font.ttf"
    path.write_bytes(b"not a font")
    with refused(None, file="font.ttf"):
        Pattern.from_text("a", 18, font=path)


@given(patterns)
def test_a_pattern_file_is_read_back_as_it_was_written(pattern: Pattern) -> None:
    assert Pattern(*pattern_from_toml(pattern_toml(pattern.name, pattern.dots))) == pattern


@pytest.mark.parametrize("suffix", [".toml", ".png", ".pbm", ".bmp"])
def test_files_of_every_kind_are_read_back(tmp_path: Path, suffix: str) -> None:
    pattern = Pattern.from_text("Two\nlines", 18)
    path = tmp_path / f"two{suffix}"
    pattern.save(path)
    kept = Pattern.load(path, 18)
    np.testing.assert_array_equal(kept.dots, pattern.dots)
    assert kept.name == ("Two lines" if suffix == ".toml" else "two")


def test_dark_and_opaque_pixels_are_dots_and_missing_rows_are_empty(tmp_path: Path) -> None:
    pixels = np.zeros((11, 4, 4), np.uint8)
    pixels[:, :, :3] = 255
    pixels[:, :, 3] = 255
    pixels[0, 1, :3] = 40
    pixels[10, 2] = (0, 0, 0, 255)
    pixels[5, 0] = (0, 0, 0, 0)
    path = tmp_path / "drawing.png"
    Image.fromarray(pixels, "RGBA").save(path)
    pattern = Pattern.load(path)
    assert pattern.dots.shape == (2, 9, 4)
    assert np.argwhere(pattern.dots).tolist() == [[0, 0, 1], [1, 1, 2]]


GOOD = 'format = 1\nname = "x"\nwires = 2\nrows = ["#.", ".#"]\n'


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("format = 1", "format = 2", "format"),
        ("format = 1", "format = true", "format"),
        ("format = 1\n", "", "format"),
        ("wires = 2\n", "", "wires"),
        ("wires = 2", "wires = 3", "rows"),
        ("wires = 2", "wires = 0", "wires"),
        ("wires = 2", "wires = true", "wires"),
        ("wires = 2", 'wires = "2"', "wires"),
        ('name = "x"', 'name = ""', "name"),
        ('name = "x"', "name = 3", "name"),
        ("rows = [", "colour = 1\nrows = [", "colour"),
        ('"#."', '"#"', "rows"),
        ('"#."', '"#x"', "rows"),
        ('"#."', "5", "rows"),
        ('["#.", ".#"]', "[]", "rows"),
        ('["#.", ".#"]', '["..", ".."]', "dots"),
        ("rows", "rows\n", None),
    ],
)
def test_a_bad_pattern_file_is_refused(tmp_path: Path, old: str, new: str, key: str | None) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(GOOD.replace(old, new), "utf-8")
    with refused(key):
        Pattern.load(path)


@given(st.integers(0, len(GOOD) - 1), st.characters(codec="utf-8"))
def test_a_changed_pattern_file_is_read_or_refused_in_a_sentence(place: int, mark: str) -> None:
    text = GOOD[:place] + mark + GOOD[place + 1 :]
    with suppress(ph.InputError):
        name, dots = pattern_from_toml(text)
        assert name.strip()
        assert dots.ndim == 3
        assert dots.size == 4


@pytest.mark.parametrize(
    ("name", "content", "key"),
    [
        ("a.toml", b"\xff\xfe", None),
        ("a.txt", b"", None),
        ("a.png", b"no picture", None),
        ("a.pbm", b"P4\n10", None),
        ("missing.png", None, None),
        ("missing.toml", None, None),
    ],
)
def test_a_file_that_is_no_pattern_is_refused(
    tmp_path: Path, name: str, content: bytes | None, key: str | None
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with refused(key) as caught:
        Pattern.load(path)
    assert str(path) in str(caught.value)


def test_the_number_of_wires_of_a_file_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "two.toml"
    path.write_text(GOOD, "utf-8")
    assert Pattern.load(path, 2).wires == 2
    with refused("wires"):
        Pattern.load(path, 9)


def test_what_cannot_be_written_is_refused_and_what_is_there_stays(tmp_path: Path) -> None:
    path = tmp_path / "kept.gif"
    path.write_text("kept", "utf-8")
    with refused(None, file="kept.gif"):
        Pattern.from_text("a").save(path)
    assert path.read_text("utf-8") == "kept"


def test_arrays_that_are_no_pattern_are_refused() -> None:
    for dots in (np.zeros((9, 5)), np.ones(5), np.ones((1, 2000, 2)), np.ones((2, 1, 1, 1))):
        with refused("dots"):
            Pattern("x", dots)
    pattern = Pattern("x", np.ones((9, 5)))
    assert (pattern.lines, pattern.wires, pattern.slots, pattern.wanted) == (1, 9, 5, 45)
    assert pattern == Pattern("x", np.ones((1, 9, 5)))
    assert hash(pattern) == hash(Pattern("x", np.ones((1, 9, 5))))
    with pytest.raises(ValueError, match="read-only"):
        pattern.dots[0, 0, 0] = False
