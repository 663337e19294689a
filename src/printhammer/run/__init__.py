"""Running a hammer: what is fired, how it moves and what it touches."""
