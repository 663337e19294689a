"""One small result of every class, by the name of the class."""

from collections.abc import Callable

from tests.chaos.samples import CHAOS

from printhammer.hammer.hammer import Hammer
from printhammer.results import Result

SAMPLES: dict[str, Callable[[Hammer], Result]] = {
    **CHAOS,
}
