"""Synthetic laboratory: simulated measurements of a hammer with realistic sensor errors.

True values are computed (`benches`), pass through the sensors (`sensor`), and become a table like those of a
real laboratory. Each kind of measurement and each column has its own random number stream, so that a change
of one stream does not affect the other streams.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.identify.bench.benches import BENCHES
from printhammer.identify.bench.sensor import (
    FULL_SCALE,
    READING,
    Amount,
    Channel,
    Sensor,
    adjusted,
    full_scale,
    wrong_rows,
)
from printhammer.results import Column, Result, part, scalar
from printhammer.results.result import Entries
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray, IntArray

KINDS: Final = tuple(BENCHES)
"""Kinds of measurements that can be simulated."""

UNITS: Final = {
    "displacement": ("m", "um"),
    "indentation": ("m", "um"),
    "force": ("N", "N"),
    "current": ("A", "A"),
    "impact speed": ("m/s", "m/s"),
    "rebound speed": ("m/s", "m/s"),
    "time": ("s", "us"),
}
"""SI unit of each column, and its unit in files, by name of the column."""

SI: Final = {name: si for name, (si, _unit) in UNITS.items()}
"""SI unit of each column, by name of the column."""

SAMPLING_RATE: Final = 1e6
"""Default sampling rate of a record, Hz; arbitrary."""
BANDWIDTH: Final = 200e3
"""Default bandwidth of the sensor of a record, Hz; arbitrary."""

_LENGTH: Final = Channel(noise=Amount(0.2e-6), resolution=Amount(0.05e-6))
_FORCE: Final = Channel(noise=Amount(0.005, FULL_SCALE), resolution=Amount(0.0005, FULL_SCALE))
_CURRENT: Final = Channel(noise=Amount(0.001, FULL_SCALE), resolution=Amount(0.0005, FULL_SCALE))
_SPEED: Final = Channel(noise=Amount(0.01, READING))

SENSORS: Final = {
    "magnet": Sensor({"displacement": _LENGTH, "current": _CURRENT, "force": _FORCE}),
    "spring": Sensor({"displacement": _LENGTH, "force": _FORCE}),
    "pack": Sensor({"indentation": _LENGTH, "force": _FORCE}),
    "backstop": Sensor({"impact speed": _SPEED, "rebound speed": _SPEED}),
    "motion": Sensor({"displacement": _LENGTH, "current": _CURRENT}, SAMPLING_RATE, BANDWIDTH),
    "current": Sensor({"current": _CURRENT}, SAMPLING_RATE, BANDWIDTH),
}
"""Default sensors by kind of measurement."""


class Measurement(Result):
    """Table of one simulated measurement, with its true values and gross errors."""

    kind: str = scalar("", "kind of measurement", more=f"{', '.join(BENCHES)}")
    comments: dict[str, str] = scalar("", "description of measurement, hammer, sensors and seed")
    values: dict[str, FloatArray] = part("readings by column, SI")
    words: dict[str, tuple[str, ...]] = part("text columns")
    true: dict[str, FloatArray] = part("true values, before noise, resolution, offset and gross errors, SI")
    outliers: IntArray = part("indices of the rows with gross errors")
    hammer: Hammer = part("measured hammer")

    @property
    def title(self) -> str:
        """Title of the measurement: its kind and the name of the hammer."""
        return f"measurement of the {self.kind} of {self.hammer.name}"

    def entries(self) -> Entries:
        """Return the columns: readings, true values such as `true_force`, text, and outlier mask `wrong`."""
        entries: Entries = {}
        for name, readings in self.values.items():
            key, si = name.replace(" ", "_"), SI[name]
            entries[key] = Column(si, name, ("row",), head=name), readings
            true = Column(si, f"{name} without errors", ("row",), head=f"true {name}")
            entries[f"true_{key}"] = true, self.true[name]
        for name, words in self.words.items():
            entries[name] = Column("", name, ("row",)), list(words)
        wrong = np.isin(np.arange(len(next(iter(self.values.values())))), self.outliers)
        return entries | {"wrong": (Column("1", "whether the reading has a gross error", ("row",)), wrong)}

    def to_csv(self) -> str:
        """Render the table as CSV: comments, a heading with units, and one line per row."""
        from printhammer.units import from_si

        lines = [f"# {key}: {value}" for key, value in self.comments.items()]
        columns = []
        for name, values in self.values.items():
            si, unit = UNITS[name]
            # Fifteen digits, so that binary rounding does not show.
            columns.append([f"{from_si(value, si, unit):.15g}" for value in values.tolist()])
        columns += [list(words) for words in self.words.values()]
        lines.append(",".join([*(f"{name} [{UNITS[name][1]}]" for name in self.values), *self.words]))
        lines += [",".join(cells) for cells in zip(*columns, strict=True)]
        return "\n".join(lines) + "\n"

    def write(self, path: str | Path) -> None:
        """Write the table to a CSV file."""
        from printhammer.support.files import write_file

        write_file(path, self.to_csv())


@checked
def measure(
    kind: str,
    hammer: Hammer,
    *,
    sensor: Sensor | Mapping[str, Any] | None = None,
    seed: int = 0,
    **bench: Any,
) -> Measurement:
    """Simulate a measurement of a hammer on a bench.

    Parameters
    ----------
    kind : str
        "magnet": static force of magnet and spring against displacement and current; "spring": force of the
        spring alone; "pack": load cycles; "backstop": rebound speeds; "motion": record of one shot;
        "current": record of the coil current in one voltage-driven shot.
    sensor : Sensor or mapping, optional
        Sensors; by default `SENSORS`. A mapping states only the settings that differ, such as {"noise":
        {"force": "0.1 N"}, "outliers": "2 %"}; see `printhammer.identify.bench.sensor.adjusted`.
    seed : int, optional
        Seed of the random number generator; the same seed gives the same table.
    **bench
        Options of the bench, in SI: `displacements`, `currents` (magnet); `displacements` (spring); `peaks`,
        the peak indentations, and `points` per branch (pack); `speeds` (backstop); `duration` and `before`,
        the time before the firing (motion, current); `locked`, the displacement at which the armature is held
        (current).

    Raises
    ------
    InputError
        The kind is unknown, or the hammer lacks the part to be measured.
    """
    if kind not in BENCHES:
        raise InputError.of("kind", kind, f"one of {', '.join(KINDS)}")
    if seed < 0:
        raise InputError.of("seed", seed, "a whole number, 0 or more")
    used = sensor if isinstance(sensor, Sensor) else adjusted(SENSORS[kind], sensor or {}, SI)
    there = BENCHES[kind](hammer, used, **bench)
    streams = np.random.SeedSequence([seed, KINDS.index(kind)]).spawn(len(UNITS) + 1)
    generators = dict(zip([*UNITS, ""], map(np.random.default_rng, streams), strict=True))
    rows, errors = wrong_rows(used.outliers, there.true[there.suspect], generators[""])
    values = {}
    for name, true in there.true.items():
        if name in there.exact:
            values[name] = true
            continue
        channel = used.channels.get(name, Channel())
        shown = channel.readings(true, generators[name].standard_normal(len(true)))
        if name == there.suspect and len(rows):
            shown = shown.copy()
            shown[rows] = channel.rounded(shown[rows] + errors, true)
        values[name] = shown
    comments = _comments(kind, hammer, used, there.true, there.exact, there.what)
    comments |= there.notes
    comments["outliers"] = f"{len(rows)} of {len(values[there.suspect])} rows"
    comments["seed"] = str(seed)
    return Measurement(kind, comments, values, there.words, there.true, rows, hammer)


def _comments(
    kind: str, hammer: Hammer, sensor: Sensor, true: dict[str, FloatArray], exact: tuple[str, ...], what: str
) -> dict[str, str]:
    from printhammer import __version__

    comments = {
        "measurement": f"{kind}, synthetic (printhammer {__version__})",
        "measured": what,
        "hammer": f"{hammer.name}, fingerprint {hammer.fingerprint[:16]}",
    }
    for name, values in true.items():
        if name in exact:
            continue
        channel = sensor.channels.get(name, Channel())
        comments[name] = channel.described(*UNITS[name], full_scale(values))
    if sensor.sampling_rate is not None:
        comments["sampling rate"] = _frequency(sensor.sampling_rate)
        comments["bandwidth"] = _frequency(sensor.bandwidth)
    return comments


def _frequency(value: float | None) -> str:
    from printhammer.units import from_si

    return "none" if value is None else f"{from_si(value, 'Hz', 'kHz'):.9g} kHz"
