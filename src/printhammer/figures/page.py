"""Figure of a printed page: dots on paper, request, placement errors, and the region of largest error.

Ink on paper is rendered into an array, as round dots of given optical densities.

Densities of overlapping dots add. The rim of a dot is soft over a tenth of its diameter, or 1.5 pixels if
that is more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, get_args

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from printhammer.errors import InputError
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import dots, heading, note
from printhammer.figures.elements.scales import Scale
from printhammer.figures.elements.style import sign, styled
from printhammer.printing.page.page import Page
from printhammer.support.arrays import FloatArray

PAPER: Final = (252, 250, 243)
"""RGB colour of the paper; arbitrary."""

INK: Final = (24, 24, 38)
"""RGB colour of fully opaque ink; arbitrary."""

MOST_PIXELS: Final = 24_000_000
"""Number of pixels above which a sheet of paper is rendered more coarsely; arbitrary."""

_SOFT: Final = 0.1  # Width of the soft rim of a dot, as a fraction of its diameter; arbitrary
_PIXELS: Final = 1.5  # Smallest width of the soft rim, pixels; arbitrary
_TOGETHER: Final = 1_000_000  # Pixels computed at once, which bounds the memory; arbitrary


@dataclass(frozen=True)
class Sheet:
    """Rectangle of paper to draw: coordinates of its edges [m], measured to the right and downward."""

    left: float
    right: float
    top: float
    bottom: float

    @property
    def width(self) -> float:
        """Width of the rectangle, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height of the rectangle, m."""
        return self.bottom - self.top

    def pixels(self, finest: float) -> tuple[float, int, int]:
        """Return the pixel size [m], at least `finest`, and the numbers of rows and columns of pixels."""
        size = max(finest, (self.width * self.height / MOST_PIXELS) ** 0.5)
        return size, max(1, round(self.height / size)), max(1, round(self.width / size))


def inked(
    sheet: Sheet, across: FloatArray, down: FloatArray, density: FloatArray, diameter: float, finest: float
) -> FloatArray:
    """Render dots; return optical densities of the paper's pixels from the top left, shape (rows, columns).

    The dots are given by centres [m], densities and a common diameter [m], and clipped at the edges of the
    sheet. The pixel size is at least `finest` [m].
    """
    size, rows, columns = sheet.pixels(finest)
    radius = 0.5 * diameter / size
    soft = max(2.0 * radius * _SOFT, _PIXELS)
    reach = int(np.ceil(radius + soft)) + 1
    x, y = (across - sheet.left) / size - 0.5, (down - sheet.top) / size - 0.5
    on = (x > -reach) & (x < columns + reach) & (y > -reach) & (y < rows + reach)
    # A border of two dot radii, rounded up, avoids clipping each dot.
    border = 2 * reach + 1
    x, y, ink = x[on] + border, y[on] + border, density[on]
    wide = columns + 2 * border
    whole = np.zeros((rows + 2 * border) * wide)
    near = np.arange(-reach, reach + 1)
    together = max(1, _TOGETHER // near.size**2)
    for first in range(0, ink.size, together):
        part = slice(first, first + together)
        column, row = np.floor(x[part]).astype(np.int64), np.floor(y[part]).astype(np.int64)
        from_x = near + (column - x[part])[:, np.newaxis]
        from_y = near + (row - y[part])[:, np.newaxis]
        far = np.sqrt(from_x[:, np.newaxis, :] ** 2 + from_y[:, :, np.newaxis] ** 2)
        cover = np.clip((radius - far) / soft + 0.5, 0.0, 1.0) * ink[part, np.newaxis, np.newaxis]
        place = (row * wide + column)[:, np.newaxis, np.newaxis] + (near[:, np.newaxis] * wide + near)
        np.add.at(whole, place.reshape(-1), cover.reshape(-1))
    return whole.reshape(-1, wide)[border : border + rows, border : border + columns]


def coloured(density: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Convert optical densities to the RGB image of ink on paper, shape (rows, columns, 3)."""
    back = np.exp(-math.log(10.0) * np.asarray(density, np.float32))[..., np.newaxis]
    ink, paper = np.array(INK, np.float32), np.array(PAPER, np.float32)
    return np.asarray(ink + back * (paper - ink) + np.float32(0.5), np.uint8)


View = Literal["page", "zoom", "sheet"]
VIEWS: Final = get_args(View)
"""Views of a page: the full page, the region of largest error, or the paper alone at true size."""

ZOOM_SHAPE: Final = 3.5
"""Width of the region of largest error, in units of the height of the column of wires; arbitrary."""

