"""diffrax: an ensemble under `jax.vmap`, with diffrax's events, restarted at switches in a compiled loop."""

from __future__ import annotations

import importlib
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.solvers.entry import Absent, Entry
from benchmarks.solvers.problem import ENDS, FIRST, checked, ensemble_tasks

from .equations import BACKSTOP, FREE, LENGTH, LOADING, TIME, UNLOADING, hammer_constants, scaled_pieces

if TYPE_CHECKING:
    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

_FIRST_STEP = 0.01


def entries(task: Task, quick: bool, members: int) -> list[Entry]:
    """Return the benchmark entries of diffrax: ensembles of `members` members.

    Raises
    ------
    Absent
        diffrax is not installed.
    """
    try:
        diffrax = importlib.import_module("diffrax")
        jax = importlib.import_module("jax")
    except ImportError as error:
        raise Absent("not installed") from error
    tasks = ensemble_tasks(task, members)
    some = checked(members)
    name = f"diffrax {diffrax.__version__} on JAX {jax.__version__}"

    def positions(tolerance: float) -> FloatArray:
        # Integrate the whole ensemble, so that the loop is compiled only once.
        return np.array([_run(task, tolerance, tasks, end)[some] for end in ENDS.tolist()])

    def entry(tolerance: float) -> Entry:
        return Entry(
            f"{name} Dopri8, its events, {tolerance:.0e}",
            partial(positions, tolerance),
            partial(_run, task, tolerance, tasks, FIRST),
            FIRST * members,
            members=members,
        )

    return [entry(tolerance) for tolerance in ((1e-9,) if quick else (1e-7, 1e-9))]


def _run(task: Task, tolerance: float, tasks: list[Task], end: float) -> FloatArray:
    tables = [scaled_pieces(member, end) for member in tasks]
    longest = 3 * (int(FIRST / (0.9 * task.period)) + 1)
    padded = np.array([np.vstack([table, np.tile(table[-1], (longest - len(table), 1))]) for table in tables])
    compiled = _compiled(tolerance, tuple(hammer_constants(task)))
    return np.asarray(compiled(padded, task.rest / LENGTH, end / TIME)) * LENGTH


@lru_cache(maxsize=4)
def _compiled(tolerance: float, c: tuple[float, ...]) -> Any:
    jax = importlib.import_module("jax")
    jnp = importlib.import_module("jax.numpy")
    diffrax = importlib.import_module("diffrax")
    optimistix = importlib.import_module("optimistix")
    jax.config.update("jax_enable_x64", True)
    front, position = c[7] / LENGTH, c[9] / LENGTH
    unit = TIME**2 / LENGTH / c[0]

    def rates(t: Any, y: Any, args: Any) -> Any:
        mode, peak, piece = args
        x, v = y
        metres = x * LENGTH
        current = piece[2] + piece[3] * jnp.exp(-piece[4] * (t - piece[0]))
        reduced = c[2] - c[3] * current
        f = c[1] - reduced * reduced / jnp.sqrt(metres) + c[4] - c[4] / c[5] * (metres - c[9])
        depth = jnp.maximum(c[9] - metres, 0.0)
        hertz = depth * jnp.sqrt(depth) * (c[10] - c[11] * v * (LENGTH / TIME))
        r = jnp.maximum((metres - c[7]) / c[8], 0.0)
        r2 = r * r
        r4 = r2 * r2
        pack = jnp.where(
            mode == LOADING, jnp.exp(2.7 * jnp.log(jnp.maximum(r, 1e-300))), peak**-8.3 * r4 * r4 * r2 * r
        )
        f += jnp.where(mode == BACKSTOP, hertz, jnp.where(mode == FREE, 0.0, -c[6] * pack))
        return v, f * unit

    def first(t: Any, y: Any, args: Any, **_: Any) -> Any:  # noqa: ARG001
        x, v = y
        choices = [x - position, v, x - front, position - x]
        return jnp.select([args[0] == mode for mode in range(4)], choices)

    def second(t: Any, y: Any, args: Any, **_: Any) -> Any:  # noqa: ARG001
        x, v = y
        return jnp.where(args[0] == FREE, front - x, jnp.where(args[0] == UNLOADING, -v, 1.0))

    event = diffrax.Event([first, second], optimistix.Newton(rtol=1e-13, atol=1e-13), direction=False)
    controller = diffrax.PIDController(rtol=tolerance, atol=tolerance)

    def one(pieces: Any, rest: Any, end: Any) -> Any:
        def going_on(carry: Any) -> Any:
            return carry[0] < end

        def stretch(carry: Any) -> Any:
            t, x, v, mode, peak, number = carry
            piece = pieces[number]
            found = diffrax.diffeqsolve(
                diffrax.ODETerm(rates),
                diffrax.Dopri8(),
                t,
                piece[1],
                jnp.minimum(_FIRST_STEP, piece[1] - t),
                (x, v),
                (mode, peak, piece),
                stepsize_controller=controller,
                event=event,
                max_steps=None,
                throw=False,
                adjoint=diffrax.ForwardMode(),
            )
            now, x, v = found.ts[-1], found.ys[0][-1], found.ys[1][-1]
            one_hit, two_hit = found.event_mask
            hit = one_hit | two_hit
            reversal = (mode == LOADING) | ((mode == UNLOADING) & two_hit)
            level = jnp.where((mode == UNLOADING) | ((mode == FREE) & two_hit), front, position)
            peak = jnp.where(hit & (mode == LOADING), (x * LENGTH - c[7]) / c[8], peak)
            x = jnp.where(hit & ~reversal, level, x)
            v = jnp.where(hit & reversal, 0.0, v)
            after_one = jnp.select([mode == m for m in range(4)], [BACKSTOP, UNLOADING, FREE, FREE])
            mode = jnp.where(one_hit, after_one, jnp.where(two_hit, LOADING, mode))
            number = jnp.where(hit, number, number + 1)
            return jnp.where(hit, now, piece[1]), x, v, mode, peak, number

        start = (
            jnp.asarray(0.0),
            rest,
            jnp.asarray(0.0),
            jnp.asarray(BACKSTOP),
            jnp.asarray(1.0),
            jnp.asarray(0),
        )
        return jax.lax.while_loop(going_on, stretch, start)[1]

    return jax.jit(jax.vmap(one, in_axes=(0, None, None)))
