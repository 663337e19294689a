// The printed line: a text as slots of wires, the run of each wire, and where its dots land.
import { many, startsOf } from "./many.js";
import { pose } from "./problem.js";
import { Refusal } from "./read.js";

const FRAME = ["x", "y", "wanted x", "wanted y", "darkness", "fault"]; // first columns of a dot
const COLUMNS = 9; // of a dot
const TOTALS = 11;
const EXTRA = 4; // rows for extra contacts of a run, beside one for each firing
const [TIME_IN, FORCE] = [1, 5]; // columns of a row of the single pulse

/** Break a text into lines, between words where it can be. */
function broken(text, columns) {
  const lines = [""];
  for (const chunk of text.trimEnd().split(/(\s+)/).filter(Boolean)) {
    let rest = chunk;
    if (lines.at(-1) && lines.at(-1).length + rest.length > columns) {
      lines[lines.length - 1] = lines.at(-1).trimEnd();
      lines.push("");
      rest = rest.trimStart();
    }
    for (; rest.length > columns; rest = rest.slice(columns)) {
      lines[lines.length - 1] += rest.slice(0, columns);
      lines.push("");
    }
    lines[lines.length - 1] += rest;
  }
  return lines.map((line) => line.trimEnd());
}

/** Return the runs of a text: print line, wire and slots of every wire that prints. */
function runsOf(text, { glyphs, columns, name }) {
  const lines = broken(text, columns);
  const lacking = [...new Set(lines.join(""))].filter((mark) => !(mark in glyphs));
  if (lacking.length) throw new Refusal(`text: the font ${name} has no ${lacking.slice(0, 8).map((mark) => `'${mark}'`).join(", ")}: expected characters that it has`);
  return lines.flatMap((line, number) => {
    const rows = glyphs[" "].map((_, wire) => [...line].map((mark) => glyphs[mark][wire]).join(""));
    return rows.map((row, wire) => ({ line: number, wire, slots: [...row].flatMap((mark, slot) => (mark === "#" ? [slot] : [])) }));
  }).filter(({ slots }) => slots.length);
}

/** The dots of the text of a state, as they are printed. */
export function line(kernel, hammer, state, limits) {
  return kernel.temporarily(() => {
    const posed = pose(kernel, hammer, state, limits);
    if (posed.sine) throw new Refusal("a continuous force prints no line: expected a pulse");
    const { font, head, faults } = limits.LINE;
    if (posed.places.front === null) throw new Refusal("the hammer has no pack: expected one that a dot is made on");
    const runs = runsOf(state.line.trim(), font);
    const alone = many(kernel, posed, kernel.copy("f", [0]), [1], [posed.wait], { room: [1 + EXTRA], most: limits.MOST_STEPS });
    const row = alone.dots.values;
    if (!(row[0] > 0)) throw new Refusal("a single pulse makes no dot: expected a pulse that throws the armature into the pack");
    const single = kernel.copy("f", [row[FORCE], row[TIME_IN], row[0] - 1]);
    const counts = runs.map(({ slots }) => slots.length);
    const slots = kernel.copy("i", runs.flatMap((run) => run.slots));
    const firings = kernel.array("f", slots.shape[0]);
    kernel.call("line_slots", slots, state.rate, limits.LINE.first, firings);
    let at = 0;
    const ends = counts.map((count) => firings.values[(at += count) - 1] + posed.wait);
    const most = Math.max(Math.floor(limits.MOST_WORK / runs.length), 1000);
    let room = counts.map((count) => 2 * count + EXTRA);
    let kept = many(kernel, posed, firings, counts, ends, { room, most });
    const needed = Array.from(kept.extra.values, (extra, k) => counts[k] + Number(extra));
    if (needed.some((count, k) => count > room[k])) {
      room = needed.map((count, k) => Math.max(count, room[k]));
      kept = many(kernel, posed, firings, counts, ends, { room, most });
    }
    const [dots, extras] = [kernel.array("f", slots.shape[0], COLUMNS), kernel.array("f", needed.reduce((sum, count) => sum + count, 0) + 1, 2)];
    const places = [startsOf(kernel, counts), kernel.copy("i", runs.map((run) => run.line)), kernel.copy("i", runs.map((run) => run.wire))];
    const tables = [kept.status, kept.reached, kept.extra, kept.dot_starts, kept.dots];
    const [extra] = kernel.call("line_dots", places, slots, firings, tables, state.rate, single, kernel.copy("f", limits.LINE.limits), kernel.copy("f", head.numbers), dots, extras);
    const totals = kernel.array("f", TOTALS);
    kernel.call("line_totals", dots, kept.status, totals);
    const sum = Array.from(totals.values);
    const column = (table, width, k, n) => Float32Array.from({ length: n }, (_, j) => table.values[j * width + k]);
    const data = Object.fromEntries(FRAME.map((name, k) => [name, column(dots, COLUMNS, k, slots.shape[0])]));
    data.fault = Int32Array.from(data.fault);
    Object.assign(data, { "extra x": column(extras, 2, 0, extra), "extra y": column(extras, 2, 1, extra) });
    const pair = (k) => (Number.isFinite(sum[k]) ? [sum[k], sum[k + 1]] : null);
    return {
      kind: "line", reason: "", wanted: slots.shape[0], good: sum[0], lost: sum[2], faults: Object.fromEntries(faults.map((name, k) => [name, sum[1 + k]]).filter(([, count]) => count)),
      wire: head.wire, pitch: head.numbers[0], force: pair(6), placement: pair(8), failed: sum[10], data,
    };
  });
}
