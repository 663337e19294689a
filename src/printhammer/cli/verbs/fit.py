"""The verb `fit`: constants from measurements, one sub-verb for each kind of table."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, announce_compiling, verb
from printhammer.cli.screen import render
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer
    from printhammer.identify.result import Fit

GROUP: Final = "Find constants from measurements: CSV tables whose heading gives every column its unit."
_MEASURED: Final = "printhammer measure all hendriks-1983 --out lab &&"
"""Makes the tables that the examples read."""

EXAMPLE: Final = (
    f"{_MEASURED} printhammer fit magnet lab/magnet.csv --spring lab/spring.csv --hammer hendriks-1983"
)

_RESULTS: Final = "Results"
# In the order of writing.
_FILES: Final = {
    "out": opt.files(
        "The constants as a fragment of a hammer file (.toml), or picture of data and residuals (.svg, .png,"
        " .pdf); may be given repeatedly.",
        ".toml",
        panel=_RESULTS,
    ),
    "covariance": opt.file("Covariance of the constants, CSV.", panel=_RESULTS),
    "into": opt.file("The hammer of --hammer with the constants replaced.", panel=_RESULTS),
}
_measured = partial(opt.source, argument=True)
_earlier = partial(opt.source, panel="Tables of the parts, fitted first")

_HAMMER: Final = opt.text(
    "HAMMER", "Hammer with what is known already; --into starts from it.", is_input=True
)
_STRICT: Final = opt.switch("End with status 1 where the data reject the law.")
_PASSED: Final = {"robust": opt.switch("Leave out rows that lie too far off, and name them.", default=True)}
_BACKSTOP: Final = opt.quantity(
    "m", "LENGTH", "Position of the backstop, such as '0.002 in'.", flag="--backstop"
)


@verb(
    "fit magnet",
    EXAMPLE,
    {
        **_PASSED,
        "spring": opt.source("Columns displacement, force: the spring alone, without magnet."),
        "position": _BACKSTOP,
    },
    **_FILES,
)
def magnet(
    job: Job,
    files: list[Path] = _measured(
        "Columns displacement, current, force: magnet and spring together; a second: as --spring.",
        many=True,
        default=...,
    ),
    zero: str = opt.text(
        "LENGTH|fit", "Reading of the displacement sensor at x = 0; or fit it.", default="0 m"
    ),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Find F0, Am and Bm of the magnet, and Bs and As of the spring.

    Forces of magnet and spring together do not tell F0 from Bs: give the spring alone with --spring.
    """
    from printhammer.drive.input import read_number
    from printhammer.identify.fitting import fit

    offset = None if zero == "fit" else read_number(zero, "m", "--zero")
    return _fitted(
        job, hammer, strict, lambda known: fit("magnet", files, hammer=known, zero=offset, **passed)
    )


