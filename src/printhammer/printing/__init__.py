"""What a hammer prints: `dots` one by one, the `rates` at which they come out well, and whole `page`s.

Everything here takes a hammer and what is to be printed, runs ensembles, and returns frozen results that can
be tabulated and drawn.
"""
