"""Compensation tables: feedforward of pulse width and firing time by the history of a dot."""
