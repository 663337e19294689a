"""Compilation of the kernel for a combination of force laws: lowering, linking, code generation, cache."""
