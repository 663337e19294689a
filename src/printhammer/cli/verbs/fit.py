"""The verb `fit`: constants fitted to measurements, one sub-verb for each kind of table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, announce_compiling, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.identify.result import Fit

GROUP: Final = "Fit constants to measurements: CSV tables whose header gives the unit of each column."
_MEASURED: Final = "printhammer measure all hendriks-1983 --out lab --force &&"
"""Command that generates the tables read by the examples."""

EXAMPLE: Final = (
    f"{_MEASURED} printhammer fit magnet lab/magnet.csv --spring lab/spring.csv --hammer hendriks-1983"
)

_RESULTS: Final = "Results"
# Options that name output files, in the order in which the files are written.
_FILES: Final = {
    "out": opt.files(
        "Output file for the fitted constants as a fragment of a hammer file (.toml), or a picture of data"
        " and residuals (.svg, .png, .pdf); repeatable.",
        ".toml",
        panel=_RESULTS,
    ),
    "covariance": opt.file("Output file for the covariance matrix of the constants (CSV).", panel=_RESULTS),
    "into": opt.file(
        "Output hammer file (TOML): the hammer of --hammer with the fitted constants.", panel=_RESULTS
    ),
}
_measured = partial(opt.source, argument=True)
_earlier = partial(opt.source, panel="Tables of the parts, fitted before the records")

_HAMMER: Final = opt.text(
    "HAMMER",
    "Hammer file, or shipped hammer, with the known constants; --into writes a fitted copy.",
    is_input=True,
)
_STRICT: Final = opt.switch("Exit with status 1 if the data reject the law.")
_PASSED: Final = {
    "columns": opt.COLUMNS,
    "robust": opt.switch("Reject outliers, and list them.", default=True),
}
_BACKSTOP: Final = opt.quantity(
    "m", "LENGTH", "Position of the backstop, e.g. '0.002 in'.", flag="--backstop"
)


@verb(
    "fit magnet",
    EXAMPLE,
    {
        **_PASSED,
        "spring": opt.source("Table of the spring alone: columns displacement, force."),
        "position": _BACKSTOP,
    },
    **_FILES,
)
def magnet(
    job: Job,
    files: list[Path] = _measured(
        "Table of magnet and spring: columns displacement, current, force; a second file: the spring alone.",
        many=True,
        default=...,
    ),
    zero: str = opt.text(
        "LENGTH|fit",
        "Reading of the displacement sensor at x = 0, or 'fit' to estimate the reading.",
        default="0 m",
    ),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Fit the constants F0, Am and Bm of the magnet, and Bs and As of the spring, to measured forces.

    The sum of magnet and spring forces does not separate F0 from Bs: add a table of the spring alone with
    --spring.
    """
    from printhammer.drive.input import read_number
    from printhammer.identify.fitting import fit

    offset = None if zero == "fit" else read_number(zero, "m", "--zero")
    return _run_fit(
        job, hammer, strict, lambda known: fit("magnet", files, hammer=known, zero=offset, **passed)
    )


