"""Compiling: the compiler's setting, and the kernel of one combination of laws."""
