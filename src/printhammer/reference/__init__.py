"""The reference: slow and independent on purpose, sharing no code with the kernel."""
