"""Workers of a page: few memories for many hammers, and jobs that end in any case of failure."""

import json
import subprocess
from typing import Any

from printhammer.studio.bundle import merged

MODULES = """
WebAssembly.Module.customSections = () => [new TextEncoder().encode("{}")];
const made = [];
let granted = Infinity; // memories
WebAssembly.Instance = class {
  constructor() {
    if (made.length >= granted) throw new RangeError("no memory");
    this.exports = { memory: { buffer: new ArrayBuffer(8) }, __heap_base: { value: 0 } };
    made.push(new WeakRef(this.exports));
  }
};
const replies = [];
globalThis.postMessage = (reply) => replies.push(reply);
globalThis.onmessage = null;
"""
ORDERS = """
const hammer = (index) => ({ quantity: "force", modules: { force: index } });
const device = (name, index) => ({ kernel: name, module: {}, hammer: hammer(index) });
const send = (data) => onmessage({ data });
// No work of this name: what matters is the kernel that is made for it.
const order = (number, name) => send({ number, work: "codes", part: null, kernel: name });
(async () => {
  for (let k = 0; k < 40; k += 1) {
    await send(device(`alike ${k}`, 0));
    await order(k, `alike ${k}`);
  }
  const shared = made.length;
  for (let k = 0; k < 40; k += 1) {
    await send(device(`own ${k}`, k));
    await order(k, `own ${k}`);
  }
  await new Promise((next) => { setTimeout(next, 20); });
  gc();
  const alive = made.filter((each) => each.deref()).length;
  granted = 0;
  replies.length = 0;
  await send(device("further", 100));
  await order(100, "further");
  await order(101, "never sent");
  console.log(JSON.stringify({ shared, alive, replies }));
})();
"""
CREW = """
Object.defineProperty(globalThis, "navigator", { value: { hardwareConcurrency: 1 }, configurable: true });
URL.createObjectURL = () => "";
globalThis.Worker = class {
  postMessage({ number }) {
    if (number) queueMicrotask(() => this.onmessage({ data: { number, frames: [number] } }));
  }
};
const shelf = {
  limits: {}, sentences: {}, quantity: () => "force", driven: () => ({}),
  module: (name) => (name === "bad" ? Promise.reject(new RangeError("no memory")) : Promise.resolve({})),
};
const crew = crewOf("", shelf);
const wanted = () => true;
const ask = (hammer) => new Promise((done) => { crew.send("map", "line", { hammer }, {}, wanted, done); });
Promise.all(["bad", "good", "bad"].map(ask)).then((answers) => console.log(JSON.stringify(answers)));
"""


def run(*parts: str) -> Any:
    command = ["node", "--expose-gc", "--eval", "".join(parts)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=20)
    return json.loads(done.stdout)


def test_a_worker_keeps_few_kernels_and_answers_where_there_is_no_memory() -> None:
    found = run(MODULES, merged("engine/worker.js"), ORDERS)
    assert found["shared"] == 1
    assert 1 <= found["alive"] <= 4
    assert [reply["number"] for reply in found["replies"]] == [100, 101]
    assert "no memory" in found["replies"][0]["reason"]
    assert found["replies"][1]["reason"]


def test_an_order_whose_module_cannot_be_compiled_ends_and_the_next_is_computed() -> None:
    bad, good, other = run(merged("engine/crew.js"), CREW)
    assert "no memory" in bad["reason"]
    assert good["frames"]
    assert "no memory" in other["reason"]
