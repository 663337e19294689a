"""The verbs of the command line, in the order of the help."""

from __future__ import annotations

from typing import Final

from printhammer.cli.runner import Verb
from printhammer.cli.verbs.chaos.basins import basins
from printhammer.cli.verbs.chaos.bifurcation import bifurcation
from printhammer.cli.verbs.chaos.continuation import continue_
from printhammer.cli.verbs.chaos.curve import curve
from printhammer.cli.verbs.chaos.lyapunov import lyapunov
from printhammer.cli.verbs.chaos.orbits import orbits
from printhammer.cli.verbs.chaos.strobe import strobe
from printhammer.cli.verbs.laboratory import fit, hammer
from printhammer.cli.verbs.laboratory.datasheet import from_datasheet
from printhammer.cli.verbs.laboratory.measure import measure
from printhammer.cli.verbs.printing.dead_time import dead_time
from printhammer.cli.verbs.printing.duty import duty
from printhammer.cli.verbs.printing.energy import energy
from printhammer.cli.verbs.printing.feedback import feedback
from printhammer.cli.verbs.printing.impact_time import impact_time
from printhammer.cli.verbs.printing.learn import learn
from printhammer.cli.verbs.printing.print_ import print_
from printhammer.cli.verbs.printing.quality import quality
from printhammer.cli.verbs.printing.tune import tune
from printhammer.cli.verbs.runs.figure import figure
from printhammer.cli.verbs.runs.map import map_
from printhammer.cli.verbs.runs.paper import paper
from printhammer.cli.verbs.runs.run import run
from printhammer.cli.verbs.runs.studio import studio
from printhammer.cli.verbs.runs.sweep import sweep
from printhammer.cli.verbs.runs.warm import warm

VERBS: Final[tuple[Verb, ...]] = (
    *(run, figure, paper, map_, strobe, orbits, bifurcation, basins, continue_, curve, lyapunov),
    *(print_, energy, feedback, quality, tune, learn, dead_time, impact_time, duty),
    *(studio, sweep, measure, warm),
    *(hammer.show, hammer.check, hammer.schema, hammer.list_shipped, from_datasheet),
    *(fit.magnet, fit.solenoid, fit.spring, fit.pack, fit.backstop, fit.motion, fit.coil),
)

GROUPS: Final = {
    "hammer": (hammer.GROUP, None),
    "fit": (fit.GROUP, fit.EXAMPLE),
}
"""What the verbs of two words have in common, by their first word: help, and an example."""
