"""Compilation of the kernel for given force laws: lowering, linking, code generation and cache."""
