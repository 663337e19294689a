"""The claims of the paper, checked: every statement of Hendriks (1983) that can be measured.

`claims.toml` puts each into numbers; one module for each family measures them; `judge_all` compares.
"""

from printhammer.claims import (
    bursts,
    buzz,
    elastomer,
    frequency_map,
    integrators,
    single_pulse,
    statics,
    strobes,
    two_pulses,
    verdicts,
)
from printhammer.claims.buzz import buzz_search
from printhammer.claims.context import Context, NotMeasurableError
from printhammer.claims.definition import KINDS, Claim, claims
from printhammer.claims.judging import JUDGES, PENDING, JudgedClaim, Measured, judge, judge_all

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
    "buzz",
    "buzz_search",
    "claims",
    "elastomer",
    "frequency_map",
    "integrators",
    "judge",
    "judge_all",
    "single_pulse",
    "statics",
    "strobes",
    "two_pulses",
    "verdicts",
]