@verb(
    "fit solenoid",
    "printhammer fit solenoid --example > solenoid.csv"
    " && printhammer fit solenoid solenoid.csv --turns 957 --current '1.2 A' --out solenoid.toml",
    _PASSED,
    **_FILES,
)
def solenoid(
    job: Job,
    file: Path | None = _measured(
        "Table of a coil, armature held: columns gap, force, inductance or linkage, optionally current."
    ),
    turns: float | None = opt.number("Number of turns of the coil.", metavar="N"),
    current: float | None = opt.quantity(
        "A", "CURRENT", "Current of all rows, if the table has no current column."
    ),
    example: bool = opt.switch("Print the published table of a pot magnet, as an example."),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Fit the magnetic circuit of a solenoid or pot magnet: gap, fringing, core and leakage.

    Force and inductance measured at the same current determine the saturation of the core. All constants of
    the magnet law `reluctance` are fitted, except the number of turns and the displacement at which the gap
    closes.
    """
    if example:
        table = files("printhammer").joinpath("identify", "static", "pot-magnet.csv")
        typer.echo(table.read_text(encoding="utf-8"), nl=False)
        return Answer()
    if file is None:
        raise InputError("FILE is missing", key="FILE", expected="a table; --example prints one")
    if turns is None:
        raise InputError("--turns is missing", key="--turns", expected="the number of turns of the coil")
    from printhammer.identify.fitting import fit

    return _run_fit(
        job, hammer, strict, lambda _known: fit("solenoid", file, turns=turns, current=current, **passed)
    )


@verb(
    "fit spring",
    f"{_MEASURED} printhammer fit spring lab/spring.csv --backstop '0.002 in'",
    {**_PASSED, "position": _BACKSTOP},
    **_FILES,
)
def spring(
    job: Job,
    file: Path = _measured("Table of the spring alone: columns displacement, force.", default=...),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Fit the constants Bs and As of the spring to measured forces."""
    from printhammer.identify.fitting import fit

    return _run_fit(job, hammer, strict, lambda known: fit("spring", file, hammer=known, **passed))


@verb(
    "fit pack",
    f"{_MEASURED} printhammer fit pack lab/pack.csv --thickness '0.007 in' --out pack.png",
    {
        **_PASSED,
        "thickness": opt.quantity("m", "LENGTH", "Thickness of the pack, e.g. '0.007 in'."),
        "exponents": opt.switch("Fit the exponents, instead of assuming 2.7 and 11."),
    },
    **_FILES,
)
def pack(
    job: Job,
    file: Path = _measured(
        "Table of load cycles: columns indentation, force, optionally branch (loading, unloading).",
        default=...,
    ),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Fit the stiffness of the pack, and with --exponents the exponents of its law."""
    from printhammer.identify.fitting import fit

    return _run_fit(job, hammer, strict, lambda known: fit("pack", file, hammer=known, **passed))


@verb(
    "fit backstop",
    "printhammer fit backstop --radius '2 mm' --modulus '200 GPa' --modulus '3 GPa'"
    " --poisson 0.3 --poisson 0.35",
    _PASSED,
    **_FILES,
)
def backstop(
    job: Job,
    file: Path | None = _measured("Table of rebounds: columns impact speed, rebound speed."),
    radius: list[str] | None = opt.text(
        "LENGTH",
        "Radius of the armature's contact surface; repeat the option for the radius of a round backstop.",
        many=True,
    ),
    modulus: list[str] | None = opt.text(
        "PRESSURE", "Young's modulus of the armature; repeat the option for the backstop.", many=True
    ),
    poisson: list[str] | None = opt.text(
        "X", "Poisson ratio of the armature; repeat the option for the backstop.", many=True
    ),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Compute the stiffness k of the backstop from its geometry, and fit its damping l to rebounds.

    A value may carry its standard error: '3 GPa +- 0.2 GPa'. Without geometry, --hammer supplies the
    stiffness.
    """

    def made(known: Hammer | None) -> Fit:
        from printhammer.identify.fitting import fit
        from printhammer.identify.static.backstop import Stiffness, fit_backstop

        stiffness = None
        if radius or modulus or poisson:
            bodies = (radius, "--radius", "m"), (modulus, "--modulus", "Pa"), (poisson, "--poisson", "1")
            stiffness = Stiffness.from_bodies(
                *([_with_error(text, flag, si) for text in texts or []] for texts, flag, si in bodies)
            )
        if file is None:
            return fit_backstop(stiffness=stiffness, **passed)
        return fit("backstop", file, hammer=known, stiffness=stiffness, **passed)

    return _run_fit(job, hammer, strict, made)


@verb(
    "fit motion",
    f"{_MEASURED} printhammer fit motion lab/motion.csv --hammer hendriks-1983 --out motion.toml",
    {
        **_PASSED,
        "bandwidth": opt.quantity("Hz", "FREQUENCY", "Bandwidth of the displacement sensor, e.g. '200 kHz'."),
    },
    **_FILES,
)
def motion(
    job: Job,
    files: list[Path] = _measured(
        "Records of single shots, one per file: columns time, displacement, optionally current.",
        many=True,
        default=...,
    ),
    hammer: str | None = _HAMMER,
    free: str | None = opt.text(
        "KEYS",
        "Constants to fit (default: 'mass', and 'backstop.damping' if a record shows a backstop contact).",
    ),
    magnet: Path | None = _earlier("Table of the force of magnet and spring, fitted before the records."),
    spring: Path | None = _earlier("Table of the force of the spring, fitted before the records."),
    pack: Path | None = _earlier("Table of load cycles of the pack, fitted before the records."),
    backstop: Path | None = _earlier("Table of rebounds from the backstop, fitted before the records."),
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Fit the mass, the damping of the backstop and other constants to records of single shots.

    Constants with standard errors in the hammer file, such as those that an earlier fit wrote with --into,
    are priors and are refined; all other constants count as exact. Tables passed with --magnet, --spring,
    --pack and --backstop are fitted first, and their constants are priors too.
    """

    def made(known: Hammer | None) -> Fit:
        from printhammer.identify.shots.motion import fit_motion

        if known is None:
            raise InputError(
                "the hammer is missing",
                key="hammer",
                expected="--hammer, whose file supplies the known constants",
            )
        keys = [key.strip() for key in free.split(",")] if free is not None else None
        tables = opt.given(magnet=magnet, spring=spring, pack=pack, backstop=backstop)
        for fit in _earlier_fits(tables, known, passed["robust"]):
            known = fit.into(known)
        return fit_motion(files, known, free=keys, **passed)

    return _run_fit(job, hammer, strict, made, "time 0 of a record is the firing")


_probe = partial(opt.text, panel="Probe")


@verb(
    "fit coil",
    "printhammer measure current relay-5v --locked '0 mm' --out current.csv &&"
    " printhammer fit coil current.csv --hammer relay-5v --locked '0 mm' --out coil.toml",
    {
        **_PASSED,
        "offset": _probe("CURRENT", "Offset of the current probe, e.g. '2 mA', '0 mA +- 5 mA' or 'fit'."),
        "gain": _probe("X", "Gain of the current probe, e.g. '1 +- 0.01' or 'fit'."),
        "delay": _probe("TIME", "Delay of the current probe, e.g. '2 us', '0 us +- 5 us' or 'fit'."),
        "bandwidth": _probe("FREQUENCY", "Bandwidth of the current probe, e.g. '200 kHz' or 'fit'."),
        "resolution": _probe(
            "CURRENT", "Quantisation step of the readings (default: estimated from the readings)."
        ),
        "locked": opt.quantity(
            "m", "LENGTH", "Displacement at which the armature is locked (default: the armature is free)."
        ),
    },
    **_FILES,
)
def coil(
    job: Job,
    files: list[Path] = _measured(
        "Records of single shots, one per file: columns time, current, optionally voltage.",
        many=True,
        default=...,
    ),
    hammer: str | None = _HAMMER,
    free: str | None = opt.text("KEYS", "Constants to fit (default: coil.resistance, coil.inductance)."),
    also: str | None = opt.text("KEYS", "Additional constants to fit, e.g. 'magnet.saturation_flux'."),
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Fit resistance and inductance of the coil, optionally a shorted turn or saturation, to current records.

    The coil voltage is the voltage column of the table or, without that column, the output of the hammer's
    driver. The hammer supplies the initial guesses.
    """

    def made(known: Hammer | None) -> Fit:
        from printhammer.identify.coil import fit_coil

        if known is None:
            raise InputError(
                "the hammer is missing",
                key="hammer",
                expected="--hammer, whose file supplies the known constants",
            )
        keys = None if free is None else _keys(free)
        return fit_coil(files, known, free=keys, also=_keys(also or ""), **passed)

    zero = "time 0 of a record is switch-on; a column 'voltage' is the coil voltage from its first row on"
    return _run_fit(job, hammer, strict, made, zero)


def _keys(text: str) -> list[str]:
    return [key.strip() for key in text.split(",") if key.strip()]


def _earlier_fits(tables: dict[str, Path], known: Hammer, robust: bool) -> list[Fit]:
    """Fit the tables of magnet, spring, pack and backstop; the hammer `known` supplies all other constants.

    If `robust`, outliers are rejected.
    """
    from printhammer.identify.fitting import fit

    rest = dict(tables)
    options: dict[str, Any] = {"hammer": known, "robust": robust}
    fits = []
    if "magnet" in rest:
        if "spring" not in rest:
            raise InputError(
                "--magnet: expected --spring as well, otherwise F0 and Bs cannot be separated", key="--magnet"
            )
        fits.append(fit("magnet", rest.pop("magnet"), spring=rest.pop("spring"), **options))
    return [*fits, *(fit(kind, path, **options) for kind, path in rest.items())]


def _run_fit(
    job: Job, hammer: str | None, strict: bool, fitted: Callable[[Hammer | None], Fit], zero: str = ""
) -> Answer:
    """Run a fit; return its summary and files.

    `fitted` performs the fit with the known constants of the hammer in the file `hammer`, if any. If
    `strict`, the exit status is 1 if the data reject the law. `zero` is a remark that defines time 0 of the
    records.
    """
    from printhammer.hammer.hammer import load
    from printhammer.support.files import write_file

    for path in job.wanted["into"]:
        if hammer is None:
            raise InputError(
                f"--into {path}: expected --hammer as well, the hammer to be updated", key="--into"
            )
    announce_compiling()
    known = None if hammer is None else load(hammer)
    with job.status_line("reading and fitting"):
        fit = fitted(known)
    if zero:
        fit = replace(fit, remarks=(*fit.remarks, zero))
    files = {
        "out": Content(lambda path: write_file(path, fit.fragment()), fit.plot),
        "covariance": Content.text(fit.covariance_table),
    }
    if job.wanted["into"] and known is not None:
        files["into"] = Content(fit.into(known).save)
    return Answer(render(fit.summary()), files=files, failed=strict and bool(fit.rejected))


def _with_error(text: str, flag: str, si: str) -> tuple[float, float]:
    """Parse a value and its standard error (default: 0), such as "3 GPa +- 0.2 GPa"."""
    from printhammer.drive.input import read_number

    value, mark, error = text.replace("±", "+-").partition("+-")
    return (
        read_number(value.strip(), si, flag),
        abs(read_number(error.strip(), si, f"the error of {flag}")) if mark else 0.0,
    )
