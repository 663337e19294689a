"""The worker of the page in Node: it maps states to frames, as in a browser."""

import json
import subprocess
from pathlib import Path
from typing import Any, Self

import numpy as np

from printhammer.studio.bundle import merged
from printhammer.studio.live import content_of
from printhammer.studio.shelf import Shelf

HOST = """
const { readFileSync } = require("node:fs");
const { createInterface } = require("node:readline");
const { gunzipSync } = require("node:zlib");
const content = JSON.parse(readFileSync(process.env.CONTENT, "utf-8"));
const plain = (_key, value) => (ArrayBuffer.isView(value) ? Array.from(value, Number) : value);
globalThis.postMessage = (message) => {
  if (!message.going) console.log(JSON.stringify(message, plain));
};
globalThis.onmessage = null;
"""

SERVE = """
onmessage({ data: { limits: { ...content.limits, ...content.sentences } } });
const unpacked = (text) => new WebAssembly.Module(gunzipSync(Buffer.from(text, "base64")));
const modules = content.modules.map(unpacked);
for (const name of content.names) {
  for (const [quantity, index] of Object.entries(content.hammers[name].modules)) {
    const hammer = { ...content.hammers[name], quantity, circuit: quantity === "voltage" };
    onmessage({ data: { kernel: `${name}, ${quantity}`, module: modules[index], hammer } });
  }
}
createInterface({ input: process.stdin }).on("line", (line) => onmessage({ data: JSON.parse(line) }));
"""


class Engine:
    """The worker of a page with the shipped hammers."""

    def __init__(self, shelf: Shelf, folder: Path) -> None:
        content = folder / "content.json"
        whole = content_of(shelf)
        self._pulses = {name: hammer["described"]["waveform"] for name, hammer in whole["hammers"].items()}
        content.write_text(json.dumps(whole), "utf-8")
        script = folder / "worker.js"
        script.write_text(HOST + merged("engine/worker.js") + SERVE, "utf-8")
        self._process = subprocess.Popen(
            ["node", str(script)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={"CONTENT": str(content)},
        )
        self._number = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        assert self._process.wait(30) == 0

    def work(self, name: str, state: dict[str, Any], **more: Any) -> list[dict[str, Any]]:
        """Return the frames of a job for a state, including intermediate frames; their `data` as arrays.

        A rejected state gives one frame with the key `refusal`.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._number += 1
        wave = state["waveform"] or self._pulses[state["hammer"]]
        kernel = f"{state['hammer']}, {wave['quantity']}"
        message = {"number": self._number, "work": name, "state": state, "kernel": kernel, **more}
        print(json.dumps(message), file=self._process.stdin, flush=True)
        frames = []
        while True:
            reply = json.loads(self._process.stdout.readline())
            if "reason" in reply:
                return [{"refusal": reply["reason"]}]
            frames += [reply["frame"]] if "frame" in reply else reply["frames"]
            if "frames" in reply:
                break
        for frame in frames:
            frame["data"] = {
                key: np.array([np.nan if value is None else value for value in values])
                for key, values in frame.get("data", {}).items()
            }
        return frames
