"""Provenance of results: inputs, versions and settings by which a result can be reproduced.

| key | |
|---|---|
| `hammer`, `hammer_fingerprint` | name of the hammer and fingerprint of its constants |
| `drive`, `drive_fingerprint` | description and fingerprint of the drive, for results with one drive |
| `waveform` | waveform of every firing, as the ``[waveform]`` table of a drive file, on one line of TOML |
| `overlap` | rule for overlapping pulses, "add" or "replace" |
| `period` | time between the firings of a regime, s |
| `scheme` | the integration scheme of a single run |
| `tolerance` | error allowed in one step |
| `status` | outcome of the run, for results of a single run |
| `printhammer`, `numpy`, `llvmlite`, `scipy` | versions that determine the exact bits of a result |

Keys that do not apply to a result are omitted; the versions are always present.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import version
from typing import Any, Final

from printhammer.drive.text import inline, waveform_text
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer

VERSIONS: Final = ("printhammer", "numpy", "llvmlite", "scipy")
"""Provenance keys of the package versions, which every result states."""

KEYS: Final = (
    "hammer",
    "hammer_fingerprint",
    "drive",
    "drive_fingerprint",
    "waveform",
    "overlap",
    "period",
    "scheme",
    "tolerance",
    "status",
    *VERSIONS,
)
"""All provenance keys, in order of display."""


def provenance(
    *,
    hammer: Hammer | None = None,
    drive: Drive | None = None,
    waveform: Waveform | None = None,
    overlap: str | None = None,
    period: float | None = None,
    scheme: str | None = None,
    tolerance: float | None = None,
    status: str | None = None,
) -> dict[str, Any]:
    """Return the provenance of a result; a drive adds its waveform and overlap rule."""
    if drive is not None:
        # A sequence has several waveforms, none of which represents the drive.
        waveform = drive.waveform if waveform is None and drive.uniform else waveform
        overlap = drive.overlap if overlap is None else overlap
    known = {
        "hammer": None if hammer is None else hammer.name,
        "hammer_fingerprint": None if hammer is None else hammer.fingerprint,
        "drive": None if drive is None else repr(drive),
        "drive_fingerprint": None if drive is None else drive.fingerprint,
        "waveform": None if waveform is None else inline(waveform_text(waveform)),
        "overlap": overlap,
        "period": period,
        "scheme": scheme,
        "tolerance": None if tolerance is None else repr(float(tolerance)),
        "status": status,
        **versions(),
    }
    return {key: value for key, value in known.items() if value is not None}


def versions() -> dict[str, str]:
    """Return the versions of the packages that determine the exact bits of a result."""
    from printhammer import __version__

    return {"printhammer": __version__, **{name: _installed(name) for name in VERSIONS[1:]}}


@cache
def _installed(name: str) -> str:
    """Return the installed version of a package; cached."""
    return version(name)
