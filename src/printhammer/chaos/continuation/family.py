"""Strobe map of a regime as a map with a parameter, for pseudo-arclength continuation.

Besides the image of a state and its derivatives, the map returns the contacts on the way from the state to
its image; the sequence of contacts is the label of the motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, Literal

import numpy as np

from printhammer.chaos.continuation.fixed_points import MapValue
from printhammer.chaos.strobe.map import IN_PACK, image_of, is_usable, margin_of
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Declared, column, part, scalar
from printhammer.run.contacts import contact_rows, contacts_of
from printhammer.run.energy import increments_of
from printhammer.run.problem import Problem, Record
from printhammer.run.regime import Regime
from printhammer.run.start import initial_state
from printhammer.support.arrays import FloatArray

_SPACING: Final = 1e-6  # Arbitrary
"""Relative step of the finite-difference derivative in the parameter, which only steers Newton's method."""
_MUCH: Final = 1e3
"""Multiplier above which the parameter step of the finite difference is reduced in proportion; arbitrary."""
_IN_PACK: Final = f"{IN_PACK} at the section; another phase of the period can be chosen"
_MOST_TOUCHES: Final = 100  # Number of contacts in a period above which the map has no value; arbitrary
_MANY: Final = f"more than {_MOST_TOUCHES} contacts"

Surface = Literal["pack", "backstop"]


def cyclic(surfaces: Iterable[str]) -> str:
    """Encode a sequence of touched surfaces as text, with P for the pack and B for the backstop.

    Of all cyclic rotations of the text, the alphabetically first is returned.
    """
    word = "".join("P" if surface == "pack" else "B" for surface in surfaces)
    if len(word) > _MOST_TOUCHES:
        return _MANY
    return min((word[i:] + word[:i] for i in range(len(word))), default="")


class Touch(Declared):
    """Contact that begins within one period of an orbit.

    Times are measured from the last firing at or before the section at which the period begins.
    """

    surface: Surface = part('"pack" or "backstop"')
    t_in: float = scalar("s", "time of touch")
    t_out: float = scalar(
        "s", "time of departure", more="may be in the next period; infinite if the contact does not end"
    )
    v_in: float = scalar("m/s", "velocity at touch")


class Passage(Declared):
    """Contacts of a motion between two sections, with the drive period and the number of firings."""

    touches: tuple[Touch, ...] = part("touches in order of time")
    period: float = scalar("s", "time between firings")
    firings: int = part("number of firings between the two sections")

    def of(self, surface: Surface) -> list[Touch]:
        """Return the touches of one surface, in order of time."""
        return [touch for touch in self.touches if touch.surface == surface]

    @property
    def sequence(self) -> str:
        """Sequence of contacts as text, P (pack) or B (backstop), rotated to the alphabetically first form.

        The text does not change if a touch passes through the section along a branch, since the start of an
        orbit is arbitrary.
        """
        return cyclic(touch.surface for touch in self.touches)

    @property
    def dots(self) -> list[tuple[float, float] | None]:
        """Flight time [s] and impact speed [m/s] of the dot of each firing; None for a lost dot."""
        dots: list[tuple[float, float] | None] = [None] * self.firings
        for touch in self.of("pack"):
            fired = math.floor(touch.t_in / self.period)
            flight = touch.t_in - fired * self.period
            known = dots[fired % self.firings]
            if known is None or flight < known[0]:
                dots[fired % self.firings] = (flight, touch.v_in)
        return dots


class Course(Declared):
    """States, peak pack forces [N] and energies [J] of a periodic orbit over one period of the orbit."""

    states: FloatArray = part("displacement [m] and velocity [m/s] at the sections, shape (firings, 2)")
    peak_forces: FloatArray = column(
        "N", "largest pack force of the contacts of each firing", "firing", more="NaN without a contact"
    )
    coil_work: float = part("work of the coil")
    drive_work: float = part("work of a force drive")
    pack_loss: float = part("loss in the pack")
    backstop_loss: float = part("loss in the backstop")
    damping_loss: float = part("loss in the damping of the armature")


