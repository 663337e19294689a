"""Draw the measured tables of learning: pictures of `docs/howto/learning.md`.

Run ``.venv/bin/python docs/measure/drawings.py``. ``--curves FILE`` draws the fraction of units that
print all dots, ``--tolerance-curves FILE`` the dots within limits against the spread of the production,
``--parts FILE`` the contributions of driver, table, learning and feedback.
"""

import argparse
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

from learning import ASKED, SHARES
from measured import Measured, read


def at_asked(table: Measured) -> str:
    """Format the rate of a table for the caption of a picture."""
    return f"{ASKED * table.settings['safe_rate']:,.0f} Hz"


def draw_ways(ax: Any, looks: dict[str, tuple[str, str, str]], points: list[tuple[Any, ...]]) -> None:
    """Draw one line per strategy, with colour, line and marker of `looks`, from (x, strategy, %) tuples."""
    for way, (colour, line, mark) in looks.items():
        ax.plot(
            *zip(*((x, y) for x, name, y in points if name == way), strict=True),
            color=colour,
            linestyle=line,
            marker=mark,
            markersize=4,
            label=way,
        )
    ax.set_ylim(-3.0, 103.0)
    ax.margins(x=0.05)
    small = import_module("printhammer.figures.elements.style").SMALL
    ax.legend(fontsize=small, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


def tolerance_curves(path: Path) -> None:
    """Draw the measured fraction of dots within limits against the spread of the production."""
    style = import_module("printhammer.figures.elements.style")
    looks = {
        "open loop, own": (style.MUTED, "-", "o"),
        "open loop, switch": (style.MUTED, "--", "o"),
        "table, switch": (style.YELLOW, "-", "s"),
        "robust table, switch": (style.ORANGE, "--", "^"),
        "learned from time, switch": (style.BLUE, "--", "D"),
        "learned from time and force, switch": (style.BLUE, "-", "D"),
    }
    table = read("learning-tolerance")
    looks |= {row[1]: (style.GREEN, "-", "v") for row in table.rows if str(row[1]).startswith("feedback")}
    with style.in_style():
        figure = style.new_figure(3.4)
        ax = figure.subplots()
        draw_ways(ax, looks, [(row[0], row[1], row[2]) for row in table.rows])
        ax.set_xlabel("Standard deviations of the production / stated ones")
        ax.set_ylabel("Dots within limits  [%]")
        style.foot(figure, " · ".join([*table.hammers, at_asked(table), f"{table.settings['units']} units"]))
        drawn = BytesIO()
        figure.savefig(drawn, dpi=110)
    path.write_bytes(drawn.getvalue())


def parts(path: Path) -> None:
    """Draw the measured contributions of driver, table, learning and feedback at 1.5 times the safe rate."""
    style = import_module("printhammer.figures.elements.style")
    looks = {
        "open loop, own": style.MUTED,
        "open loop, switch": style.MUTED,
        "robust table, switch": style.ORANGE,
        "learned from time, switch, 1000 dots": style.BLUE,
        "learned from time and force, switch, 1000 dots": style.BLUE,
        "feedback, sensor blinded": style.GREEN,
        "feedback": style.GREEN,
    }
    learned, seen = read("learning"), read("learning-feedback")
    shares = {str(row[1]): float(str(row[3])) for row in learned.rows if row[0] == ASKED}
    shares |= {str(row[1]): float(str(row[2])) for row in seen.rows if row[0] == ASKED}
    with style.in_style():
        figure = style.new_figure(2.8)
        ax = figure.subplots()
        ways = list(looks)[::-1]
        ax.barh(ways, [shares[way] for way in ways], color=[looks[way] for way in ways])
        for place, way in enumerate(ways):
            ax.annotate(
                f"{shares[way]:.0f} %",
                (shares[way], place),
                xytext=(-4, 0),
                textcoords="offset points",
                ha="right",
                va="center",
                color="white",
            )
        ax.set_xlim(0.0, 100.0)
        ax.set_xlabel("Dots within limits at 1.5 times the open-loop safe rate  [%]")
        counts = f"{learned.settings['units']} units, feedback {seen.settings['units']}"
        style.foot(figure, " · ".join([*learned.hammers, at_asked(learned), counts]))
        drawn = BytesIO()
        figure.savefig(drawn, dpi=110)
    path.write_bytes(drawn.getvalue())


def curves(path: Path) -> None:
    """Draw the measured fraction of units that print all dots, against rate, for each strategy."""
    style = import_module("printhammer.figures.elements.style")
    looks = {
        "open loop, own": (style.MUTED, "-", "o"),
        "table, own": (style.YELLOW, "--", "s"),
        "table, switch": (style.YELLOW, "-", "s"),
        "robust table, switch": (style.ORANGE, "-", "^"),
        "learned from time, switch, 1000 dots": (style.BLUE, "--", "D"),
        "learned from time and force, switch, 1000 dots": (style.BLUE, "-", "D"),
        "feedback, sensor blinded": (style.GREEN, "--", "v"),
        "feedback": (style.GREEN, "-", "v"),
    }
    learned, seen = read("learning"), read("learning-feedback")
    points = [(row[0], row[1], 100.0 * row[4] / row[2]) for row in learned.rows]
    points += [(row[0], row[1], 100.0 * row[3] / seen.settings["units"]) for row in seen.rows]
    with style.in_style():
        figure = style.new_figure(3.6)
        ax = figure.subplots()
        draw_ways(ax, looks, points)
        ax.set_xticks(SHARES)
        ax.set_xlabel("Rate / open-loop safe rate of the nominal hammer")
        ax.set_ylabel("Units that print all dots  [%]")
        sizes = f"{learned.settings['units']} units, {min(row[2] for row in learned.rows)} of some strategies"
        style.foot(figure, f"{', '.join(learned.hammers)} · {sizes}, feedback {seen.settings['units']}")
        drawn = BytesIO()
        figure.savefig(drawn, dpi=110)
    path.write_bytes(drawn.getvalue())


def main() -> None:
    """Draw the requested pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--curves", type=Path)
    parser.add_argument("--tolerance-curves", type=Path)
    parser.add_argument("--parts", type=Path)
    asked = parser.parse_args()
    drawings = ((asked.curves, curves), (asked.tolerance_curves, tolerance_curves), (asked.parts, parts))
    for path, draw in drawings:
        if path is not None:
            draw(path)


if __name__ == "__main__":
    main()
