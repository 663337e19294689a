"""Coefficients of the Runge-Kutta-Nystrom pair 8(6) in nine stages, first same as last.

The pair integrates x'' = f(t, x), where f does not depend on the velocity. Source: J. R. Dormand, M. E. A.
El-Mikkawy, P. J. Prince, "High-order embedded Runge-Kutta-Nystrom formulae", IMA J. Numer. Anal. 7 (1987)
423-430, pair RKN8(6)9FM. Stages are numbered from 1. ``A`` holds the stage weights, ``BX`` and ``BV`` the
weights of position and velocity at the end, ``EX`` and ``EV`` the differences from the embedded method of
order 6. The ninth stage is also the first stage of the next step.
"""

C2 = 1 / 20
C3 = 1 / 10
C4 = 3 / 10
C5 = 1 / 2
C6 = 7 / 10
C7 = 9 / 10
A21 = 1 / 800
A31 = 1 / 600
A32 = 1 / 300
A41 = 9 / 200
A42 = -9 / 100
A43 = 9 / 100
A51 = -66701 / 197352
A52 = 28325 / 32892
A53 = -2665 / 5482
A54 = 2170 / 24669
A61 = 227015747 / 304251000
A62 = -54897451 / 30425100
A63 = 12942349 / 10141700
A64 = -9499 / 304251
A65 = 539 / 9250
A71 = -1131891597 / 901789000
A72 = 41964921 / 12882700
A73 = -6663147 / 3220675
A74 = 270954 / 644135
A75 = -108 / 5875
A76 = 114 / 1645
A81 = 13836959 / 3667458
A82 = -17731450 / 1833729
A83 = 1063919505 / 156478208
A84 = -33213845 / 39119552
A85 = 13335 / 28544
A86 = -705 / 14272
A87 = 1645 / 57088
BX1 = 223 / 7938
BX3 = 1175 / 8064
BX4 = 925 / 6048
BX5 = 41 / 448
BX6 = 925 / 14112
BX7 = 1175 / 72576
BV1 = 223 / 7938
BV3 = 5875 / 36288
BV4 = 4625 / 21168
BV5 = 41 / 224
BV6 = 4625 / 21168
BV7 = 5875 / 36288
BV8 = 223 / 7938
EX1 = -544307 / 12215700
EX3 = 544307 / 4963840
EX4 = -544307 / 3722880
EX5 = 1632921 / 12409600
EX6 = -544307 / 8686720
EX7 = 544307 / 44674560
EV1 = -544307 / 12215700
EV3 = 544307 / 4467456
EV4 = -544307 / 2606016
EV5 = 1632921 / 6204800
EV6 = -544307 / 2606016
EV7 = 544307 / 4467456
EV8 = 322012 / 3053925
EV9 = -3 / 20
