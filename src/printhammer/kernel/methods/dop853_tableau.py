"""Coefficients of the explicit Runge-Kutta method DOP853, order 8 with embedded orders 5 and 3.

Source: E. Hairer, S. P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993),
section II.10; the method is due to Dormand and Prince. Stages are numbered from 1: ``C07`` is the node of
stage 7, and ``A07`` the row of weights of the earlier slopes. Zero weights are omitted: rows 2 to 5 hold the
weights of slopes (1), (1, 2), (1, 3) and (1, 3, 4), later rows the weights of slopes 1, 4, 5 and so on. ``B``
holds the weights of the solution, ``E3`` and ``E5`` the weights of the two error estimates, for slopes 1 and
6 to 12.
"""

import numpy as np

_LONGEST = 9


def _row(*weights: float) -> tuple[float, ...]:
    """Return a row of weights padded with zeros, so that row sums are compiled for one length only."""
    return weights + (0.0,) * (_LONGEST - len(weights))


C02 = 0.05260015195876773
C03 = 0.0789002279381516
C04 = 0.1183503419072274
C05 = 0.2816496580927726
C06 = 0.3333333333333333
C07 = 0.25
C08 = 0.3076923076923077
C09 = 0.6512820512820513
C10 = 0.6
C11 = 0.8571428571428571
A02 = _row(0.05260015195876773)
A03 = _row(0.0197250569845379, 0.0591751709536137)
A04 = _row(0.02958758547680685, 0.08876275643042054)
A05 = _row(0.2413651341592667, -0.8845494793282861, 0.924834003261792)
A06 = _row(0.037037037037037035, 0.17082860872947386, 0.12546768756682242)
A07 = _row(0.037109375, 0.17025221101954405, 0.06021653898045596, -0.017578125)
A08 = _row(
    0.03709200011850479,
    0.17038392571223998,
    0.10726203044637328,
    -0.015319437748624402,
    0.008273789163814023,
)
A09 = _row(
    0.6241109587160757,
    -3.3608926294469414,
    -0.868219346841726,
    27.59209969944671,
    20.154067550477894,
    -43.48988418106996,
)
A10 = _row(
    0.47766253643826434,
    -2.4881146199716677,
    -0.590290826836843,
    21.230051448181193,
    15.279233632882423,
    -33.28821096898486,
    -0.020331201708508627,
)
A11 = _row(
    -0.9371424300859873,
    5.186372428844064,
    1.0914373489967295,
    -8.149787010746927,
    -18.52006565999696,
    22.739487099350505,
    2.4936055526796523,
    -3.0467644718982196,
)
A12 = _row(
    2.273310147516538,
    -10.53449546673725,
    -2.0008720582248625,
    -17.9589318631188,
    27.94888452941996,
    -2.8589982771350235,
    -8.87285693353063,
    12.360567175794303,
    0.6433927460157636,
)
B = _row(
    0.054293734116568765,
    4.450312892752409,
    1.8915178993145003,
    -5.801203960010585,
    0.3111643669578199,
    -0.1521609496625161,
    0.20136540080403034,
    0.04471061572777259,
)
E3 = _row(
    -0.18980075407240762,
    4.450312892752409,
    1.8915178993145003,
    -5.801203960010585,
    -0.4226823213237919,
    -0.1521609496625161,
    0.20136540080403034,
    0.02265179219836082,
)
E5 = _row(
    0.01312004499419488,
    -1.2251564463762044,
    -0.4957589496572502,
    1.6643771824549864,
    -0.35032884874997366,
    0.3341791187130175,
    0.08192320648511571,
    -0.022355307863886294,
)

STAGES = 12
FULL_A, FULL_B = np.zeros((STAGES, STAGES)), np.zeros(STAGES)
"""Complete weight matrix A and vector B, including zero weights, for loops over stages."""
for _i, _weights in enumerate((A02, A03, A04, A05, A06, A07, A08, A09, A10, A11, A12), start=1):
    _slopes = {1: (0,), 2: (0, 1), 3: (0, 2), 4: (0, 2, 3)}.get(_i, (0, *range(3, _i)))
    FULL_A[_i, _slopes] = _weights[: len(_slopes)]
FULL_B[[0, *range(5, STAGES)]] = B[: STAGES - 4]
