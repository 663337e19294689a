"""Forced oscillator with Coulomb friction in closed form: J. P. Den Hartog, Trans. ASME 53 (1931) 107."""

import math

import numpy as np
from scipy.optimize import minimize_scalar


class DenHartog:
    """Symmetric motion without stops of x'' + x + f sgn(x') = a cos(β t + φ), from x = x0, v = 0 at t = 0.

    Half a cycle, v < 0, is x = f (1 - cos t - βU sin t) + aV cos(β t + φ), V = 1/(1 - β²), U = tan(π/2β)/β.
    x(0) = -x(π/β) = x0 and x'(0) = 0 give aV cos φ = x0 and aV sin φ = -f U, so x0² = (aV)² - (f U)².
    v < 0 in between needs x0 > f S/β², S the maximum of β (sin t + βU (cos β t - cos t))/sin β t; its limit
    at t = 0 is 1, where the other forces at the turn are f. (Den Hartog, Trans. ASME 53 (1931) 107.)
    """

    def __init__(self, beta: float, f: float) -> None:
        self.beta, self.f = beta, f
        self.big_u, self.big_v = math.tan(0.5 * math.pi / beta) / beta, 1.0 / (1.0 - beta**2)
        half = math.pi / beta
        grid = np.linspace(0.0, half, 4002)[1:-1]
        top = float(grid[np.argmax(self.ratio(grid))])
        near = (max(top - half / 4000.0, 1e-9), min(top + half / 4000.0, half - 1e-9))
        self.best = minimize_scalar(
            lambda t: -float(self.ratio(t)), bounds=near, method="bounded", options={"xatol": 1e-12}
        )
        self.big_s = max(1.0, -float(self.best.fun))
        self.boundary = f * math.hypot(self.big_s / beta**2, self.big_u) / abs(self.big_v)

    def ratio(self, t: np.ndarray) -> np.ndarray:
        b = self.beta
        ratio: np.ndarray = b * (np.sin(t) + b * self.big_u * (np.cos(b * t) - np.cos(t))) / np.sin(b * t)
        return ratio

    def motion(self, a: float) -> tuple[float, float]:
        """Amplitude x0 and phase φ."""
        x0 = math.sqrt((a * self.big_v) ** 2 - (self.f * self.big_u) ** 2)
        return x0, math.atan2(-self.f * self.big_u / (a * self.big_v), x0 / (a * self.big_v))
