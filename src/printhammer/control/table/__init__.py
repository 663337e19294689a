"""Compensation tables: feedforward of pulse width and firing time as a function of a dot's history."""
