// A worker: it has the kernels of the hammers it was sent, and answers one order after the other.
import { Kernel } from "./call.js";
import { line } from "./line.js";
import { codes, piece, section } from "./many.js";
import { curves } from "./pictures.js";
import { Refusal } from "./read.js";

const kernels = new Map();
let limits = {};

const WORKS = {
  curves: (kernel, hammer, { state }) => curves(kernel, hammer, state, limits),
  piece: (kernel, hammer, { state, part }) => [piece(kernel, hammer, state, limits, part)],
  codes: (kernel, _hammer, { part }) => [codes(kernel, part)],
  line: (kernel, hammer, { state }) => [line(kernel, hammer, state, limits)],
  section: (kernel, hammer, { state, points }) => [section(kernel, hammer, state, limits, points)],
};

onmessage = ({ data }) => {
  if (data.limits) { limits = data.limits; return; }
  if (data.module) {
    kernels.set(data.name, { kernel: new Kernel(data.module), hammer: data.hammer });
    return;
  }
  const { kernel, hammer } = kernels.get(data.state.hammer);
  try {
    const frames = WORKS[data.work](kernel, hammer, data);
    const buffers = frames.flatMap((frame) => Object.values({ ...frame.data, ...(frame.x ? { x: frame.x } : {}) }).map((array) => array.buffer));
    postMessage({ number: data.number, frames }, [...new Set(buffers)]);
  } catch (error) {
    postMessage({ number: data.number, reason: error instanceof Refusal ? error.message : `this could not be computed, ${error}` });
  }
};
