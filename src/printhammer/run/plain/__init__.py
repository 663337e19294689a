"""Plain functions of numbers and arrays: entry points of the web page, and scales and windows of runs."""
