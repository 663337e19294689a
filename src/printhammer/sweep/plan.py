"""Plan of a sweep: members, blocks of work, and layout of the store.

The members form a grid or a Latin hypercube, divided into blocks of work.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from importlib.metadata import version
from typing import Any, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.results import Declared, part
from printhammer.results.provenance import provenance
from printhammer.results.store import Layout, Variable
from printhammer.results.summary import (
    Cells,
    Grid,
    Summary,
    styled,
)
from printhammer.support.arrays import FloatArray
from printhammer.sweep.members import Maker
from printhammer.sweep.outputs import FIRING, TIME, Output
from printhammer.sweep.spec import Spec


def latin_hypercube(members: int, seed: int, axes: int) -> FloatArray:
    """Draw a Latin hypercube, shape (members, axes), of numbers in [0, 1).

    Each axis is divided into as many equal strata as there are members; each stratum contains one random
    point (McKay, Beckman and Conover, Technometrics 21 (1979) 239).
    """
    random = np.random.Generator(np.random.PCG64(seed))
    drawn = np.empty((members, axes))
    for column in range(axes):
        drawn[:, column] = (random.permutation(members) + random.random(members)) / members
    return drawn


def between(share: FloatArray, low: float, high: float, geometric: bool) -> FloatArray:
    """Interpolate the range from `low` to `high` at the fractions `share`, from 0 to 1.

    The scale is logarithmic if `geometric`, otherwise linear.
    """
    values: FloatArray
    if geometric:
        values = np.exp(np.log(low) + share * (np.log(high) - np.log(low)))
    else:
        values = low + share * (high - low)
    return np.clip(values, min(low, high), max(low, high))


class Blocks(Declared):
    """Division of a grid of members into blocks, each a whole chunk and contiguous in member order."""

    shape: tuple[int, ...] = part("members along each dimension; the last dimension varies fastest")
    chunks: tuple[int, ...] = part("members of a block along each dimension")

    @classmethod
    def of(cls, shape: Sequence[int], most: int) -> Blocks:
        """Divide a grid into blocks of at most `most` members."""
        chunks = [1] * len(shape)
        inner = 1
        for dim in reversed(range(len(shape))):
            chunks[dim] = max(1, min(shape[dim], most // inner))
            if chunks[dim] < shape[dim]:
                break
            inner *= shape[dim]
        return cls(tuple(shape), tuple(chunks))

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of blocks along each dimension."""
        return tuple(-(-length // chunk) for length, chunk in zip(self.shape, self.chunks, strict=True))

    @property
    def number(self) -> int:
        """Total number of blocks."""
        return math.prod(self.counts)

    def indices(self) -> Iterator[tuple[int, ...]]:
        """Iterate over the block indices in the chunk grid, in the order of the members."""
        return iter(np.ndindex(*self.counts))

    def size(self, index: Sequence[int]) -> tuple[int, ...]:
        """Return the shape of a block: its number of members along each dimension of the grid."""
        return tuple(
            min(chunk, length - i * chunk)
            for i, length, chunk in zip(index, self.shape, self.chunks, strict=True)
        )

    def members(self, index: Sequence[int]) -> range:
        """Return the member indices of a block, in the order of the members."""
        first = 0
        for i, length, chunk in zip(index, self.shape, self.chunks, strict=True):
            first = first * length + i * chunk
        return range(first, first + math.prod(self.size(index)))


FORMAT: Final = "1"
"""Version of the layout of stores."""

MEMBER: Final = "member"

_MOST_MEMBERS: Final = 1_000_000_000  # Largest number of members; arbitrary, to refuse typing errors
_BLOCKS: Final = 128  # Number of blocks aimed at, for progress and resumption; arbitrary
_FEWEST_IN_BLOCK: Final = 16
"""Smallest number of members of a block: the lanes integrated together; arbitrary."""
_MOST_IN_BLOCK: Final = 256
"""Largest number of members of a block: the lanes of one thread, as in `kernel.lanes.layout`."""
_MOST_BYTES: Final = 2**25  # Largest size of the results of a block; arbitrary


class Plan(Declared):
    """Spec of a sweep with its members, blocks and store layout."""

    spec: Spec = part("the spec")
    shape: tuple[int, ...] = part("members along each dimension")
    dims: tuple[str, ...] = part("names of the member dimensions")
    blocks: Blocks = part("the blocks of work")

    @property
    def members(self) -> int:
        """Number of members of the sweep."""
        return math.prod(self.shape)

    @cached_property
    def _drawn(self) -> FloatArray:
        """Axis values, shape (members, axes), of a Latin hypercube."""
        spec = self.spec
        share = latin_hypercube(spec.members or 0, spec.seed or 0, len(spec.axes))
        columns = [
            between(share[:, i], axis.values[0], axis.values[1], axis.geometric)
            for i, axis in enumerate(spec.axes)
        ]
        return np.stack(columns, axis=1)

    def rows(self, members: Iterable[int]) -> FloatArray:
        """Return the axis values, SI, of the given members, shape (members, axes)."""
        which = np.fromiter(members, np.int64)
        if not self.spec.grid:
            return self._drawn[which]
        places = np.unravel_index(which, self.shape)
        columns = [axis.values[place] for axis, place in zip(self.spec.axes, places, strict=True)]
        return np.stack(columns, axis=1)

    def layout(self) -> Layout:
        """Return the layout of the store: arrays, coordinates and attributes."""
        outputs = self.spec.outputs
        trailing = {"": (), FIRING: (FIRING,), TIME: (TIME,)}
        results = [
            Variable(
                output.name,
                (*self.dims, *trailing[output.dim]),
                (*self.shape, *outputs.length(output)),
                output.dtype,
                output.fill,
                output.attrs,
            )
            for output in outputs.arrays
        ]
        # Metadata for readers of the store.
        attrs: dict[str, Any] = {
            "title": self.spec.title,
            "hammer_file": self.spec.base.hammer.to_toml(),
            "spec": self.spec.text,
            "design": self.spec.design,
        }
        if not self.spec.grid:
            attrs["seed"] = self.spec.seed
            # xarray reads this attribute to mark the coordinates.
            attrs["coordinates"] = " ".join(axis.name for axis in self.spec.axes)
        return Layout(self.blocks.chunks, (*results, *self._coordinates()), attrs, identity(self.spec))

    def _coordinates(self) -> list[Variable]:
        coordinates = []
        for i, axis in enumerate(self.spec.axes):
            attrs = {"long_name": axis.note.meaning, "units": axis.note.si, "key": axis.key}
            dims = (axis.name,) if self.spec.grid else self.dims
            values = axis.values if self.spec.grid else self._drawn[:, i]
            dtype = "int64" if axis.counts else "float64"
            coordinates.append(_coordinate(axis.name, dims, values.astype(dtype), attrs))
        if not self.spec.grid:
            attrs = {"long_name": "number of the member"}
            coordinates.append(_coordinate(MEMBER, (MEMBER,), np.arange(self.members), attrs))
        outputs = self.spec.outputs
        if any(output.dim == FIRING for output in outputs.arrays):
            attrs = {"long_name": "number of the firing"}
            coordinates.append(_coordinate(FIRING, (FIRING,), np.arange(outputs.firings), attrs))
        if outputs.times.size:
            attrs = {"long_name": "time", "units": "s"}
            coordinates.append(_coordinate(TIME, (TIME,), outputs.times, attrs))
        return coordinates

    def table(self) -> list[tuple[Output, tuple[int, ...], int]]:
        """List the arrays with their shapes and uncompressed sizes in bytes."""
        outputs = self.spec.outputs
        shapes = [(*self.shape, *outputs.length(output)) for output in outputs.arrays]
        return [
            (output, shape, math.prod(shape) * np.dtype(output.dtype).itemsize)
            for output, shape in zip(outputs.arrays, shapes, strict=True)
        ]

    def summary(self) -> Summary:
        """Summarise axes, members, blocks and arrays of the sweep."""
        spec, every = self.spec, self.table()
        values = [axis.values for axis in spec.axes]
        axes = [
            Cells("axis", [axis.key for axis in spec.axes], left=True),
            Cells("", [str(len(each)) if spec.grid else "drawn" for each in values]),
            Cells("from", [each.min() for each in values], "", ".6g"),
            Cells("to", [each.max() for each in values], "", ".6g"),
            Cells("unit", ["" if axis.note.si == "1" else axis.note.si for axis in spec.axes], left=True),
        ]
        outputs, shapes, sizes = zip(*every, strict=True)
        meanings = [output.meaning + (f" [{output.unit}]" if output.unit else "") for output in outputs]
        arrays = [
            Cells("array", [output.name for output in outputs], left=True),
            Cells("shape", [" × ".join(map(str, shape)) for shape in shapes], left=True),
            Cells("size", [size_text(size) for size in sizes]),
            Cells("", meanings, left=True),
        ]
        blocks = "1 block" if self.blocks.number == 1 else f"{self.blocks.number} blocks"
        return Summary(
            [
                f"{styled('strong', spec.title or spec.where)}  {spec.base.hammer.name}\n",
                Grid(axes),
                "",
                Grid(arrays),
                (
                    f"\n{self.members} members in {blocks} of up to {math.prod(self.blocks.chunks)};"
                    f" {size_text(sum(sizes))} before compression"
                ),
            ]
        )


def size_text(size: float) -> str:
    """Format a size in bytes, such as "1.2 MB"."""
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} TB"


def identity(spec: Spec) -> dict[str, str]:
    """Return the properties that all results in a store must share, human-readable properties first."""
    return {
        "store_format": FORMAT,
        **provenance(hammer=spec.base.hammer, tolerance=spec.base.tolerance),
        "zarr": version("zarr"),
        "axes": ", ".join(axis.key for axis in spec.axes),
        "spec_fingerprint": spec.fingerprint,
    }


def _coordinate(name: str, dims: tuple[str, ...], values: Any, attrs: dict[str, Any]) -> Variable:
    return Variable(name, dims, values.shape, str(values.dtype), 0, attrs, values)


def make_plan(spec: Spec) -> Plan:
    """Build the plan of a spec.

    Raises
    ------
    InputError
        There are too many members, or the first, the middle and the last member are all invalid.
    """
    if spec.grid:
        dims, shape = tuple(axis.name for axis in spec.axes), tuple(len(axis.values) for axis in spec.axes)
    else:
        dims, shape = (MEMBER,), (spec.members or 0,)
    members = math.prod(shape)
    if members > _MOST_MEMBERS:
        raise InputError(
            f"{spec.where}: {members} members",
            expected=f"at most {_MOST_MEMBERS}",
            file=spec.where,
            key="members",
        )
    whole = Plan(spec, shape, dims, Blocks.of(shape, members))
    most = spec.chunk
    if most is None:
        bytes_of_member = sum(size for _output, _shape, size in whole.table()) // members
        room = max(1, _MOST_BYTES // bytes_of_member)
        most = min(max(members // _BLOCKS, _FEWEST_IN_BLOCK), _MOST_IN_BLOCK, room)
    plan = Plan(spec, shape, dims, Blocks.of(shape, most))
    _try(plan)
    return plan


def _try(plan: Plan) -> None:
    """Build the first, middle and last member; raise InputError if all three are invalid."""
    maker = Maker(plan.spec.base)
    faults: list[InputError] = []
    for row in plan.rows([0, plan.members // 2, plan.members - 1]):
        try:
            maker.member(row)
        except InputError as error:
            faults.append(error)
        else:
            return
    raise faults[0].within(plan.spec.where)
