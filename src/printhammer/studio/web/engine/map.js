// The frequency-time map: its rates shared out among workers, and displacements as codes for colours.

/** Have the rates of a map computed; gives the pieces in order, a reason, or null where the map is not wanted any more. */
export async function pictureOf(crew, state, [rows, columns], wanted, isWanted) {
  const each = Math.ceil(rows / (crew.count * (wanted ? 8 : 1)));
  const rate = (row) => state.low + (row / (rows - 1)) * (state.high - state.low);
  const pieces = [];
  for (let first = 0; first < rows; first += each) {
    const rates = Array.from({ length: Math.min(each, rows - first) }, (_, k) => rate(first + k));
    pieces.push(new Promise((done) => { crew.send("map", "piece", state, { part: { rates, columns, wanted } }, isWanted, done); }));
  }
  const answers = await Promise.all(pieces);
  if (answers.includes(null)) return null;
  const refused = answers.find((answer) => answer.reason);
  return refused ?? { rows, columns, pieces: answers.map(({ frames }) => frames[0]) };
}

/** Join pieces to the frame of a map: displacements as integers, 0 at its lowest place, 65534 at its highest. */
export function codesOf({ rows, columns, pieces }, state, { hammers, limits }) {
  const { backstop, front, platen } = hammers[state.hammer].described.places;
  const x = new Float32Array(rows * columns);
  const struck = pieces[0].struck && new Uint8Array(pieces.reduce((sum, each) => sum + each.struck.length, 0));
  let [at, from] = [0, 0];
  for (const each of pieces) {
    x.set(each.x, at);
    struck?.set(each.struck, from);
    at += each.x.length;
    from += each.struck?.length ?? 0;
  }
  let [least, most] = [Infinity, -Infinity];
  for (const value of x) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  const low = backstop ?? (Number.isFinite(least) ? least : 0);
  let high = platen ?? (Number.isFinite(most) ? most : 0);
  high = Math.max(high, low + 1e-7 * Math.max(Math.abs(low), 1e-30));
  const { GAP } = limits;
  const codes = Uint16Array.from(x, (value) => (Number.isNaN(value) ? GAP : Math.min(Math.max(((value - low) / (high - low)) * (GAP - 1), 0), GAP - 1)));
  codes.shape = [rows, columns];
  if (struck) struck.shape = [rows, struck.length / rows];
  const failed = pieces.reduce((sum, each) => sum + each.ok.filter((ok) => !ok).length, 0);
  return { kind: "map", rates: [state.low, state.high], end: pieces[0].end, low, high, front, pattern: state.pattern, pulses: state.pulses, failed, reason: "", data: { codes, ...(struck ? { struck } : {}) } };
}
