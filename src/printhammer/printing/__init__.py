"""Print quality: single dots (`dots`), safe rates and yields (`rates`), and printed pages (`page`).

Each computation simulates a hammer on a dot pattern, in ensembles, and returns an immutable result that can
be tabulated and plotted.
"""
