"""Sweeps: the one entry, from a spec to a store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from printhammer.results.files import need_for
from printhammer.results.store import Store, open_store
from printhammer.support.threads import thread_count
from printhammer.sweep.plan import make_plan
from printhammer.sweep.spec import read_spec
from printhammer.sweep.work import Index, run_local

if TYPE_CHECKING:
    import xarray as xr

    from printhammer.sweep.work import Results

Progress = Callable[[float, int, int], None]
"""Takes the members done so far, those of them that were in the store before, and all."""


def sweep(
    spec: str | Path | Mapping[str, Any],
    out: str | Path,
    *,
    threads: int | None = None,
    dask: Any = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Run many hammers under many drives and keep the results in a store.

    The results are written block by block. Whatever ends the process, the same call goes on where it ended,
    and the complete store is the same to the bit as that of an uninterrupted sweep, its time stamps apart; so
    it is for any number of threads and for dask.

    Parameters
    ----------
    spec : path or mapping
        A spec file, or what one says; see the guide on sweeps.
    out : path
        Folder of the store (Zarr v3), made, continued, or found complete.
    threads : int, optional
        Threads on this machine; by default as many as there are cores.
    dask : str or distributed.Client, optional
        Do the work on a dask cluster instead: the address of its scheduler, or a client of it.
    progress : callable, optional
        Called now and then with the members done, how many of them were done before, and all members.

    Returns
    -------
    xarray.Dataset
        The store, opened; values are read when they are used. The dimensions are the axes of a grid, or
        `member` for a Latin hypercube. A member that failed is a row with a status.

    Raises
    ------
    InputError
        The spec is not one; the store holds other results, is being written to by another process or cannot
        be written; nobody answers at the address.
    """
    thread_count(threads)
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
    return open_store(out)


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
