"""Waveforms: what one firing does, current or force against time."""
