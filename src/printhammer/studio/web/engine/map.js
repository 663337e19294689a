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
export async function codesOf(crew, { rows, columns, pieces }, state) {
  const { end, places } = pieces[0];
  const joined = (name, type) => {
    const whole = new type(pieces.reduce((sum, each) => sum + each[name].length, 0));
    pieces.reduce((at, each) => { whole.set(each[name], at); return at + each[name].length; }, 0);
    return whole;
  };
  const part = { x: joined("x", Float32Array), rows, columns, places };
  const { frames, reason } = await new Promise((done) => { crew.send("map", "codes", state, { part }, () => true, done); });
  if (reason) return { kind: "map", reason, detail: "none", data: {} };
  const [{ low, high, data }] = frames;
  data.codes.shape = [rows, columns];
  if (pieces[0].struck) {
    data.struck = joined("struck", Uint8Array);
    data.struck.shape = [rows, data.struck.length / rows];
  }
  const failed = pieces.reduce((sum, each) => sum + each.ok.filter((ok) => !ok).length, 0);
  return { kind: "map", rates: [state.low, state.high], end, low, high, front: places.front, pattern: state.pattern, pulses: state.pulses, failed, reason: "", data };
}
