"""The numerical kernel: arrays and numbers only, no units, files or pictures."""
