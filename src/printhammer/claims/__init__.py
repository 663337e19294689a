"""The claims of the paper, checked: every statement of Hendriks (1983) that can be measured.

`claims.toml` puts each into numbers; one module for each family measures them; `judge_all` compares.
"""

from printhammer.claims import bursts, integrators, statics, strobes, verdicts
from printhammer.claims import pulses as pulses
from printhammer.claims.context import Context, NotMeasurableError
from printhammer.claims.definition import KINDS, Claim, claims
from printhammer.claims.judging import JUDGES, PENDING, JudgedClaim, Measured, judge, judge_all
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
