// The hammers of the page with their modules, unpacked from what Python has embedded.
import { readersOf } from "./read.js";

/** Undo `deltas` of printhammer/studio/bundle.py: literals, and copies of what came before. */
export function unpack(bytes, size) {
  const whole = new Uint8Array(size);
  let [from, to] = [0, 0];
  const number = () => {
    let value = 0;
    for (let factor = 1; ; factor *= 128) {
      const next = bytes[from];
      from += 1;
      value += (next & 127) * factor;
      if (next < 128) return value;
    }
  };
  for (;;) {
    const literals = number();
    whole.set(bytes.subarray(from, from + literals), to);
    [from, to] = [from + literals, to + literals];
    if (to >= size) return whole;
    const [length, distance] = [number(), number()];
    whole.copyWithin(to, to - distance, to - distance + length);
    to += length;
  }
}

/** The shelf of the content of the page and its packed modules. */
export function shelfOf({ names, hammers, sizes, limits, vocabulary, version, sentences, stateFile }, packed) {
  const whole = unpack(packed, sizes.reduce((sum, size) => sum + size, 0));
  const ends = sizes.map((_, k) => sizes.slice(0, k + 1).reduce((sum, size) => sum + size, 0));
  const compiled = sizes.map(() => null);
  return {
    names, hammers, limits, vocabulary, version, sentences, stateFile,
    readers: readersOf(limits, vocabulary),
    /** What drives the coil or the armature in a state: current, force or voltage. */
    quantity: ({ hammer, waveform }) => (waveform ?? hammers[hammer].described.waveform).quantity,
    /** A hammer as a quantity drives it. */
    driven: (name, quantity) => ({ ...hammers[name], quantity, circuit: quantity === "voltage" }),
    /** The compiled module of a hammer that a quantity drives; each is compiled once. */
    module(name, quantity) {
      const module = hammers[name].modules[quantity];
      compiled[module] ??= WebAssembly.compile(whole.subarray(ends[module] - sizes[module], ends[module]));
      return compiled[module];
    },
  };
}