_WIDTH: Final = 7.6  # Width of the figure, inches; arbitrary
_SIDE: Final = 0.2  # Margin at either side, inches; arbitrary
_LABEL: Final = 0.24  # Height of a heading, inches; arbitrary
_GAP: Final = 0.1  # Gap between panels, inches; arbitrary
_BESIDE: Final = 0.15  # Gap between panels side by side, inches; arbitrary
_UPRIGHT: Final = 0.5  # Ratio of height to width above which panels are side by side; arbitrary
_BAR: Final = 1.5  # Length of the colour bar, inches; arbitrary
_LEAST_MARK: Final = 1.8  # Smallest size of a mark, points; arbitrary
_NEUTRAL: Final = "#c6ccd1"
_TALLEST: Final = 4.5  # Largest height of a panel, inches; arbitrary
_LARGEST: Final = 0.1  # Largest distance between slots in the figure, inches; arbitrary
_FOOT: Final = 0.62  # Height of the text at the foot, inches; arbitrary
_INCH: Final = 25.4e-3  # An inch, m
_FINENESS: Final = 10  # Pixels per slot of a page; arbitrary
_ACROSS: Final = 2000  # Largest number of pixels across; arbitrary
_ZOOM_FINENESS: Final = 50  # Pixels per slot of the region of largest error; arbitrary
_SHEET_FINENESS: Final = 16  # Pixels per slot of a sheet of paper at true size; arbitrary
_MICRONS: Final = Scale("Placement error", "m", "um")


@styled
def plot(page: Page, view: View = "page") -> Figure:
    """Draw a printed page: the print, the request, their difference, and the region of largest error.

    In the difference, the colour of a dot shows its placement error, and crosses mark lost dots. In the
    region of largest error, rings mark requested dots, and crosses lost dots.

    Parameters
    ----------
    view : str, optional
        "page": from the top, the print, the request, the difference, and the region of largest error; "zoom":
        the region of largest error alone; "sheet": the paper alone, at true size.
    """
    if view == "sheet":
        return _sheet_alone(page)
    if view == "zoom":
        return _zoom_alone(page)
    if view != "page":
        raise InputError.of("view", view, f"one of {', '.join(VIEWS)}")
    sheet, place = whole_sheet(page), zoomed_sheet(page)
    # Panels are side by side if the paper is upright, else one below the other.
    beside = sheet.height > _UPRIGHT * sheet.width
    wide = _WIDTH - 2.0 * _SIDE
    each = (wide - 2.0 * _BESIDE) / 3.0 if beside else wide
    scale = min(each / sheet.width, _TALLEST / sheet.height, _LARGEST / page.head.pitch)
    strip = scale * sheet.height
    sheet = replace(sheet, right=sheet.left + each / scale)
    zoom = wide * place.height / place.width
    rows = 1 if beside else 3
    height = rows * (_LABEL + strip + _GAP) + (1.5 + beside) * _LABEL + zoom + _FOOT + 0.1
    figure, top = style.new_figure(height, _WIDTH, "none"), height - 0.1
    if beside:
        top -= _LABEL
        look: dict[str, Any] = {"fontsize": style.SMALL, "color": style.MUTED, "va": "center"}
        figure.text(_SIDE / _WIDTH, (top + 0.1) / height, _printed_title(page), **look)
    axes = []
    for number, name in enumerate(("Printed" if beside else _printed_title(page), "Wanted", "Difference")):
        if number == 0 or not beside:
            top -= _LABEL
        left = _SIDE + (number * (each + _BESIDE) if beside else 0.0)
        axes.append(_panel(figure, sheet, top, strip, name, left))
        if number == 2 or not beside:
            top -= strip + _GAP
    fine = max(page.head.pitch / _FINENESS, sheet.width / _ACROSS)
    _paper(axes[0], sheet, page, _dots(page), fine)
    full = np.full(page.line.shape, page.head.density)
    _paper(axes[1], sheet, page, (*page.intended, full), fine)
    _differences(figure, axes[2], page, beside * _LABEL)
    top -= 1.5 * _LABEL
    _zoom(_panel(figure, place, top, zoom, _zoom_title(page)), place, page)
    _sign(figure, page)
    return figure


def whole_sheet(page: Page) -> Sheet:
    """Return the rectangle of paper with all print lines of a page and a margin."""
    head, pattern = page.head, page.pattern
    margin = 2.0 * head.wire_diameter
    across = (pattern.slots - 1) * head.pitch
    down = (pattern.lines - 1) * head.line_pitch + (head.wires - 1) * head.wire_pitch
    return Sheet(-margin, across + margin, -margin, down + margin)


