"""The model: laws, force sum, modes, drive at an instant, and slopes of the laws."""
