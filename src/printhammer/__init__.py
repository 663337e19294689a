"""A laboratory for impact print hammers.

From a hammer, described by constants that can be measured, and a drive, the package computes how the hammer
moves, what it prints, and when its motion becomes chaotic. Internally, every quantity is in SI.

The public names are listed in `__init__.pyi` and imported on first use, so that importing the package takes
no time. The lazy loader ensures that `printhammer.sweep` is the function, not the subpackage of the same
name.
"""

from lazy_loader import attach_stub

__version__ = "0.1.0"

__getattr__, _, __all__ = attach_stub(__name__, __file__)
__all__ += ["__version__"]


def __dir__() -> list[str]:
    return sorted(__all__)
