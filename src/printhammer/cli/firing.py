"""How the verbs of chaos are told what is fired for ever: by period or rate, or by a drive file."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.cli import options as opt
from printhammer.cli.runner import Job, tables_beside
from printhammer.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Firing


def firing_of(
    job: Job, hammer: Hammer, passed: dict[str, Any], example: str = "", *, timed: bool = True
) -> Firing:
    """Take the options that say how a hammer is fired out of those that are passed, for `Regime.of`.

    One of period and rate is asked for, with an example, where `timed`; a drive file stands instead: an
    endless force, or pulses at a constant rate. InputError where the hammer has nothing to fire, the file
    holds anything else, or more is given than is asked for.
    """
    file: Path | None = passed.pop("drive", None)
    train = {name: passed.pop(name, None) for name in ("period", "rate", "overlap")}
    if file is None:
        if hammer.waveform is None:
            raise InputError(
                f"{hammer.path}: the hammer has no [waveform] to fire, expected one, or --drive FILE"
            )
        if timed:
            opt.need_one(train, f"{example}, or --drive FILE")
        firing: Firing = opt.given(**train)  # type: ignore[assignment]
        return firing
    from printhammer.drive.file import load_drive
    from printhammer.drive.trains import PulseTrain

    opt.refuse(train, f"none beside --drive {file}")
    drive = load_drive(file, hammer.waveform)
    job.check(*tables_beside(file, drive.waveform))
    if math.isinf(drive.waveform.support) and drive.period is not None:
        return {"drive": drive}
    if not isinstance(drive, PulseTrain) or drive.period is None:
        raise InputError(
            f"{file}: expected a force without end, [sine], or pulses at a constant rate, [train]"
        )
    return {"waveform": drive.waveform, "period": drive.period, "overlap": drive.overlap}
