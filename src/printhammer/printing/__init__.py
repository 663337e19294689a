"""Print quality: single dots (`dots`), safe rates and yields (`rates`), and printed pages (`page`).

Every computation takes a hammer and a pattern, simulates ensembles, and returns a frozen result that can be
tabulated and plotted.
"""
