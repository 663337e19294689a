"""Limits of the studio: sizes of messages and files, ranges of inputs, and computation time."""

from __future__ import annotations

from typing import Final

LARGEST_MESSAGE: Final = 1_000_000
"""Largest size of a message to the server, bytes."""

LARGEST_FILE: Final = 400_000
"""Largest length of a file dropped on the page, characters."""

MOST_DOTS: Final = 200
"""Largest number of dots in a dotted TOML key of a file dropped on the page."""

LONGEST_REASON: Final = 500
"""Largest length of the reason in a refusal frame, characters."""

MOST_PULSES: Final = 64
"""Largest number of firings of a drive, and of slots of a pattern."""

RATES: Final = (10.0, 20e3)
"""Range of firing rates, Hz."""

LONGEST_TIME: Final = 0.5
"""Largest width, rise, decay or fall of a pulse, s."""

LARGEST_CURRENT: Final = 100.0
"""Largest amplitude of a current or force pulse, A or N."""

LARGEST_VOLTAGE: Final = 1e4
"""Largest amplitude of a voltage pulse, V."""

LARGEST: Final = {"V": LARGEST_VOLTAGE, "ohm": 1e6}
"""Largest value of a driver's constant, by its unit."""

SPAN: Final = 10.0
"""Largest factor by which a control may change a constant from its value in the loaded hammer."""

MOST_STEPS: Final = 50_000
"""Step limit of the single run that the curves show."""

MOST_MAP_STEPS: Final = 20_000
"""Step limit of each run of a view that needs many runs, such as the map."""

MOST_SECTION_STEPS: Final = 60_000
"""Step limit of the run to the first points of a strobe section."""

MOST_WORK: Final = 20_000_000
"""Limit on the total number of steps of all runs of a printed line."""

ALIKE: Final = 1.25
"""Factor by which a constant may change before the work of a map is estimated again."""

PATIENCE: Final = 20.0
"""Time limit for computing a view, s; a view that exceeds the limit shows a message instead."""

MOST_SAMPLES: Final = 2000
"""Largest number of samples of a waveform, and of a measured curve."""

LONGEST_TEXT: Final = 200
"""Largest length of a printed line, characters."""

MOST_TABS: Final = 8
"""Largest number of pages connected at the same time."""
