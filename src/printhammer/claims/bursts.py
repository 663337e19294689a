"""Claims about bursts of nine pulses at increasing rates, and about the frequency-time map (Figs. 8, 9)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from printhammer.claims.context import Context, NotMeasurableError
from printhammer.claims.judging import WHOLE, Claim, Measured, claims, measures, spread
from printhammer.claims.verdicts import panel_name, printed_verdicts
from printhammer.drive.trains import Drive, PulseTrain
from printhammer.maps.frequency import TAIL
from printhammer.run.motion import Motion
from printhammer.support.arrays import BoolArray, FloatArray

# Number of rates simulated in one batch; the search stops at the first batch with a lost dot; arbitrary
_TOGETHER: Final = 64
_SAMPLES: Final = 2001  # Samples of a drive for a lower bound of its peak; arbitrary


def spreads(motion: Motion) -> tuple[int, float | None, float | None]:
    """Return the number of printed dots of a motion, and the spreads of their peak forces and flight times.

    A spread is the largest value minus the smallest: of the peak forces as a fraction of their mean, of the
    flight times in s. Both spreads are None if fewer than two dots are printed.
    """
    forces = [dot.peak_force for dot in motion.dots if dot.peak_force is not None]
    flights = [dot.flight_time for dot in motion.dots if dot.flight_time is not None]
    if len(forces) < 2:
        return len(forces), None, None
    return len(forces), spread(forces) / float(np.mean(forces)), spread(flights)


@measures("independent_at_low_rate", "pack", "waveform")
def independent_at_low_rate(context: Context, claim: Claim) -> Measured:
    """Measure the spreads of peak force and flight time over the dots of a burst at a low rate."""
    rate, pulses = claim.settings["rate_Hz"], claim.settings["pulses"]
    struck, force, flight = spreads(context.train(rate, pulses))
    value = {"dots_struck": struck, "force_spread": force, "flight_time_spread_s": flight}
    if force is None or flight is None:
        return Measured(value, f"{struck} of {pulses} dots are struck.")
    return Measured(
        value,
        f"{struck} of {pulses} dots; forces agree within {force:.2%}, flight times within"
        f" {flight * 1e6:.2f} us.",
    )


def rates_of(settings: Mapping[str, Any]) -> list[float]:
    """Return the firing rates [Hz] at which a claim is tested, ascending, from the claim's settings."""
    first, last, step = (settings[name] for name in ("first_rate_Hz", "last_rate_Hz", "rate_step_Hz"))
    return [float(first + step * k) for k in range(round((last - first) / step) + 1)]


def onsets(context: Context) -> dict[str, float]:
    """Find the lowest firing rate [Hz] at which flight times vary, forces vary, and a dot is lost.

    Flight times or forces vary if their spread over the dots of a burst exceeds the limit in the claim's
    settings.

    The keys of the result are "flight_time", "force" and "lost"; the key of an event that does not occur up
    to the first lost dot is absent.
    """
    settings = claims()["order_of_onset"].settings
    rates, pulses = rates_of(settings), settings["pulses"]
    first: dict[str, float] = {}
    for start in range(0, len(rates), _TOGETHER):
        some = rates[start : start + _TOGETHER]
        dots = context.dots([PulseTrain(context.waveform, rate=rate, pulses=pulses) for rate in some])
        for k, rate in enumerate(some):
            forces, flights = (
                column[k][dots.struck[k]].tolist() for column in (dots.peak_force, dots.flight_time)
            )
            if len(forces) > 1 and spread(flights) > settings["flight_time_spread_s"]:
                first.setdefault("flight_time", rate)
            if len(forces) > 1 and spread(forces) / float(np.mean(forces)) > settings["force_spread"]:
                first.setdefault("force", rate)
            if len(forces) < pulses:
                first["lost"] = rate
                return first
    return first


