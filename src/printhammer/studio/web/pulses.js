// The kinds of a pulse: currents, forces and drivers by voltage; what one begins with, and how far its constants go.
const START = { amplitude: 1, width: 3e-4, rise: 5e-5, decay: 5e-5, fall: 5e-5 };
const LONGEST = 2e-3;
const TWICE = 2; // the rail in the voltage that drives the peak current for ever

const short = (value) => Number(value.toPrecision(4));

export const isDriver = (studio, wave) => studio.drivers.includes(wave?.shape);

/** Return the resistance of the coil as it is set, or is taken where the file states none, ohm. */
function resistanceOf(studio) {
  const { described, store } = studio;
  const own = [...described.constants, ...described.open].find((constant) => constant.key === "coil.resistance");
  return store.state.constants["coil.resistance"] ?? own?.value ?? 10;
}

/** Return the voltage against which the current of a driver decays, V. */
export const decayVoltage = (wave) => wave.decay_voltage ?? (wave.decay === "rail" ? wave.voltage : 0.7);

/** Return a pulse of another shape that does about what the one before did. */
export function startOf(studio, shape, before) {
  const fields = studio.shapes[shape];
  const wanted = { shape };
  const driver = studio.drivers.includes(shape);
  const was = isDriver(studio, before);
  const resistance = resistanceOf(studio);
  const { waveform: own, rail } = studio.described;
  // The hammer's own one comes back as it was.
  if (driver !== was && own?.shape === shape) return { ...own };
  const known = driver && !was ? { ...(isDriver(studio, own) ? own : rail) } : { ...before };
  const start = { ...START };
  if (driver) {
    const voltage = known.voltage ?? TWICE * resistance;
    const most = voltage / resistance; // reached after long
    Object.assign(start, {
      voltage, upper: 0.4 * most, lower: 0.32 * most, peak_time: 0.5 * known.width, hold_upper: 0.2 * most, hold_lower: 0.16 * most,
      capacitance: (4 * known.width) / resistance, charging_resistance: 10 * resistance, reverse: 0.3 * known.width,
    });
    wanted.decay = known.decay ?? "diode";
  } else if (was) {
    start.amplitude = before.voltage / (TWICE * resistance);
    for (const name of ["decay", "rise", "fall"]) delete known[name];
  }
  for (const field of fields) {
    const { name, optional } = field;
    const kept = typeof known[name] === "number" ? known[name] : null;
    const begin = name in start ? start[name] : field.start;
    wanted[name] = kept ?? (name === "off_time" || name === "decay_voltage" ? null : short(begin));
    if (optional && name === "lower" && typeof known.off_time === "number") wanted[name] = null;
    if (name === "off_time") wanted[name] = known.off_time ?? null;
  }
  wanted.quantity = driver ? "voltage" : was ? studio.quantity() : before?.quantity ?? studio.quantity();
  return wanted;
}

/** Whether the page computes a pulse of another shape in the place of one: a driver needs a coil, and each quantity a kernel. */
export function isOffered(studio, shape, before) {
  const { rail, quantities } = studio.described;
  if (shape === "sampled") return true;
  return Boolean(rail || !studio.drivers.includes(shape)) && quantities.includes(startOf(studio, shape, before ?? {}).quantity);
}

/** Return the choices of a driver, each with what it changes: the path of its decay, how a chopper chops. */
export function choicesOf(studio, wave) {
  if (!isDriver(studio, wave)) return [];
  const paths = {
    name: "decay", hint: "Path of the current after the supply is switched off: through a diode, against a zener voltage, or back into the rail.", choices: studio.decays, get: (now) => now.decay,
    // A resistor is that of a diode: behind a zener, or into the rail, there is none until it is set.
    set: (decay, now) => ({ decay, decay_voltage: decay === "zener" ? short(now.decay_voltage ?? now.voltage) : null, ...(decay === "diode" ? {} : { decay_resistance: 0 }) }),
  };
  const chopping = {
    name: "chopped", hint: "Where a chopper switches on again: at a lower current, or after a fixed time.", choices: ["lower current", "fixed time"], get: (now) => (now.off_time === null ? "lower current" : "fixed time"),
    set: (way, now) => (way === "fixed time" ? { lower: null, off_time: short(Math.max(0.1 * now.width, 1e-6)) } : { lower: short(0.8 * now.upper), off_time: null }),
  };
  return wave.shape === "chopper" ? [paths, chopping] : [paths];
}

/** Whether a constant is moved by a slider: one of a choice that is not made has none. */
export const hasRow = (wave, name) => !(["lower", "off_time"].includes(name) && wave[name] === null);

/** Return where a slider moves a constant of a pulse whose own value is known: ends, and whether by factors or whole. */
export function reachOf(studio, wave, { name, unit, positive, least }, own) {
  const high = 3 * (Math.abs(own) || 1);
  if (unit === "s") return { low: positive ? 1e-6 : 0, high: Math.max(LONGEST / 2, 2 * own) };
  if (name === "coils") return { low: 1, high: Math.max(24, 2 * own), whole: true };
  if (name === "voltage") return { low: own / 20, high };
  if (name.endsWith("_voltage")) return { low: 0, high: name === "diode_voltage" ? Math.max(3, high) : Math.max(3 * wave.voltage, high) };
  if (unit === "F" || name === "charging_resistance") return { low: own / 100, high: 100 * own, log: true };
  if (unit === "ohm") return { low: 0, high: Math.max((name === "source_resistance" ? 1 : 10) * resistanceOf(studio), high) };
  if (least !== null) return { low: positive ? own / 20 : least, high };
  return { low: -high, high };
}

/** The longest width to which a pulse is dragged, s. */
export const longest = (own) => Math.max(LONGEST, 2 * own);
