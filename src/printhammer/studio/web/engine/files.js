// Files dropped on the page: a state, a hammer, a drive, measured curves.
import { driveOf, isDrive, tomlOf } from "./drive.js";
import { readFile, Refusal } from "./read.js";
import { recordOf } from "./records.js";

/** Read a dropped file; returns what it holds, or refuses it in a sentence. */
export function dropped({ name, text, columns }, shelf) {
  const where = name.slice(-80) || "dropped file";
  const most = shelf.limits.LARGEST_FILE;
  if (text.length > most) throw new Refusal(`${where} has ${text.length} characters: expected at most ${most}`);
  if (/\.json$/i.test(name)) return { what: "state", ...readFile(text, where, shelf) };
  if (!/\.toml$/i.test(name)) return recordOf(text, where, columns, shelf.limits);
  const document = tomlOf(text, where, shelf.limits);
  if (!isDrive(document)) {
    shelf.adopt(text);
    return { what: "hammer", name: where, text };
  }
  return { what: "drive", name: where, patch: driveOf(document, shelf, where) };
}
