"""The verb `fit`: constants from measurements, one sub-verb for each kind of table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.hammer.hammer import Hammer
    from printhammer.identify.result import Fit

EXAMPLE: Final = "Example: printhammer fit magnet magnet.csv --spring spring.csv --hammer hendriks-1983"

_RESULTS: Final = "Results"

app = typer.Typer(
    help="Find constants from measurements: CSV tables whose heading gives every column its unit.",
    epilog=EXAMPLE,
    no_args_is_help=True,
)


def _result(flag: str, text: str) -> Any:
    return typer.Option(flag, metavar="FILE", help=text, rich_help_panel=_RESULTS)


def _earlier(text: str) -> Any:
    panel = "Tables of the parts, fitted first"
    return typer.Option(metavar="FILE", help=f"Table of {text}.", rich_help_panel=panel)


def _table(text: str) -> Any:
    return typer.Argument(metavar="FILE", help=text, show_default=False)


HammerOption = Annotated[
    str | None,
    typer.Option(metavar="HAMMER", help="Hammer with what is known already; --into starts from it."),
]
OutOption = Annotated[Path | None, _result("--out", "The constants as a fragment of a hammer file, TOML.")]
IntoOption = Annotated[Path | None, _result("--into", "The hammer of --hammer with the constants replaced.")]
PlotOption = Annotated[Path | None, _result("--plot", "Picture of data and residuals, .svg, .png or .pdf.")]
CovarianceOption = Annotated[Path | None, _result("--covariance", "Covariance of the constants, CSV.")]
StrictOption = Annotated[
    bool, typer.Option("--strict", help="End with status 1 where the data reject the law.")
]
RobustOption = Annotated[
    bool, typer.Option("--robust/--no-robust", help="Leave out rows that lie too far off, and name them.")
]
BackstopOption = Annotated[
    str | None,
    typer.Option("--backstop", metavar="LENGTH", help="Position of the backstop, such as '0.002 in'."),
]


@app.command("magnet", epilog=EXAMPLE)
def magnet(
    files: Annotated[
        list[Path],
        _table("Columns displacement, current, force: magnet and spring together; a second: as --spring."),
    ],
    spring: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Columns displacement, force: the spring alone, without magnet."),
    ] = None,
    backstop: BackstopOption = None,
    zero: Annotated[
        str,
        typer.Option(metavar="LENGTH|fit", help="Reading of the displacement sensor at x = 0; or fit it."),
    ] = "0 m",
    hammer: HammerOption = None,
    robust: RobustOption = True,
    out: OutOption = None,
    into: IntoOption = None,
    plot: PlotOption = None,
    covariance: CovarianceOption = None,
    strict: StrictOption = False,
) -> None:
    """Find F0, Am and Bm of the magnet, and Bs and As of the spring.

    Forces of magnet and spring together do not tell F0 from Bs: give the spring alone with --spring.
    """
    results = _Results(out, into, plot, covariance, hammer, [*files, *([spring] if spring else [])])

    def found(known: Hammer | None) -> Fit:
        from printhammer.identify.fitting import fit

        offset = None if zero == "fit" else _length(zero, "--zero")
        position = _length(backstop, "--backstop")
        return fit(
            "magnet", files, hammer=known, position=position, spring=spring, zero=offset, robust=robust
        )

    results.make(found, strict=strict)


@app.command("spring", epilog="Example: printhammer fit spring spring.csv --backstop '0.002 in'")
def spring(
    file: Annotated[Path, _table("Columns displacement, force: the spring alone.")],
    backstop: BackstopOption = None,
    hammer: HammerOption = None,
    robust: RobustOption = True,
    out: OutOption = None,
    into: IntoOption = None,
    plot: PlotOption = None,
    covariance: CovarianceOption = None,
    strict: StrictOption = False,
) -> None:
    """Find Bs and As of the spring."""
    results = _Results(out, into, plot, covariance, hammer, [file])

    def found(known: Hammer | None) -> Fit:
        from printhammer.identify.fitting import fit

        position = _length(backstop, "--backstop")
        return fit("spring", file, hammer=known, position=position, robust=robust)

    results.make(found, strict=strict)


@app.command("pack", epilog="Example: printhammer fit pack pack.csv --thickness '0.007 in' --plot pack.png")
def pack(
    file: Annotated[Path, _table("Columns indentation, force and perhaps branch (loading, unloading).")],
    thickness: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Thickness of the pack, such as '0.007 in'.")
    ] = None,
    exponents: Annotated[
        bool, typer.Option("--exponents", help="Fit the exponents too, instead of 2.7 and 11.")
    ] = False,
    hammer: HammerOption = None,
    robust: RobustOption = True,
    out: OutOption = None,
    into: IntoOption = None,
    plot: PlotOption = None,
    covariance: CovarianceOption = None,
    strict: StrictOption = False,
) -> None:
    """Find the stiffness of the ribbon and paper pack, and the exponents if asked."""
    results = _Results(out, into, plot, covariance, hammer, [file])

    def found(known: Hammer | None) -> Fit:
        from printhammer.identify.fitting import fit

        value = _length(thickness, "--thickness")
        return fit("pack", file, hammer=known, thickness=value, exponents=exponents, robust=robust)

    results.make(found, strict=strict)


@app.command(
    "backstop",
    epilog="Example: printhammer fit backstop --radius '2 mm' --modulus '200 GPa' --modulus '3 GPa'"
    " --poisson 0.3 --poisson 0.35",
)
def backstop(
    file: Annotated[Path | None, _table("Columns impact speed, rebound speed.")] = None,
    radius: Annotated[
        list[str] | None,
        typer.Option(metavar="LENGTH", help="Radius of the armature; again for a backstop that is round."),
    ] = None,
    modulus: Annotated[
        list[str] | None, typer.Option(metavar="PRESSURE", help="Young's modulus, for each of both bodies.")
    ] = None,
    poisson: Annotated[
        list[str] | None, typer.Option(metavar="X", help="Poisson ratio, for each of both bodies.")
    ] = None,
    hammer: HammerOption = None,
    robust: RobustOption = True,
    out: OutOption = None,
    into: IntoOption = None,
    plot: PlotOption = None,
    covariance: CovarianceOption = None,
    strict: StrictOption = False,
) -> None:
    """Find the stiffness k of the backstop from its geometry, and its damping l from rebounds.

    A value may carry its standard error: '3 GPa +- 0.2 GPa'. Without geometry the stiffness is taken from
    --hammer.
    """
    results = _Results(out, into, plot, covariance, hammer, [file] if file else [])

    def found(known: Hammer | None) -> Fit:
        from printhammer.identify.fitting import fit
        from printhammer.identify.static.backstop import Stiffness, fit_backstop

        bodies = (radius or [], modulus or [], poisson or [])
        stiffness = None
        if any(bodies):
            flags = ("radius", "m"), ("modulus", "Pa"), ("poisson", "1")
            pairs = [
                [_with_error(text, flag, si) for text in texts]
                for texts, (flag, si) in zip(bodies, flags, strict=True)
            ]
            stiffness = Stiffness.from_bodies(*pairs)
        if file is None:
            return fit_backstop(stiffness=stiffness, robust=robust)
        return fit("backstop", file, hammer=known, stiffness=stiffness, robust=robust)

    results.make(found, strict=strict)


@app.command(
    "motion", epilog="Example: printhammer fit motion motion.csv --hammer hendriks-1983 --out motion.toml"
)
def motion(
    files: Annotated[
        list[Path], _table("Columns time, displacement and perhaps current; one single shot each.")
    ],
    hammer: HammerOption = None,
    free: Annotated[
        str | None,
        typer.Option(metavar="KEYS", help="Constants to find, such as 'mass, backstop.damping'."),
    ] = None,
    bandwidth: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Of the displacement sensor, such as '200 kHz'.")
    ] = None,
    magnet: Annotated[Path | None, _earlier("magnet and spring")] = None,
    spring: Annotated[Path | None, _earlier("the spring alone")] = None,
    pack: Annotated[Path | None, _earlier("the pack")] = None,
    backstop: Annotated[Path | None, _earlier("rebounds from the backstop")] = None,
    robust: RobustOption = True,
    out: OutOption = None,
    into: IntoOption = None,
    plot: PlotOption = None,
    covariance: CovarianceOption = None,
    strict: StrictOption = False,
) -> None:
    """Find the mass, the damping of the backstop and what else single shots tell.

    Constants of the hammer count as exact. Those found in tables given with --magnet, --spring, --pack and
    --backstop count as known with their errors instead, and the shots may improve them.
    """
    tables = {"magnet": magnet, "spring": spring, "pack": pack, "backstop": backstop}
    earlier = {kind: path for kind, path in tables.items() if path is not None}
    results = _Results(out, into, plot, covariance, hammer, [*files, *earlier.values()])

    def found(known: Hammer | None) -> Fit:
        from printhammer.drive.input import read_number
        from printhammer.errors import InputError
        from printhammer.identify.shots.motion import fit_motion

        if known is None:
            raise InputError("the hammer is missing, expected --hammer with the constants known already")
        keys = [key.strip() for key in free.split(",")] if free is not None else None
        cutoff = None if bandwidth is None else read_number(bandwidth, "Hz", "--bandwidth")
        fits = _earlier_fits(earlier, known, robust=robust)
        for fit in fits:
            known = fit.into(known)
        return fit_motion(files, known, free=keys, robust=robust, bandwidth=cutoff, earlier=fits)

    results.make(found, strict=strict)


def _earlier_fits(tables: dict[str, Path], known: Hammer, *, robust: bool) -> list[Fit]:
    """Fit tables of the parts of a hammer, whose other constants are known."""
    from printhammer.errors import InputError
    from printhammer.identify.fitting import fit

    rest = dict(tables)
    options: dict[str, Any] = {"hammer": known, "robust": robust}
    found = []
    if "magnet" in rest:
        if "spring" not in rest:
            raise InputError("--magnet: expected --spring too, or F0 and Bs cannot be told apart")
        found.append(fit("magnet", rest.pop("magnet"), spring=rest.pop("spring"), **options))
    return [*found, *(fit(kind, path, **options) for kind, path in rest.items())]


class _Results:
    """What a fit is to leave behind, checked before any work."""

    def __init__(
        self,
        out: Path | None,
        into: Path | None,
        plot: Path | None,
        covariance: Path | None,
        hammer: str | None,
        tables: list[Path],
    ) -> None:
        self.out, self.into, self.plot, self.covariance = out, into, plot, covariance
        self.hammer, self.tables = hammer, tables

    def make(self, found: Callable[[Hammer | None], Fit], *, strict: bool) -> None:
        """Fit, write and tell."""
        from printhammer.cli.fit_screen import show
        from printhammer.cli.saving import PICTURES, check_endings, say_written
        from printhammer.cli.terminal import console
        from printhammer.errors import InputError
        from printhammer.hammer.hammer import load
        from printhammer.support.outputs import check_outputs

        if self.into is not None and self.hammer is None:
            raise InputError(f"--into {self.into}: expected --hammer too, in which constants are replaced")
        check_endings([] if self.plot is None else [self.plot], PICTURES, "--plot")
        wanted = [path for path in (self.out, self.into, self.plot, self.covariance) if path is not None]
        read = [*self.tables, *([Path(self.hammer)] if self.hammer is not None else [])]
        check_outputs(wanted, read)
        known = None if self.hammer is None else load(self.hammer)
        fit = found(known)
        made = fit.into(known) if self.into is not None and known is not None else None
        screen = console()
        show(fit, screen)
        for path in self._write(fit, made):
            say_written(screen, path)
        if strict and fit.rejected:
            raise typer.Exit(1)

    def _write(self, fit: Fit, made: Hammer | None) -> list[Path]:
        from printhammer.cli.saving import write_picture
        from printhammer.identify.fragment import covariance_table
        from printhammer.support.outputs import write_file

        written = []
        if self.plot is not None:
            from printhammer.figures.fit import plot

            write_picture(self.plot, plot(fit))
            written.append(self.plot)
        if self.out is not None:
            write_file(self.out, fit.fragment())
            written.append(self.out)
        if self.covariance is not None:
            write_file(self.covariance, covariance_table(fit))
            written.append(self.covariance)
        if self.into is not None and made is not None:
            made.save(self.into)
            written.append(self.into)
        return written


def _length(text: str | None, flag: str) -> float | None:
    from printhammer.drive.input import read_number

    return None if text is None else read_number(text, "m", flag)


def _with_error(text: str, flag: str, si: str) -> tuple[float, float]:
    """Read a value and its standard error, such as "3 GPa +- 0.2 GPa"; without one it is 0."""
    from printhammer.drive.input import read_number

    value, mark, error = text.replace("±", "+-").partition("+-")
    return (
        read_number(value.strip(), si, f"--{flag}"),
        abs(read_number(error.strip(), si, f"the error of --{flag}")) if mark else 0.0,
    )
