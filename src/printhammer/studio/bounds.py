"""How much one message may ask for, and how large it may be."""

from __future__ import annotations

from typing import Final

LARGEST_MESSAGE: Final = 1_000_000
"""Bytes of one message to the server."""

LARGEST_FILE: Final = 400_000
"""Characters of a dropped file."""

MOST_DOTS: Final = 200
"""Dots in a key of a dropped file."""

LONGEST_REASON: Final = 500
"""Characters of the reason why something is refused."""

MOST_PULSES: Final = 64
"""Firings of a drive, and slots of a pattern."""

RATES: Final = (10.0, 20e3)
"""Firing rates, Hz."""

LONGEST_TIME: Final = 0.5
"""Longest width, rise, decay or fall of a pulse, s."""

LARGEST_CURRENT: Final = 100.0
"""Largest amplitude, A or N."""

LARGEST_VOLTAGE: Final = 1e4
"""Largest amplitude, V."""

LARGEST: Final = {"V": LARGEST_VOLTAGE, "ohm": 1e6}
"""Largest constants of a driver, by their units."""

SPAN: Final = 10.0
"""Factor by which a constant may differ from the one of the hammer that is loaded."""

MOST_STEPS: Final = 50_000
"""Steps after which a run is given up."""

MOST_MAP_STEPS: Final = 20_000
"""Steps of one run, for a view that takes many runs or long ones."""

MOST_SECTION_STEPS: Final = 60_000
"""Steps of the run to the first points of a strobe section."""

MOST_WORK: Final = 20_000_000
"""Steps of all runs of a printed line."""

ALIKE: Final = 1.25
"""Factor by which a constant may move before the work of a map is tried out anew."""

PATIENCE: Final = 20.0
"""Seconds after which work on a view is given up; what takes longer is told so instead."""

MOST_SAMPLES: Final = 2000
"""Samples of a waveform, and of a measured curve."""

LONGEST_TEXT: Final = 200
"""Characters of a printed line."""

MOST_TABS: Final = 8
"""Connections at a time."""
