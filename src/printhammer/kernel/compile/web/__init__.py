"""WebAssembly: the entry points of a hammer's kernel as a module, and how JavaScript calls it."""
