// Calls of a kernel in WebAssembly, see `build.py`: arrays live in the memory of the module, and an entry point
// takes the address of a block of arguments. Letters of a signature: "i" int64, "f" float64, "b" a truth value;
// "f2" an array of float64 with two axes in C order, "s2" of float32, "i1" of int64.

const SLOT = 8, PAGE = 65536;
const ELEMENTS = { f: Float64Array, s: Float32Array, i: BigInt64Array };

export class Kernel {
  // `module` is a WebAssembly.Module; a worker may receive it by postMessage.
  constructor(module) {
    const [section] = WebAssembly.Module.customSections(module, "printhammer");
    Object.assign(this, JSON.parse(new TextDecoder().decode(section)));
    this.exports = new WebAssembly.Instance(module).exports;
    this.memory = this.exports.memory;
    this.top = this.exports.__heap_base.value;
  }

  // Array of zeros in the memory of the module; `values` is a view that holds until memory grows.
  array(letter, ...shape) {
    const type = ELEMENTS[letter], length = shape.reduce((product, n) => product * n, 1);
    const at = this.take(length * type.BYTES_PER_ELEMENT), { memory } = this;
    const array = { letter, shape, at, get values() { return new type(memory.buffer, at, length); } };
    array.values.fill(letter === "i" ? 0n : 0);
    return array;
  }

  // Array with the elements of a typed or plain one.
  copy(letter, elements, ...shape) {
    const array = this.array(letter, ...(shape.length ? shape : [elements.length]));
    array.values.set(letter === "i" ? Array.from(elements, BigInt) : elements);
    return array;
  }

  // Run a function; free the memory of the arrays that it has made.
  temporarily(task) {
    const { top } = this;
    try {
      return task();
    } finally {
      this.top = top;
    }
  }

  // Call an entry point; arguments are nested as in its signature. Returns its integers as an array.
  call(name, ...values) {
    const { arguments: signature, results } = this.entries[name], slots = [];
    flatten(signature, values, name, slots);
    return this.temporarily(() => {
      const at = this.take(SLOT * (slots.length + Math.max(results, 1)));
      const block = new DataView(this.memory.buffer, at);
      slots.forEach(([kind, value], i) => {
        if (kind === "f") block.setFloat64(SLOT * i, value, true);
        else block.setBigInt64(SLOT * i, BigInt(value), true);
      });
      if (this.exports[name](at) !== 0n) throw new Error(`${name} raised an exception`);
      return Array.from({ length: results }, (_, i) => Number(block.getBigInt64(SLOT * (slots.length + i), true)));
    });
  }

  take(bytes) {
    const at = (this.top + 15) & ~15;
    this.top = at + bytes;
    const lacking = this.top - this.memory.buffer.byteLength;
    if (lacking > 0) this.memory.grow(Math.ceil(lacking / PAGE));
    return at;
  }
}

function flatten(signature, value, place, slots) {
  if (typeof signature !== "string") {
    const names = Object.keys(signature);
    if (Object.keys(value).length !== names.length) throw new TypeError(`${place}: expected ${names.length} values`);
    names.forEach(name => flatten(signature[name], value[name], `${place}.${name}`, slots));
  } else if (signature.length === 2) {
    if (value?.letter !== signature[0] || value.shape.length !== Number(signature[1]))
      throw new TypeError(`${place}: expected an array ${signature}`);
    slots.push(["i", value.at], ...value.shape.map(n => ["i", n]));
  } else slots.push([signature, value]);
}
