"""Hosts that call a WebAssembly kernel as Python calls machine code: wasmtime, and Node with call.mjs.

Helpers only; assertions are in the tests that use them.
"""

import base64
import json
import struct
import subprocess
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

import numpy as np

from printhammer.kernel.compile.signatures import RESULTS

LETTERS = {np.dtype(np.float64): "f", np.dtype(np.float32): "s", np.dtype(np.int64): "i"}
CALL = files("printhammer.kernel.compile.web") / "call.mjs"


def leaves(value: Any) -> Iterator[Any]:
    """Yield numbers and arrays of nested tuples in order."""
    if isinstance(value, tuple):
        for element in value:
            yield from leaves(element)
    else:
        yield value


def answer(results: list[int]) -> Any:
    """Return results in the form of the caller of machine code: None, an integer, or a tuple of integers."""
    return (None, *results[:1])[len(results)] if len(results) < 2 else tuple(results)


class Wasmtime:
    """A module in wasmtime, called with blocks of arguments as in `calls.calling_code`."""

    def __init__(self, module: bytes) -> None:
        import wasmtime

        self._store = wasmtime.Store()
        compiled = wasmtime.Module(self._store.engine, module)
        self.imports = [each.name for each in compiled.imports]
        self._exports = wasmtime.Instance(self._store, compiled, []).exports(self._store)
        self._memory = self._exports["memory"]

    def call(self, name: str, *arguments: Any, results: int | None = None) -> Any:
        count = RESULTS[name] if results is None else results
        top, store = self._exports["__heap_base"].value(self._store), self._store
        values = list(leaves(arguments))
        places: dict[int, int] = {}
        for i, value in enumerate(values):
            if isinstance(value, np.ndarray):
                places[i] = top = (top + 15) // 16 * 16
                top += value.nbytes
        block = (top + 15) // 16 * 16
        lacking = block + 4096 - self._memory.data_len(store)
        if lacking > 0:
            self._memory.grow(store, -(-lacking // 65536))
        slots = b""
        for i, value in enumerate(values):
            if i in places:
                self._memory.write(store, value.tobytes(), places[i])
                slots += struct.pack(f"<{1 + value.ndim}q", places[i], *value.shape)
            elif isinstance(value, bool | np.bool_ | int | np.integer):
                slots += struct.pack("<q", int(value))
            else:
                slots += struct.pack("<d", value)
        self._memory.write(store, slots, block)
        assert self._exports[name](store, block) == 0
        for i, place in places.items():
            content = self._memory.read(store, place, place + values[i].nbytes)
            values[i][...] = np.frombuffer(bytes(content), values[i].dtype).reshape(values[i].shape)
        end = block + len(slots)
        return answer(
            list(struct.unpack(f"<{count}q", bytes(self._memory.read(store, end, end + 8 * count))))
        )


NODE = """
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
const { Kernel } = await import(process.argv[1]);
const begun = performance.now();
const kernel = new Kernel(await WebAssembly.compile(readFileSync(process.argv[2])));
console.log(JSON.stringify({ milliseconds: performance.now() - begun, entries: kernel.entries }));
const types = { f: Float64Array, s: Float32Array, i: BigInt64Array };
for await (const line of createInterface({ input: process.stdin })) {
  const { name, values } = JSON.parse(line), arrays = [];
  const unpacked = value => {
    if (value === null || typeof value !== "object") return Number(value);
    if (value.letter === undefined)
      return Array.isArray(value) ? value.map(unpacked)
        : Object.fromEntries(Object.entries(value).map(([key, each]) => [key, unpacked(each)]));
    const buffer = Uint8Array.from(Buffer.from(value.bytes, "base64")).buffer;
    arrays.push(kernel.copy(value.letter, new types[value.letter](buffer), ...value.shape));
    return arrays.at(-1);
  };
  const answer = () => kernel.temporarily(() => {
    const given = values.map(unpacked), begun = performance.now(), results = kernel.call(name, ...given);
    const milliseconds = performance.now() - begun, { buffer } = kernel.memory;
    return { results, milliseconds, arrays: arrays.map(({ at, values }) =>
      Buffer.from(buffer, at, values.byteLength).toString("base64")) };
  });
  try {
    console.log(JSON.stringify(answer()));
  } catch ({ message }) {
    console.log(JSON.stringify({ error: message }));
  }
}
"""


class Node:
    """A module in Node, called through call.mjs; `milliseconds` is the time of the latest call."""

    def __init__(self, module: Path) -> None:
        self._process = subprocess.Popen(
            ["node", "--input-type=module", "--eval", NODE, str(CALL), str(module)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        hello = self._reply()
        self.milliseconds, self.entries = hello["milliseconds"], hello["entries"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        assert self._process.wait(30) == 0

    def _reply(self) -> Any:
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())

    def call(self, name: str, *arguments: Any, results: int | None = None) -> Any:
        """Call an entry point; the module itself states the number of its results."""
        arrays: list[np.ndarray] = []

        def packed(value: Any) -> Any:
            if isinstance(value, np.ndarray):
                arrays.append(value)
                content = base64.b64encode(value.tobytes()).decode()
                return {"letter": LETTERS[value.dtype], "shape": value.shape, "bytes": content}
            if isinstance(value, tuple):
                names = getattr(value, "_fields", None)
                elements = [packed(element) for element in value]
                return dict(zip(names, elements, strict=True)) if names else elements
            return value if isinstance(value, bool | int) else repr(float(value)).replace("inf", "Infinity")

        assert self._process.stdin is not None
        request = {"name": name, "values": [packed(value) for value in arguments]}
        print(json.dumps(request), file=self._process.stdin, flush=True)
        reply = self._reply()
        if "error" in reply:
            raise RuntimeError(reply["error"])
        for array, content in zip(arrays, reply["arrays"], strict=True):
            array[...] = np.frombuffer(base64.b64decode(content), array.dtype).reshape(array.shape)
        self.milliseconds = reply["milliseconds"]
        return answer(reply["results"])
