"""What a hammer prints: patterns of dots and how well they come out, quality, safe rate, pages.

Everything here takes a hammer and what is to be printed, runs ensembles, and returns frozen results that can
be tabulated and drawn.
"""
