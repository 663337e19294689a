// Quantities as they are typed: numbers, units and arithmetic, such as `1/660us` or `2*12.5 N/mm`.

// Powers of kg, m, s, A and rad, and the size in SI.
const UNITS = {};
const BASES = {
  g: [1e-3, [1, 0, 0, 0]], m: [1, [0, 1, 0, 0]], s: [1, [0, 0, 1, 0]], A: [1, [0, 0, 0, 1]], Hz: [1, [0, 0, -1, 0]],
  N: [1, [1, 1, -2, 0]], J: [1, [1, 2, -2, 0]], Pa: [1, [1, -1, -2, 0]], W: [1, [1, 2, -3, 0]], V: [1, [1, 2, -3, -1]], H: [1, [1, 2, -2, -2]], ohm: [1, [1, 2, -3, -2]], Wb: [1, [1, 2, -2, -1]], F: [1, [-1, -2, 4, 2]],
};
const PREFIXES = { "": 1, n: 1e-9, u: 1e-6, "\u00b5": 1e-6, "\u03bc": 1e-6, m: 1e-3, c: 1e-2, k: 1e3, M: 1e6, G: 1e9 };
for (const [base, [size, powers]] of Object.entries(BASES)) {
  for (const [prefix, factor] of Object.entries(PREFIXES)) UNITS[prefix + base] = { value: size * factor, powers: [...powers, 0] };
}
const INCH = 0.0254;
const POUND = 0.45359237;
const GRAVITY = 9.80665;
Object.assign(UNITS, {
  in: { value: INCH, powers: [0, 1, 0, 0, 0] }, mil: { value: 1e-3 * INCH, powers: [0, 1, 0, 0, 0] }, lb: { value: POUND, powers: [1, 0, 0, 0, 0] }, oz: { value: POUND / 16, powers: [1, 0, 0, 0, 0] },
  lbf: { value: POUND * GRAVITY, powers: [1, 1, -2, 0, 0] }, ozf: { value: (POUND * GRAVITY) / 16, powers: [1, 1, -2, 0, 0] },
  psi: { value: (POUND * GRAVITY) / INCH ** 2, powers: [1, -1, -2, 0, 0] }, ksi: { value: (1e3 * POUND * GRAVITY) / INCH ** 2, powers: [1, -1, -2, 0, 0] }, "%": { value: 0.01, powers: [0, 0, 0, 0, 0] },
  rad: { value: 1, powers: [0, 0, 0, 0, 1] }, deg: { value: Math.PI / 180, powers: [0, 0, 0, 0, 1] },
});
const PLAIN = [0, 0, 0, 0, 0];
const TOKEN = /\s*(?:(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)|([A-Za-z\u00b5\u03bc%]+)|(.))/y;

class Problem extends Error {}

function tokens(text) {
  const list = [];
  TOKEN.lastIndex = 0;
  while (TOKEN.lastIndex < text.length) {
    const [, number, name, sign] = TOKEN.exec(text) ?? [];
    if (number !== undefined) list.push({ number: Number(number) });
    else if (name !== undefined) list.push({ name });
    else if (sign?.trim()) list.push({ sign: sign.replace(/[·×]/, "*").replace("−", "-") });
    else break;
  }
  return list;
}

const scaled = (a, b, way) => ({ value: way > 0 ? a.value * b.value : a.value / b.value, powers: a.powers.map((power, k) => power + way * b.powers[k]), unit: a.unit || b.unit });
const raised = (a, power) => ({ value: a.value ** power, powers: a.powers.map((each) => each * power), unit: a.unit });
const alike = (a, b) => a.powers.every((power, k) => Math.abs(power - b.powers[k]) < 1e-9);

/** Return what an expression amounts to: its value in SI and its powers of kg, m, s, A and rad. */
function evaluate(text) {
  const list = tokens(text);
  let at = 0;
  const sign = (marks) => (marks.includes(list[at]?.sign) ? list[at++].sign : null);

  function atom() {
    if (sign("(")) {
      const inner = sum();
      if (!sign(")")) throw new Problem("a bracket is not closed");
      return inner;
    }
    const token = list[at];
    if (token?.number !== undefined) { at += 1; return { value: token.number, powers: PLAIN, unit: false }; }
    if (token?.name !== undefined) {
      const unit = Object.hasOwn(UNITS, token.name) ? UNITS[token.name] : null;
      if (!unit) throw new Problem(`${token.name} is no unit that is known here`);
      at += 1;
      return { ...unit, unit: true };
    }
    throw new Problem("it is no number");
  }
  function power() {
    const base = atom();
    if (!sign("^")) return base;
    const way = sign("-") ? -1 : 1;
    const exponent = atom();
    if (!alike(exponent, { powers: PLAIN })) throw new Problem("an exponent has no unit");
    return raised(base, way * exponent.value);
  }
  // A number and the units behind it belong together: 1/660us is 1/(660 us).
  function quantity() {
    let left = power();
    while (list[at]?.name !== undefined) left = scaled(left, power(), 1);
    return left;
  }
  function product() {
    if (sign("-")) return scaled({ value: -1, powers: PLAIN }, product(), 1);
    if (sign("+")) return product();
    let left = quantity();
    for (let mark = sign("*/"); mark; mark = sign("*/")) left = scaled(left, sign("-") ? scaled({ value: -1, powers: PLAIN }, quantity(), 1) : quantity(), mark === "*" ? 1 : -1);
    return left;
  }
  function sum() {
    let left = product();
    for (let mark = sign("+-"); mark; mark = sign("+-")) {
      const right = product();
      if (!alike(left, right)) throw new Problem("it adds what has different units");
      left = { ...left, value: left.value + (mark === "+" ? right.value : -right.value), unit: left.unit || right.unit };
    }
    return left;
  }
  const whole = sum();
  if (at < list.length) throw new Problem("it is no number");
  return whole;
}

/**
 * Read what was typed for a quantity whose SI unit is `si` and which is shown in `shown` ({ name, factor }).
 * Returns { value } in SI, or { problem }: why it is none.
 */
export function readQuantity(text, si, shown) {
  // A comma between digits is a decimal one.
  const typed = text.trim().replace(/(\d),(\d)/g, "$1.$2");
  const plain = si === "degC" ? typed.replace(/\s*(°\s*C|degC)$/, "") : typed.replace(/°/g, "deg");
  if (!plain) return { problem: "it is empty" };
  try {
    const read = evaluate(plain);
    if (!Number.isFinite(read.value)) return { problem: "it is not finite" };
    if (!read.unit) return { value: read.value / shown.factor };
    const wanted = unitOfSi(si);
    if (wanted && alike(read, wanted)) return { value: read.value / wanted.value };
    if (wanted && read.powers.every((power, k) => power === -wanted.powers[k]) && si === "Hz") return { problem: `it is a time; a rate is 1/${plain}` };
    return { problem: si === "1" ? "it has a unit, expected a plain number" : `it is no quantity in ${shown.name || si}` };
  } catch (error) {
    if (error instanceof Problem) return { problem: error.message };
    throw error;
  }
}

function unitOfSi(si) {
  if (si === "1" || !si) return { value: 1, powers: PLAIN };
  try { return evaluate(si); } catch { return null; }
}