@measures("order_of_onset", *WHOLE)
def order_of_onset(context: Context, _claim: Claim) -> Measured:
    """Measure the lowest firing rate at which flight times vary, forces vary, and a dot is lost."""
    first = context.once("onsets", lambda: onsets(context))
    lost = first.get("lost")
    value: dict[str, Any] = {"first_lost_dot_at_Hz": lost}
    for name in ("flight_time", "force"):
        onset = first.get(name)
        value[f"{name}_varies_from_Hz"] = onset
        both = onset is not None and lost is not None
        value[f"rate_below_first_lost_dot_{name}_Hz"] = lost - onset if both and lost and onset else None
    texts = {name: f"at {rate:.0f} Hz" for name, rate in first.items()}
    return Measured(
        value,
        f"Flight times first vary {texts.get('flight_time', 'at no rate before')}, forces"
        f" {texts.get('force', 'at no rate before')}; the first dot is lost"
        f" {texts.get('lost', 'at no rate tried')}.",
    )


@measures("second_dot_lost", *WHOLE)
def second_dot_lost(context: Context, claim: Claim) -> Measured:
    """Measure the lowest range of firing rates in which the second pulse prints no dot.

    The second pulse prints no dot if the largest displacement after its firing does not reach the pack.
    """
    settings = claim.settings
    waveform, front, _ = context.waveform, context.front, context.dot
    begins = ends = None
    for rate in rates_of(settings):
        # The interval of the second firing ends at the time of a third firing.
        motion = context.run(PulseTrain(waveform, rate=rate, pulses=2), 2.0 / rate)
        peak = motion.peak_after(1)
        below = peak is None or peak[1] < front
        if below and begins is None:
            begins = rate
        if begins is not None:
            if not below:
                break
            ends = rate
    wanted = settings["quenched_rate_Hz"]
    value = {
        "begins_at_rate_Hz": begins,
        "contains_quenched_rate": bool(begins is not None and ends is not None and begins <= wanted <= ends),
        "ends_at_rate_Hz": ends,
    }
    if begins is None:
        return Measured(value, f"The second dot is never lost up to {settings['last_rate_Hz']:.0f} Hz.")
    return Measured(value, f"The second dot is first lost from {begins:.0f} to {ends:.0f} Hz.")


def hung_up(motion: Motion) -> bool:
    """Whether the armature stays off the backstop from its first pack contact to the last firing."""
    left = _first_leaving(motion)
    if left is None:
        return False
    # Every touch and release ends a step, so that the step times miss no contact.
    times = motion.step_times
    between = (times > left) & (times < motion.drive.times[-1])
    return not (motion.at(times)[0][between] <= motion.hammer.origin).any()


def _first_leaving(motion: Motion) -> float | None:
    """Return the time at which the armature first leaves the pack, s; None without a pack contact."""
    times = motion.step_times
    inside = motion.at(times)[0] > (motion.hammer.front or 0.0)
    if not inside.any():
        return None
    first = int(np.argmax(inside))
    outside = ~inside[first:]
    return float(times[first + int(np.argmax(outside))]) if outside.any() else motion.end


def _exceeds(drive: Drive, limit: float) -> bool:
    """Whether the peak absolute value of a drive, a current [A] or force [N], exceeds `limit`."""
    # Samples give a lower bound of the peak, whose exact value is slow to compute.
    samples = np.abs(drive.value(np.linspace(0.0, drive.end, _SAMPLES)))
    return bool(samples.max() > limit) or drive.peak > limit


def hang_up_range(context: Context) -> tuple[float | None, list[Motion], float]:
    """Find the range of firing rates in which the armature hangs up (stays off the backstop).

    Returns, in this order: the lowest rate of the range [Hz]; the motions at all rates of the range, fastest
    first; and the highest rate tested [Hz], which is the last rate of the claim's settings or the highest
    rate that the current limit permits. The lowest rate is None if the armature does not hang up at the
    highest rate.
    """
    settings = claims()["hang_up_at_high_rate"].settings
    step, pulses, limit = (settings[name] for name in ("rate_step_Hz", "pulses", "current_limit_A"))
    waveform = context.waveform
    rate, lowest, motions = settings["last_rate_Hz"], None, []
    if waveform.quantity == "current":
        while rate > 0.0 and _exceeds(PulseTrain(waveform, rate=rate, pulses=pulses), limit):
            rate -= step
    highest = rate
    while rate > 0.0:
        motion = context.train(rate, pulses, tail=1e-3)
        if not hung_up(motion):
            break
        lowest = rate
        motions.append(motion)
        rate -= step
    return lowest, motions, highest


