"""Scripts of pages and of the gallery: run in this process or in a separate interpreter."""

import os
import runpy
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib import pyplot as plt

from printhammer.kernel.compile import cache, specialise
from printhammer.parts import PARTS

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


def run_here(script: Path, folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Run a script in a folder as the main program of this process, and undo its side effects.

    A separate interpreter takes three seconds to import the package. The traceback of an error names the
    script and the line.
    """
    parts, loaded, style = dict(PARTS), set(sys.modules), mpl.rcParams.copy()
    patch.chdir(folder)
    patch.setattr(tempfile, "tempdir", str(folder))
    patch.setattr(sys, "argv", [str(script)])
    patch.setattr(sys, "path", [str(script.parent), str(EXAMPLES), *sys.path])
    # Verbs that ran before in this process announce compilations on the standard error.
    patch.setattr(cache, "listeners", set())
    patch.setattr(specialise, "begin_ahead", None)
    try:
        runpy.run_path(str(script), run_name="__main__")
    finally:
        plt.close("all")
        mpl.rcParams.update(style)
        PARTS.clear()
        PARTS.update(parts)
        for name in set(sys.modules) - loaded:
            if Path(getattr(sys.modules[name], "__file__", None) or os.devnull).parent == EXAMPLES:
                del sys.modules[name]


def run_apart(script: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a script in a folder with a separate interpreter, in which warnings are errors."""
    path = f"{ROOT}{os.pathsep}{EXAMPLES}"
    done = subprocess.run(
        [sys.executable, "-W", "error", str(script)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "MPLBACKEND": "Agg", "TMPDIR": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done
