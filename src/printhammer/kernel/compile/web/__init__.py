"""WebAssembly modules with the entry points of a hammer's kernel, and their calls from JavaScript."""
