"""Pages of text, tables and figures, laid out with matplotlib alone: what the PDF of a report is made of.

Lengths are in points from the upper left corner of an A4 page.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from printhammer.figures.elements.style import INK, MUTED, ORANGE, TINY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.backends.backend_pdf import PdfPages
    from matplotlib.figure import Figure

PAGE: Final = (595.0, 842.0)
MARGIN: Final = 56.0
WIDTH: Final = PAGE[0] - 2.0 * MARGIN
SANS: Final = "DejaVu Sans"
SERIF: Final = "DejaVu Serif"
LINE: Final = "#d0cdc6"

_FOOT: Final = 34.0
_LEADING: Final = 1.38
_INCH: Final = 72.0


@dataclass(frozen=True)
class Words:
    """Text in one style.

    Attributes
    ----------
    text : str
        The text; it is broken into lines.
    size : float
        Size of the letters.
    color, family, weight : str
        As in matplotlib.
    """

    text: str
    size: float = 8.0
    color: str = INK
    family: str = SANS
    weight: str = "normal"

    def lines(self, width: float) -> list[str]:
        """Break the text into lines of a width; a word wider than that is broken too."""
        space = self._width(" ")
        lines, line, used = [], "", 0.0
        for word in (part for whole in self.text.split(" ") for part in self._parts(whole, width)):
            long = self._width(word)
            if line and used + space + long > width:
                lines.append(line)
                line, used = word, long
            else:
                line, used = (f"{line} {word}", used + space + long) if line else (word, long)
        return [*lines, line] if line else lines

    def height(self, width: float) -> float:
        """Return the height of the text in lines of a width."""
        return len(self.lines(width)) * self.leading

    @property
    def leading(self) -> float:
        """Way from one line to the next."""
        return _LEADING * self.size

    def _parts(self, word: str, width: float) -> list[str]:
        if self._width(word) <= width:
            return [word]
        most = max(1, int(len(word) * width / self._width(word)) - 1)
        return [word[i : i + most] for i in range(0, len(word), most)]

    def _width(self, text: str) -> float:
        return _width_of(text, self.size, self.family, self.weight)


@lru_cache(maxsize=65536)
def _width_of(text: str, size: float, family: str, weight: str) -> float:
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family=family, weight=weight, size=size)
    width, _, _ = text_to_path.get_text_width_height_descent(text, font, ismath=False)
    return float(width)


class Sheet:
    """A document that is written from top to bottom; a new page begins where one is full.

    Parameters
    ----------
    pdf : PdfPages
        Where pages go.
    foot : str
        Written at the foot of each page, beside its number.
    """

    def __init__(self, pdf: PdfPages, foot: str) -> None:
        self._pdf = pdf
        self._foot = foot
        self._figure: Figure | None = None
        self.number = 0
        self.y = MARGIN

    def page(self, figure: Figure | None = None) -> Figure:
        """Begin a page, on a figure that becomes one or on an empty one."""
        from matplotlib.figure import Figure

        self.close()
        self._figure = Figure(figsize=(PAGE[0] / _INCH, PAGE[1] / _INCH)) if figure is None else figure
        self.number += 1
        self.y = MARGIN
        return self._figure

    def close(self) -> None:
        """End the page."""
        if self._figure is not None:
            foot = PAGE[1] - _FOOT
            self.put(Words(self._foot, 7.0, MUTED), MARGIN, foot)
            self.put(Words(str(self.number), 7.0, MUTED), MARGIN + WIDTH, foot, ha="right")
            self._pdf.savefig(self._figure)  # type: ignore[no-untyped-call]
            self._figure = None

    def put(self, words: Words, x: float, y: float, **options: Any) -> None:
        """Write one line with its upper edge at a place."""
        self._now.text(
            x / PAGE[0],
            1.0 - (y + words.size) / PAGE[1],
            words.text,
            fontsize=words.size,
            color=words.color,
            family=words.family,
            weight=words.weight,
            va="baseline",
            parse_math=False,
            in_layout=False,
            **options,
        )

    def box(self, x: float, y: float, width: float, height: float, color: str) -> None:
        """Fill a rectangle, its upper left corner at a place."""
        from matplotlib.patches import Rectangle

        figure = self._now
        figure.add_artist(
            Rectangle(
                (x / PAGE[0], 1.0 - (y + height) / PAGE[1]),
                width / PAGE[0],
                height / PAGE[1],
                transform=figure.transFigure,
                facecolor=color,
                edgecolor="none",
                in_layout=False,
            )
        )

    def room(self, height: float) -> bool:
        """Begin a page unless there is room for a height; return whether one was begun."""
        if self._figure is not None and self.y + height <= PAGE[1] - MARGIN:
            return False
        self.page()
        return True

    def write(self, words: Words, *, x: float = MARGIN, width: float = WIDTH, after: float = 0.0) -> None:
        """Write text in lines of a width, over several pages if need be."""
        for line in words.lines(width):
            self.room(words.leading)
            self.put(Words(line, words.size, words.color, words.family, words.weight), x, self.y)
            self.y += words.leading
        self.y += after

    def heading(self, text: str, *, before: float = 22.0, keep: float = 90.0) -> None:
        """Write a heading that stays with what follows."""
        if not self.room(before + keep):
            self.y += before if self.y > MARGIN else 0.0
        self.write(Words(text, 15.0, family=SERIF, weight="bold"), after=6.0)

    def table(
        self,
        heads: Sequence[str],
        widths: Sequence[float],
        rows: Sequence[Sequence[Sequence[Words]]],
        *,
        size: float = 7.5,
    ) -> None:
        """Write a table, its heads again on each page.

        Parameters
        ----------
        heads : sequence of str
            Heads of the columns.
        widths : sequence of float
            Widths of the columns in parts of the page.
        rows : sequence
            For each row its cells, each a sequence of `Words` below each other.
        size : float, optional
            Of the heads.
        """
        gap = 10.0
        ways = [part * WIDTH - gap for part in widths]
        places = [MARGIN + WIDTH * sum(widths[:i]) for i in range(len(widths))]
        first = True
        for cells in rows:
            height = max(
                sum(words.height(way) for words in cell) for cell, way in zip(cells, ways, strict=True)
            )
            if self.room(height + 30.0) or first:
                for head, place in zip(heads, places, strict=True):
                    self.put(Words(head, size, MUTED, weight="bold"), place, self.y)
                self.y += 1.6 * size
                first = False
            self.box(MARGIN, self.y, WIDTH, 0.5, LINE)
            top = self.y + 3.0
            for cell, place, way in zip(cells, places, ways, strict=True):
                y = top
                for words in cell:
                    for line in words.lines(way):
                        self.put(Words(line, words.size, words.color, words.family, words.weight), place, y)
                        y += words.leading
            self.y = top + height + 2.5

    def picture(self, figure: Figure, title: str) -> None:
        """Begin a page with a heading and a figure, which is given the size of the page."""
        width, height = (_INCH * float(side) for side in figure.get_size_inches())
        scale = min(1.0, WIDTH / width)
        remark, signed = figure.get_suptitle(), figure.get_supxlabel()
        figure.suptitle("")
        figure.supxlabel("")
        figure.set_size_inches(PAGE[0] / _INCH, PAGE[1] / _INCH)
        self.page(figure)
        self.write(Words(title, 15.0, family=SERIF, weight="bold"), after=10.0)
        for line in remark.splitlines():
            self.write(Words(line, 7.0, ORANGE))
        wide, tall = scale * width, scale * height
        engine: Any = figure.get_layout_engine()
        foot = 1.0 - (self.y + tall) / PAGE[1]
        engine.set(rect=(MARGIN / PAGE[0], foot, wide / PAGE[0], tall / PAGE[1]))
        self.y += tall + 4.0
        self._keys(figure)
        self.put(Words(signed, TINY, MUTED), MARGIN + WIDTH, self.y, ha="right")
        self.y += 16.0

    def _keys(self, figure: Figure) -> None:
        """Move the keys at the edge of a figure below it."""
        for key in list(figure.legends):
            handles, labels = key.legend_handles, [text.get_text() for text in key.get_texts()]
            key.remove()
            figure.legend(
                [handle for handle in handles if handle is not None],
                labels,
                loc="center left",
                bbox_to_anchor=(MARGIN / PAGE[0], 1.0 - (self.y + 5.0) / PAGE[1]),
                fontsize=TINY + 0.5,
                frameon=False,
                borderpad=0.0,
                handletextpad=0.4,
            ).set_in_layout(False)

    @property
    def _now(self) -> Figure:
        if self._figure is None:
            return self.page()
        return self._figure
