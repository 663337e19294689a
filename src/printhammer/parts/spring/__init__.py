"""Laws of the spring."""
