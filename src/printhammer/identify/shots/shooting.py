"""Multiple shooting: each segment of a shot has an initial state; at the solution the gaps are closed.

The model of a record is a chain of segments. The first segment begins at rest at the firing; every later
segment begins in free flight, with displacement and velocity as additional unknowns. At the solution each
segment begins where the preceding one ends. Gaps are allowed while the constants are wrong, so that no error
grows through more than one contact. The unknown states are eliminated from the linearised conditions
("condensing": H. G. Bock, in: Modelling of Chemical Reaction Systems, Springer 1981, 102), so that a step
costs no more than a step in the constants alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from printhammer.drive.trains import PulseTrain
from printhammer.errors import InputError
from printhammer.hammer.equilibrium import rest_state
from printhammer.hammer.hammer import Hammer
from printhammer.identify.lowpass import lowpass_motion, time_constant
from printhammer.identify.shots.shot import Pulse, Shot, stroke_of
from printhammer.run.ensemble import Ensemble
from printhammer.support.arrays import FloatArray, IntArray

_STEP: Final = 1e-7  # Arbitrary
"""Finite-difference step: relative for a constant, normalised by stroke and typical speed for a state."""
_FINEST: Final = 2e-6
"""Largest time step of the displacement before low-pass filtering, s; arbitrary."""


@dataclass(frozen=True, eq=False)
class Parameters:
    """Fitted parameters: constants of the hammer, and constants of the current of each shot."""

    keys: tuple[str, ...]
    """Dotted keys of the fitted hammer constants."""
    owners: tuple[int, ...]
    """Index of the shot to whose current pulse each pulse parameter belongs."""
    scales: FloatArray
    """Scales of all parameters, SI; derivatives are per unit of scale."""

    @property
    def count(self) -> int:
        """Number of fitted parameters: hammer constants and pulse constants."""
        return len(self.keys) + len(self.owners)

    def of_shot(self, shot: int) -> list[int]:
        """Return the indices of the parameters that describe the current pulse of a shot."""
        return [len(self.keys) + i for i, owner in enumerate(self.owners) if owner == shot]


@dataclass(frozen=True, eq=False)
class Chain:
    """Simulated segments of one shot at given parameter values, with derivatives of the motion."""

    motion: FloatArray
    """Displacement [m] and velocity [m/s] at the grid times; shape (g, 2)."""
    gaps: FloatArray
    """Gaps: final state of each segment minus the initial state of the next, shape (j, 2)."""
    by_parameter: FloatArray
    """Derivatives of the motion per unit of each parameter's scale, shape (g, 2, p); p = 0 if omitted."""
    by_state: FloatArray
    """Derivatives of the motion with respect to the initial state of the segment, shape (g, 2, 2)."""
    end_by_parameter: FloatArray
    """Derivatives of each segment's final state per unit of each parameter's scale, shape (j, 2, p)."""
    end_by_state: FloatArray
    """Derivatives of each segment's final state with respect to its initial state, shape (j, 2, 2)."""


@dataclass(frozen=True, eq=False)
class _Plan:
    """Time grid of a shot, with the grid indices of samples and segment starts."""

    grid: FloatArray
    samples: IntArray
    begins: IntArray
    tau: float


@dataclass(frozen=True, eq=False)
class _Run:
    """Ensemble run of one segment: hammer, drive, initial state and output times."""

    hammer: Hammer
    drive: PulseTrain
    state: FloatArray
    times: FloatArray


