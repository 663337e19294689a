"""Plain functions of numbers and arrays: entry points of the page, and arithmetic of runs."""
