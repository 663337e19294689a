"""Entry point of sweeps, from a spec to a store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.errors import InputError
from printhammer.results.files import frame_of, need_for, write_csv
from printhammer.results.store import Store, open_store
from printhammer.support.arguments import checked
from printhammer.support.threads import thread_count
from printhammer.sweep.plan import make_plan
from printhammer.sweep.spec import read_spec
from printhammer.sweep.work import Index, Results, run_local

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Progress = Callable[[float, int, int], None]
"""Progress callback; arguments: members done, members done before this run, total number of members."""


@checked
def sweep(
    spec: str | Path | Mapping[str, Any],
    out: str | Path,
    *,
    threads: int | None = None,
    dask: Any = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Run many hammers under many drives and store the results.

    The results are written block by block. After an interruption of any kind, the same call resumes the
    sweep. Apart from time stamps, the complete store is identical to that of an uninterrupted sweep,
    whatever the number of threads, with or without dask.

    Parameters
    ----------
    spec : path or mapping
        Spec file, or its contents as a mapping; see the guide on sweeps.
    out : path
        Folder of the store (Zarr v3): a new folder, an unfinished store to resume, or a complete store. If
        the name ends in .csv, a table with one row per member and one column per firing is written to that
        file; the store has the same name with the suffix .zarr.
    threads : int, optional
        Threads on this machine; by default as many as there are cores.
    dask : str or distributed.Client, optional
        Address of the scheduler of a dask cluster, or a client, to run there instead.
    progress : callable, optional
        Called at intervals with three numbers of members: done, done before this run, and total.

    Returns
    -------
    xarray.Dataset
        The opened store; values are read on access. The dimensions are the axes of a grid, or `member` for a
        Latin hypercube. A member that failed is a row with a status.

    Raises
    ------
    InputError
        The spec is invalid; the store holds other results, is locked by another process or cannot be written;
        no scheduler answers at the address.
    """
    thread_count(threads)
    table = Path(out) if Path(out).suffix.lower() == ".csv" else None
    if table is not None:
        out = table.with_suffix(".zarr")
        if table.exists() and not Path(out).exists():
            raise InputError.of("out", str(table), "a new file, or a file whose store exists")
    need_for(out, ".zarr")
    plan = make_plan(read_spec(spec))
    with ExitStack() as stack:
        client = None
        if dask is not None:
            from printhammer.sweep.cluster import client_of

            client = stack.enter_context(client_of(dask))
        store = stack.enter_context(Store(out, plan.layout(), _now()))
        todo = [index for index in plan.blocks.indices() if not store.done(index)]
        before = plan.members - sum(len(plan.blocks.members(index)) for index in todo)
        done = before

        def write(index: Index, results: Results) -> None:
            nonlocal done
            size = plan.blocks.size(index)
            store.write(
                index, {name: values.reshape(*size, *values.shape[1:]) for name, values in results.items()}
            )
            done += len(plan.blocks.members(index))

        def tell(under_way: float) -> None:
            if progress is not None:
                progress(done + under_way, before, plan.members)

        tell(0.0)
        if client is None:
            run_local(plan, todo, write, tell, threads)
        else:
            from printhammer.sweep.cluster import run_dask

            run_dask(plan, todo, write, tell, client)
        tell(0.0)
        store.finish(_now())
    result = open_store(out)
    if table is not None:
        write_csv(_member_table(result), table)
    return result


def _member_table(result: xr.Dataset) -> pd.DataFrame:
    """Convert a sweep to a table with one row per member.

    The columns are the axis values, the status in words, and the elements of every other array, with one
    column for each firing or output time. For a member that was not run, only axis values and status are
    filled in.
    """
    wide = result[["status"]]
    for name, variable in result.data_vars.items():
        further = [dim for dim in variable.dims if dim not in wide["status"].dims]
        for place in np.ndindex(*(result.sizes[dim] for dim in further)):
            column = variable.isel(dict(zip(further, place, strict=True))).drop_vars(further, errors="ignore")
            wide["_".join([str(name), *(str(k + 1) for k in place)])] = column
    table = frame_of(wide, {})
    attrs = result["status"].attrs
    codes = dict(zip(attrs["flag_values"], str(attrs["flag_meanings"]).split(), strict=True))
    table["status"] = [codes[code].replace("_", " ") for code in table["status"]]
    own = list(table.columns)[list(table.columns).index("status") + 1 :]
    table[own] = table[own].astype(object).where(table["reached [s]"].notna(), None)
    return table


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
