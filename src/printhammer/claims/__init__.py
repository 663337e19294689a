"""Claims of the paper: the measurable statements of Hendriks (1983), each tested for a hammer.

`claims.toml` states the claims as numbers; one module per family measures the values; `judge_all` compares
the measured values with the claims.
"""

from printhammer.claims import bursts, integrators, statics, strobes, verdicts
from printhammer.claims import pulses as pulses
from printhammer.claims.context import Context, NotMeasurableError
from printhammer.claims.judging import (
    JUDGES,
    KINDS,
    PENDING,
    Claim,
    JudgedClaim,
    Measured,
    claims,
    judge,
    judge_all,
)
from printhammer.claims.pulses import buzz_search

__all__ = [
    "JUDGES",
    "KINDS",
    "PENDING",
    "Claim",
    "Context",
    "JudgedClaim",
    "Measured",
    "NotMeasurableError",
    "bursts",
    "buzz_search",
    "claims",
    "integrators",
    "judge",
    "judge_all",
    "pulses",
    "statics",
    "strobes",
    "verdicts",
]
