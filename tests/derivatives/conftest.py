"""A kernel that hangs must fail a test in this folder too."""

from tests.kernel.conftest import _few_steps  # noqa: F401