@verb(
    "fit solenoid",
    "printhammer fit solenoid solenoid.csv --turns 957 --current '1.2 A' --out solenoid.toml",
    _PASSED,
    **_FILES,
)
def solenoid(
    job: Job,
    file: Path = _measured(
        "Columns gap, force, inductance or linkage, and perhaps current: a coil at a held armature.",
        default=...,
    ),
    turns: float = opt.number("Turns of the coil.", metavar="N", default=...),
    current: float | None = opt.quantity("A", "CURRENT", "Of all rows, where the table has no column of it."),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Find the magnetic circuit of a solenoid or pot magnet: gap, fringe, core, leakage.

    Force and inductance at one current tell how far the core saturates. The constants are those of the magnet
    law reluctance; where its gap closes is not among them.
    """
    from printhammer.identify.fitting import fit

    return _fitted(
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
    file: Path = _measured("Columns displacement, force: the spring alone.", default=...),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Find Bs and As of the spring."""
    from printhammer.identify.fitting import fit

    return _fitted(job, hammer, strict, lambda known: fit("spring", file, hammer=known, **passed))


@verb(
    "fit pack",
    f"{_MEASURED} printhammer fit pack lab/pack.csv --thickness '0.007 in' --out pack.png",
    {
        **_PASSED,
        "thickness": opt.quantity("m", "LENGTH", "Thickness of the pack, such as '0.007 in'."),
        "exponents": opt.switch("Fit the exponents too, instead of 2.7 and 11."),
    },
    **_FILES,
)
def pack(
    job: Job,
    file: Path = _measured(
        "Columns indentation, force and perhaps branch (loading, unloading).", default=...
    ),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Find the stiffness of the ribbon and paper pack, and the exponents if asked."""
    from printhammer.identify.fitting import fit

    return _fitted(job, hammer, strict, lambda known: fit("pack", file, hammer=known, **passed))


@verb(
    "fit backstop",
    "printhammer fit backstop --radius '2 mm' --modulus '200 GPa' --modulus '3 GPa'"
    " --poisson 0.3 --poisson 0.35",
    _PASSED,
    **_FILES,
)
def backstop(
    job: Job,
    file: Path | None = _measured("Columns impact speed, rebound speed."),
    radius: list[str] | None = opt.text(
        "LENGTH", "Radius of the armature; again for a backstop that is round.", many=True
    ),
    modulus: list[str] | None = opt.text("PRESSURE", "Young's modulus, for each of both bodies.", many=True),
    poisson: list[str] | None = opt.text("X", "Poisson ratio, for each of both bodies.", many=True),
    hammer: str | None = _HAMMER,
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Find the stiffness k of the backstop from its geometry, and its damping l from rebounds.

    A value may carry its standard error: '3 GPa +- 0.2 GPa'. Without geometry the stiffness is taken from
    --hammer.
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

    return _fitted(job, hammer, strict, made)


@verb(
    "fit motion",
    f"{_MEASURED} printhammer fit motion lab/motion.csv --hammer hendriks-1983 --out motion.toml",
    {
        **_PASSED,
        "bandwidth": opt.quantity("Hz", "FREQUENCY", "Of the displacement sensor, such as '200 kHz'."),
    },
    **_FILES,
)
def motion(
    job: Job,
    files: list[Path] = _measured(
        "Columns time, displacement and perhaps current; one single shot each.", many=True, default=...
    ),
    hammer: str | None = _HAMMER,
    free: str | None = opt.text("KEYS", "Constants to find, such as 'mass, backstop.damping'."),
    magnet: Path | None = _earlier("Table of magnet and spring."),
    spring: Path | None = _earlier("Table of the spring alone."),
    pack: Path | None = _earlier("Table of the pack."),
    backstop: Path | None = _earlier("Table of rebounds from the backstop."),
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Find the mass, the damping of the backstop and what else single shots tell.

    Constants of the hammer that have standard errors in its file, as --into of other fits writes them, count
    as known with these errors, and the shots improve them; the others count as exact. Tables given with
    --magnet, --spring, --pack and --backstop are fitted first.
    """

    def made(known: Hammer | None) -> Fit:
        from printhammer.identify.shots.motion import fit_motion

        if known is None:
            raise InputError(
                "the hammer is missing", key="hammer", expected="--hammer with the constants known already"
            )
        keys = [key.strip() for key in free.split(",")] if free is not None else None
        tables = opt.given(magnet=magnet, spring=spring, pack=pack, backstop=backstop)
        for fit in _earlier_fits(tables, known, passed["robust"]):
            known = fit.into(known)
        return fit_motion(files, known, free=keys, **passed)

    return _fitted(job, hammer, strict, made)


@verb(
    "fit coil",
    "printhammer fit coil current.csv --hammer driven.toml --locked '100 um' --out coil.toml",
    {
        **_PASSED,
        "bandwidth": opt.quantity("Hz", "FREQUENCY", "Of the current probe, such as '200 kHz'."),
        "locked": opt.quantity("m", "LENGTH", "Where the armature was locked; without it, it is free."),
    },
    **_FILES,
)
def coil(
    job: Job,
    files: list[Path] = _measured(
        "Columns time, current and perhaps voltage; one shot each.", many=True, default=...
    ),
    hammer: str | None = _HAMMER,
    free: str | None = opt.text("KEYS", "Constants to find, instead of coil.resistance, coil.inductance."),
    also: str | None = opt.text("KEYS", "Further ones, such as 'magnet.saturation_flux'."),
    strict: bool = _STRICT,
    **passed: Any,
) -> Answer:
    """Find resistance and inductance of the coil, a shorted turn or the saturation, from its current.

    The hammer's own driver switches the coil, or the voltage of the table. Constants to find begin with the
    values of --hammer.
    """

    def made(known: Hammer | None) -> Fit:
        from printhammer.identify.coil import FREE, fit_coil

        if known is None:
            raise InputError(
                "the hammer is missing", key="hammer", expected="--hammer with the constants known already"
            )
        keys = list(FREE) if free is None else _keys(free)
        return fit_coil(files, known, free=[*keys, *_keys(also or "")], **passed)

    return _fitted(job, hammer, strict, made)


def _keys(text: str) -> list[str]:
    return [key.strip() for key in text.split(",") if key.strip()]


def _earlier_fits(tables: dict[str, Path], known: Hammer, robust: bool) -> list[Fit]:
    """Fit tables of the parts of a hammer, whose other constants are known."""
    from printhammer.identify.fitting import fit

    rest = dict(tables)
    options: dict[str, Any] = {"hammer": known, "robust": robust}
    fits = []
    if "magnet" in rest:
        if "spring" not in rest:
            raise InputError(
                "--magnet: expected --spring too, or F0 and Bs cannot be told apart", key="--magnet"
            )
        fits.append(fit("magnet", rest.pop("magnet"), spring=rest.pop("spring"), **options))
    return [*fits, *(fit(kind, path, **options) for kind, path in rest.items())]


def _fitted(job: Job, hammer: str | None, strict: bool, fitted: Callable[[Hammer | None], Fit]) -> Answer:
    """Fit, and return what is shown and written."""
    from printhammer.hammer.hammer import load
    from printhammer.support.files import write_file

    for path in job.wanted["into"]:
        if hammer is None:
            raise InputError(
                f"--into {path}: expected --hammer too, in which constants are replaced", key="--into"
            )
    announce_compiling()
    known = None if hammer is None else load(hammer)
    fit = fitted(known)
    files = {
        "out": Content(lambda path: write_file(path, fit.fragment()), fit.plot),
        "covariance": Content.text(fit.covariance_table),
    }
    if job.wanted["into"] and known is not None:
        files["into"] = Content(fit.into(known).save)
    return Answer(render(fit.summary()), files=files, failed=strict and bool(fit.rejected))


def _with_error(text: str, flag: str, si: str) -> tuple[float, float]:
    """Read a value and its standard error, such as "3 GPa +- 0.2 GPa"; without one it is 0."""
    from printhammer.drive.input import read_number

    value, mark, error = text.replace("±", "+-").partition("+-")
    return (
        read_number(value.strip(), si, flag),
        abs(read_number(error.strip(), si, f"the error of {flag}")) if mark else 0.0,
    )
