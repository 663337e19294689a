"""Laws of the backstop."""
