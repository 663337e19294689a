"""One small result of every class, by the name of the class."""

from collections.abc import Callable

from printhammer.hammer.hammer import Hammer
from printhammer.results import Result


def strobe(hammer: Hammer) -> Result:
    from printhammer.chaos.strobe import strobe

    return strobe(hammer, period=1.3e-3, points=5, verdict=False)


SAMPLES: dict[str, Callable[[Hammer], Result]] = {
    "Strobe": strobe,
}
