// A worker: it has the modules of the hammers it was sent, and answers one order after the other.
import { Kernel } from "./call.js";
import { line } from "./line.js";
import { codes, piece } from "./many.js";
import { curves } from "./pictures.js";
import { Refusal } from "./read.js";
import { section } from "./strobe.js";

const KEPT = 4; // kernels, each of which has a memory: a browser grants some hundred to all workers together
const devices = new Map(); // hammers with their modules
const kernels = new Map(); // by the index of the module, which hammers of the same laws share; the one used last comes last
let limits = {};

/** The kernel of a module; of several, those used last are kept. */
function kernelOf(module, index) {
  const kernel = kernels.get(index) ?? new Kernel(module);
  kernels.delete(index);
  kernels.set(index, kernel);
  if (kernels.size > KEPT) kernels.delete(kernels.keys().next().value);
  return kernel;
}

const WORKS = {
  curves: (kernel, hammer, { state }) => curves(kernel, hammer, state, limits),
  piece: (kernel, hammer, { state, part }) => [piece(kernel, hammer, state, limits, part)],
  codes: (kernel, _hammer, { part }) => [codes(kernel, part)],
  line: (kernel, hammer, { state }) => [line(kernel, hammer, state, limits)],
  section: (kernel, hammer, { state, counts, judged }) => section(kernel, hammer, state, limits, { counts, judged }),
};

const LOOK = 30; // ms of work between two looks at whether it is still wanted
let dropped = 0;

const arraysOf = (frame) => Object.values({ ...frame.data, ...(frame.x ? { x: frame.x } : {}) });
const post = (message, frames) => postMessage(message, [...new Set(frames.flatMap(arraysOf).map((array) => array.buffer))]);

/** Work step by step: send the frames on the way, and stop where the work is not wanted any more. */
async function inSteps(steps, number) {
  let looked = performance.now();
  for (const { frame } of steps) {
    if (frame) post({ number, frame }, [frame]);
    if (performance.now() < looked + LOOK) continue;
    postMessage({ number, going: true });
    await new Promise((next) => { setTimeout(next); });
    looked = performance.now();
    if (dropped === number) return null;
  }
  return [];
}

onmessage = async ({ data }) => {
  if (data.limits) { limits = data.limits; return; }
  if (data.module) {
    devices.set(data.kernel, data);
    return;
  }
  if (data.drop) { dropped = data.drop; return; }
  const { number } = data;
  try {
    const { module, hammer } = devices.get(data.kernel);
    const kernel = kernelOf(module, hammer.modules[hammer.quantity]);
    const work = WORKS[data.work](kernel, hammer, data);
    const frames = Array.isArray(work) ? work : await inSteps(work, number);
    post({ number, frames }, frames ?? []);
  } catch (error) {
    postMessage({ number, reason: error instanceof Refusal ? error.message : `this could not be computed, ${error}` });
  }
};