class RegimeFamily:
    """Strobe map of a regime, iterated `firings` times, as a function of state and parameter `name`."""

    def __init__(self, regime: Regime, name: str, firings: int, tolerance: float) -> None:
        self.regime, self.name, self.firings, self.tolerance = regime, name, firings, tolerance

    def __call__(self, state: FloatArray, parameter: float) -> MapValue:
        """Evaluate the iterated strobe map and its derivatives at a state (m, m/s) and a parameter [SI]."""
        try:
            regime = self.regime.with_(self.name, parameter)
            problem, end = self._problem(regime, state)
        except InputError as error:
            return MapValue.none(2, str(error))
        hammer = regime.hammer
        if not is_usable(hammer, float(state[0]), float(state[1])):
            return MapValue.none(2, _IN_PACK)
        record = problem.run(end)
        if record.status_name != "ok":
            return MapValue.none(2, record.status_name)
        period = (end - problem.start) / self.firings
        touches = _touches(hammer, record, problem.start - self.regime.phase * period, end - problem.start)
        passage = Passage(touches, period, self.firings)
        reached = image_of(regime, state, self.firings, self.tolerance, contacts=False)
        if not reached.ok:
            return MapValue.none(2, _IN_PACK if reached.status == IN_PACK else reached.status)
        image, jacobian = reached.state, reached.jacobian
        slope = None
        if np.isfinite(jacobian).all():
            growth = float(np.abs(np.linalg.eigvals(jacobian)).max())
            slope = self._slope(state, parameter, image, growth)
        if slope is None:
            return MapValue.none(2, "runs with a slightly different parameter ended early")
        return MapValue(image, jacobian, slope, passage.sequence, extra=passage)

    def margin(self, state: FloatArray, parameter: float) -> float:
        """Compute the signed distance of the motion from a grazing, the margin of the image of a state.

        See `printhammer.chaos.strobe.map.Image`.
        """
        problem, end = self._problem(self.regime.with_(self.name, parameter), state)
        return margin_of(problem, problem.run(end))

    def _slope(
        self, state: FloatArray, parameter: float, image: FloatArray, growth: float
    ) -> FloatArray | None:
        # A large multiplier implies a large curvature.
        step = _SPACING * min(1.0, _MUCH / max(growth, 1.0)) * (abs(parameter) or 1.0)
        beside = [self.end_of(state, parameter + sign * step) for sign in (-1.0, 1.0)]
        if beside[0] is not None and beside[1] is not None:
            return np.asarray((beside[1] - beside[0]) / (2.0 * step))
        if beside[1] is not None:
            return np.asarray((beside[1] - image) / step)
        return None if beside[0] is None else np.asarray((image - beside[0]) / step)

    def end_of(self, state: FloatArray, parameter: float) -> FloatArray | None:
        """Compute the image of a state (m, m/s) at a parameter value, without derivatives.

        None if the run ends early or the state or the parameter value is invalid.
        """
        try:
            problem, end = self._problem(self.regime.with_(self.name, parameter), state)
        except InputError:
            return None
        record = problem.run(end)
        return None if record.status_name != "ok" else np.asarray(record.nodes[-1, 1:3])

    def _problem(self, regime: Regime, state: FloatArray) -> tuple[Problem, float]:
        train, _ = regime.train(self.firings)
        moments = regime.moments(train, self.firings)
        start = initial_state(regime.hammer, (float(state[0]), float(state[1])))
        problem = Problem(regime.hammer, train, start, float(moments[0]), self.tolerance)
        return problem, float(moments[-1])

    def course(self, state: FloatArray, parameter: float) -> Course:
        """Compute states, pack forces and energies of a periodic orbit from its state at the section."""
        regime = self.regime.with_(self.name, parameter)
        problem, end = self._problem(regime, state)
        record = problem.run(end)
        increments = increments_of(problem, record)
        forces = np.full(self.firings, np.nan)
        zero = problem.start - regime.phase * regime.period
        for contact in contacts_of(contact_rows(problem, record, increments, has_rigid_backstop(regime))):
            if contact.surface == "pack" and not contact.initial and contact.peak_force is not None:
                fired = math.floor((contact.t_in - zero) / regime.period) % self.firings
                forces[fired] = np.fmax(forces[fired], contact.peak_force)
        sections = np.array([problem.start + regime.period * k for k in range(self.firings)])
        states = problem.resample(record, sections)[:, :2].copy()
        return Course(states, forces, *(float(total) for total in increments.sum(axis=0)[:5]))


def has_rigid_backstop(regime: Regime) -> bool:
    """Whether the velocity jumps at the backstop, so that the strobe map has a kink at a grazing."""
    return regime.hammer.backstop is not None and regime.hammer.backstop.law == "rigid"


def _touches(hammer: Hammer, record: Record, zero: float, length: float) -> tuple[Touch, ...]:
    """List the touches of an orbit from a run of `length` seconds, one period of the orbit.

    Times are measured from the time `zero` of the run. A contact that is open at the end of the run ends in
    the next period, when the contact open at its start ends.
    """
    position, front = hammer.position, hammer.front
    touches = []
    open_at_start = {int(row[0]): float(row[3]) for row in record.contacts if row[6]}
    for row in record.contacts:
        if row[6]:
            continue
        leave = float(row[3])
        if math.isnan(leave):
            leave = open_at_start.get(int(row[0]), math.inf) + length
        x = float(record.nodes[int(row[5]), 1])
        pack = front is not None and (position is None or abs(x - front) < abs(x - position))
        end = math.inf if math.isnan(leave) else leave - zero
        touches.append(Touch("pack" if pack else "backstop", float(row[1]) - zero, end, float(row[2])))
    return tuple(touches)
