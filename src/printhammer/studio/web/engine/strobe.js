// The endless train of a state: the states at its firings, its largest exponent, and what kind of motion it is.
import { pose, resample, slotsOf, STATUS, trainOf } from "./problem.js";
import { Refusal } from "./read.js";

const PLACE = { pauseAfter: 1, time: 4, position: 5, velocity: 6 }; // indices in the state of a run
const CURRENT = 10; // column of the current of the coil in a table of `resample`
const CAPACITY = 4096; // rows of nodes of one stretch of a run
const PAUSED = 5; // status of a run that goes on
const FIRST_POINTS = 25;
const PERIODS = 64; // largest period that is looked for, in firings
const AGREEMENT = 1e-6; // half-widths within which two states agree
const SEARCH = 4; // numbers of Newton's method
const [ORBIT, IMAGE] = [10, 7]; // columns of an orbit and of an image
const [TRY] = [0];
const MAP_TOLERANCE = 1e-13;
const STOPPED = "the run ended before firing";
const FORGETS = "no exponent: the motion comes to rest and forgets its past";
const REASONS = {
  "-1": "the states still move, and Newton's method needs a derivative that does not exist",
  "-3": "no period, and the motion comes to rest on the backstop only once; more firings decide",
  "-4": "no period, and no exponent, since the motion passes a touch without velocity",
  "-6": `no period up to ${PERIODS}, and the largest exponent is not positive by 3 standard errors`,
};
const NAMES = { "-2": "superstable", "-5": "strange" };

const finite = (value) => (Number.isFinite(value) ? value : null);
const rounded = (value, digits) => String(Number(value.toPrecision(digits)));
const firings = (count) => `${count} firing${count > 1 ? "s" : ""}`;

/** Run a function with the memory of the module; free the arrays that a generator has made when it ends. */
function* within(kernel, task) {
  const { top } = kernel;
  try {
    return yield* task();
  } finally {
    kernel.top = top;
  }
}

/** What the variational equations write, for two columns at marks; see printhammer/kernel/variational/layout.py. */
function carriedOf(kernel, { circuit }, marks) {
  const rows = circuit ? 7 : 3;
  const unknown = (...shape) => {
    const array = kernel.array("f", ...shape);
    array.values.fill(NaN);
    return array;
  };
  return {
    columns: kernel.array("f", rows, 2), work: kernel.array("f", 15, circuit ? 16 : 7), track: kernel.copy("f", [0, 1, 0, 0]), states: unknown(marks, circuit ? 8 : 4),
    changes: unknown(marks, rows, 2), growth: unknown(marks, 2), passed: kernel.array("f", 0, 2, rows, 2),
  };
}

/** Integrate a train in stretches, with the growth of perturbations, from a state at `begin`; `take` sees each stretch. */
function* flowed(kernel, posed, { times, begin = 0, state = null, control, marks }, take) {
  const train = trainOf(kernel, posed, posed.sine ? [0] : times);
  const renormalise = state === null;
  const marked = kernel.copy("f", marks);
  const rows = posed.circuit ? 7 : 3;
  const initial = kernel.array("f", rows, 2);
  [initial.values[0], initial.values[3]] = renormalise ? posed.scales : [1, 1];
  const carried = carriedOf(kernel, posed, marks.length);
  const none = kernel.array("i", 0);
  const { top } = kernel;
  for (let capacity = CAPACITY; ; capacity *= 4) {
    kernel.top = top;
    const [nodes, contacts] = [kernel.array("f", capacity, posed.width), kernel.array("f", capacity, 7)];
    const carry = kernel.copy("f", posed.carry);
    carry.values[PLACE.pauseAfter] = capacity / 2;
    carry.values[PLACE.time] = begin;
    if (state) [carry.values[PLACE.position], carry.values[PLACE.velocity]] = state;
    for (let total = 0; ;) {
      const [status, used, touched] = kernel.call("run", [train, posed.constants, control, posed.bounds, 5e7], marks.at(-1), nodes, contacts, carry);
      if (used > capacity) break;
      total += used;
      const record = { nodes: { ...nodes, shape: [used, posed.width], get values() { return nodes.values.subarray(0, used * posed.width); } }, train };
      kernel.call("flow", record.nodes, train, posed.constants, posed.scales, posed.bounds, [], marked, none, renormalise, status !== PAUSED, initial, carried);
      const known = { status, carried, total, record, reached: carry.values[PLACE.time] };
      if (take) yield* take(known);
      if (status !== PAUSED) return known;
      if (touched) contacts.values.copyWithin(0, (touched - 1) * 7, touched * 7);
    }
    // A stretch was too long for its arrays: everything is computed again with longer ones.
    const again = carriedOf(kernel, posed, marks.length);
    for (const name of Object.keys(carried)) carried[name].values.set(again[name].values);
  }
}

/**
 * Follow the endless train of a state: yields `{ frame }` with ever more points, and `{}` between them.
 * `counts` are the numbers of points of the frames; `judged` the first and the last firing by which the motion is classified, or null.
 */
