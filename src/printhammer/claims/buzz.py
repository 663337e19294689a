"""Claims about buzz printing, Fig. 7."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.claims.context import TAIL, Context
from printhammer.claims.definition import Claim, claims
from printhammer.claims.judging import WHOLE, Measured, measures
from printhammer.drive.trains import PulseTrain
from printhammer.printing.dots.buzz import (
    BuzzSearch,
    BuzzTrain,
    delayed_train,
    find_buzz_train,
    longest_run,
)
from printhammer.printing.dots.settling import touches

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


def _wanted() -> tuple[int, tuple[float, float]]:
    """Return the number of dots, and the limits of their relative force, that make buzz printing."""
    band = claims()["buzz_printing"].band
    limits = (band["least_force_over_single"]["at_least"], band["largest_force_over_single"]["at_most"])
    return band["dots"]["at_least"], limits


def buzz_search(context: Context) -> BuzzSearch:
    """Return the search for a train that buzz-prints."""
    fewest, forces = _wanted()
    return context.once("buzz", lambda: find_buzz_train(context.hammer, fewest=fewest, forces=forces))


def _described(train: BuzzTrain) -> str:
    how = "one every" if train.kind == "uniform" else "each after the leaving of the pack by"
    return f"{len(train.times)} pulses, {how} {train.interval * 1e6:.1f} us"


@measures("buzz_printing", *WHOLE)
def buzz_printing(context: Context, claim: Claim) -> Measured:
    """Dots of the best train without a touch of the backstop, and their forces."""
    search = buzz_search(context)
    train = search.best
    if train is None or not train.count:
        nothing = {**dict.fromkeys(claim.band), "dots": 0, "trains_tried": search.tried}
        return Measured(nothing, f"No train does: {search.reason}.")
    motion = context.run(PulseTrain(context.waveform, at=train.times), train.times[-1] + TAIL)
    dots = motion.dots[train.first : train.first + train.count]
    returns = [contact.t_in for contact in touches(motion)]
    struck = [dot.fired_at + dot.flight_time for dot in dots if dot.flight_time is not None]
    forces = [dot.peak_force / context.print_force for dot in dots if dot.peak_force is not None]
    value: dict[str, Any] = {
        "dots": len(struck),
        "backstop_touches_before": sum(t < struck[0] for t in returns),
        "backstop_touches_between": sum(struck[0] <= t <= struck[-1] for t in returns),
        "backstop_touches_after": train.touches[2],
        "least_force_over_single": min(forces),
        "largest_force_over_single": max(forces),
        "first_dot": train.first + 1,
        "interval_s": train.interval,
        "train": train.kind,
        "clear_from_the_first_firing": train.clear,
        "trains_tried": search.tried,
    }
    if search.train is None:
        return Measured(
            value, f"The best of {search.tried} trains tried, {_described(train)}, is not enough."
        )
    return Measured(
        value,
        f"{_described(train)}: {len(struck)} dots of {min(forces):.2f} to {max(forces):.2f} of the single"
        f" force. {train.touches_text}.",
    )


@measures("buzz_is_delicate", *WHOLE)
def buzz_is_delicate(context: Context, claim: Claim) -> Measured:
    """How many of four small changes break the train found."""
    train = buzz_search(context).train
    if train is None:
        return Measured({"cases_broken": None}, "There is no train to be broken.")
    change, shift = claim.settings["interval_change"], claim.settings["pack_front_shift_m"]
    fewest, _ = _wanted()
    counts = {
        f"interval {sign * change:+.0%}": _count(
            context, context.hammer, train, train.interval * (1.0 + sign * change)
        )
        for sign in (-1, 1)
    } | {
        f"pack front {sign * shift * 1e6:+.0f} um": _count(
            context, context.hammer.replace("pack.front", context.front + sign * shift), train, train.interval
        )
        for sign in (-1, 1)
    }
    broken = [name for name, count in counts.items() if count < fewest]
    value = {"cases_broken": len(broken), "dots_left": counts}
    left = ", ".join(f"{count} with {name}" for name, count in counts.items())
    return Measured(value, f"Dots left of {train.count}: {left}.")


def _count(context: Context, hammer: Hammer, train: BuzzTrain, interval: float) -> int:
    """Return the dots of a train of that kind, interval and number of pulses that count."""
    times = tuple(k * interval for k in range(len(train.times)))
    if train.kind != "uniform":
        times = delayed_train(hammer, interval, len(train.times))
    single = context.run(PulseTrain(context.waveform), TAIL, hammer=hammer)
    force = single.dots[0].peak_force
    if not force:
        return 0
    motion = context.attempt(PulseTrain(context.waveform, at=times), times[-1] + TAIL, hammer=hammer)
    return len(longest_run(motion, force, _wanted()[1]).forces)
