"""The time of impact without a sensor of its own: from samples of the current or the voltage of the coil."""