export function* section(kernel, hammer, state, limits, { counts, judged }) {
  return yield* within(kernel, function* () {
    const posed = pose(kernel, hammer, state, limits);
    const last = judged ? judged[1] : counts.at(-1);
    const times = slotsOf(kernel, { ...state, pattern: "", pulses: last + 1 });
    const marks = times.slice(0, last);
    const currents = kernel.array("f", posed.circuit ? last : 0);
    let [known, shown, failed] = [0, 0, ""];
    const frameOf = (carried, points, more = {}) => {
      const [width, from] = [carried.states.shape[1], carried.states.values];
      const column = (k) => Float32Array.from({ length: points }, (_, row) => from[row * width + k]);
      return { kind: "strobe", status: failed || "ok", rate: state.rate, verdict: null, exponent: null, last: counts.at(-1), reason: "", data: { x: column(0), v: column(1) }, ...more };
    };
    const take = function* ({ record, status, carried, total }) {
      const [width, from] = [carried.states.shape[1], carried.states.values];
      let now = known;
      while (now < last && Number.isFinite(from[now * width])) now += 1;
      if (posed.circuit && now > known) {
        kernel.temporarily(() => {
          const rows = resample(kernel, posed, record, marks.slice(known, now)).values;
          for (let k = known; k < now; k += 1) currents.values[k] = rows[(k - known) * posed.columns + CURRENT];
        });
      }
      known = now;
      failed = status === PAUSED || status === 0 ? "" : STATUS[status];
      if (known < FIRST_POINTS && total > limits.MOST_SECTION_STEPS) throw new Refusal(`the first ${FIRST_POINTS} strobe points would take more than ${limits.MOST_SECTION_STEPS} steps for this hammer: expected fewer`);
      while (counts[shown] <= known) {
        const points = counts[shown];
        shown += 1;
        yield { frame: frameOf(carried, points, { exponent: points < 150 ? null : exponentAt(kernel, carried, points) }) };
      }
      yield {};
    };
    const { carried, status } = yield* flowed(kernel, posed, { times, control: posed.exact, marks }, take);
    if (status !== 0 && known < FIRST_POINTS) throw new Refusal(`the first ${FIRST_POINTS} strobe points: ${STATUS[status]} after firing ${known}`);
    if (shown < counts.length) yield { frame: frameOf(carried, counts.at(-1)) };
    if (!judged) return null;
    const verdict = yield* judge(kernel, hammer, state, limits, posed, { carried, status, currents, judged, known });
    yield { frame: frameOf(carried, counts.at(-1), { verdict }) };
    return null;
  });
}

/** The largest exponent over the later half of the first firings, or null. */
function exponentAt(kernel, carried, points) {
  const { value, error, smooth } = growthOf(kernel, carried, Math.floor(points / 2) + 1, points);
  if (!smooth || !Number.isFinite(value)) return null;
  return { value, standard_error: error, firings: [Math.floor(points / 2) + 1, points] };
}

/** Mean and standard error of the growth from a firing to a later one. */
function growthOf(kernel, carried, first, last) {
  return kernel.temporarily(() => {
    const growth = kernel.copy("f", carried.growth.values.subarray(2 * first, 2 * last), last - first, 2);
    const out = kernel.array("f", 2);
    const [rests] = kernel.call("exponent", growth, kernel.array("f", last - first + 1), out);
    const [value, error] = out.values;
    return { value, error, rests, smooth: carried.track.values[1] === 1 };
  });
}

/** Half-widths of the window of strobe plots, of the memory, of a typical current; then what counts as agreement. */
function windowOf(kernel, hammer, state, posed) {
  return kernel.temporarily(() => {
    const out = kernel.array("f", 2);
    const [way, speed] = posed.atOrigin();
    kernel.call("half_widths", way, speed, posed.places.backstop ?? NaN, posed.places.front ?? NaN, out);
    const [width, high] = out.values;
    return [width, high, width, ...(posed.circuit ? [posed.currentScale] : []), AGREEMENT];
  });
}