def zoom_slots(page: Page) -> int:
    """Return the width of the region of largest error, in slots."""
    return max(1, round(ZOOM_SHAPE * page.head.wires * page.head.wire_pitch / page.head.pitch))


def zoomed_sheet(page: Page) -> Sheet:
    """Return the rectangle of paper around the region of largest error of a page."""
    head, slots = page.head, zoom_slots(page)
    line, first = page.worst_place(slots)
    top = line * head.line_pitch
    last = first + slots - 1
    margin = 1.2 * head.pitch
    return Sheet(
        first * head.pitch - margin,
        last * head.pitch + margin,
        top - margin,
        top + (head.wires - 1) * head.wire_pitch + margin,
    )


def _panel(figure: Figure, sheet: Sheet, top: float, height: float, title: str, left: float = _SIDE) -> Axes:
    """Add titled axes for a sheet of paper to a figure; height, top and left edge in inches."""
    width, whole = figure.get_size_inches()
    wide = height * sheet.width / sheet.height
    ax = figure.add_axes((left / width, (top - height) / whole, wide / width, height / whole))
    ax.set_xlim(sheet.left, sheet.right)
    ax.set_ylim(sheet.bottom, sheet.top)
    ax.set_xticks([])
    ax.set_yticks([])
    for spine in ax.spines.values():
        spine.set_color(style.FAINT)
    heading(ax, title, color=style.MUTED, pad=3.0)
    return ax


def _printed_title(page: Page) -> str:
    return f"Printed at {page.rate:.6g} Hz, {page.strategy}, carriage at {page.speed:.3g} m/s"


def _zoom_title(page: Page) -> str:
    line, first = page.worst_place(zoom_slots(page))
    last = min(first + zoom_slots(page), page.pattern.slots)
    return (
        f"Region of largest error: print line {line + 1}, slots {first + 1} to {last} (rings: requested dots)"
    )


def _dots(page: Page) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return positions across and down [m], and optical densities, of all dots, extra contacts included."""
    printed, extra = (*page.places, page.density), (*page.extra_places, page.extra_density)
    across, down, density = (
        np.concatenate([values[page.printed], more]) for values, more in zip(printed, extra, strict=True)
    )
    return across, down, density


def _paper(ax: Axes, sheet: Sheet, page: Page, dots: tuple[FloatArray, ...], finest: float) -> None:
    """Draw a sheet of paper with dots; pixels are at least `finest` [m]."""
    across, down, density = dots
    picture = coloured(inked(sheet, across, down, density, page.head.wire_diameter, finest))
    extent = (sheet.left, sheet.right, sheet.bottom, sheet.top)
    ax.imshow(picture, extent=extent, aspect="auto", interpolation="antialiased")


def _discs(
    ax: Axes, across: FloatArray, down: FloatArray, diameter: float, **options: Any
) -> EllipseCollection:
    from matplotlib.collections import EllipseCollection

    size = np.full(across.shape, diameter)
    where = {"offsets": np.column_stack([across, down]), "offset_transform": ax.transData}
    discs = EllipseCollection(size, size, np.zeros(across.shape), units="xy", **where, **options)
    ax.add_collection(discs, autolim=False)
    return discs


def _in_points(ax: Axes, length: float) -> float:
    """Convert a length [m] on the paper to points in the figure."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    width, _height = figure.get_size_inches()
    left, right = ax.get_xlim()
    return float(72.0 * width * ax.get_position().width * length / (right - left))


