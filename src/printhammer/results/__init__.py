"""Results: what they hold, and their files."""
