"""Measure the coverage of the final intervals of the commands in ``docs/howto/fitting.md``.

Run ``.venv/bin/python docs/measure/recipe.py``, which takes some 25 minutes. ``--labs N`` sets the
number of synthetic laboratories, whose seeds are 0 to N - 1.
"""

import argparse
import contextlib
import math
import re
import shlex
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from importlib import import_module
from io import StringIO
from pathlib import Path

import numpy as np
from measured import MOTION, ROOT, Cell, Column, write
from scipy.stats import beta
from studies.recovery import true_value

import printhammer as ph
from printhammer.identify.result import CONFIDENCE, student

PAGE = ROOT / "docs" / "howto" / "fitting.md"
GUESS = 1.15
"""Initial guess of the mass, as a fraction of the true mass."""


def recipe() -> list[list[str]]:
    """Return the commands of the page, without options for figures."""
    block = next(
        text for text in re.findall(r"```sh\n(.*?)```", PAGE.read_text("utf-8"), re.S) if "motion" in text
    )
    lines = [re.sub(r" --plot \S+", "", line) for line in block.splitlines() if line]
    return [shlex.split(line)[1:] for line in lines]


def run(arguments: list[str], folder: str) -> None:
    """Run a command of the program in a folder, silently and in this process."""
    with contextlib.chdir(folder), redirect_stdout(StringIO()), redirect_stderr(StringIO()) as said:
        try:
            import_module("printhammer.cli.main").main(arguments)
        except SystemExit as end:
            if end.code:
                raise RuntimeError(f"{shlex.join(arguments)}: {said.getvalue()}") from None


def laboratory(hammer: ph.Hammer, seed: int, commands: list[list[str]]) -> ph.Hammer:
    """Measure a hammer in one laboratory, and return the constants fitted by the commands of the page."""
    with tempfile.TemporaryDirectory() as folder:
        hammer.save(Path(folder) / "true.toml")
        hammer.replace("mass", GUESS * hammer.mass).save(Path(folder) / "base.toml")
        run(["measure", "all", "true.toml", "--out", ".", "--seed", str(seed)], folder)
        for command in commands:
            run(command, folder)
        return ph.load(Path(folder) / "hammer.toml")


def table(made: list[ph.Hammer], truth: ph.Hammer) -> list[list[Cell]]:
    """Return one row for each constant, and one row for all constants."""
    rows: list[list[Cell]] = []
    every = made[0].uncertainty
    keys = every.keys if every is not None else ()
    total = 0
    for key in keys:
        true = true_value(truth, key)
        errors = np.array([one.uncertainty.error(key) for one in made if one.uncertainty is not None])
        off = np.array([one.constants[key].si - true for one in made]) / errors
        held = int((np.abs(off) <= student(math.inf)).sum())
        total += held
        share = 100.0 * float(np.median(errors)) / true
        rows.append(
            [f"`{key}`", f"{held} of {len(made)}", _between(held, len(made)), share, float(off.mean())]
        )
    rows.append(["all", f"{total} of {len(made) * len(keys)}", None, None, None])
    return rows


def _between(held: int, count: int) -> str:
    """Return the 95 % Clopper-Pearson interval of the fraction of intervals that contain the true value."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = beta.ppf(tail, held, count - held + 1) if held else 0.0
    high = beta.ppf(1.0 - tail, held + 1, count - held) if held < count else 1.0
    return f"{100.0 * low:.1f} to {100.0 * high:.1f}"


def main() -> None:
    """Measure the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--labs", type=int, default=100)
    options = parser.parse_args()
    truth, commands = ph.load("hendriks-1983"), recipe()
    made = []
    for seed in range(options.labs):
        made.append(laboratory(truth, seed, commands))
        print(f"laboratory {seed}", flush=True)
    columns = [
        Column(name="constant"),
        Column(name="intervals that hold"),
        Column(name="their share, 95 % interval", unit="%"),
        Column(name="standard error", unit="%", format=".2g"),
        Column(name="mean error in standard errors", format="+.2f"),
    ]
    rooms = (*MOTION, "identify", "studies/recovery")
    write("recipe", columns, table(made, truth), {"laboratories": options.labs}, rooms)


if __name__ == "__main__":
    main()
