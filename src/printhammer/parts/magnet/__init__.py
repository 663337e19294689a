"""Laws of the magnet."""
