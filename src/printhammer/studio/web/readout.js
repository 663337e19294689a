// What every view tells at the time of the cursor, which is the same in all.
import { said } from "./captions.js";
import { displacementAt, valueAt } from "./curves.js";
import { shown, unitOf } from "./units.js";

const small = (value, most) => (Math.abs(value) < 1e-4 * most ? 0 : value);

/** The firing that was the last one before a time, or nothing. */
function firingAt(motion, time) {
  let last = -1;
  for (const fired of motion.fired) if (fired <= time) last += 1;
  return last;
}

/** The voltage across the coil at a time, behind a sign; nothing where none drives it. */
export const voltageAt = (motion, time, sign) => (motion.data.u ? `${sign}${shown(small(valueAt(motion, motion.data.u, time), 100), "V", 3)}` : "");

const TEXTS = {
  motion: ({ motion }, time) => `${shown(time, "s")}: ${shown(displacementAt(motion, time), "m")}, ${shown(valueAt(motion, motion.data.v, time), "m/s", 3)}, ${shown(small(valueAt(motion, motion.data.drive, time), motion.peak || 1), motion.quantity === "force" ? "N" : "A", 3)}${voltageAt(motion, time, ", ")}`,
  forces: ({ motion }, time, _studio, wide) => {
    const unit = unitOf("N");
    const number = (force) => Number((force * unit.factor).toPrecision(3));
    const parts = ["drive", "magnet", "spring", "pack", "backstop", "damping", "drag"].filter((name) => `F ${name}` in motion.data).map((name) => [name, small(valueAt(motion, motion.data[`F ${name}`], time), 100)]).filter(([, force]) => force).sort((one, other) => Math.abs(other[1]) - Math.abs(one[1]));
    return `${parts.slice(0, wide ? 6 : 1).map(([name, force]) => `${name} ${number(force)}, `).join("")}total ${number(small(valueAt(motion, motion.data["F total"], time), 100))} ${unit.name}`;
  },
  phase: ({ motion }, time) => `${shown(displacementAt(motion, time), "m")}, ${shown(valueAt(motion, motion.data.v, time), "m/s", 3)}`,
  loops: ({ motion }, time) => {
    const [pack, stop] = [-valueAt(motion, motion.data["F pack"], time), valueAt(motion, motion.data["F backstop"], time) + valueAt(motion, motion.data["F damping"], time)];
    const nothing = Math.max(Math.abs(stop), Math.abs(pack)) < 1e-3;
    return `${shown(displacementAt(motion, time), "m")}: ${nothing ? "no contact" : Math.abs(stop) > Math.abs(pack) ? `backstop ${shown(stop, "N", 3)}` : `pack ${shown(pack, "N", 3)}`}`;
  },
  map: ({ map }, time, studio) => {
    if (map?.reason !== "") return "";
    const x = studio.views.map.valueAt(time, studio.store.state.rate);
    return x === null ? "" : `${shown(studio.store.state.rate, "Hz")}: ${shown(x, "m")}`;
  },
  strobe: ({ motion, strobe }, time) => {
    const k = firingAt(motion, time);
    return strobe?.reason === "" && k >= 0 && k < strobe.data.x.length ? `firing ${k + 1}: ${shown(strobe.data.x[k], "m")}, ${shown(strobe.data.v[k], "m/s", 3)}` : "";
  },
  energy: ({ motion, dots }, time) => {
    const dot = dots?.energy && dots.dots[firingAt(motion, time)];
    if (!dot) return "";
    return dot.struck ? `dot ${dot.index + 1}: ${shown(dot.loading_work, "J", 3)}, ${dot.net_loss > dot.loading_work ? `kept ${shown(dot.net_loss, "J", 3)}, pushed again` : `kept ${Math.round((100 * dot.net_loss) / dot.loading_work)} %`}` : `dot ${dot.index + 1}: lost`;
  },
  line: ({ motion, dots }, time) => {
    const dot = dots?.dots[firingAt(motion, time)];
    if (!dot) return "";
    return dot.struck ? `dot ${dot.index + 1}: ${shown(dot.peak_force, "N", 3)} after ${shown(dot.flight_time, "s", 4)}` : `dot ${dot.index + 1}: lost`;
  },
};

/** Return what a view tells at the cursor, more of it where it is wide; nothing where the time is at its beginning. */
export function readoutOf(name, studio, wide = false) {
  const { frames, cursor } = studio;
  if (!frames.motion || !(cursor > 0) || !TEXTS[name]) return "";
  return said(TEXTS[name](frames, cursor, studio, wide), studio.described);
}
