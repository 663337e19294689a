// A state as texts: the file of its hammer and of its drive, a script, a command line.
import { driveText } from "./drive.js";
import { Refusal, settingsOf } from "./read.js";

const HAMMER_FILE = "studio-hammer.toml";
const DRIVE_FILE = "studio-drive.toml";
const CLASSES = { "half-sine": "HalfSine", rectangle: "Rectangle", trapezoid: "Trapezoid", sampled: "Sampled", rail: "Rail", chopper: "Chopper", "peak-and-hold": "PeakAndHold", capacitor: "Capacitor", bridge: "Bridge" };

const written = (number) => (Number.isInteger(number) && Math.abs(number) < 1e16 ? `${number}.0` : String(number).replace("e+", "e"));
const python = (value) => (value === null ? "None" : typeof value === "number" ? written(value) : Array.isArray(value) ? `[${value.map(python).join(", ")}]` : JSON.stringify(value));

/** Return the texts of a state by kind, as the exports of the studio name them. */
export function textsOf(state, shelf) {
  const hammer = shelf.hammers[state.hammer];
  const { constants, waveform } = state;
  const byVoltage = (waveform ?? hammer.described.waveform)?.quantity === "voltage";
  const set = { ...state, constants: settingsOf({ described: hammer.described, constants, byVoltage }) };
  return {
    hammer: hammerFile(set, hammer),
    drive: driveText(state, shelf),
    python: scriptOf(set, hammer),
    command: commandOf(set, hammer),
    state: `${JSON.stringify({ ...shelf.stateFile, state }, null, 1)}\n`,
  };
}

/** The file of the hammer with the constants that are changed, each in SI. */
function hammerFile(state, hammer) {
  let { text } = hammer;
  for (const [key, value] of Object.entries(state.constants)) {
    const dot = key.lastIndexOf(".");
    const [section, name] = dot < 0 ? ["", key] : [key.slice(0, dot), key.slice(dot + 1)];
    const { unit } = [...hammer.described.constants, ...hammer.described.open].find((constant) => constant.key === key);
    text = changed(text, section, name, written(value), unit);
  }
  return text;
}

/** The section of each line of a TOML text; that of an entry of a list has the name of the entry, such as "force.weight". */
function sectionsOf(lines) {
  const heads = lines.map((line) => /^\s*\[(\[?)\s*([\w.-]+)\s*\]/.exec(line));
  let here = "";
  return heads.map((head, k) => {
    if (!head) return here;
    here = head[2];
    if (head[1]) {
      const after = heads.findIndex((other, at) => at > k && other);
      const names = lines.slice(k + 1, after < 0 ? lines.length : after).map((line) => /^\s*name\s*=\s*["']([^"']*)["']/.exec(line));
      here = `${here}.${names.find((found) => found)?.[1] ?? ""}`;
    }
    return here;
  });
}

/** Set one value of a TOML text: the first line of a section that gives it, or a new one at the end of the section. */
function changed(text, section, name, value, unit) {
  const whole = unit === "1" ? value : `"${value} ${unit}"`;
  const lines = text.split("\n");
  const sections = sectionsOf(lines);
  let last = -1;
  for (let k = 0; k < lines.length; k += 1) {
    if (sections[k] !== section) continue;
    if (lines[k].trim()) last = k;
    if (new RegExp(`^\\s*${name}\\s*=`).test(lines[k])) {
      const apart = /unit\s*=/.test(lines[k]);
      lines[k] = lines[k].includes("{")
        ? lines[k].replace(/(value\s*=\s*)("[^"]*"|[^,}\s]+)/, (_all, begin) => `${begin}${apart ? value : whole}`).replace(/(unit\s*=\s*)"[^"]*"/, (_all, begin) => `${begin}"${unit}"`)
        : `${name} = ${whole}`;
      return lines.join("\n");
    }
  }
  if (section.includes(".")) throw new Refusal(`${section}.${name}: expected its entry under [[${section.split(".")[0]}]] in the hammer file, one constant a line`);
  const added = `${name} = { value = ${value}, ${unit === "1" ? "" : `unit = "${unit}", `}status = "assumed", source = "set in the studio" }`;
  if (last < 0 && section) lines.push(`[${section}]`, added, "");
  else lines.splice(last + 1, 0, added);
  return lines.join("\n");
}

function scriptOf(state, hammer) {
  const lines = ["import printhammer as ph", ""];
  lines.push(hammer.shipped ? `hammer = ph.load(${python(state.hammer)})` : `hammer = ph.Hammer.from_toml(${JSON.stringify(hammer.text)})`);
  const changes = Object.entries(state.constants).sort();
  if (changes.length) lines.push("hammer = hammer.replace(", "    {", ...changes.map(([key, value]) => `        ${python(key)}: ${python(value)},`), "    }", ")");
  if (state.waveform?.shape === "sine") {
    const { amplitude, phase } = state.waveform;
    const force = `${python(amplitude)}, ${python(state.rate)}${phase ? `, phase=${python(phase)}` : ""}`;
    const duration = written((state.pattern.length || state.pulses) / state.rate);
    return [...lines, `motion = ph.simulate(hammer, ph.SineForce(${force}), duration=${duration})`, "print(motion.energy)", ""].join("\n");
  }
  let waveform = "hammer.waveform";
  if (state.waveform) {
    const { shape, ...fields } = state.waveform;
    lines.splice(1, 0, `from printhammer.drive.waveforms.shapes import ${CLASSES[shape]}`);
    const { times, values, quantity } = fields;
    lines.push(shape === "sampled"
      ? `waveform = Sampled.from_samples(${python(times)}, ${python(values)}, quantity=${python(quantity)})`
      : `waveform = ${CLASSES[shape]}(${Object.entries(fields).map(([key, value]) => `${key}=${python(value)}`).join(", ")})`);
    waveform = "waveform";
  }
  const overlap = state.overlap === "add" ? "" : `, overlap=${python(state.overlap)}`;
  if (state.pattern) lines.push(`times = [slot / ${python(state.rate)} for slot, mark in enumerate(${python(state.pattern)}) if mark == "1"]`, `drive = ph.PulseTrain(${waveform}, at=times${overlap})`);
  else lines.push(`drive = ph.PulseTrain(${waveform}, rate=${python(state.rate)}, pulses=${state.pulses}${overlap})`);
  return [...lines, "motion = ph.simulate(hammer, drive)", "print(motion.dots)", ""].join("\n");
}

function commandOf(state, { shipped }) {
  const hammer = Object.keys(state.constants).length || !shipped ? HAMMER_FILE : state.hammer;
  const periods = state.waveform?.shape === "sine" ? ` --duration '${written((state.pattern.length || state.pulses) / state.rate)} s'` : "";
  if (periods) return `printhammer run ${hammer} --drive ${DRIVE_FILE}${periods}`;
  if (state.waveform || state.pattern) return `printhammer run ${hammer} --drive ${DRIVE_FILE}`;
  return `printhammer run ${hammer} --rate '${written(state.rate)} Hz' --pulses ${state.pulses}${state.overlap === "add" ? "" : ` --overlap ${state.overlap}`}`;
}
