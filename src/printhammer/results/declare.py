"""Declarations of result fields: each field states its meaning, unit and dimensions.

`column`, `coordinate`, `scalar` and `part` declare the fields of a `printhammer.results.Result`, and
`derived` adds a property to its table. Dataset, table, files, the Attributes section of the docstring and the
HTML repr are generated from the declarations. `Declared` is the base of classes that have declared fields but
are not results.

The formatting functions show results and their fields in notebooks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from inspect import cleandoc
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Final,
    Literal,
    TypedDict,
    TypeVar,
    Unpack,
    dataclass_transform,
)

import numpy as np

from printhammer.support.html import html_table, titled

MOST_ROWS: Final = 40
"""Maximum number of displayed table rows; longer tables show their first and last rows. Arbitrary."""


def cell(value: Any) -> str:
    """Format a value as a table cell: numbers to six digits, arrays by their shape, None as a dash."""
    if value is None:
        return "-"
    if isinstance(value, np.ndarray):
        return f"array, {extent(value)}"
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)


def extent(values: Any) -> str:
    """Format the shape of an array, such as "3 × 512"."""
    return " × ".join(map(str, np.shape(values)))


def span(values: Any) -> str:
    """Format the range of an array as "minimum to maximum"; empty if the array has no finite number."""
    array = np.asarray(values)
    if array.dtype.kind not in "fiu":
        return ""
    finite = array[np.isfinite(array)]
    return f"{finite.min():.6g} to {finite.max():.6g}" if finite.size else ""


def shortened(rows: Sequence[Sequence[str]], most: int = MOST_ROWS) -> list[Sequence[str]]:
    """Shorten a table of more than `most` rows to its first and last rows.

    A row between them states the number of omitted rows.
    """
    hidden, half = len(rows) - most, most // 2
    if hidden <= 0:
        return list(rows)
    return [*rows[:half], [*["…"] * (len(rows[0]) - 1), f"{hidden} more"], *rows[len(rows) - half :]]


Kind = Literal["column", "coordinate", "scalar", "part"]

_KEY: Final = "column"
_SECTION: Final = re.compile(r"^(?:Notes|References|Examples|See Also)\n-{3,}$", re.MULTILINE)
_F = TypeVar("_F", bound="Callable[..., Any]")


@dataclass(frozen=True)
class Column:
    """Declaration of a field of a result.

    Attributes
    ----------
    unit : str
        SI unit; "1" for a pure number, empty for words.
    meaning : str
        One phrase: the long name of the Dataset, and the first words in the docstring.
    dims : tuple of str
        Dimensions; none for a scalar.
    kind : str
        "column" and "coordinate" are arrays of the Dataset, "scalar" is an attribute, "part" is not in the
        Dataset.
    more : str
        Further text of the docstring.
    name : str
        Name in the Dataset.
    dtype : object
        Type of the numbers in the Dataset; None keeps the type of the values.
    codes : sequence of str
        Names of the codes 0, 1, 2 and so on; the table shows the names.
    head : str
        Heading in the table, without the unit; empty for `name`.
    attrs : mapping or None
        Further attributes of the Dataset variable.
    """

    unit: str
    meaning: str
    dims: tuple[str, ...] = ()
    kind: Kind = "column"
    more: str = ""
    name: str = ""
    dtype: Any = None
    codes: Sequence[str] = ()
    head: str = ""
    attrs: Mapping[str, str] | None = None

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the variable in the Dataset, such as its unit and long name."""
        coded = ", ".join(f"{code} {name}" for code, name in enumerate(self.codes))
        return {
            **({"units": self.unit} if self.unit else {}),
            "long_name": self.meaning,
            **({"codes": coded} if coded else {}),
            **(self.attrs or {}),
        }

    def heading(self, name: str) -> str:
        """Return the heading of the column in a table, such as "x [m]"."""
        return heading(self.head or name, self.unit)

    @property
    def sentence(self) -> str:
        """Return the text of the field in the Attributes section of the docstring."""
        unit = f", {self.unit}" if self.unit not in ("", "1") else ""
        more = f"; {self.more}" if self.more else ""
        return f"{self.meaning[:1].upper()}{self.meaning[1:]}{unit}{more}."


def heading(name: str, unit: str) -> str:
    """Return the heading of a column, such as "x [m]", without unit for a pure number or a text."""
    return name if unit in ("", "1") else f"{name} [{unit}]"


class More(TypedDict, total=False):
    """Optional keyword arguments of `column` and related functions, as described for `Column`."""

    more: str
    name: str
    dtype: Any
    codes: Sequence[str]
    head: str
    attrs: Mapping[str, str] | None


def column(unit: str, meaning: str, dims: str, *, default: Any = MISSING, **more: Unpack[More]) -> Any:
    """Declare an array of the Dataset.

    Parameters
    ----------
    unit, meaning : str
        SI unit ("1" for a pure number, empty for words) and one phrase.
    dims : str
        Names of the dimensions, with spaces between them.
    default : object, optional
        Default value of the field.
    **more
        Options of `Column`, such as `more`, additional text for the docstring, or `name` and `head`, the name
        in the Dataset and the table heading if they differ from the name of the field.
    """
    note = Column(unit, meaning, tuple(dims.split()), "column", **more)
    return field(default=default, repr=False, metadata={_KEY: note})


