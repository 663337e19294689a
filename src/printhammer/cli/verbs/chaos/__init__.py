"""Verbs of a hammer that is fired for ever: periodic, strange, and what lies between."""
