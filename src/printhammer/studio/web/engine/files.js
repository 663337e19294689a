// Files dropped on the page: a state, a hammer, a drive, measured curves.
import { driveOf, isDrive, tomlOf } from "./drive.js";
import { readFile, Refusal } from "./read.js";
import { recordOf } from "./records.js";
import { sizeOf } from "./table.js";

/** Read a dropped file; returns what it holds, or refuses it in a sentence. */
export function dropped({ name, text, columns }, shelf) {
  const where = name.slice(-80) || "dropped file";
  const [isState, isToml] = [/\.json$/i.test(name), /\.toml$/i.test(name)];
  const most = isState ? shelf.limits.LARGEST_MESSAGE : shelf.limits.LARGEST_FILE;
  // Of a long table, lines were left empty.
  const size = isState || isToml ? text.length : sizeOf(text);
  if (size > most) throw new Refusal(`${where} has ${size} characters: expected at most ${most}`);
  if (isState) return { what: "state", ...readFile(text, where, shelf) };
  if (!isToml) return recordOf(text, where, columns, shelf.limits);
  const document = tomlOf(text, where, shelf.limits);
  if (!isDrive(document)) {
    shelf.adopt(text);
    return { what: "hammer", name: where, text };
  }
  return { what: "drive", name: where, patch: driveOf(document, shelf, where) };
}