def coordinate(unit: str, meaning: str, dims: str, *, default: Any = MISSING, **more: Unpack[More]) -> Any:
    """Declare a coordinate of the Dataset; arguments as for `column`."""
    note = Column(unit, meaning, tuple(dims.split()), "coordinate", **more)
    return field(default=default, repr=False, metadata={_KEY: note})


def scalar(unit: str, meaning: str, *, more: str = "", name: str = "", **default: Any) -> Any:
    """Declare an attribute of the Dataset: a number, text or short list; arguments as for `column`.

    `default` and `default_factory` are passed to `dataclasses.field`.
    """
    return field(**default, metadata={_KEY: Column(unit, meaning, (), "scalar", more, name)})


def part(meaning: str, *, more: str = "", repr: bool = True, **default: Any) -> Any:
    """Declare a field outside the Dataset, such as the hammer; the field may enter the provenance.

    `default` and `default_factory` are passed to `dataclasses.field`.
    """
    return field(**default, repr=repr, metadata={_KEY: Column("", meaning, (), "part", more)})


def derived(
    unit: str, meaning: str, dims: str = "", *, kind: Kind | None = None, **more: Unpack[More]
) -> Callable[[_F], _F]:
    """Declare a property as a variable of the Dataset: a decorator below `@property` or `@cached_property`.

    Arguments as for the function `column`; without dimensions the property is an attribute of the Dataset.
    """
    sort: Kind = kind or ("column" if dims.split() else "scalar")
    note = Column(unit, meaning, tuple(dims.split()), sort, **more)

    def mark(function: _F) -> _F:
        setattr(function, _KEY, note)
        return function

    return mark


def columns_of(result: type[Any]) -> dict[str, Column]:
    """Return the declarations of a class by attribute name: fields in order, then derived properties."""
    declared: dict[str, Column] = {}
    if is_dataclass(result):
        declared = {entry.name: entry.metadata[_KEY] for entry in fields(result) if _KEY in entry.metadata}
    for owner in reversed(result.__mro__):
        for name, value in vars(owner).items():
            function = getattr(value, "fget", None) or getattr(value, "func", None)
            if isinstance(value, property | cached_property) and hasattr(function, _KEY):
                declared[name] = getattr(function, _KEY)
    return {key: note if note.name else replace(note, name=key) for key, note in declared.items()}


def with_attributes(doc: str, result: type[Any], columns: Mapping[str, Column]) -> str:
    """Return a docstring with an Attributes section generated from the declared fields.

    The section is placed before Notes, References and similar sections. Properties keep their own docstrings.
    """
    doc = cleandoc(doc)
    types = {entry.name: getattr(entry.type, "__name__", entry.type) for entry in fields(result)}
    lines: list[str] = []
    for name, note in columns.items():
        if name in types:
            lines += [f"{name} : {_type_text(str(types[name]), note.dims)}", f"    {note.sentence}"]
    if not lines or "Attributes\n-" in doc:
        return doc
    section = "\n".join(["Attributes", "----------", *lines])
    place = _SECTION.search(doc)
    if place is None:
        return f"{doc.rstrip()}\n\n{section}\n"
    return f"{doc[: place.start()]}{section}\n\n{doc[place.start() :]}"


def _type_text(annotation: str, dims: tuple[str, ...]) -> str:
    """Format a type annotation in numpydoc style, such as "int array, shape (firing,)"."""
    if not dims or not ("Array" in annotation or "ndarray" in annotation):
        return annotation.replace(" | ", " or ")
    sort = "int " if "int" in annotation.lower() else "bool " if "bool" in annotation.lower() else ""
    none = " or None" if "None" in annotation else ""
    return f"{sort}array, shape ({', '.join(dims)}{',' if len(dims) == 1 else ''}){none}"


@dataclass_transform(frozen_default=True, field_specifiers=(column, coordinate, scalar, part))
class Declared:
    """Base of classes with declared fields but without a Dataset; subclasses are frozen dataclasses.

    The fields declare their meanings like the fields of a result; the Attributes section of the docstring is
    generated from the declarations. With `eq=False` instances are compared by identity, as required for
    fields that are arrays.
    """

    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init_subclass__(cls, *, eq: bool = True, **options: Any) -> None:
        super().__init_subclass__(**options)
        dataclass(frozen=True, eq=eq)(cls)
        cls.__doc__ = with_attributes(cls.__doc__ or "", cls, columns_of(cls))

    def _repr_html_(self) -> str:
        """Return the HTML repr: values with units and meanings."""
        notes = columns_of(type(self))
        rows = [
            (
                notes[entry.name].heading(entry.name),
                cell(getattr(self, entry.name)),
                notes[entry.name].meaning,
            )
            for entry in fields(self)
            if entry.repr and entry.name in notes
        ]
        return titled(type(self).__name__, html_table(rows))

    def __dir__(self) -> list[str]:
        """Return the names offered for tab completion: public fields, properties and methods."""
        return public_names(super().__dir__())


def public_names(names: Iterable[str]) -> list[str]:
    """Return the public names among the names of an object's attributes, sorted, without class constants."""
    return sorted(name for name in names if not name.startswith("_") and not name.isupper())
