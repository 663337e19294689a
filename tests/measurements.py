"""Measurement tables for tests, from formulas that are independent of the package."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

B = 5.08e-5
F0, AM, BM = 2.4, 0.44, 0.093
BS, AS = 14.3, 466e-6
STIFFNESS, THICKNESS = 260.0, 1.778e-4
RATIO = 0.36
"""l/k, s/m."""

SI = {
    "displacement": "m",
    "indentation": "m",
    "current": "A",
    "force": "N",
    "impact speed": "m/s",
    "rebound speed": "m/s",
}


def write(path: Path, columns: Mapping[str, Array], branch: list[str] | None = None) -> Path:
    """Write columns in SI."""
    heading = [f"{name} [{SI[name]}]" for name in columns]
    rows = [[repr(float(cell)) for cell in row] for row in zip(*columns.values(), strict=True)]
    if branch is not None:
        heading.append("branch")
        rows = [[*row, word] for row, word in zip(rows, branch, strict=True)]
    path.write_text("\n".join(",".join(row) for row in [heading, *rows]) + "\n", "utf-8")
    return path


def magnet(places: int = 12, currents: tuple[float, ...] = (0.0, 0.5, 1.0, 1.5, 2.0)) -> dict[str, Array]:
    grid = np.meshgrid(np.linspace(B, 3.81e-4, places), currents, indexing="ij")
    x, current = (axis.ravel() for axis in grid)
    force = F0 - (AM - BM * current) ** 2 * x**-0.5 + BS - BS * (x - B) / AS
    return {"displacement": x, "current": current, "force": force}


def spring(places: int = 15) -> dict[str, Array]:
    x = np.linspace(B, 3.81e-4, places)
    return {"displacement": x, "force": BS - BS * (x - B) / AS}


def pack(
    peaks: tuple[float, ...] = (60e-6, 90e-6, 110e-6), rows: int = 20
) -> tuple[dict[str, Array], list[str]]:
    depths, forces, branch = [], [], []
    for peak in peaks:
        up, down = np.linspace(0.0, peak, rows), np.linspace(peak, 0.0, rows + 1)[1:]
        depths += [up, down]
        forces += [STIFFNESS * (up / THICKNESS) ** 2.7]
        forces += [STIFFNESS * (peak / THICKNESS) ** 2.7 * (down / peak) ** 11]
        branch += ["loading"] * rows + ["unloading"] * rows
    return {"indentation": np.concatenate(depths), "force": np.concatenate(forces)}, branch


@cache
def rebound(speed: float) -> float:
    """Solve the restitution law by the Lambert function."""
    with mpmath.workdps(40):
        z = mpmath.mpf(RATIO) * mpmath.mpf(speed)
        y = 1 + mpmath.lambertw(-mpmath.exp(-(1 + z - mpmath.log1p(z))))
        return float(y.real / mpmath.mpf(RATIO))


def rebounds(count: int = 30) -> dict[str, Array]:
    speed = np.linspace(0.1, 1.6, count)
    return {"impact speed": speed, "rebound speed": np.array([rebound(v) for v in speed])}
