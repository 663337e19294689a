"""Model: laws, force sum, modes, drive at an instant, and derivatives of the laws."""
