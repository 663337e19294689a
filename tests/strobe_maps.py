"""The strobe map of one state, for tests."""

import numpy as np
import numpy.typing as npt

from printhammer.chaos.strobe.map import MAP_TOLERANCE, Image, image_of
from printhammer.run.regime import Regime


def strobe_map(
    regime: Regime,
    state: npt.ArrayLike,
    *,
    firings: int = 1,
    phase: float | None = None,
    tolerance: float = MAP_TOLERANCE,
    contacts: bool = True,
) -> Image:
    """Return the image of a state under the iterated strobe map, at a phase (default: of the regime)."""
    start = np.asarray(state, dtype=np.float64)
    return image_of(Regime.of(regime, phase=phase), start, firings, tolerance, contacts=contacts)