@measures("hang_up_at_high_rate", *WHOLE)
def hang_up_at_high_rate(context: Context, _claim: Claim) -> Measured:
    """Measure the firing rate above which the armature hangs up in every burst, up to the current limit."""
    lowest, _, highest = context.once("hang-up", lambda: hang_up_range(context))
    value = {"hang_up_rate_Hz": lowest, "highest_rate_Hz": highest}
    if lowest is None:
        return Measured(value, f"At {highest:.0f} Hz the armature still touches the backstop.")
    return Measured(value, f"From {lowest:.0f} to {highest:.0f} Hz the armature stays off the backstop.")


@measures("weak_prints_when_hung_up", *WHOLE)
def weak_prints_when_hung_up(context: Context, _claim: Claim) -> Measured:
    """Measure the largest peak force on the pack after the first dot, in bursts that end in hang-up.

    The claim concerns distinct impacts (see `later_impacts`); the largest force of all impacts is reported
    too.
    """
    lowest, motions, highest = context.once("hang-up", lambda: hang_up_range(context))
    if lowest is None:
        raise NotMeasurableError("The armature does not hang up")
    impacts = [
        (force, 1.0 / (motion.drive.period or math.inf), distinct)
        for motion in motions
        for force, distinct in later_impacts(motion)
    ]
    force, rate, _ = max((impact for impact in impacts if impact[2]), default=(0.0, 0.0, True))
    other, other_rate, _ = max(impacts, default=(0.0, 0.0, True))
    value = {
        "largest_force_over_single": force / context.print_force,
        "largest_force_N": force,
        "at_rate_Hz": rate,
        "largest_of_all_over_single": other / context.print_force,
        "largest_of_all_at_rate_Hz": other_rate,
    }
    return Measured(
        value,
        f"From {lowest:.0f} to {highest:.0f} Hz the strongest distinct impact after the first dot reaches"
        f" {force:.1f} N, at {rate:.0f} Hz; the strongest of all impacts reaches {other:.1f} N, at"
        f" {other_rate:.0f} Hz.",
    )


def later_impacts(motion: Motion) -> list[tuple[float, bool]]:
    """Return the peak force [N] of each pack contact after the first, and whether the contact is distinct.

    An impact is distinct if at most one pulse was fired since the preceding contact: several pulses that
    together lift the armature cause a single impact.
    """
    contacts = [contact for contact in motion.contacts if contact.surface == "pack"]
    return [
        (after.peak_force or 0.0, (after.firing or 0) - (before.firing or 0) <= 1)
        for before, after in itertools.pairwise(contacts)
    ]


@measures("flight_time_spread", *WHOLE)
def flight_time_spread(context: Context, claim: Claim) -> Measured:
    """Measure the spread of flight times in a burst, at the strobe time of each strange train of Fig. 11."""
    settings, pulses = claim.settings, claim.settings["pulses"]
    _, _, slow = spreads(context.train(settings["rate_Hz"], pulses))
    by_panel: dict[str, Any] = {}
    for period, verdict in printed_verdicts().items():
        if verdict == "strange":
            drive = PulseTrain(context.waveform, period=period, pulses=pulses)
            by_panel[panel_name(period)] = spreads(context.run(drive, float(drive.times[-1]) + 4e-3))[2]
    known = [flight for flight in by_panel.values() if flight is not None]
    least = min(known) - slow if slow is not None and len(known) == len(by_panel) else None
    over = {name: sum(flight > settings[name] for flight in known) for name in ("dot_matrix_s", "engraved_s")}
    value = {
        "least_spread_minus_low_rate_s": least,
        "low_rate_spread_s": slow,
        "spreads_s": by_panel,
        "bursts_over_200_us": over["dot_matrix_s"],
        "bursts_over_30_us": over["engraved_s"],
    }
    return Measured(
        value,
        f"{over['dot_matrix_s']} of {len(by_panel)} bursts have a spread above 200 us, the tolerance of"
        f" dot-matrix printing, and {over['engraved_s']} a spread above 30 us.",
    )


