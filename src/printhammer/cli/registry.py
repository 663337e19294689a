"""All verbs of the command line, in the order of the help."""

from __future__ import annotations

from typing import Final

from printhammer.cli.runner import Verb
from printhammer.cli.verbs import fit, hammer
from printhammer.cli.verbs.bifurcation import basins, bifurcation
from printhammer.cli.verbs.coil import dead_time, duty, impact_time
from printhammer.cli.verbs.continuation import continue_, curve
from printhammer.cli.verbs.drives import energy, feedback
from printhammer.cli.verbs.hammer import from_datasheet
from printhammer.cli.verbs.map import map_
from printhammer.cli.verbs.measure import measure
from printhammer.cli.verbs.paper import figure, paper
from printhammer.cli.verbs.quality import print_, quality
from printhammer.cli.verbs.run import run
from printhammer.cli.verbs.strobe import lyapunov, orbits, strobe
from printhammer.cli.verbs.studio import studio, warm
from printhammer.cli.verbs.sweep import sweep
from printhammer.cli.verbs.tune import learn, tune

VERBS: Final[tuple[Verb, ...]] = (
    *(run, figure, paper, map_, strobe, orbits, bifurcation, basins, continue_, curve, lyapunov),
    *(print_, energy, feedback, quality, tune, learn, dead_time, impact_time, duty),
    *(studio, sweep, measure, warm),
    *(hammer.show, hammer.check, hammer.schema, hammer.list_shipped, from_datasheet),
    *(fit.magnet, fit.solenoid, fit.spring, fit.pack, fit.backstop, fit.motion, fit.coil),
)

GROUPS: Final = {"hammer": (hammer.GROUP, None), "fit": (fit.GROUP, fit.EXAMPLE)}
"""Help text and example of each group of two-word verbs, by the first word of the verb."""
