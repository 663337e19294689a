from typing import TYPE_CHECKING

import pytest

from printhammer.claims import Context

if TYPE_CHECKING:
    import printhammer as ph


@pytest.fixture(scope="session")
def context(hammer: "ph.Hammer") -> Context:
    return Context(hammer)