_SPACING: Final = 10e-6
"""Sampling interval of a displacement record in the sensitivity test, s; arbitrary."""


def sensitivity(context: Context, band: tuple[float, float], grid: float, step: float, pulses: int) -> float:
    """Compute the RMS change of the displacement record per hertz of firing rate, m/Hz, in a band of rates.

    `band` contains the lowest and highest rate [Hz]; `grid` is the spacing of the rates in the band [Hz]. At
    each rate, a burst of `pulses` firings is compared with a burst at a rate higher by `step` [Hz], from the
    first firing until `TAIL` after the last firing at the lower rate.

    Raises
    ------
    NotMeasurableError
        The band is narrower than `step`, or a run ended early.
    """
    low, high = band
    slower = low + grid * np.arange(math.floor((high - step - low) / grid * (1.0 + 1e-12)) + 1)
    if not len(slower):
        raise NotMeasurableError(f"From {low:.6g} to {high:.6g} Hz there are no two rates to compare")
    ends = np.repeat((pulses - 1) / slower + TAIL, 2)
    times = np.arange(0.0, ends[0], _SPACING)
    drives = [
        PulseTrain(context.waveform, rate=rate, pulses=pulses)
        for rate in np.stack([slower, slower + step], axis=1).ravel().tolist()
    ]
    result = context.ensemble(drives, ends, times=times)
    assert result.x is not None
    change = (result.x[1::2].astype(np.float64) - result.x[::2]) / step
    # Displacements beyond the end of a record are NaN.
    return float(np.sqrt(np.nanmean(change**2)))


@measures("map_sensitivity", *WHOLE)
def map_sensitivity(context: Context, claim: Claim) -> Measured:
    """Measure the change of the displacement record per hertz of firing rate, in three bands of rates.

    The bands are: low rates; erratic rates, from the first variation of flight times to hang-up; and rates
    above hang-up.
    """
    settings = claim.settings
    first = context.once("onsets", lambda: onsets(context)).get("flight_time")
    hung, _, highest = context.once("hang-up", lambda: hang_up_range(context))
    bands: dict[str, tuple[float | None, float | None]] = {
        "low": (settings["first_rate_Hz"], settings["low_rate_Hz"]),
        "erratic": (first, hung),
        "hung_up": (hung, highest),
    }
    known = {name: (low, high) for name, (low, high) in bands.items() if low is not None and high is not None}
    grid, pulses = settings["rate_grid_Hz"], settings["pulses"]
    changes, coarse = (
        {name: sensitivity(context, band, grid, step, pulses) for name, band in known.items()}
        for step in (settings["rate_step_Hz"], settings["coarse_step_Hz"])
    )
    value: dict[str, Any] = {
        "erratic_over_low": _ratio(changes, "low"),
        "erratic_over_hung_up": _ratio(changes, "hung_up"),
        "low_m_per_Hz": changes.get("low"),
        "erratic_m_per_Hz": changes.get("erratic"),
        "hung_up_m_per_Hz": changes.get("hung_up"),
        "erratic_over_low_coarse": _ratio(coarse, "low"),
        "erratic_over_hung_up_coarse": _ratio(coarse, "hung_up"),
        "erratic_from_Hz": first,
        "hang_up_rate_Hz": hung,
    }
    if first is None or hung is None:
        missing = "Flight times do not vary" if first is None else "The armature does not hang up"
        return Measured(value, f"{missing} at any rate simulated: the erratic band has no end.")
    texts = {name: f"{change * 1e6:.3g} um" for name, change in changes.items()}
    fine, whole = settings["rate_step_Hz"], settings["coarse_step_Hz"]
    return Measured(
        value,
        f"Per hertz, taken over {fine:g} Hz, the record changes by {texts['low']} from"
        f" {bands['low'][0]:.0f} to"
        f" {bands['low'][1]:.0f} Hz, {texts['erratic']} from {first:.0f} to {hung:.0f} Hz, and"
        f" {texts['hung_up']} from there to {highest:.0f} Hz; taken over {whole:g} Hz, the ratios are"
        f" {value['erratic_over_low_coarse']:.2g} and {value['erratic_over_hung_up_coarse']:.2g}.",
    )


