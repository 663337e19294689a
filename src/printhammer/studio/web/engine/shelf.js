// The hammers of the page with their modules, unpacked from the text in which Python has embedded them.
import { readersOf } from "./read.js";

async function unpacked(text) {
  const packed = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip")));
}

/** Unpack the content of the page. */
export async function shelfOf(text) {
  const content = await (await unpacked(text)).json();
  const { names, hammers, modules, limits, vocabulary, version, sentences, stateFile } = content;
  const compiled = modules.map(() => null);
  return {
    names, hammers, limits, vocabulary, start: {}, version, sentences, stateFile, noFiles: sentences.files,
    readers: readersOf(limits, vocabulary),
    /** The compiled module of a hammer; each is compiled once. */
    module(name) {
      const { module } = hammers[name];
      compiled[module] ??= unpacked(modules[module]).then((response) => response.arrayBuffer()).then((bytes) => WebAssembly.compile(bytes));
      return compiled[module];
    },
  };
}
