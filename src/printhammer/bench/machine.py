"""What a benchmark ran on."""

from __future__ import annotations

import os
import platform
from contextlib import suppress
from importlib import metadata
from pathlib import Path


def machine() -> dict[str, str]:
    """Return processor, cores, how busy they are now, system and versions, in words."""
    import numba
    import numpy

    import printhammer

    processor = platform.processor() or platform.machine()
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                processor = line.partition(":")[2].strip()
                break
    wide = ""
    with suppress(OSError):
        flags = Path("/proc/cpuinfo").read_text("utf-8")
        wide = next(
            (f", {name}" for flag, name in (("avx512f", "AVX-512"), ("avx2", "AVX2")) if flag in flags), ""
        )
    busy = "unknown"
    with suppress(OSError, AttributeError):
        busy = f"{os.getloadavg()[0]:.1f}"
    return {
        "processor": f"{processor} ({platform.machine()}{wide})",
        "cores": str(cores()),
        "other load before the run": busy,
        "system": platform.system(),
        "Python": platform.python_version(),
        "printhammer": printhammer.__version__,
        "NumPy": numpy.__version__,
        "Numba": numba.__version__,
        "llvmlite": metadata.version("llvmlite"),
    }


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
