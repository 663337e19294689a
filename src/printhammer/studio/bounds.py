"""Limits on the work and the size of a message."""

from __future__ import annotations

from typing import Final

LARGEST_MESSAGE: Final = 1_000_000
"""Largest size of a message to the server, bytes."""

LARGEST_FILE: Final = 400_000
"""Largest length of a dropped file, characters."""

MOST_DOTS: Final = 200
"""Largest number of dots in a key of a dropped file."""

LONGEST_REASON: Final = 500
"""Largest length of the reason of a refusal, characters."""

MOST_PULSES: Final = 64
"""Largest number of firings of a drive, and of slots of a pattern."""

RATES: Final = (10.0, 20e3)
"""Range of firing rates, Hz."""

LONGEST_TIME: Final = 0.5
"""Largest width, rise, decay or fall of a pulse, s."""

LARGEST_CURRENT: Final = 100.0
"""Largest amplitude, A or N."""

LARGEST_VOLTAGE: Final = 1e4
"""Largest amplitude, V."""

LARGEST: Final = {"V": LARGEST_VOLTAGE, "ohm": 1e6}
"""Largest constants of a driver, by their units."""

SPAN: Final = 10.0
"""Largest factor between a constant and its value in the loaded hammer."""

MOST_STEPS: Final = 50_000
"""Step limit of a single run."""

MOST_MAP_STEPS: Final = 20_000
"""Step limit of one run, for views with many or long runs."""

MOST_SECTION_STEPS: Final = 60_000
"""Step limit of the run to the first points of a strobe section."""

MOST_WORK: Final = 20_000_000
"""Step limit of all runs of a printed line."""

ALIKE: Final = 1.25
"""Factor by which a constant may change before the work of a map is estimated again."""

PATIENCE: Final = 20.0
"""Time limit of a view, s; a view beyond it shows a message instead."""

MOST_SAMPLES: Final = 2000
"""Largest number of samples of a waveform, and of a measured curve."""

LONGEST_TEXT: Final = 200
"""Largest length of a printed line, characters."""

MOST_TABS: Final = 8
"""Largest number of simultaneous connections."""