/** Classify the motion of a train by its states and its exponent. */
function* judge(kernel, hammer, state, limits, posed, { carried, status, currents, judged: [first, last], known }) {
  const evidence = { firings: [first, last], tolerance: limits.TOLERANCE, multiplier: null, reason: "", at_other_tolerances: {} };
  if (status !== 0 || known < last) {
    return { ...evidence, verdict: "undecided", nearest_period: null, distance: null, exponent_per_firing: null, standard_error: null, rests: 0, reason: `${STOPPED} ${last}: ${STATUS[status]}`, phrases: [`firings ${first} to ${last}, tolerance ${rounded(limits.TOLERANCE, 6)}`] };
  }
  const [count, width, columns] = [last - first + 1, carried.states.shape[1], posed.circuit ? 7 : 4];
  const rows = kernel.array("f", count, columns); // as strobes: displacement, velocity, mode, memory, current
  for (let k = 0; k < count; k += 1) {
    rows.values.set(carried.states.values.subarray((first - 1 + k) * width, (first - 1 + k) * width + 4), k * columns);
    if (posed.circuit) rows.values[k * columns + 4] = currents.values[first - 1 + k];
  }
  const [states, branches] = [kernel.array("f", count, posed.circuit ? 4 : 3), kernel.array("i", count)];
  kernel.call("section", rows, posed.places.front ?? Infinity, states, branches);
  const scales = kernel.copy("f", windowOf(kernel, hammer, state, posed));
  const distances = kernel.array("f", PERIODS);
  const [agreed, near] = kernel.call("distances", states, branches, scales, distances);
  const { value, error, rests, smooth } = growthOf(kernel, carried, first, last);
  yield {};
  let [settled, why, multiplier] = [0, "", NaN];
  if (agreed) ({ settled, why, multiplier } = yield* settle(kernel, posed, state, limits, states, scales, agreed));
  const [code] = kernel.call("classify", agreed, settled, value, error, smooth, rests);
  const verdict = code > 0 ? `period-${code}` : NAMES[code] ?? "undecided";
  const nearest = code > 0 ? code : near;
  const distance = nearest ? distances.values[nearest - 1] : NaN;
  const phrases = [];
  if (code > 0) {
    phrases.push(`states ${firings(code)} apart agree to ${distance.toExponential(1)} of the window`);
    if (!Number.isNaN(multiplier)) phrases.push(`they approach an orbit that Newton's method finds, of largest multiplier ${rounded(multiplier, 6)}`);
  } else if (verdict === "superstable" && distance === 0) phrases.push(`states ${firings(nearest)} apart agree to the last bit`);
  else if (nearest) phrases.push(`no period up to ${PERIODS}: states ${firings(nearest)} apart come closest, to ${distance.toExponential(1)} of the window`);
  else phrases.push(`no period up to ${PERIODS}: states that far apart lie on other branches of the pack`);
  if (value === -Infinity) phrases.push(FORGETS);
  else if (Number.isFinite(value)) phrases.push(`largest exponent ${value > 0 ? "+" : ""}${rounded(value, 4)} ± ${rounded(error, 2)} per firing`);
  phrases.push(`firings ${first} to ${last}, tolerance ${rounded(limits.TOLERANCE, 6)}`);
  return {
    ...evidence, verdict, nearest_period: nearest || null, distance: finite(distance), exponent_per_firing: finite(value), standard_error: finite(error),
    multiplier: finite(multiplier), reason: code > 0 ? "" : why || REASONS[code] || "", rests, phrases,
  };
}

/** The period to which states that agree `period` firings apart have settled: by themselves, or by Newton's method. */
function* settle(kernel, posed, state, limits, states, scales, period) {
  const [planar] = posed.circuit ? kernel.call("is_planar", posed.constants) : [1];
  const [clear] = kernel.call("settled", states, scales, period, Boolean(planar));
  if (clear || !planar) return { settled: clear, why: "", multiplier: NaN };
  const byStates = () => {
    const [settled] = kernel.call("settled", states, scales, period, false);
    return { settled, why: REASONS[-1], multiplier: NaN };
  };
  for (let count = 1; count <= period; count += 1) {
    if (period % count) continue;
    const found = yield* within(kernel, function* () {
      const [orbit, trial, search] = [kernel.array("f", count, ORBIT), kernel.array("f", count, 2), kernel.array("f", SEARCH)];
      if (!kernel.call("guess", states, scales, period, count, orbit, trial)[0]) return null;
      const images = kernel.array("f", count, IMAGE);
      let outcome = TRY;
      while (outcome === TRY) {
        let usable = true;
        for (let k = 0; k < count && usable; k += 1) {
          usable = yield* imageOf(kernel, posed, state, limits, trial.values.slice(2 * k, 2 * k + 2), images, k);
          yield {};
        }
        [outcome] = kernel.call("improve", images, usable, scales, orbit, trial, search);
      }
      const out = kernel.array("f", 1);
      const [judged] = kernel.call("has_settled", states, scales, orbit, search, outcome, out);
      return { judged, multiplier: out.values[0] };
    });
    if (found?.judged < 0) return byStates();
    if (found?.judged > 0) return { settled: count, why: "", multiplier: found.multiplier };
  }
  return { settled: 0, why: `Newton's method finds no stable orbit of ${firings(period)} there that the states approach`, multiplier: NaN };
}

/** Write the image of a state after one firing with its derivative, and return whether it is known. */
function* imageOf(kernel, posed, state, limits, start, images, place) {
  return yield* within(kernel, function* () {
    const times = slotsOf(kernel, { ...state, pattern: "", pulses: posed.memory + 3 });
    const marks = times.slice(-3, -1);
    const { status, carried, record } = yield* flowed(kernel, posed, { times, begin: marks[0], state: start, control: posed.controlAt(MAP_TOLERANCE), marks });
    const current = posed.circuit ? resample(kernel, posed, record, [marks[1]]).values[CURRENT] / posed.currentScale : 0;
    const image = kernel.array("f", IMAGE);
    const [usable] = kernel.call("image", kernel.copy("f", start), carried.states, current, carried.columns, carried.track.values[1], posed.constants, image);
    images.values.set(image.values, IMAGE * place);
    return status === 0 && usable === 1;
  });
}
