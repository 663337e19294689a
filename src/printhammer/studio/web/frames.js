// Frames of the server: a heading in JSON and arrays, see printhammer/studio/frames.py.
const KINDS = { f4: Float32Array, f8: Float64Array, u2: Uint16Array, i4: Int32Array, u1: Uint8Array };

/** Return the heading of a frame, its arrays by name under `data`. */
export function decode(buffer) {
  const bytes = buffer instanceof ArrayBuffer ? buffer : buffer.buffer.slice(buffer.byteOffset, buffer.byteOffset + buffer.byteLength);
  const length = new DataView(bytes).getUint32(0, true);
  const heading = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  heading.data = {};
  for (const { name, dtype, shape, offset } of heading.arrays) {
    const count = shape.reduce((product, size) => product * size, 1);
    heading.data[name] = new KINDS[dtype](bytes, 4 + length + offset, count);
    heading.data[name].shape = shape;
  }
  return heading;
}
