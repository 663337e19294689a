"""Run every verb on every shipped device other than the print hammer, and write a table of the outcomes.

Run ``.venv/bin/python docs/measure/devices.py``, which takes an hour of processor time, mostly for learning.
With names of devices or verbs as arguments, the script runs only these, prints their output and writes no
table. With ``--keep FOLDER``, the script stores the outcome of each cell in a file, and reuses these files.
Each cell is a run of the verb with its defaults, at a size that takes seconds except for learning, in a
separate folder; the table is rewritten after each verb.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import shlex
import signal
import sys
import tempfile
import time
import traceback
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from measured import MOTION, Cell, Column, write

import printhammer as ph
from printhammer.run.window import scaled_rate

# The program depends on every room, but the outcomes in this table depend only on the motions.
program = import_module("printhammer.cli.main").main

DEVICES = (
    "impact-wire",
    "dot-peen",
    "braille-embosser",
    "relay-5v",
    "pot-magnet",
    "pinball-coil",
    "pinball-flipper",
)

VERBS = {
    "run": "run {device}",
    "duty": "duty {device} --thermal-resistance '12 K/W' --limit '91 degC' --ambient '25 degC'",
    "energy": "energy {device} --dots 1",
    "feedback": "feedback {device}",
    "map": "map {device} --rates 12 --times 64",
    "strobe": "strobe {device} --period {period} --points 20 --no-verdict",
    "impact-time": "impact-time {device} --dots 10 --hammers 3",
    "quality": "quality {device} --rate {rate} --pattern 1101",
    "quality --safe-rate": "quality {device} --safe-rate",
    "print": "print I --hammer {device} --rate {rate} --out page.png",
    "bifurcation": "bifurcation {device} --values 4 --firings 30 --refine 0 --no-exponents",
    "basins --quench": "basins {device} --quench --gaps {gaps} --widths {widths}",
    "sweep": "sweep spec.toml --out members.csv",
    "tune": "tune {device} --rate {fast} --history 1 --reach 1 --no-brake --out table.csv",
    "dead-time": "dead-time {device} --voltage {voltage} --temperature '20 degC, 20 degC, 1'",
    "measure all": "measure all {device} --out bench",
    "learn": "learn {device} --history 1 --reach 1 --members 100 --table learned.csv",
}
"""Command line of each verb; the rates correspond to 300 and 1750 Hz for the paper's hammer."""

SPEC = """format = 1
hammer = "{device}"
[drive.train]
pulses = 3
[[axis]]
key = "drive.rate"
values = [{rates}]
[[axis]]
key = "mass"
values = [{masses}]
[outputs]
dots = ["struck", "flight_time", "peak_force"]
scalars = ["lost_dots"]
"""
"""Spec of the sweep: two rates and two masses."""

LIMIT = 60  # Processor time limit of a cell, s
LIMITS = {"learn": 1800}  # Processor time limits of verbs that take longer, s


class TooLongError(Exception):
    """Raised if a cell takes longer than `LIMIT`."""


def late(*_: object) -> NoReturn:
    """Interrupt a cell that exceeds the time limit."""
    raise TooLongError


def slots(device: str) -> dict[str, str]:
    """Return the rates, the period, the masses and the widths of the second pulse for a device, as text."""
    hammer = ph.load(device)
    rate = scaled_rate(hammer, 300.0)
    width, voltage = (float(getattr(hammer.waveform, name, 0.0)) for name in ("width", "voltage"))
    return {
        "rate": f"'{rate:g} Hz'",
        "fast": f"'{scaled_rate(hammer, 1750.0):g} Hz'",
        "rates": f'"{rate:g} Hz", "{2.0 * rate:g} Hz"',
        "masses": f'"{1e3 * hammer.mass:g} g", "{1.1e3 * hammer.mass:g} g"',
        "period": f"'{1e3 / rate:g} ms'",
        "gaps": f"'{0.2e3 / rate:g} ms, {0.3e3 / rate:g} ms, 4'",
        "widths": f"'{0.5e3 * width:g} ms, {1.5e3 * width:g} ms, 4'",
        "voltage": f"'{voltage:g} V, {voltage:g} V, 1'",
    }


def tried(verb: str, device: str) -> tuple[int | None, str]:
    """Run a cell and print its output; return the exit status (None after a timeout) and the last message."""
    texts = slots(device)
    arguments = shlex.split(VERBS[verb].format(device=device, **texts))
    out, err = io.StringIO(), io.StringIO()
    status: int | None = 0
    began, before = time.process_time(), os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        Path("spec.toml").write_text(SPEC.format(device=device, **texts), encoding="utf-8")
        signal.setitimer(signal.ITIMER_PROF, LIMITS.get(verb, LIMIT))
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                program(arguments)
        except SystemExit as end:
            status = int(end.code or 0)
        except TooLongError:
            status = None
        except Exception:  # noqa: BLE001 - no cell may end with a traceback
            status = -1
            traceback.print_exc(file=err)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            os.chdir(before)
    said = [line for line in err.getvalue().splitlines() if line.startswith("printhammer: ")]
    sentence = said[-1].removeprefix("printhammer: ") if said else err.getvalue()[-200:]
    head = f"##### {verb} {device}: {status}, {time.process_time() - began:.0f} s"
    print(f"\n{head}\n{out.getvalue()}{err.getvalue()}", flush=True)
    return status, sentence


WORDS = {0: "yes", 1: "in part", 2: "no", -1: "error"}
"""Text of a cell for each exit status."""


def outcome(verb: str, device: str, folder: str | None) -> tuple[int | None, str]:
    """Return the outcome of a cell as `tried` does, from its file in the folder if there is one."""
    path = None if folder is None else Path(folder) / f"{verb} {device}.json"
    if path is not None and path.is_file():
        status, sentence = json.loads(path.read_text(encoding="utf-8"))
        return status, sentence
    found = tried(verb, device)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(found), encoding="utf-8")
    return found


def main() -> None:
    """Run the cells; write the table if all cells were requested."""
    signal.signal(signal.SIGPROF, late)
    asked = sys.argv[1:]
    folder = asked.pop(asked.index("--keep") + 1) if "--keep" in asked else None
    asked = [word for word in asked if word != "--keep"]
    devices = [name for name in DEVICES if name in asked] or list(DEVICES)
    verbs = [name for name in VERBS if name in asked] or list(VERBS)
    rows: list[list[Cell]] = []
    for verb in verbs:
        cells = [outcome(verb, device, folder) for device in devices]
        reasons = [
            re.sub(rf"^{device}(\.toml)?: ", "", sentence)
            for device, (status, sentence) in zip(devices, cells, strict=True)
            if status in (1, 2)
        ]
        why = "; ".join(dict.fromkeys(reasons))
        too_long = f"over {LIMITS.get(verb, LIMIT)} s"
        rows.append([verb, *(WORDS.get(status, too_long) for status, _sentence in cells), why])
        if not asked:
            columns = [Column(name=name) for name in ("verb", *devices, "why not")]
            write("devices", columns, rows, {"limit": LIMIT}, MOTION, DEVICES)


if __name__ == "__main__":
    main()