def erratic_pairs(
    struck: BoolArray, flight_time: FloatArray, settings: Mapping[str, Any]
) -> tuple[BoolArray, BoolArray]:
    """Return masks of the pairs of neighbouring rates with different dots, and the rates with unequal dots.

    The tables `struck` (whether a dot is printed) and `flight_time` [s] have one row per firing rate and one
    column per dot. The first mask has one entry per pair of neighbouring rates: true if a dot is printed at
    only one of the two rates, or if its two flight times differ by more than `flight_time_change_s`; dots
    before number `first_dot` are ignored. The second mask has one entry per rate: true if a dot is lost, or
    if the flight times of two dots differ by more than `flight_time_spread_s`. The limits are in `settings`.
    """
    flights = np.where(struck, flight_time, np.nan)
    change = np.abs(np.diff(flights, axis=0)) > settings["flight_time_change_s"]
    late = (change | (struck[1:] != struck[:-1]))[:, settings["first_dot"] - 1 :]
    spreads = np.fmax.reduce(flights, axis=1) - np.fmin.reduce(flights, axis=1)
    return late.any(axis=1), ~struck.all(axis=1) | (spreads > settings["flight_time_spread_s"])


def erratic_share(
    rates: FloatArray, erratic: BoolArray, varies: BoolArray, hang_up: float | None
) -> tuple[float | None, float | None]:
    """Compute the fraction of erratic pairs of rates, from the first rate with unequal dots up to hang-up.

    Return the fraction and the first rate with unequal dots [Hz]. Both are None without such a rate; the
    fraction is None if no pair lies between this rate and the hang-up rate `hang_up` [Hz]. `erratic` and
    `varies` are the two masks of `erratic_pairs`.
    """
    if not varies.any():
        return None, None
    first = float(rates[int(np.argmax(varies))])
    inside = (rates[:-1] >= first) & (rates[1:] <= (math.inf if hang_up is None else hang_up))
    return (float(erratic[inside].mean()) if inside.any() else None), first


@measures("chaotic_region", *WHOLE)
def chaotic_region(context: Context, claim: Claim) -> Measured:
    """Measure the fraction of neighbouring firing rates, below hang-up, whose bursts differ in a late dot."""
    rates = rates_of(claim.settings)
    pulses = claim.settings["pulses"]
    dots = context.dots([PulseTrain(context.waveform, rate=rate, pulses=pulses) for rate in rates])
    erratic, varies = erratic_pairs(dots.struck, dots.flight_time, claim.settings)
    hung, _, _ = context.once("hang-up", lambda: hang_up_range(context))
    share, first = erratic_share(np.array(rates), erratic, varies, hung)
    value = {
        "erratic_share": share,
        "erratic_share_of_all": float(erratic.mean()),
        "varies_from_Hz": first,
        "hang_up_rate_Hz": hung,
    }
    if share is None:
        return Measured(value, f"Up to {rates[-1]:.0f} Hz no dot varies before hang-up.")
    return Measured(
        value,
        f"Dots vary from {first:.0f} Hz on; from there up to {min(rates[-1], hung or math.inf):.0f} Hz a late"
        f" dot changes at once between {share:.0%} of neighbouring rates.",
    )


def _ratio(changes: dict[str, float], name: str) -> float | None:
    return changes["erratic"] / changes[name] if "erratic" in changes and changes.get(name) else None
