"""Search for periodic orbits, stable or not: close returns of motions, converged by Newton's method."""

from __future__ import annotations

from typing import Final, SupportsIndex, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.orbits.collection import Orbits
from printhammer.chaos.orbits.newton import ExactMaps, close_orbits
from printhammer.chaos.orbits.orbit import Orbit, no_orbit, orbit_of
from printhammer.chaos.orbits.stages import LONE, Search, shortest
from printhammer.chaos.strobe.map import MAP_EFFORT, read_state
from printhammer.drive.input import read_count
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.run.effort import Effort, InThreads, computation
from printhammer.run.regime import Fired, Regime

LONGEST: Final = 8
"""Default largest orbit period to search for, in firings; arbitrary."""

MOST_FIRINGS: Final = 64  # Largest orbit period that can be searched for, in firings; arbitrary
STARTS: Final = 1024
"""Default number of initial states of a search, in addition to the rest state; arbitrary."""
GUESSES: Final = 48
"""Default number of initial guesses for each orbit period and each block of starts; arbitrary."""
FOLLOW: Final = 2
"""Default largest period, in firings, of the orbits whose branches are followed; arbitrary."""


@computation
def orbits(
    hammer: Hammer | Regime,
    *,
    longest: SupportsIndex = LONGEST,
    starts: SupportsIndex = STARTS,
    guesses: SupportsIndex = GUESSES,
    follow: SupportsIndex = FOLLOW,
    effort: Effort = MAP_EFFORT,
    **firing: Unpack[Fired],
) -> Orbits:
    """Search for the periodic orbits of a hammer under a periodic drive, stable and unstable.

    Motions are simulated from rest and from states spread over the plane; each close return after a number of
    firings is an initial guess for Newton's method on the strobe map. The result does not depend on the
    number of threads.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer, or a regime; a hammer requires the keywords of `printhammer.Regime.of`. The search chooses
        the phase itself.
    longest : int, optional
        Largest orbit period to search for, in firings, at most 64.
    starts : int, optional
        Number of states, in addition to the rest state, from which motions are simulated, rounded up to 128,
        1024, 2048, 4096 and so on. A search with more starts or guesses finds all orbits of a search with
        fewer.
    guesses : int, optional
        Number of guesses for each orbit period, in each block of starts: the first 128, those up to 1024,
        those up to 2048, and so on. The number is rounded up to 8, 48, 96 and so on, and multiplied by eight
        for period 1, by four for period 2, and by two for periods 3 and 4. Further guesses are concatenations
        of known shorter orbits.
    follow : int, optional
        Largest period, in firings, of the orbits whose branches are followed, over drive periods up to 5 %
        shorter or longer. Where a branch returns to the drive period of the regime, a further orbit exists.
        If 0, no branch is followed.

    Returns
    -------
    Orbits
        Orbits, with the outcome of the guesses; a search that finds no orbit raises no exception.
    """
    regime = Regime.of_firing(hammer, firing)
    most, several = read_count(longest, "longest"), read_count(guesses, "guesses")
    count = read_count(starts, "starts")
    if most > MOST_FIRINGS:
        raise InputError.of("longest", most, f"at most {MOST_FIRINGS} firings", written=str(most))
    onward = read_count(follow, "follow", least=0)
    return Search(regime, most, several, onward, effort).run(count)


@computation
def orbit(
    regime: Regime,
    state: npt.ArrayLike,
    *,
    firings: SupportsIndex = 1,
    phase: float | None = None,
    effort: Effort = MAP_EFFORT,
    **_keywords: Unpack[InThreads],
) -> Orbit:
    """Find the periodic orbit near a state at a section, by Newton's method.

    Parameters
    ----------
    regime : Regime
        Hammer and periodic drive.
    state : array, shape (2,)
        Displacement [m] and velocity [m/s] at a section.
    firings : int, optional
        Number of firings after which the orbit repeats.
    phase : float, optional
        Phase of the section, by default that of the regime. The armature must not be moving out of the pack
        at the section, since its state would then include a memory.

    Returns
    -------
    Orbit
        The orbit, of fewer firings if the motion repeats after a divisor of `firings`. The status reports an
        orbit that is not found; no exception is raised.
    """
    regime, count = Regime.of(regime, phase=phase), read_count(firings, "firings")
    states = [read_state(state)]
    if count > MOST_FIRINGS:
        raise InputError.of("firings", count, f"at most {MOST_FIRINGS}", written=str(count))
    scales = regime.window.half_widths
    exact = ExactMaps(regime, effort)
    for _ in range(count - 1):
        images = exact(states[-1][np.newaxis], np.ones(1, np.int64))
        if images.reasons[0] or not np.isfinite(images.states).all():
            break
        states.append(images.states[0])
    # If one of the sections falls into the pack, the orbit is a single segment.
    segments = np.ones(count, np.int64) if len(states) == count else np.array([count])
    guess = np.array(states[: len(segments)])
    (closing,) = close_orbits(exact, guess[np.newaxis], segments[np.newaxis], scales, **LONE)
    if not closing.closed:
        return no_orbit(regime, count, effort.tolerance, closing.reason)
    return orbit_of(regime, shortest(closing, scales), effort.tolerance)
