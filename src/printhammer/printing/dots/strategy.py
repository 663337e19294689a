"""Strategies: from what is wanted to a drive. Open loop here; tables and feedback are others of the kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from printhammer.drive.batch import PulseTrains, firings_of
from printhammer.errors import InputError
from printhammer.printing.dots.nominal import pulse_of
from printhammer.printing.dots.slots import slot_times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer


class Strategy(Protocol):
    """A way to drive a hammer: a function that gives a drive for each pattern.

    It is called with the hammer that is driven, which may differ from the one that the strategy was made for,
    the patterns as the numbers of the slots at which dots are wanted, and the slots per second, Hz. Each
    drive has one firing for each wanted dot, in order; slot 0 is at `FIRST_SLOT` of
    `printhammer.printing.dots.slots`, so that a dot may be fired ahead of its slot. What it gives for a
    pattern must not depend on the others.
    """

    def __call__(
        self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float, /
    ) -> Sequence[Drive]:
        """Return a drive for each pattern."""
        ...


def open_loop(hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> Sequence[Drive]:
    """Fire the waveform of the hammer at every slot at which a dot is wanted, whatever the hammer does.

    Raises
    ------
    InputError
        The hammer has no waveform.
    """
    return OpenLoop()(hammer, patterns, rate)


class OpenLoop:
    """As `open_loop`, with another waveform than that of the hammer.

    Parameters
    ----------
    waveform : Waveform, optional
        What is fired.
    """

    name = "open loop"

    def __init__(self, waveform: Waveform | None = None) -> None:
        self.waveform = waveform

    def __call__(self, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float) -> Sequence[Drive]:
        """Return a drive for each pattern."""
        if not patterns:
            return []
        return PulseTrains(pulse_of(hammer, self.waveform), [slot_times(slots, rate) for slots in patterns])


def checked_drives(
    strategy: Strategy, hammer: Hammer, patterns: Sequence[tuple[int, ...]], rate: float
) -> Sequence[Drive]:
    """Return the drives of a strategy.

    Raises
    ------
    InputError
        It gives another number of drives, or drives with another number of firings, than is wanted.
    """
    drives = strategy(hammer, patterns, rate)
    if len(drives) != len(patterns):
        raise InputError(f"the strategy gives {len(drives)} drives, expected {len(patterns)}")
    for slots, count in zip(patterns, firings_of(drives).counts.tolist(), strict=True):
        if count != len(slots):
            raise InputError(
                f"the strategy gives {count} firings for the slots {slots}, expected {len(slots)}"
            )
    return drives


def name_of(strategy: Strategy) -> str:
    """Return the name of a strategy, such as "open loop"."""
    name = getattr(strategy, "name", None) or getattr(strategy, "__name__", type(strategy).__name__)
    return str(name).replace("_", " ")
