"""Modules of the page in Node; helpers only."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import printhammer as ph
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import SHAPES, Sampled, Waveform
from printhammer.studio import Shelf, live
from printhammer.studio.bundle import merged
from printhammer.studio.live import content_of

STATE: dict[str, Any] = {
    "hammer": "",
    "text": "",
    "constants": {},
    "waveform": None,
    "rate": 1200.0,
    "pulses": 9,
    "pattern": "",
    "overlap": "add",
    "low": 500.0,
    "high": 2000.0,
    "line": "",
    "views": ["motion", "map", "strobe"],
}
"""A state of the first hammer of a page."""


def drive_of(state: dict[str, Any], waveform: Waveform | None) -> Drive:
    """Return the drive of a state in Python; `waveform` is the pulse of its hammer."""
    fields = dict(state["waveform"] or {})
    shape = fields.pop("shape", None)
    if shape == "sine":
        return ph.SineForce(fields["amplitude"], state["rate"], phase=fields["phase"])
    if shape == "sampled":
        waveform = Sampled.from_samples(fields["times"], fields["values"], quantity=fields["quantity"])
    elif shape:
        waveform = SHAPES[shape](**fields)
    assert waveform is not None
    rate, overlap = state["rate"], state["overlap"]
    if state["pattern"]:
        at = [slot / rate for slot, mark in enumerate(state["pattern"]) if mark == "1"]
        return ph.PulseTrain(waveform, at=at, overlap=overlap)
    return ph.PulseTrain(waveform, rate=rate, pulses=state["pulses"], overlap=overlap)


_ASK = """
const { createInterface } = require("node:readline");
let shelf = null;
const asked = { %s };
createInterface({ input: process.stdin }).on("line", (line) => {
  const [what, ...words] = JSON.parse(line);
  if (what === "shelf") {
    const adopt = () => { throw new Refusal("no files"); };
    shelf = { ...words[0], readers: readersOf(words[0].limits, words[0].vocabulary), adopt };
    console.log("true");
    return;
  }
  try { console.log(JSON.stringify({ found: asked[what](...words) })); }
  catch (error) {
    if (!(error instanceof Refusal)) throw error;
    console.log(JSON.stringify({ refused: error.message }));
  }
});
"""


class NoModule:
    """Replacement for the WebAssembly module of a hammer, for tests that need only its description."""

    name = "none"

    def content(self) -> bytes:
        return b""


def without_modules(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write pages without WebAssembly modules, whose linking is slow."""
    monkeypatch.setattr(live, "page_module", lambda _laws: NoModule())


def evaluated(modules: Path, script: str) -> Any:
    """Run a script in Node that imports modules of the page; return the JSON that it writes."""
    command = ["node", "--input-type=module", "-"]
    done = subprocess.run(
        command, cwd=modules, input=script, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@contextmanager
def node(module: str, functions: str, shelf: Shelf) -> Iterator[Any]:
    """Run a module of the page; yield a function that calls one of `functions` by name with JSON."""
    with pytest.MonkeyPatch.context() as patch:
        without_modules(patch)
        content = content_of(shelf)
    command = ["node", "--eval", merged(module) + _ASK % functions]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdin is not None
    assert process.stdout is not None

    def ask(what: str, *words: Any) -> Any:
        assert process.stdin is not None
        assert process.stdout is not None
        print(json.dumps([what, *words]), file=process.stdin, flush=True)
        return json.loads(process.stdout.readline())

    try:
        ask("shelf", content)
        yield ask
    finally:
        process.stdin.close()
        process.stdout.close()
        assert process.wait(20) == 0
