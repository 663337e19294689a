"""The class `Hammer`: one actuator and its constants, with unit, status and source.

A hammer is read from a TOML file (`load`, `Hammer.from_toml`), modified by `Hammer.replace`, and written
without loss. Numbers are SI in memory; the file keeps its units, comments and layout.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError, located, nearest
from printhammer.hammer.edit import Edit, changed, changed_text, edit_of
from printhammer.hammer.file import FORMAT, Contents, build, physics_of, read_document
from printhammer.hammer.uncertainty import UNCERTAINTY, Uncertainty
from printhammer.parts import BackstopPart, CoilPart, DampingPart, MagnetPart, PackPart, Part, SpringPart
from printhammer.parts.base import domain_of
from printhammer.parts.friction import DryFriction
from printhammer.parts.spring.forces import ForceSum
from printhammer.parts.spring.terms import Term
from printhammer.support.arguments import checked
from printhammer.support.constants import Constant
from printhammer.support.html import html_table, titled

_CHANGED: Final = ", changed"

REPLACED: Final = "replaced"
"""Default source of a constant set by `Hammer.replace`."""


def shipped() -> tuple[str, ...]:
    """List the names of the shipped hammers."""
    folder = files("printhammer").joinpath("hammers")
    return tuple(sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml")))


@checked
def load(name_or_path: str | Path) -> Hammer:
    """Load a shipped hammer by name, or a hammer file by path.

    Parameters
    ----------
    name_or_path : str or Path
        Name of a shipped hammer, such as "hendriks-1983", or a path to a hammer file.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or does not describe a hammer; one sentence names the file, the
        key, the value and what was expected.
    """
    if isinstance(name_or_path, str) and name_or_path in shipped():
        source = files("printhammer").joinpath("hammers", f"{name_or_path}.toml")
        return Hammer.from_toml(source.read_text(encoding="utf-8"), name=f"{name_or_path}.toml")
    path = Path(name_or_path)
    try:
        text = path.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: expected a TOML file in UTF-8", file=path) from None
    except FileNotFoundError:
        raise InputError(
            f"{path}: there is no such file", file=path, expected=f"a path or {nearest(str(path), shipped())}"
        ) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: the hammer file cannot be read ({reason})", file=path) from None
    return Hammer.from_toml(text, name=str(path), folder=path.parent)


@dataclass(frozen=True, eq=False, repr=False)
class Hammer:
    """Actuator: armature, magnet, coil, spring and backstop, the pack that is struck, and the waveform.

    Created by `load` or `Hammer.from_toml`. Two hammers are equal if their files have equal contents.
    """

    _contents: Contents
    _document: Mapping[str, Any]
    _text: str
    _edits: tuple[Edit, ...] = ()
    _where: str = "hammer"
    _folder: Path = field(default_factory=Path)

    @classmethod
    def from_toml(cls, text: str, name: str = "hammer", folder: str | Path | None = None) -> Hammer:
        """Parse the text of a hammer file.

        Parameters
        ----------
        text : str
            Text of the file, in TOML.
        name : str, optional
            Name for error messages, usually the file name.
        folder : path, optional
            Folder of force tables and sampled waveforms; by default the working directory.
        """
        place = Path(folder) if folder is not None else Path()
        document = read_document(text, name)
        return cls(build(document, name, place), document, text, (), name, place)

    @classmethod
    def build(
        cls,
        mass: str | float,
        *,
        name: str = "hammer",
        status: str = "assumed",
        source: str = "given in Python",
        **parts: Any,
    ) -> Hammer:
        """Build a hammer, such as a textbook impact oscillator, from its parts.

        Parameters
        ----------
        mass : str or float
            Mass of the armature, as text with its unit, or in kg.
        name : str, optional
            Short name.
        status, source : str, optional
            Status and source of all constants.
        **parts
            `magnet`, `spring`, `pack`, `backstop`, `damping`, `waveform`, `platen`, `coil`, each in a form
            that `replace` accepts.
        """
        constant = 'mass = { value = 1.0, unit = "kg", status = "assumed", source = "to be replaced" }'
        bare = cls.from_toml(f'format = {FORMAT}\nname = "hammer"\n\n{constant}\n')
        return bare._with({"name": name, "mass": mass, **parts}, status, source, name)

    @property
    def name(self) -> str:
        """Short name of the hammer, such as "hendriks-1983"."""
        return self._contents.name

    @property
    def title(self) -> str:
        """One-line description of the hammer, or an empty string."""
        return self._contents.title

    @property
    def note(self) -> str:
        """Important remarks on the constants of the hammer, or an empty string."""
        return self._contents.note

    @property
    def strike(self) -> str:
        """Noun for the result of a pulse, such as "closing" of a relay; "dot" by default."""
        return self._contents.strike or "dot"

    @property
    def struck(self) -> str:
        """Noun for the struck object, such as "pole" of a relay, or an empty string."""
        return self._contents.struck

    @property
    def mover(self) -> str:
        """Noun for the moving part, such as "ball"; "armature" by default."""
        return self._contents.mover or "armature"

    @property
    def shown_units(self) -> dict[str, str]:
        """Display units that the hammer file sets for lengths and times, by SI unit."""
        units = {"m": self._contents.length_unit, "s": self._contents.time_unit}
        return {si: unit for si, unit in units.items() if unit}

    @property
    def views(self) -> tuple[str, ...]:
        """Names of the studio views, in the order of the file; if empty, the parts determine the views."""
        return self._contents.views

    @property
    def path(self) -> str:
        """Path of the hammer file, for messages; marked as modified if constants were replaced."""
        return self._where

    @property
    def mass(self) -> float:
        """Mass of the armature, kg."""
        return self._contents.body.mass

    @property
    def platen(self) -> float | None:
        """Position of the platen, m; None without a platen."""
        return self._contents.body.platen

    @property
    def coil_resistance(self) -> float | None:
        """Resistance of the coil, ohm; None if unspecified."""
        return getattr(self.coil, "resistance", None)

    @cached_property
    def magnet(self) -> MagnetPart | None:
        """Magnet: permanent magnet and coil; None if absent."""
        part = self._contents.parts.get("magnet")
        return part if isinstance(part, MagnetPart) else None

    @cached_property
    def coil(self) -> CoilPart | None:
        """Circuit of the coil; None if absent."""
        part = self._contents.parts.get("coil")
        return part if isinstance(part, CoilPart) else None

    @cached_property
    def spring(self) -> SpringPart | None:
        """Spring of the armature; None if absent."""
        part = self._contents.parts.get("spring")
        return part if isinstance(part, SpringPart) else None

    @cached_property
    def domain(self) -> tuple[float, float]:
        """Range of displacements in which the laws of magnet and spring are valid, m."""
        return domain_of(self.magnet, self.spring)

    @cached_property
    def pack(self) -> PackPart | None:
        """Ribbon and paper pack; None if absent."""
        part = self._contents.parts.get("pack")
        return part if isinstance(part, PackPart) else None

    @cached_property
    def backstop(self) -> BackstopPart | None:
        """Backstop of the armature; None if absent."""
        part = self._contents.parts.get("backstop")
        return part if isinstance(part, BackstopPart) else None

    @cached_property
    def damping(self) -> DampingPart | None:
        """Damping of the armature at every displacement; None if absent."""
        part = self._contents.parts.get("damping")
        return part if isinstance(part, DampingPart) else None

    @property
    def is_damped(self) -> bool:
        """Whether a damping, or a contact of the list ``[[contact]]``, dissipates energy of the armature."""
        return self.damping is not None or (self.spring is not None and self.spring.viscous)

    @property
    def parts(self) -> Mapping[str, Part]:
        """Parts of the hammer that are present, by role."""
        return MappingProxyType(self._contents.parts)

    @property
    def laws(self) -> dict[str, str]:
        """Law of each part, force and contact, and shape of the waveform, by table of the hammer file."""
        laws = {role: part.law for role, part in self.parts.items()}
        for role, part in (("spring", self.spring), ("damping", self.damping)):
            if isinstance(part, (ForceSum, DryFriction)):
                laws.pop(role)
                if role in self._document:
                    laws[role] = self._document[role]["law"]
        laws |= {key: term.law for key, term in self.terms.items()}
        return laws | ({} if self.waveform is None else {"waveform": self.waveform.shape})

    @property
    def terms(self) -> Mapping[str, Term]:
        """Additional forces and contacts by key, such as "force.weight" or "contact.pole"."""
        return MappingProxyType(self._contents.terms)

    @property
    def waveform(self) -> Waveform | None:
        """Standard waveform of one pulse; None if absent."""
        return self._contents.waveform

    @cached_property
    def position(self) -> float | None:
        """Position of the backstop, m; None without a backstop."""
        return self.backstop.position if self.backstop is not None else None

    @cached_property
    def front(self) -> float | None:
        """Position of the front face of the pack, m; None without a pack."""
        return self.pack.front if self.pack is not None else None

    @cached_property
    def origin(self) -> float:
        """Position b of equation (4), m: position of the backstop, or 0 without a backstop."""
        return self.position if self.position is not None else 0.0

    @property
    def constants(self) -> Mapping[str, Constant]:
        """Constants of the hammer file, by dotted key such as "magnet.F0"."""
        return MappingProxyType(self._contents.constants)

    @property
    def uncertainty(self) -> Uncertainty | None:
        """Standard errors and correlations of the constants; None if all constants are exact."""
        return self._contents.uncertainty

    @cached_property
    def fingerprint(self) -> str:
        """Hexadecimal digest of the physics of the hammer: laws, SI values, options and tables.

        Names, notes, units, sources, statuses, errors, comments and file names do not affect the digest; an
        option or constant at its default counts as missing.
        """
        content: dict[str, Any] = {"mass": self.mass.hex()}
        if self.platen is not None:
            content["platen"] = self.platen.hex()
        if self.coil_resistance is not None:
            content["coil.resistance"] = self.coil_resistance.hex()
        models: dict[str, tuple[str, Any]] = {role: (part.law, part) for role, part in self.parts.items()}
        if not physics_of(self.coil).keys() - {"resistance"}:
            # A resistance alone does not make a circuit: it only affects the heat.
            models.pop("coil", None)
        if self.waveform is not None:
            models["waveform"] = (self.waveform.shape, self.waveform)
        for section, (kind, model) in models.items():
            content[section] = {"": kind, **physics_of(model)}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def replace(
        self,
        key: str | Mapping[str, Any],
        value: Any = None,
        *,
        status: str = "assumed",
        source: str = REPLACED,
    ) -> Hammer:
        """Return a new hammer with constants, options or whole parts replaced; the original is unchanged.

        Parameters
        ----------
        key : str or mapping
            Dotted key, such as "pack.stiffness", "pack.reloading" or "backstop"; or a mapping of keys to
            values, which are set together.
        value : object, optional
            For a constant: text with its unit ("60 lbf"), a float in SI, or a `Constant`; for an option: its
            value; for a part: a part, or a mapping of its keys with "law"; None removes an optional entry.
            The standard errors of replaced constants are removed, unless "uncertainty" is set, too.
        status, source : str, optional
            Status and source of the constants that are set.
        """
        wanted = {key: value} if isinstance(key, str) else dict(key)
        return self._with(wanted, status, source, f"{self._where.removesuffix(_CHANGED)}{_CHANGED}")

    def _with(self, wanted: Mapping[str, Any], status: str, source: str, where: str) -> Hammer:
        """Return a new hammer, the keys in `wanted` set to their values; messages begin with `where`."""
        document = dict(self._document)
        edits: list[Edit] = []
        with located(where):
            for name, entry in wanted.items():
                edit = edit_of(document, name, entry, status, source)
                document = changed(document, [edit])
                edits.append(edit)
            known = self.uncertainty
            if known is not None and UNCERTAINTY not in wanted:
                gone = {key for key in known.keys if key in wanted or key.rpartition(".")[0] in wanted}
                if gone:
                    units = {key: constant.si_unit for key, constant in self.constants.items()}
                    edits.append((UNCERTAINTY, known.without(gone).table(units)))
                    document = changed(document, edits[-1:])
        contents = build(document, where, self._folder, like=(self._document, self._contents))
        return Hammer(contents, document, self._text, (*self._edits, *edits), where, self._folder)

    def to_toml(self) -> str:
        """Return the text of the hammer file, with the original layout and all replacements."""
        return changed_text(self._text, self._edits) if self._edits else self._text

    def save(self, path: str | Path) -> None:
        """Write the hammer file and, into the same folder, the tables to which the file refers.

        Raises
        ------
        InputError
            The file cannot be written, or a table would overwrite a different file; existing files are kept.
        """
        target = Path(path)
        draft = target.with_name(target.name + ".part")
        try:
            tables = self._tables(target)
            draft.write_bytes(self.to_toml().encode())
            for name, data in tables.items():
                (target.parent / name).write_bytes(data)
            draft.replace(target)
        except OSError as error:
            with suppress(OSError):
                draft.unlink()
            raise InputError(
                f"{target}: the hammer file cannot be written ({error.strerror})", file=target
            ) from None

    @property
    def files(self) -> dict[str, str]:
        """Paths of the table files, relative to the folder of the hammer file, by key such as "magnet"."""
        models = {"magnet": self.magnet, "waveform": self.waveform, **self.terms}
        names = {key: getattr(model, "file", None) for key, model in models.items()}
        return {key: name for key, name in names.items() if name}

    def _tables(self, target: Path) -> dict[str, bytes]:
        """Return the contents, by file name, of the tables that are missing in the folder of `target`."""
        missing: dict[str, bytes] = {}
        for name in self.files.values():
            if Path(name).is_absolute():
                continue
            data, there = (self._folder / name).read_bytes(), target.parent / name
            if not there.exists():
                missing[name] = data
            elif there.read_bytes() != data:
                raise InputError(f"{there}: the file differs from the table of {self.name}", file=there)
        return missing

    @cached_property
    def rest(self) -> float:
        """Displacement at which the armature rests at zero current, m."""
        from printhammer.hammer.equilibrium import rest_state

        return rest_state(self)

    def check(self) -> None:
        """Check that the armature of a hammer with magnet and backstop rests at the backstop.

        Raises
        ------
        InputError
            At zero current, the net force of magnet and spring pulls the armature off the backstop, or
            compresses the backstop beyond the range of the magnet's law.
        """
        if self.magnet is not None and self.backstop is not None:
            with located(self._where):
                _ = self.rest

    def warnings(self) -> list[str]:
        """List the warnings about a hammer; a hammer with warnings can still be simulated.

        There is one sentence for each interval between backstop and platen in which the net force of magnet
        and spring at zero current is positive, and one for each displacement at which the pull of a measured
        magnet changes sign.
        """
        from printhammer.hammer.equilibrium import positive_intervals, pull_reversals
        from printhammer.units import from_si

        self.check()
        sentences = []
        for ends in positive_intervals(self):
            low, high = (from_si(end, "m", "um") for end in ends)
            where = f"from {low:.4g} to {high:.4g} um"
            sentences.append(
                f"the net force at zero current is positive {where}: the armature may never return from there"
            )
        sentences += [
            f"the pull changes sign at {from_si(place, 'm', 'mm'):.4g} mm within the table"
            for place in pull_reversals(self)
        ]
        return sentences

    @staticmethod
    def schema() -> dict[str, Any]:
        """Return the JSON schema of hammer files."""
        from printhammer.hammer.schema import schema

        return schema()

    def __eq__(self, other: object) -> bool:
        """Compare the contents of the hammer files, regardless of their layout."""
        if not isinstance(other, Hammer):
            return NotImplemented
        return self.fingerprint == other.fingerprint and self._document == other._document

    def __hash__(self) -> int:
        return hash(self.fingerprint)

    def __repr__(self) -> str:
        return f"<Hammer {self.name} {self.fingerprint[:8]}>"

    def _repr_html_(self) -> str:
        """Return the HTML repr: name and title, laws, and constants with their sources."""
        laws = list(self.laws.items())
        if self.waveform is not None:
            laws[-1] = ("waveform", f"{self.waveform.shape}, {self.waveform.quantity}")
        rows = [
            (each.key, f"{each.value:.6g} {each.unit}", each.meaning, each.status, each.source)
            for each in self.constants.values()
        ]
        heads = ("constant", "value", "meaning", "status", "source")
        return titled(
            f"{self.name}: {self.title}" if self.title else self.name,
            html_table(laws, ("part", "law")),
            html_table(rows, heads),
        )