def _differences(figure: Figure, ax: Axes, page: Page, above: float) -> None:
    """Draw the placement errors of a page in colours, lost dots as crosses, and a colour bar.

    `above` is an additional distance of the colour bar from the axes below it, inches.
    """
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    on, head, (across, down) = page.printed, page.head, page.places
    error = _MICRONS.shown(page.placement_error[on])
    # The scale covers at least the limits, so that negligible errors stay dark.
    bound = float(_MICRONS.shown(page.limits.arrival * page.speed))
    widest = max(float(np.abs(error).max(initial=0.0)), bound)
    colours = LinearSegmentedColormap.from_list("off", [style.BLUE, _NEUTRAL, style.ORANGE])
    off = {"array": error, "cmap": colours, "norm": Normalize(-widest, widest), "gid": "placement error"}
    discs = _discs(ax, across[on], down[on], head.wire_diameter, linewidths=0.0, **off)
    wanted_across, wanted_down = (part[page.lost] for part in page.intended)
    mark = max(_in_points(ax, head.wire_diameter), _LEAST_MARK)
    cross = {"marker": "x", "mew": 0.25 * mark, "gid": "lost"}
    dots(ax, wanted_across, wanted_down, 0.9 * mark, style.INK, **cross)
    width, whole = figure.get_size_inches()
    box = ax.get_position()
    left, bottom = (_WIDTH - _SIDE - _BAR - 0.75) / width, box.y1 + (0.06 + above) / whole
    bar_axes = figure.add_axes((left, bottom, _BAR / width, 0.09 / whole))
    bar = figure.colorbar(discs, cax=bar_axes, orientation="horizontal", ticks=[])
    bar.outline.set_visible(False)
    how = {"va": "center", "fontsize": style.TINY, "zorder": 3.0}
    note(bar_axes, f"−{widest:.3g} µm, early", (-0.02, 0.5), ha="right", **how)
    note(bar_axes, f"late, {widest:.3g} µm", (1.02, 0.5), ha="left", **how)


def _zoom(ax: Axes, sheet: Sheet, page: Page) -> None:
    head = page.head
    fine = max(head.pitch / _ZOOM_FINENESS, sheet.width / _ACROSS)
    _paper(ax, sheet, page, _dots(page), fine)
    across, down = page.intended
    reach = head.pitch
    near = (across > sheet.left - reach) & (across < sheet.right + reach)
    near &= (down > sheet.top - reach) & (down < sheet.bottom + reach)
    on, lost = near & page.printed, near & page.lost
    mark = _in_points(ax, head.wire_diameter)
    rings = {"facecolors": "none", "linewidths": min(style.THIN, 0.07 * mark)}
    _discs(ax, across[on], down[on], head.wire_diameter, edgecolors=style.BLUE, gid="wanted", **rings)
    _discs(ax, across[lost], down[lost], head.wire_diameter, edgecolors=style.ORANGE, gid="lost", **rings)
    dots(ax, across[lost], down[lost], 0.4 * mark, style.ORANGE, marker="x", mew=0.1 * mark)
    more = near[page.extra_of]
    extra_across, extra_down = (part[more] for part in page.extra_places)
    _discs(ax, extra_across, extra_down, head.wire_diameter, edgecolors=style.GREEN, gid="extra", **rings)


def _sign(figure: Figure, page: Page) -> None:
    """Write the hammer and the print quality at the foot of the figure of a page."""
    sign(figure, page.hammer)
    _width, whole = figure.get_size_inches()
    left = _SIDE / _WIDTH
    figure.text(left, 0.4 / whole, summary(page), fontsize=style.SMALL, color=style.INK, va="center")


def summary(page: Page) -> str:
    """Summarise the print quality of a page in one line."""
    lost, extra = int(page.lost.sum()), int(page.extra_contacts.sum())
    said = [f"{page.line.size} dots requested", f"{int(page.printed.sum())} printed", f"{lost} lost"]
    if not page.run.all():
        said.append(f"{int((~page.run).sum())} not run")
    said.append(f"{int(page.good.sum())} within limits")
    said.append(f"{extra} extra contacts")
    if page.printed.any():
        error = _MICRONS.shown(page.placement_error[page.printed])
        darkness = page.darkness[page.printed]
        said.append(f"placement ±{np.std(error):.3g} µm, worst {np.abs(error).max():.3g} µm")
        said.append(f"darkness {darkness.min():.2f} to {darkness.max():.2f}")
    return " · ".join(said)


def _zoom_alone(page: Page) -> Figure:
    place = zoomed_sheet(page)
    wide = _WIDTH - 2.0 * _SIDE
    height = wide * place.height / place.width
    figure = style.new_figure(height + 2.5 * _LABEL + _FOOT, _WIDTH, "none")
    title = f"{_printed_title(page)}\n{_zoom_title(page)}"
    _zoom(_panel(figure, place, _FOOT + height, height, title), place, page)
    _sign(figure, page)
    return figure


def _sheet_alone(page: Page) -> Figure:
    sheet = whole_sheet(page)
    figure = style.new_figure(sheet.height / _INCH, sheet.width / _INCH, "none")
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set_axis_off()
    ax.set_xlim(sheet.left, sheet.right)
    ax.set_ylim(sheet.bottom, sheet.top)
    _paper(ax, sheet, page, _dots(page), page.head.pitch / _SHEET_FINENESS)
    return figure
