"""Description of the machine on which a benchmark runs."""

from __future__ import annotations

import os
import platform
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from printhammer import __version__
from printhammer.support.threads import thread_count


def machine() -> dict[str, str]:
    """Return processor, number of cores, current load, system and package versions as text."""
    processor, wide, busy = platform.processor() or platform.machine(), "", "unknown"
    with suppress(OSError):
        info = Path("/proc/cpuinfo").read_text("utf-8")
        names = [line for line in info.splitlines() if line.startswith("model name")]
        processor = names[0].partition(":")[2].strip() if names else processor
        vectors = (("avx512f", "AVX-512"), ("avx2", "AVX2"))
        wide = next((f", {name}" for flag, name in vectors if flag in info), "")
    with suppress(OSError, AttributeError):
        busy = f"{os.getloadavg()[0]:.1f}"
    return {
        "processor": f"{processor} ({platform.machine()}{wide})",
        "cores": str(thread_count(None)),
        "other load before the run": busy,
        "system": platform.system(),
        "Python": platform.python_version(),
        "printhammer": __version__,
        "NumPy": version("numpy"),
        "Numba": version("numba"),
        "llvmlite": version("llvmlite"),
    }
