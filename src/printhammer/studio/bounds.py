"""Limits of the studio: sizes of states and files, ranges of inputs, numbers of steps, and resolution."""

from __future__ import annotations

import math
from typing import Final

LARGEST_MESSAGE: Final = 1_000_000
"""Largest length of a state file, characters; arbitrary."""

LARGEST_FILE: Final = 400_000
"""Largest length of a file dropped on the page, characters; arbitrary."""

MOST_DOTS: Final = 200
"""Largest number of dots in a dotted TOML key of a file dropped on the page; arbitrary."""

LONGEST_REASON: Final = 500
"""Largest length of an error message about a refused input, characters; arbitrary."""

MOST_PULSES: Final = 64
"""Largest number of firings of a drive, and of slots of a pattern; arbitrary."""

RATES: Final = (0.01, 20e3)
"""Range of firing rates, Hz; arbitrary."""

LONGEST_TIME: Final = 0.5
"""Largest width, rise, decay or fall of a pulse, s; arbitrary."""

LARGEST_CURRENT: Final = 100.0
"""Largest amplitude of a current or force pulse, A or N; arbitrary."""

LARGEST_VOLTAGE: Final = 1e4
"""Largest amplitude of a voltage pulse, V; arbitrary."""

LARGEST: Final = {"V": LARGEST_VOLTAGE, "ohm": 1e6}
"""Largest value of a driver's constant, by its unit."""

SPAN: Final = 10.0
"""Largest factor by which a slider may change a constant from its value in the loaded hammer; arbitrary."""

SPAN_OF_PLACES: Final = 100e-6
"""Half the slider range of a position at 0 that is the only position of a device, m; arbitrary."""

QUARTER_TURN: Final = 0.5 * math.pi
"""Half the slider range of an angle, rad."""

MOST_STEPS: Final = 50_000
"""Step limit of the single run that the curves show; arbitrary."""

MOST_MAP_STEPS: Final = 20_000
"""Step limit per run of views that consist of many runs, such as the map; arbitrary."""

MOST_SECTION_STEPS: Final = 60_000
"""Step limit of the run that computes the first points of a strobe section; arbitrary."""

MOST_WORK: Final = 20_000_000
"""Limit on the total number of steps of all runs of a printed line; arbitrary."""

MOST_SAMPLES: Final = 2000
"""Largest number of samples of a waveform, and of a measured curve; arbitrary."""

LONGEST_TEXT: Final = 200
"""Largest length of a printed line, characters; arbitrary."""

POINTS: Final = 1600
"""Smallest number of points of a plotted curve; arbitrary."""

MOST_ENDS: Final = 20_000
"""Largest number of step ends of the integrator among the points of a plotted curve; arbitrary."""

PREVIEW: Final = {"false": (64, 128), "true": (32, 128)}
"""Numbers of rates and times of the coarse map, by whether a voltage drives the coil.

A run with a circuit takes about five times as long. Arbitrary."""

FULL: Final = (512, 512)
"""Numbers of rates and times of the full map; arbitrary."""

GAP: Final = 65535
"""Integer code of a map cell without a displacement."""

POINTS_OF_SECTION: Final = (25, 50, 100, 150, 200, 300, 400)
"""Numbers of strobe points after which the section is redrawn during its computation; arbitrary."""
