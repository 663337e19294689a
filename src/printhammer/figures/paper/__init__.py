"""Figures 2 to 11 of the paper, one function per figure."""
