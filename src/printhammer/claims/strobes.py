"""Claims about the state at the instant of firing, Fig. 11."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from printhammer.claims.context import Context
from printhammer.claims.judging import WHOLE, Claim, Measured, claims, measures, rank_correlation
from printhammer.claims.verdicts import panel_name, printed_verdicts
from printhammer.support.arrays import FloatArray

_ORBIT_TIME: Final = 4e-3
"""Duration of the single-pulse orbit, s: from the first return until the armature has settled; arbitrary."""
_ORBIT_POINTS: Final = 200_001  # Points of the orbit, dense compared with the distances measured; arbitrary
_LATTICE: Final = 101  # Points along each axis of the window; arbitrary


def window() -> tuple[FloatArray, FloatArray]:
    """Return the centre and the half-widths of the window of Fig. 11: each (displacement, velocity), SI."""
    settings = claims()["poincare_window"].settings
    low, high = np.array([settings["window_x_m"], settings["window_v_m_per_s"]]).T
    return 0.5 * (low + high), 0.5 * (high - low)


def strobe_points(context: Context, period: float, points: int) -> FloatArray:
    """Compute displacement [m] and velocity [m/s] at the first firings of a train from rest.

    `period` is the time between firings, s; the result has the shape (points, 2).
    """
    _, x, v = context.strobe_train(period, points).strobe
    return np.column_stack([x, v])


def scaled(points: FloatArray) -> FloatArray:
    """Divide displacements [m] and velocities [m/s] by the half-widths of the window of Fig. 11."""
    _, half = window()
    return points / half


def panels(context: Context, *, strange: bool = True) -> dict[str, FloatArray]:
    """Compute the strobe points of the panels of Fig. 11, by panel name; by default strange trains only."""
    count = claims()["poincare_window"].settings["points"]
    return {
        panel_name(period): strobe_points(context, period, count)
        for period, verdict in printed_verdicts().items()
        if verdict == "strange" or not strange
    }


@measures("poincare_window", *WHOLE)
def poincare_window(context: Context, claim: Claim) -> Measured:
    """Measure the fraction of each panel's strobe points inside the window; list the points outside."""
    centre, half = window()
    shares: dict[str, float] = {}
    outside: dict[str, Any] = {}
    for name, points in panels(context, strange=False).items():
        beyond = (np.abs(points - centre) > half).any(axis=1)
        shares[name] = 1.0 - float(beyond.mean())
        if beyond.any():
            outside[name] = points[beyond].tolist()
    value = {
        "least_share_inside": min(shares.values()),
        "shares_inside": shares,
        "outside_m_and_m_per_s": outside,
    }
    least = claim.band["least_share_inside"]["at_least"]
    low = [f"{name} ({share:.1%})" for name, share in shares.items() if share < least]
    remark = f"below {least:.0%} at {', '.join(low)}" if low else f"no panel is below {least:.0%}"
    return Measured(
        value, f"Inside the window: {np.mean(list(shares.values())):.1%} of all points; {remark}."
    )


@measures("behind_the_backstop", *WHOLE)
def behind_the_backstop(context: Context, _claim: Claim) -> Measured:
    """Measure how far behind the backstop the deepest strobe point of all strange trains lies, m."""
    depths = {name: context.position - float(points[:, 0].min()) for name, points in panels(context).items()}
    deepest = max(depths, key=lambda name: depths[name])
    value = {"depth_m": depths[deepest], "depths_m": depths}
    return Measured(
        value, f"The deepest point lies {depths[deepest] * 1e6:.2f} um behind the backstop, at {deepest}."
    )


@measures("low_rate_fixed_point", *WHOLE)
def low_rate_fixed_point(context: Context, claim: Claim) -> Measured:
    """Measure the scatter of the last strobe points of slow trains, which should reach a fixed point."""
    settings = claim.settings
    last = settings["last_points"]
    apart = {}
    for period in settings["strobe_times_s"]:
        points = scaled(strobe_points(context, period, settings["firings"]))[-last:]
        apart[f"{period * 1e3:g} ms"] = float(np.linalg.norm(points - points[-1], axis=1).max())
    worst = max(apart, key=lambda name: apart[name])
    value = {"largest_scaled_distance": apart[worst], "scaled_distances": apart}
    return Measured(
        value,
        f"The last {last} of {settings['firings']} points differ most at {worst}, by {apart[worst]:.1e} of"
        " the window.",
    )


@measures("cloud_grows", *WHOLE)
def cloud_grows(context: Context, _claim: Claim) -> Measured:
    """Measure, per panel, the 95th percentile of the distance of strobe points from the rest state."""
    rest = scaled(np.array([context.rest, 0.0]))
    radii = {
        name: float(np.percentile(np.linalg.norm(scaled(points) - rest, axis=1), 95.0))
        for name, points in panels(context).items()
    }
    # The panels are in order of increasing rate.
    correlation = rank_correlation(range(len(radii)), list(radii.values()))
    value = {"rank_correlation": correlation, "scaled_radii": radii}
    first, *_, last = radii.items()
    return Measured(
        value,
        f"The radius grows from {first[1]:.2f} of the window at {first[0]} to {last[1]:.2f} at {last[0]}.",
    )


@measures("successive_points_apart", *WHOLE)
def successive_points_apart(context: Context, claim: Claim) -> Measured:
    """Measure the median distance of successive strobe points, relative to the median of all pairs."""
    ratios: dict[str, float | None] = {}
    for name, states in panels(context).items():
        points = scaled(states)
        steps = np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))
        apart = np.linalg.norm(points[:, np.newaxis] - points, axis=2)
        pairs = np.median(apart[np.triu_indices(len(points), 1)])
        ratios[name] = float(steps / pairs) if pairs > 0.0 else None
    count = sum(ratio is not None and ratio >= claim.settings["least_ratio"] for ratio in ratios.values())
    value = {"panels_apart": count, "ratios": ratios}
    return Measured(value, f"Successive points are apart in {count} of {len(ratios)} panels.")


@measures("points_on_single_pulse_orbit", *WHOLE)
def points_on_single_pulse_orbit(context: Context, claim: Claim) -> Measured:
    """Measure the median distance of strobe points from the path of the single-pulse motion in state space.

    The distance is divided by the median distance of all states in the window of Fig. 11 from the path.
    """
    from scipy.spatial import cKDTree

    motion, start = context.single, context.returns[0].t_in
    times = np.linspace(start, min(start + _ORBIT_TIME, motion.end), _ORBIT_POINTS)
    tree = cKDTree(scaled(np.column_stack(motion.at(times))))
    centre, half = window()
    axis = np.linspace(-1.0, 1.0, _LATTICE)
    lattice = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2) + centre / half
    anywhere = float(np.median(tree.query(lattice)[0]))
    ratios = {
        name: float(np.median(tree.query(scaled(points))[0])) / anywhere
        for name, points in panels(context).items()
    }
    count = sum(ratio <= claim.settings["largest_ratio"] for ratio in ratios.values())
    value = {"panels_on_orbit": count, "ratios": ratios, "scaled_distance_anywhere": anywhere}
    return Measured(value, f"The points lie on the orbit in {count} of {len(ratios)} panels.")
