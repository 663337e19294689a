"""Drives: firing times and waveforms."""
