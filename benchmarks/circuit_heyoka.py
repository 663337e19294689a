"""One pulse of a rail-driven hammer with heyoka: Taylor series, heyoka's events, one system for all modes.

    x = c0 + c1 q + c2 q^2,    dq/ds = k v,    dt/ds = k dx/dq

with q = x in free flight and q = sqrt(b - x) in the backstop, where the power 1.5 is not analytic in x; the
current is the third state. Lengths are in units of 0.1 mm, times in units of 0.1 ms.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from tests.circuits import Phase

    from printhammer.hammer.hammer import Hammer

_LENGTH, _TIME = 1e-4, 1e-4
_LONGEST: Final = 5.0
_MODAL: Final = ("c0", "c1", "c2", "k", "contact", "place")
_DRIVE: Final = ("u", "resistance", "closed", "decaying", "edge")
_PLACE: Final = {name: i for i, name in enumerate((*_MODAL, *_DRIVE))}


class Pulse:
    """One pulse of a hammer without a pack, from rest in its backstop."""

    def __init__(self, hy: Any, hammer: Hammer, phases: list[Phase], start: float, tolerance: float) -> None:
        c = {key: constant.si for key, constant in hammer.constants.items()}
        self.place, self.start = c["backstop.position"] / _LENGTH, start / _LENGTH
        self.phases, self.resistance = phases, c["coil.resistance"]
        p = {name: hy.par[i] for name, i in _PLACE.items()}
        q, v, t, i = hy.make_vars("q", "v", "t", "i")
        x = p["c0"] + p["c1"] * q + p["c2"] * q * q
        pace = p["k"] * (p["c1"] + 2.0 * p["c2"] * q)
        root = (_LENGTH * x) ** 0.5
        flux = c["magnet.Am"] - c["magnet.Bm"] * i
        stiffness = c["spring.Bs"] / c["spring.As"]
        force = c["magnet.F0"] + c["spring.Bs"] - flux * flux / root
        force -= stiffness * (_LENGTH * x - c["backstop.position"])
        # In the backstop, the depth to the power 1.5 is q cubed.
        depth = p["contact"] * _LENGTH**1.5 * q * q * q
        force += depth * (c["backstop.stiffness"] - c["backstop.damping"] * _LENGTH / _TIME * v)
        emf = 2.0 * c["magnet.Bm"] * flux / root
        inductance = c["coil.inductance"] - 4.0 * c["magnet.Bm"] ** 2 * root
        rate = (p["u"] - p["resistance"] * i - emf * (_LENGTH / _TIME) * v) / inductance
        rates = [
            (q, p["k"] * v),
            (v, pace * (_TIME**2 / _LENGTH / c["mass"]) * force),
            (t, pace),
            (i, pace * _TIME * p["closed"] * rate),
        ]
        # The guard function of an inactive event is constant.
        gaps = [q - p["place"], p["edge"] - t, 1.0 - p["decaying"] + p["decaying"] * i]
        switches = [
            hy.t_event(gap, callback=_Switch(self, k), direction=hy.event_direction.negative)
            for k, gap in enumerate(gaps)
        ]
        self.integrator = hy.taylor_adaptive(
            rates, [0.0] * 4, pars=[0.0] * len(_PLACE), t_events=switches, tol=tolerance
        )
        self.state, self.parameters = self.integrator.state, self.integrator.pars

    def run(self, end: float) -> tuple[float, float, float]:
        """Integrate to `end` [s]; return displacement [m], velocity [m/s] and current [A]."""
        self.end, self.phase = end / _TIME, 0
        self.integrator.time = 0.0
        self._contact(inside=True)
        self.state[:] = math.sqrt(self.place - self.start), 0.0, 0.0, 0.0
        self._enter()
        self.integrator.reset_cooldowns()
        self.integrator.propagate_until(1e9, max_delta_t=_LONGEST)
        q, v, _t, i = self.state
        c0, c1, c2 = self.parameters[:3]
        return float(c0 + c1 * q + c2 * q * q) * _LENGTH, float(v) * _LENGTH / _TIME, float(i)

    def switch(self, which: int) -> bool:
        """Process an event (contact, end of phase, end of current); return whether the run continues."""
        if which == 0:
            self.inside = not self.inside
            self.state[0] = 0.0 if self.inside else self.place
            self._contact(inside=self.inside)
        elif which == 1:
            if self.phase + 1 == len(self.phases):
                return False
            self.phase += 1
            self._enter()
        else:
            self.state[3] = 0.0
            self._set(closed=0.0, decaying=0.0)
        return True

    def _enter(self) -> None:
        phase = self.phases[self.phase]
        later = [p.start / _TIME for p in self.phases[self.phase + 1 :]]
        edge = min([*later, self.end])
        # Set the time exactly, since the event is located only up to rounding.
        self.state[2] = phase.start / _TIME
        self._set(
            u=-phase.voltage if phase.decay else phase.voltage,
            resistance=self.resistance + phase.series,
            closed=1.0,
            decaying=float(phase.decay),
            edge=edge * (1.0 - 1e-15),
        )

    def _contact(self, *, inside: bool) -> None:
        self.inside = inside
        if inside:
            self._set(c0=self.place, c1=0.0, c2=-1.0, k=-1.0, contact=1.0, place=0.0)
        else:
            self._set(c0=0.0, c1=1.0, c2=0.0, k=1.0, contact=0.0, place=self.place)

    def _set(self, **values: float) -> None:
        for name, value in values.items():
            self.parameters[_PLACE[name]] = value


class _Switch:
    """Event callback; heyoka copies callbacks, but all copies must refer to the same run."""

    def __init__(self, owner: Pulse, which: int) -> None:
        self.owner, self.which = owner, which

    def __deepcopy__(self, memo: Any) -> _Switch:
        return self

    def __call__(self, _integrator: Any, _sign: int) -> bool:
        return self.owner.switch(self.which)
