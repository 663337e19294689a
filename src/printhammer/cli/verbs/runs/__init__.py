"""Verbs of runs, and of what shows them: maps, sweeps, figures, the report, the studio."""
