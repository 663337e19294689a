"""Slot rates: print quality at a rate, the safe rate, and the effects of tolerances and materials."""
