"""What bursts of least work cost against the rate."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.control.least_work.burst import NoBurstError, least_work
from printhammer.errors import InputError
from printhammer.printing.dots.nominal import rate_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt
    import xarray as xr

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

FOUND = "ok"
NOT_FOUND = "no current found"


@dataclass(frozen=True)
class LeastWorkRates:
    """Bursts of least work at several rates: arrays of shape (n,), NaN where no current was found.

    Attributes
    ----------
    hammer : Hammer
        The hammer.
    rates : array
        Dots per second, Hz.
    count : int
        Number of dots of each burst.
    net_ratio, positive_ratio, bound_ratio : array
        As those of `LeastWork`.
    squared_current : array
        Integral of the squared current over the burst, A^2 s.
    adequate : int array
        Number of adequate dots.
    status : str array
        "ok", or "no current found", which is no proof that there is none.
    """

    hammer: Hammer
    rates: FloatArray
    count: int
    net_ratio: FloatArray = field(repr=False)
    positive_ratio: FloatArray = field(repr=False)
    bound_ratio: FloatArray = field(repr=False)
    squared_current: FloatArray = field(repr=False)
    adequate: npt.NDArray[np.int64] = field(repr=False)
    status: npt.NDArray[np.str_] = field(repr=False)

    def to_dataset(self) -> xr.Dataset:
        """Return the works as a Dataset over `rate` [Hz], with units and provenance in the attributes."""
        import xarray as xr

        from printhammer import __version__

        def entry(values: Any, unit: str, meaning: str) -> Any:
            return "rate", values, {"units": unit, "long_name": meaning}

        data = {
            "net_ratio": entry(self.net_ratio, "1", "net work of the coil over what the pack absorbs"),
            "positive_ratio": entry(self.positive_ratio, "1", "positive work over what the pack absorbs"),
            "bound_ratio": entry(self.bound_ratio, "1", "least positive work of any current, likewise"),
            "squared_current": entry(self.squared_current, "A^2 s", "integral of the squared current"),
            "adequate": entry(self.adequate, "1", "number of adequate dots"),
            "status": entry(self.status, "1", "whether a current was found"),
        }
        attributes = {
            "title": f"bursts of least work of {self.hammer.name}",
            "hammer": self.hammer.name,
            "hammer_fingerprint": self.hammer.fingerprint,
            "dots": self.count,
            "printhammer": __version__,
            "numpy": np.__version__,
        }
        rate = {"rate": entry(self.rates, "Hz", "dots per second")}
        return xr.Dataset(data, coords=rate, attrs=attributes)

    def plot(self, **options: Any) -> Any:
        """Draw the works against the rate; returns a matplotlib figure."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.control.energy_rates").plot(self, **options)


def least_work_rates(
    hammer: Hammer,
    rates: Sequence[float | str],
    *,
    dots: int = 3,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> LeastWorkRates:
    """Find bursts of least work at several rates.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    rates : sequence of float or str
        Dots per second, Hz, or text with a unit.
    dots : int, optional
        Number of dots of each burst.
    progress : callable, optional
        Called with the number of rates done and of all.
    **options
        As for `least_work`.

    Returns
    -------
    LeastWorkRates
        With a status for each rate; a rate at which no current was found is no exception.

    Raises
    ------
    InputError
        No rates, or as for `least_work`.
    """
    if isinstance(rates, str) or not len(rates):
        raise InputError(f"rates = {rates!r}, expected at least one rate in a sequence")
    asked = np.array([rate_of(rate) for rate in rates])
    rows: list[tuple[float, float, float, float, int, str]] = []
    for number, rate in enumerate(asked.tolist()):
        try:
            found = least_work(hammer, rate, dots=dots, **options)
        except NoBurstError:
            rows.append((np.nan, np.nan, np.nan, np.nan, 0, NOT_FOUND))
        else:
            ratios = found.net_ratio, found.positive_ratio, found.bound_ratio
            rows.append((*ratios, found.work.squared_current, found.adequate, FOUND))
        if progress is not None:
            progress(number + 1, asked.size)
    net, positive, least, squared, adequate, status = zip(*rows, strict=True)
    return LeastWorkRates(
        hammer=hammer,
        rates=asked,
        count=int(dots),
        net_ratio=np.array(net),
        positive_ratio=np.array(positive),
        bound_ratio=np.array(least),
        squared_current=np.array(squared),
        adequate=np.array(adequate, dtype=np.int64),
        status=np.array(status, dtype="U16"),
    )