class Shooting:
    """Multiple-shooting model of several shots, whose segments are integrated as one ensemble.

    Constants of the hammer that are not fitted stay fixed; where a pulse is None, the hammer's own waveform
    is fired.
    """

    def __init__(
        self, hammer: Hammer, shots: Sequence[Shot], pulses: Sequence[Pulse | None], parameters: Parameters
    ) -> None:
        self.hammer = hammer
        self.shots = list(shots)
        self.pulses = list(pulses)
        self.parameters = parameters
        self.plans = [_plan(shot) for shot in shots]
        self.stroke = stroke_of(hammer, shots[0].x)
        speed = max(float(np.abs(np.gradient(shot.x, shot.t)).max()) for shot in shots)
        self.units = np.array([self.stroke, speed])
        self.steps = _STEP * self.units
        waveforms = [hammer.waveform if pulse is None else pulse.waveform for pulse in pulses]
        # The margin is 50 %, since the fit may lengthen a pulse.
        self.lasting = [0.0 if each is None else 1.5 * each.support for each in waveforms]

    def hammer_at(self, values: FloatArray) -> Hammer:
        """Return the hammer with the fitted constants set to `values`, SI."""
        changes = {key: float(value) for key, value in zip(self.parameters.keys, values, strict=False)}
        return self.hammer.replace(changes) if changes else self.hammer

    def _variants(
        self, values: FloatArray, derivatives: bool
    ) -> list[tuple[Hammer, float, list[PulseTrain]]]:
        """Build the hammer, its rest position [m] and the drives of all shots at given parameter values, SI.

        The first entry of the list is for these values. With `derivatives`, one entry follows for each
        parameter, with this parameter perturbed.
        """
        parameters = self.parameters
        count = len(parameters.keys)
        variants = []
        base, drives = self.hammer_at(values), []
        for shot, pulse in enumerate(self.pulses):
            own = values[parameters.of_shot(shot)]
            drives.append(_drive(base, pulse, own))
        variants.append((base, rest_state(base), drives))
        if not derivatives:
            return variants
        for number in range(parameters.count):
            moved = values.copy()
            moved[number] += _STEP * parameters.scales[number]
            if number < count:
                other = base.replace(parameters.keys[number], float(moved[number]))
                fired = [
                    _drive(other, None, moved) if pulse is None else drive
                    for pulse, drive in zip(self.pulses, drives, strict=True)
                ]
                variants.append((other, rest_state(other), fired))
            else:
                shot = parameters.owners[number - count]
                fired = list(drives)
                fired[shot] = _drive(base, self.pulses[shot], moved[parameters.of_shot(shot)])
                variants.append((base, variants[0][1], fired))
        return variants

    def chains(
        self, values: FloatArray, states: Sequence[FloatArray], *, derivatives: bool
    ) -> list[Chain] | None:
        """Integrate all segments of all shots; return None for an invalid hammer or a failed simulation.

        `values` are the parameters, SI; `states` are the displacement [m] and velocity [m/s] at the joints
        between the segments of each shot, shape (j, 2). With `derivatives`, the chains contain the
        derivatives of the motion.
        """
        try:
            variants = self._variants(values, derivatives)
        except InputError:
            return None
        runs: list[_Run] = []
        where: dict[tuple[int, int, int], int] = {}
        for shot, plan in enumerate(self.plans):
            rows = [*plan.begins.tolist(), len(plan.grid) - 1]
            for stretch in range(len(plan.begins)):
                times = plan.grid[rows[stretch] : rows[stretch + 1] + 1]
                begin = None if stretch == 0 else states[shot][stretch - 1]
                for number, (hammer, rest, fired) in enumerate(variants):
                    if self._has_effect(number, shot, times[0]):
                        where[shot, stretch, number] = len(runs)
                        state = np.array([rest, 0.0]) if begin is None else begin
                        runs.append(_Run(hammer, fired[shot], state, times))
                if derivatives and begin is not None:
                    hammer, _rest, fired = variants[0]
                    for which, step in enumerate(np.diag(self.steps)):
                        where[shot, stretch, -1 - which] = len(runs)
                        runs.append(_Run(hammer, fired[shot], begin + step, times))
        try:
            ensemble = Ensemble(
                [run.hammer for run in runs],
                [run.drive for run in runs],
                [run.times[-1] for run in runs],
                states=[run.state for run in runs],
                starts=[run.times[0] for run in runs],
            )
        except InputError:
            return None
        # The ensemble is too small to be worth compiling a vectorised kernel.
        result = ensemble.run(strobes=[run.times for run in runs], engine="plain")
        if not result.ok.all() or result.strobes is None:
            return None
        table = np.stack([result.strobes.x, result.strobes.v], axis=2)
        count = self.parameters.count if derivatives else 0
        return [self._chain(shot, states[shot], table, where, count) for shot in range(len(self.shots))]

    def _has_effect(self, variant: int, shot: int, start: float) -> bool:
        """Whether the perturbation of a variant changes a segment of a shot.

        `variant` is the index in the list of `_variants`, and `start` is the time at which the segment
        begins, s.
        """
        number = variant - 1 - len(self.parameters.keys)
        return number < 0 or (self.parameters.owners[number] == shot and start <= self.lasting[shot])

    def _chain(
        self,
        shot: int,
        states: FloatArray,
        table: FloatArray,
        where: dict[tuple[int, int, int], int],
        count: int,
    ) -> Chain:
        plan = self.plans[shot]
        size, stretches = len(plan.grid), len(plan.begins)
        motion, by_state = np.zeros((size, 2)), np.zeros((size, 2, 2))
        by_parameter = np.zeros((size, 2, count))
        ends, ends_p, ends_s = (
            np.zeros((stretches, 2)),
            np.zeros((stretches, 2, count)),
            np.zeros((stretches, 2, 2)),
        )
        rows = [*plan.begins.tolist(), size - 1]
        for stretch in range(stretches):
            span = slice(rows[stretch], rows[stretch + 1] + 1)
            long = rows[stretch + 1] + 1 - rows[stretch]
            base = table[where[shot, stretch, 0], :long]
            motion[span] = base
            for number in range(count):
                run = where.get((shot, stretch, number + 1))
                by_parameter[span, :, number] = 0.0 if run is None else (table[run, :long] - base) / _STEP
            for which in range(2):
                run = where.get((shot, stretch, -1 - which))
                change = 0.0 if run is None else (table[run, :long] - base) / self.steps[which]
                by_state[span, :, which] = change
            # The joint itself belongs to the next segment.
            ends[stretch] = motion[span][-1]
            ends_p[stretch], ends_s[stretch] = by_parameter[span][-1], by_state[span][-1]
        return Chain(motion, ends[:-1] - states, by_parameter, by_state, ends_p[:-1], ends_s[:-1])

    def shown(self, shot: int, motion: FloatArray) -> FloatArray:
        """Apply the sensor model: return the readings at the samples of a shot.

        `motion` contains displacement and velocity on the time grid, or their derivatives, shape (g, 2, ...).
        The readings, or their derivatives, have the shape (n, ...). Before the firing the reading is the rest
        position.
        """
        plan = self.plans[shot]
        flat = motion.reshape(len(motion), 2, -1)
        out = lowpass_motion(plan.grid, flat[:, 0], flat[:, 1], plan.tau)
        rows = np.maximum(plan.samples, 0)
        return out[rows].reshape(len(rows), *motion.shape[2:])

    def opened(self, shot: int, chain: Chain) -> tuple[FloatArray, FloatArray]:
        """Compute the readings of a shot with independent segments, i.e. with gaps, and their derivatives.

        The readings have the shape (n,). The derivatives have the shape (n, p + 2 j): first the derivatives
        with respect to the p parameters, per unit of their scales, then with respect to displacement and
        velocity at the j joints, per unit of `units`.
        """
        plan = self.plans[shot]
        count = chain.by_parameter.shape[2]
        joints = len(plan.begins) - 1
        table = np.zeros((len(plan.grid), 2, 1 + count + 2 * joints))
        table[:, :, 0] = chain.motion
        table[:, :, 1 : 1 + count] = chain.by_parameter
        rows = [*plan.begins.tolist(), len(plan.grid)]
        for joint in range(joints):
            span = slice(rows[joint + 1], rows[joint + 2])
            first = 1 + count + 2 * joint
            table[span, :, first : first + 2] = chain.by_state[span] * self.units
        out = self.shown(shot, table)
        return out[:, 0], out[:, 1:]

    def condensed(self, shot: int, chain: Chain) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Eliminate the joint states by condensing; return the linear model of a shot with closed gaps.

        Returns
        -------
        tuple
            In this order: readings with closed gaps at unchanged parameters, shape (n,); their derivatives
            with respect to the parameters, shape (n, p); change of the joint states that closes the gaps at
            unchanged parameters, shape (j, 2); derivatives of this change with respect to the parameters,
            shape (j, 2, p). The derivatives are per unit of each parameter's scale.
        """
        plan = self.plans[shot]
        count = chain.by_parameter.shape[2]
        joints = len(plan.begins) - 1
        closing, states_p = np.zeros((joints, 2)), np.zeros((joints, 2, count))
        change, change_p = np.zeros(2), np.zeros((2, count))
        linear = np.concatenate([chain.motion[:, :, np.newaxis], chain.by_parameter], axis=2)
        rows = [*plan.begins.tolist(), len(plan.grid)]
        for joint in range(joints):
            matrix = chain.end_by_state[joint]
            change = chain.gaps[joint] + matrix @ change
            change_p = chain.end_by_parameter[joint] + matrix @ change_p
            closing[joint], states_p[joint] = change, change_p
            span = slice(rows[joint + 1], rows[joint + 2])
            linear[span] += chain.by_state[span] @ np.concatenate([change[:, np.newaxis], change_p], axis=1)
        out = self.shown(shot, linear)
        return out[:, 0], out[:, 1:], closing, states_p


def _drive(hammer: Hammer, pulse: Pulse | None, values: FloatArray) -> PulseTrain:
    if pulse is not None:
        return PulseTrain(pulse.changed(values.tolist()) if pulse.names else pulse.waveform)
    if hammer.waveform is None:
        raise InputError(f"{hammer.path}: the hammer has no waveform", file=hammer.path, key="waveform")
    return PulseTrain(hammer.waveform)


def _plan(shot: Shot) -> _Plan:
    tau = time_constant(shot.bandwidth)
    after = shot.t >= 0.0
    times = shot.t[after]
    if len(times) == 0 or times[0] > 0.0:
        times = np.concatenate([[0.0], times])
    if tau > 0.0:
        each = np.maximum(1, np.ceil(np.diff(times) / _FINEST)).astype(np.int64)
        parts = [a + (b - a) * np.arange(n) / n for a, b, n in zip(times, times[1:], each, strict=False)]
        times = np.concatenate([*parts, times[-1:]])
    samples = np.searchsorted(times, shot.t)
    samples[~after] = -1
    begins = np.concatenate([[0], samples[shot.joints]]).astype(np.int64)
    return _Plan(times, samples, begins, tau)
