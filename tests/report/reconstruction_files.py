"""Made-up results of a reconstruction, in the format of its data files."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

BEST = {
    "value": {"net_over_magnet_force": 0.39},
    "holds": True,
    "constants": {"mass": 4e-4},
    "costs": ["settle_out"],
}
SAMPLE: dict[str, Any] = {
    "base_rates": {
        "format": 1,
        "hammers": 1000,
        "seed": 7,
        "space": {"mass": [2e-4, 2e-3, "kg"]},
        "claims": {"settle_out": {"measured": 900, "holds": 9}, "poincare": {"measured": 0, "holds": 0}},
        "poincare_panels": {"1.35 ms": {"measured": 500, "as_printed": 100}},
    },
    "predictions": {
        "format": 1,
        "seed": 7,
        "candidates": 4000,
        "hammers": 20,
        "stated_held": ["geometry"],
        "claims": {"settle_out": {"kind": "shape", "measured": 20, "holds": 3}},
    },
    "search": {
        "format": 1,
        "shipped": "ab" * 32,
        "searches": [
            {"aim": "stated", "seed": 7, "candidates": 4000},
            {"aim": "all", "seed": 8, "candidates": 9000},
        ],
        "core_hours": 4.5,
        "tolerance": 2e-11,
        "waveform": "rectangle",
        "gauge": "the print force",
        "failing": {"release_margin": {"value": {"net_over_magnet_force": 0.41}, "why": "so", "best": BEST}},
    },
    "family": {
        "format": 1,
        "hammers": [
            {
                "name": "family-01",
                "constants": {"mass": 4e-4},
                "verdicts": {"settle_out": "fails"},
                "panels": 9,
                "conclusions": {"safe_rate_Hz": 600.0},
            }
        ],
        "conclusions": {"safe_rate_Hz": {"low": 600.0, "high": 610.0, "robust": True, "text": "so"}},
    },
    "schemes": {
        "format": 1,
        "shipped": "ab" * 32,
        "panels": {"exact": ["period-1"] * 12, "runge-kutta-4, look-ahead": ["strange"] * 12},
        "claims": {"settle_out": "holds", "two_pulses_660us": "fails"},
        "family": {"family-01": {"exact": 9, "computed": 5, "same": 6}},
        "hammers": 10,
        "seed": 7,
        "changes": [
            {
                "first": "exact",
                "second": "runge-kutta-4, look-ahead",
                "panels": 120,
                "differ": 30,
                "share": 0.25,
                "share_error": 0.06,
                "periodic_to_strange": 14,
                "strange_to_periodic": 1,
            }
        ],
    },
}


def write(folder: Path, **changes: Any) -> Path:
    """Write the files, with some files changed, or omitted if their change is None."""
    for name, content in {**SAMPLE, **changes}.items():
        if content is not None:
            (folder / f"{name}.json").write_text(json.dumps(content))
    return folder


def changed(name: str, *steps: Any, to: Any) -> dict[str, Any]:
    """Return a file with one value changed, addressed by its name."""
    document = deepcopy(SAMPLE[name])
    place = document
    for step in steps[:-1]:
        place = place[step]
    place[steps[-1]] = to
    return {name: document}
