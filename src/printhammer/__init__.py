"""A laboratory for impact print hammers.

Give it a hammer, described by constants that can be measured, and a drive, and it tells how the hammer moves,
what it prints and when it turns chaotic. Inside, every quantity is in SI.

The public names stand in `__init__.pyi` and are imported on first use, so that importing the package costs
nothing. The module `printhammer.sweep` does not hide the function of that name: the loader sees to it.
"""

from lazy_loader import attach_stub

__version__ = "0.1.0"

__getattr__, _, __all__ = attach_stub(__name__, __file__)
__all__ += ["__version__"]


def __dir__() -> list[str]:
    return sorted(__all__)
