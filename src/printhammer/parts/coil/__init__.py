"""Laws of the circuit of the coil."""
