"""Context of the claims: a hammer and the runs that several claims share, each simulated once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any, Final, TypeVar

from printhammer.drive.trains import Drive, PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import PrinthammerError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.settling import touches
from printhammer.run.contacts import Contact, Dot
from printhammer.run.ensemble import DotTable, EnsembleResult
from printhammer.run.motion import Motion
from printhammer.run.problem import TOLERANCE
from printhammer.run.simulate import Scheme, simulate

CYCLE: Final = 20e-3
"""Duration of the single-pulse cycle, s: from rest until long after the armature has settled; arbitrary."""

TAIL: Final = 4e-3
"""Time simulated after the last firing of a train, s, so that its dot is included; arbitrary."""

_IDLE: Final = 1e-3  # Firing time of the pulse that ends the simulated rest, s; arbitrary

_T = TypeVar("_T")


class NotMeasurableError(PrinthammerError):
    """Raised if a claim concerns a component that the hammer lacks, or an event that does not occur."""


class Context:
    """Hammer with the simulated motions that the claims need, each computed once.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    tolerance : float
        Tolerance of the default integrator.
    scheme : str
        Integrator of the runs, as for `printhammer.simulate`.
    """

    def __init__(self, hammer: Hammer, tolerance: float = TOLERANCE, scheme: Scheme = "default") -> None:
        self.hammer = hammer
        self.tolerance = tolerance
        self.scheme: Scheme = scheme
        self._motions: dict[tuple[Any, ...], Motion] = {}
        self._kept: dict[str, Any] = {}

    def need(self, name: str) -> Any:
        """Return a component or constant of the hammer by name.

        Raises
        ------
        NotMeasurableError
            The hammer lacks the component or constant.
        """
        part = getattr(self.hammer, name)
        if part is None:
            raise NotMeasurableError(f"The hammer has no {name}")
        return part

    @property
    def waveform(self) -> Waveform:
        """Standard waveform of the hammer."""
        own: Waveform = self.need("waveform")
        return own

    @property
    def position(self) -> float:
        """Position of the backstop, m."""
        self.need("backstop")
        return self.hammer.origin

    @property
    def front(self) -> float:
        """Displacement of the front of the pack, m."""
        return float(self.need("pack").front)

    def once(self, name: str, search: Callable[[], _T]) -> _T:
        """Return the result of `search`, which is called only once for each `name` and then cached."""
        if name not in self._kept:
            self._kept[name] = search()
        kept: _T = self._kept[name]
        return kept

    def attempt(
        self,
        drive: Drive,
        duration: float,
        *,
        hammer: Hammer | None = None,
        state: tuple[float, float] | None = None,
        **options: Any,
    ) -> Motion:
        """Simulate the hammer of the context, or `hammer`, for `duration` [s]; cache the motion.

        `state` is the initial displacement [m] and velocity [m/s]; by default the hammer starts from rest.
        `options` are passed to `printhammer.simulate`. A run that ends early raises no exception.
        """
        which = self.hammer if hammer is None else hammer
        options = {"tolerance": self.tolerance, "scheme": self.scheme, **options}
        key = (which.fingerprint, drive.fingerprint, duration, state, *sorted(options.items()))
        if key not in self._motions:
            # Only two grid points: values are computed on demand.
            self._motions[key] = simulate(which, drive, duration=duration, state=state, points=2, **options)
        return self._motions[key]

    def run(self, drive: Drive, duration: float, **options: Any) -> Motion:
        """Simulate the hammer of the context under a drive for `duration` [s]; cache the motion.

        Raises
        ------
        NotMeasurableError
            The run ended early.
        """
        motion = self.attempt(drive, duration, **options)
        if not motion.ok:
            raise NotMeasurableError(f"A run under {drive!r} did not end: {motion.message}")
        return motion

    def ensemble(self, drives: Sequence[Drive], ends: Any, **options: Any) -> EnsembleResult:
        """Simulate the hammer of the context under each drive, from rest until its end time in `ends` [s].

        `options` are passed to `Ensemble.run`.

        Raises
        ------
        NotMeasurableError
            A run ended early.
        """
        from printhammer.run.ensemble import Ensemble

        result = Ensemble(self.hammer, list(drives), ends, tolerance=self.tolerance).run(**options)
        for drive, status in zip(drives, result.status_names, strict=True):
            if status != "ok":
                raise NotMeasurableError(f"A run under {drive!r} did not end: {status}")
        return result

    def dots(self, drives: Sequence[Drive], tail: float = TAIL) -> DotTable:
        """Simulate the hammer under each drive until `tail` [s] after its last firing; return all dots."""
        result = self.ensemble(drives, [float(drive.times[-1]) + tail for drive in drives], dots=True)
        assert result.dots is not None
        return result.dots

    def pulses(self, times: Iterable[float], duration: float) -> Motion:
        """Simulate a run from rest for `duration` [s], with a pulse fired at each of the `times` [s]."""
        return self.run(PulseTrain(self.waveform, at=list(times)), duration)

    def train(self, rate: float, pulses: int, tail: float = TAIL) -> Motion:
        """Simulate a pulse train at a rate [Hz] from rest, until `tail` [s] after its last firing."""
        drive = PulseTrain(self.waveform, rate=rate, pulses=pulses)
        return self.run(drive, float(drive.times[-1]) + tail)

    def strobe_train(self, period: float, points: int) -> Motion:
        """Simulate a pulse train of a given period [s], from rest to the firing of the last strobe point."""
        drive = PulseTrain(self.waveform, period=period, pulses=points)
        return self.run(drive, float(drive.times[-1]))

    @cached_property
    def single(self) -> Motion:
        """Motion of the single-pulse cycle: one pulse, from rest until the armature has settled."""
        return self.pulses([0.0], CYCLE)

    @cached_property
    def returns(self) -> list[Contact]:
        """Backstop contacts after a single pulse, in order of time."""
        contacts = touches(self.single)
        if not contacts:
            raise NotMeasurableError("The armature does not return to the backstop after a single pulse")
        return contacts

    @cached_property
    def idle(self) -> Motion:
        """Motion of the hammer at rest, before any firing."""
        return self.pulses([_IDLE], 0.5 * _IDLE)

    @property
    def rest(self) -> float:
        """Displacement at rest, m."""
        return float(self.idle.at(0.0)[0][0])

    @cached_property
    def peak(self) -> float:
        """Largest displacement after a single pulse, m."""
        highest = self.single.peak_after(0)
        if highest is None:
            raise NotMeasurableError("The armature has no largest displacement after a single pulse")
        return highest[1]

    @property
    def stroke(self) -> float:
        """Single-pulse stroke: peak displacement minus backstop position, m."""
        stroke = self.peak - self.position
        if stroke <= 0.0:
            raise NotMeasurableError("The armature stays in the backstop after a single pulse")
        return stroke

    @property
    def dot(self) -> Dot:
        """Dot printed by the single pulse."""
        dot = self.single.dots[0]
        if not dot.struck:
            raise NotMeasurableError("The armature does not reach the pack after a single pulse")
        return dot

    @property
    def print_force(self) -> float:
        """Peak force of the single-pulse dot, N."""
        force = self.dot.peak_force
        if not force:
            raise NotMeasurableError("The single-pulse dot has no peak force")
        return force
