"""Evaluate the claims of the paper for its hammer with a rail driver.

Run ``.venv/bin/python docs/measure/rail.py``, which takes some minutes.
"""

import runpy
from pathlib import Path

from measured import MOTION, Cell, Column, write

import printhammer as ph
from printhammer.claims.judging import judge_all

EXAMPLE = Path(__file__).parents[2] / "examples" / "behind_a_rail.py"
ROOMS = (*MOTION, "claims", "chaos", "derivatives", "maps", "printing")


def main() -> None:
    """Evaluate the claims for the hammer with a prescribed current and with rail drivers."""
    import matplotlib

    matplotlib.use("Agg")
    devices = runpy.run_path(str(EXAMPLE))["devices"]
    hammers = {"current": ph.load("hendriks-1983")}
    hammers |= {f"{voltage:.0f} V": device for voltage, (device, _worst) in devices.items()}
    judged = {name: judge_all(hammer) for name, hammer in hammers.items()}
    rows: list[list[Cell]] = []
    for each in zip(*judged.values(), strict=True):
        verdicts = [
            "not measured" if claim.value is None and claim.verdict == "fails" else claim.verdict
            for claim in each
        ]
        if len(set(verdicts)) > 1:
            rows.append([each[0].claim.name, *verdicts])
    totals = [sum(claim.verdict == "holds" for claim in each) for each in judged.values()]
    rows.append([f"of {len(judged['current'])} hold", *totals])
    columns = [Column(name="claim"), *(Column(name=name) for name in judged)]
    write(
        "rail-claims",
        columns,
        rows,
        settings={"voltages": ", ".join(f"{voltage:g} V" for voltage in devices)},
        rooms=ROOMS,
    )


if __name__ == "__main__":
    main()
