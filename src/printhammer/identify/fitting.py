"""Entry point of all fits: selects the fit by kind of measurement, and supplies the known constants."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from printhammer.drive.input import read_number
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.identify.result import Fit, with_error
from printhammer.support.arguments import checked

KINDS: Final = ("magnet", "solenoid", "spring", "pack", "backstop", "motion", "coil")


@checked
def fit(
    kind: str, path: str | Path | Sequence[str | Path], *, hammer: Hammer | None = None, **options: Any
) -> Fit:
    """Fit constants of a hammer to a measurement.

    Parameters
    ----------
    kind : str
        "magnet": F0, Am, Bm (and Bs, As) from forces against displacement and current; "solenoid": the
        magnetic circuit of the law `reluctance` from forces and inductances against the gap; "spring": Bs, As
        from forces of the spring alone; "pack": the stiffness from load cycles; "backstop": l/k, and l, from
        rebounds; "motion": mass, damping and so on from records of single shots; "coil": resistance,
        inductance and so on from records of the current while a voltage is applied.
    path : path, or sequence of path
        The table, CSV with units in its heading; several tables for "motion" and "coil"; for "magnet"
        optionally a second table without currents, for the spring alone.
    hammer : Hammer, optional
        Hammer with the known constants: position of the backstop, thickness of the pack, stiffness of the
        backstop; for "motion" and "coil", which require it, all constants that are not fitted. The
        uncertainty of a known constant is propagated, except for "coil".
    **options
        Options of the kind; lengths in m or with a unit. For all: `robust` (true), whether to exclude
        outliers, and `columns`, the contents of the columns (`printhammer.support.tables.columns`). For
        "magnet": `spring`, a table of the spring alone; `position` of the backstop; `zero`, the reading of
        the displacement sensor at x = 0, or None to fit it. For "solenoid": see
        `printhammer.identify.static.solenoid.fit_solenoid`. For "spring": `position`. For "pack":
        `thickness`; `exponents`, whether to fit the exponents. For "backstop": `stiffness`, N/m^1.5 or a
        `printhammer.identify.static.backstop.Stiffness`. For "motion": see
        `printhammer.identify.shots.motion.fit_motion`. For "coil": see `printhammer.identify.coil.fit_coil`.

    Returns
    -------
    Fit
        Constants with standard errors and 95 % intervals, their covariance, the combinations that the data do
        not determine, and the test of the law.

    Raises
    ------
    InputError
        The kind is unknown, a table is invalid, or the data are insufficient; the message says what is
        missing.
    """
    if kind not in KINDS:
        raise InputError.of("kind", kind, f"one of {', '.join(KINDS)}")
    many = [path] if isinstance(path, str) or not hasattr(path, "__iter__") else list(path)
    if kind in ("motion", "coil"):
        from printhammer.identify.coil import fit_coil
        from printhammer.identify.shots.motion import fit_motion

        if hammer is None:
            raise InputError(
                "the hammer is missing", key="hammer", expected="a hammer that supplies the known constants"
            )
        if kind == "coil":
            return fit_coil(many, hammer, **options)
        return fit_motion(many, hammer, **options)
    if kind == "magnet" and len(many) == 2 and options.get("spring") is None:
        many, options["spring"] = _magnet_and_spring(many)
    if len(many) != 1:
        raise InputError(f"{len(many)} tables", key="tables", expected=f"a single table of the kind {kind!r}")
    if kind == "solenoid":
        from printhammer.identify.static.solenoid import fit_solenoid

        return fit_solenoid(many[0], **options)
    for name in ("position", "thickness", "zero"):
        if isinstance(options.get(name), str):
            options[name] = read_number(options[name], "m", name)
    return _static(kind, many[0], hammer, options)


def _magnet_and_spring(paths: list[Any]) -> tuple[list[Any], Any]:
    """Sort two force tables: the table with coil currents first, the table without currents second."""
    from printhammer.support.tables.readings import read_table

    columns = {"displacement": "m", "force": "N"}
    with_current = [
        "current" in read_table(path, columns, optional={"current": "A"}).values for path in paths
    ]
    if sum(with_current) != 1:
        names = " and ".join(str(path) for path in paths)
        raise InputError(
            f"{names}: expected one table with the column 'current' and one without", key="current"
        )
    first = with_current.index(True)
    return [paths[first]], paths[1 - first]


def _static(kind: str, table: Any, hammer: Hammer | None, options: dict[str, Any]) -> Fit:
    """Fit a table of static forces, or of rebounds.

    The uncertainty of the known constant that the fit requires, if stated, is propagated by central
    differences.
    """
    name, key = _TAKEN[kind]
    known = None
    if options.get(name) is None:
        known = _known(hammer, key)
        options[name] = known
    fit = _fitted(kind, table, options)
    error = hammer.uncertainty.error(key) if hammer is not None and hammer.uncertainty is not None else 0.0
    if known is None or not error > 0.0:
        return fit
    up, down = (_fitted(kind, table, {**options, name: known + shift}) for shift in (error, -error))
    return with_error(
        fit, key, error, [0.5 * (up[each].value - down[each].value) / error for each in fit.keys]
    )


_TAKEN: Final = {
    "magnet": ("position", "backstop.position"),
    "spring": ("position", "backstop.position"),
    "pack": ("thickness", "pack.thickness"),
    "backstop": ("stiffness", "backstop.stiffness"),
}
"""Known constant that each static fit requires: name of the option, and key in the hammer file."""


def _known(hammer: Hammer | None, key: str) -> float | None:
    """Return a known constant of a hammer, SI; None if the hammer does not state the constant.

    The stiffness of the backstop may also be computed from other constants of the backstop.
    """
    if hammer is None:
        return None
    if key == "backstop.stiffness":
        return getattr(hammer.backstop, "k", None)
    if key == "backstop.position":
        return hammer.position
    return hammer.constants[key].si if key in hammer.constants else None


def _fitted(kind: str, table: Any, options: dict[str, Any]) -> Fit:
    if kind == "magnet":
        from printhammer.identify.static.magnet import fit_magnet

        return fit_magnet(table, **options)
    if kind == "spring":
        from printhammer.identify.static.spring import fit_spring

        if options["position"] is None:
            raise InputError(
                "the position of the backstop is missing",
                key="position",
                expected="this value, or a hammer that states the constant",
            )
        return fit_spring(table, **options)
    if kind == "pack":
        from printhammer.identify.static.pack import fit_pack

        if options["thickness"] is None:
            raise InputError(
                "the thickness of the pack is missing",
                key="thickness",
                expected="this value, or a hammer that states the constant",
            )
        return fit_pack(table, **options)
    from printhammer.identify.static.backstop import fit_backstop

    return fit_backstop(table, **options)
