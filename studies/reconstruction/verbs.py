"""The verbs of the study: search for the hammer of the paper, judge candidates, ship the best."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, announce_compiling, verb
from printhammer.cli.screen import Column, table
from printhammer.errors import InputError

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

HELP: Final = "Search for hammers that reproduce the paper, judge the candidates, and tabulate the results."
EXAMPLE: Final = "python -m studies.reconstruction search all.jsonl --minutes 1"
_SEARCHED: Final = "python -m studies.reconstruction search all.jsonl --from family --minutes 0.1 &&"
_TWO: Final = f"{_SEARCHED} python -m studies.reconstruction judge all.jsonl judged.jsonl --best 2"
_JUDGED_TOO: Final = f"{_TWO} &&"
"""Commands that write the logs used in the examples."""

_WORKERS: Final = opt.bounded(1, "Number of processes.", default=2, metavar="N")
_SEED: Final = opt.bounded(0, "Seed of the random number generator.", default=1)
_LOG: Final = opt.argument("LOG", "Log of a search.", default=..., type=Path, is_input=True)
_JUDGED: Final = opt.argument("JUDGED", "Log of judged candidates.", default=..., type=Path, is_input=True)


def _written(what: str, metavar: str = "FILE", *, continued: bool = False) -> opt.Files:
    return opt.Files(
        what, metavar, default=..., type=Path, argument=True, pictures=False, continued=continued
    )


def _json(table: dict[str, Any]) -> str:
    return json.dumps(table, indent=1, allow_nan=False) + "\n"


@verb(
    "search",
    EXAMPLE,
    log=_written("Log of the search (JSON Lines); an existing log is continued.", "LOG", continued=True),
)
def search(
    job: Job,
    aim: str = opt.choice(
        "stated|all|panels|buzz|claims",
        "Claims that guide the search: stated claims; also shapes; also with emphasis on panels of Fig. 11"
        " or on buzz printing; or also the appearance of Figs. 8, 9 and 11.",
        default="all",
    ),
    waveform: str = opt.choice(
        "rectangle|trapezoid|half-sine", "Shape of the current waveform.", default="rectangle"
    ),
    seed: int = _SEED,
    sample: int = opt.bounded(1, "Number of points of the initial Sobol sample.", default=16384),
    start_from: str = opt.text(
        "LOG",
        "Log of another search, or the word family, whose best hammers are additional starting points.",
        default="",
        flag="--from",
    ),
    minutes: float = opt.bounded(0, "Search time in minutes; 0: until interrupted.", default=60.0),
    workers: int = _WORKERS,
) -> Answer:
    """Search for hammers that satisfy the claims, and log each candidate; Ctrl-C loses nothing."""
    from time import monotonic

    from studies.reconstruction.search.evaluation import AIMS, WEIGHTS
    from studies.reconstruction.search.search import Plan, known_starts, starts_of
    from studies.reconstruction.search.search import search as candidates
    from studies.reconstruction.search.space import SHAPES
    from studies.reconstruction.workers import worker_pool

    (log,) = job.outputs
    leading, shape = AIMS[AIMS.index(aim)], SHAPES[SHAPES.index(waveform)]
    starts: tuple[tuple[float, ...], ...] = ()
    if start_from:
        starts = known_starts(leading) if start_from == "family" else starts_of(Path(start_from), leading)
    plan = Plan(leading, seed, sample, starts, shape)
    announce_compiling()
    start = monotonic()
    count: int = 0
    best: dict[str, Any] | None = None
    with job.status_line("compiling and sampling") as say:

        def tell(noted: int, least: float, row: dict[str, Any]) -> None:
            nonlocal count, best
            count, best = noted, row
            panels = row["measured"].get("panels")
            as_printed = "" if panels is None else f", {panels} panels of Fig. 11 as printed"
            say(f"{noted} candidates, least loss {least:.3f}{as_printed}")

        with worker_pool(workers) as pool:
            for _row in candidates(plan, log, pool=pool, tell=tell):
                if minutes and monotonic() - start > 60.0 * minutes:
                    break
    shown = []
    if best is not None:
        known = best["losses"]
        left = ", ".join(f"{name} {known[name]:.3f}" for name in WEIGHTS[plan.aim] if known.get(name))
        shown = [f"{count} candidates; least loss {best['total']:.4f}: {left or 'none left'}"]
    return Answer(shown, files={"log": Content()})


@verb(
    "judge",
    _TWO,
    judged=_written("Log of judged candidates.", "JUDGED", continued=True),
)
def judge(
    job: Job,
    log: Path = _LOG,
    best: int = opt.bounded(1, "Number of candidates to judge.", default=100),
    every_claim: bool = opt.switch("Judge all claims, not only the stated claims."),
    workers: int = _WORKERS,
) -> Answer:
    """Judge the best candidates of a search by the claims themselves, at the default tolerance."""
    from printhammer.claims import claims
    from studies.reconstruction.judging.judged import STATED
    from studies.reconstruction.judging.shortlist import judge_candidates, rounded, shortlist
    from studies.reconstruction.search.log import read_search
    from studies.reconstruction.workers import worker_pool

    _heading, rows = read_search(log)
    chosen = [rounded(row["constants"]) for row in shortlist(rows, best)]
    if not chosen:
        raise InputError(f"{log}: expected candidates that print, and there are none")
    announce_compiling()
    names = list(claims()) if every_claim else list(STATED)
    (judged,) = job.outputs
    with job.progress_bar("judging") as count, worker_pool(workers) as pool:
        count(0, len(chosen))

        def tell(done: int, of: int, _row: dict[str, Any]) -> None:
            count(len(chosen) - of + done, len(chosen))

        result = judge_candidates(chosen, judged, names=names, pool=pool, tell=tell)
    complete = sum(all(row["verdicts"].get(name) for name in STATED) for row in result)
    panels = max((row["panels"] or 0 for row in result), default=0)
    return Answer(
        [
            (
                f"{len(result)} candidates judged: {complete} meet all stated claims outside Fig. 11; up to"
                f" {panels} panels of Fig. 11 as printed"
            )
        ],
        files={"judged": Content()},
    )


@verb(
    "base-rates",
    "python -m studies.reconstruction base-rates base_rates.json --hammers 10",
    out=_written("JSON file to write."),
)
def base_rates(
    job: Job,
    hammers: int = opt.bounded(1, "Number of random hammers.", default=100),
    slow: int = opt.bounded(0, "Number of hammers for which the slow claims are also judged.", default=3),
    seed: int = _SEED,
    workers: int = _WORKERS,
) -> Answer:
    """Count the random plausible hammers for which each claim holds."""
    from studies.reconstruction.judging.base_rates import base_rates as count
    from studies.reconstruction.workers import worker_pool

    announce_compiling()
    with job.progress_bar("random hammers") as tell, worker_pool(workers) as pool:
        tell(0, hammers)
        table = count(hammers, seed, slow=slow, pool=pool, tell=tell)
    return Answer(
        [f"{name}: {entry['holds']} of {entry['measured']}" for name, entry in table["claims"].items()],
        files={"out": Content.text(partial(_json, table))},
    )


@verb(
    "predictions",
    "python -m studies.reconstruction search stated.jsonl --aim stated --minutes 0.1"
    " && python -m studies.reconstruction judge stated.jsonl judged.jsonl --best 2"
    " && python -m studies.reconstruction predictions stated.jsonl judged.jsonl predictions.json",
    out=_written("JSON file to write."),
)
def predictions(log: Path = _LOG, judged: Path = _JUDGED) -> Answer:
    """Count the hammers found with the stated claims alone for which each other claim holds."""
    from studies.reconstruction.judging.log import read_judged
    from studies.reconstruction.judging.predictions import predictions as count
    from studies.reconstruction.search.log import read_search

    heading, rows = read_search(log)
    if heading["aim"] != "stated":
        raise InputError(f"{log}: aim = {heading['aim']!r}, expected the log of a search on stated claims")
    table = count(read_judged(judged, some=True), heading["seed"], len(rows))
    return Answer(files={"out": Content.text(partial(_json, table))})


@verb(
    "schemes",
    "python -m studies.reconstruction schemes schemes.json --hammers 2",
    out=_written("JSON file to write."),
)
def schemes(
    job: Job,
    hammer: Hammer = opt.HAMMER_OPTION,
    hammers: int = opt.bounded(1, "Number of random hammers.", default=100),
    seed: int = _SEED,
    workers: int = _WORKERS,
) -> Answer:
    """Count how often an integrator of 1983 and the exact motion have different verdicts on Fig. 11."""
    from studies.reconstruction.judging.schemes import schemes_json
    from studies.reconstruction.workers import worker_pool

    announce_compiling()
    with job.progress_bar("random hammers") as tell, worker_pool(workers) as pool:
        tell(0, hammers)
        table = schemes_json(hammer, hammers, seed, pool=pool, tell=tell)
    return Answer(
        [
            f"{row['first']} to {row['second']}: {row['differ']} of {row['panels']} verdicts differ"
            for row in table["changes"]
        ],
        files={"out": Content.text(partial(_json, table))},
    )


_FRONT: Final[tuple[Column[Any], ...]] = (
    Column("candidate", lambda row: row["candidate"]),
    Column("panels of\nFig. 11", lambda row: row["panels"]),
    Column("other\nclaims", lambda row: row["others"]),
    Column("all other\nstated", lambda row: "yes" if row["stated"] else "no"),
    Column("buzz\nprinting", lambda row: "yes" if row["buzzes"] else "no"),
)


@verb(
    "front",
    f"{_SEARCHED} python -m studies.reconstruction judge all.jsonl judged.jsonl --best 1 --every-claim"
    " && python -m studies.reconstruction front judged.jsonl --out front.csv",
    out=opt.results("the Pareto front"),
)
def front(
    judged: list[Path] = opt.argument(
        "JUDGED...", "Logs of judged candidates.", type=Path, is_input=True, many=True, default=...
    ),
    core_hours: float = opt.bounded(0, "Core time of the searches in hours.", default=0.0),
) -> Answer:
    """Show the Pareto front of judged hammers: panels of Fig. 11 against all other claims that hold."""
    from studies.reconstruction.judging.front import front as pareto
    from studies.reconstruction.judging.log import read_judged

    rows = [row for path in judged for row in read_judged(path, some=True)]
    result = pareto(rows, 3600.0 * core_hours)
    best = result.to_dataframe().reset_index().query("on_front").sort_values("panels", ascending=False)
    shown = table(_FRONT, [row for _, row in best.iterrows()], Units.SI)
    return Answer([shown, "", result.title], files={"out": Content.of(result)})


@verb(
    "family",
    "python -m studies.reconstruction search all.jsonl --from family --minutes 0.1"
    " && python -m studies.reconstruction judge all.jsonl judged.jsonl --best 3"
    " && python -m studies.reconstruction family judged.jsonl --hammers 1 --out family",
)
def family(
    job: Job,
    judged: list[Path] = opt.argument(
        "JUDGED...", "Logs of judged candidates.", type=Path, is_input=True, many=True, default=...
    ),
    out: Path = opt.folder("Output folder for the family.", default=Path("build/family")),
    hammers: int = opt.bounded(1, "Maximum number of hammers in the family.", default=24),
    least: int = opt.bounded(1, "Minimum number of hammers in the family.", default=20),
) -> Answer:
    """Select clearly different hammers that do equally well; report which conclusions hold for all."""
    from studies.reconstruction.family.family import WRITTEN, write_family

    job.check_new(out / name for name in WRITTEN)
    announce_compiling()
    members = write_family(
        judged,
        out,
        lambda text: job.show(f"[dim]{escape(text)}[/dim]"),
        count=hammers,
        least=min(least, hammers),
    )
    return Answer([f"{len(members)} hammers; [dim]wrote[/dim] {escape(str(out))}"])


@verb(
    "ship",
    f"{_JUDGED_TOO} python -m studies.reconstruction ship judged.jsonl all.jsonl --out build/hammer",
)
def ship(
    job: Job,
    judged: Path = _JUDGED,
    logs: list[Path] = opt.argument(
        "LOG...", "Logs of the searches.", type=Path, is_input=True, many=True, default=...
    ),
    out: Path = opt.folder("Output folder for the hammer file and the data.", default=Path("build/hammer")),
    name: str = opt.text("TEXT", "Name of the hammer.", default="hendriks-1983"),
    core_hours: float = opt.bounded(0, "Core time of the searches in hours.", default=0.0),
) -> Answer:
    """Write the best judged candidate as a hammer file, and the best candidate for each failing claim."""
    from printhammer.claims import claims
    from printhammer.support.files import check_outputs, make_folder, write_file
    from studies.reconstruction.judging.log import read_judged
    from studies.reconstruction.search.log import read_search
    from studies.reconstruction.shipping import best_of, search_json, shipped_hammer

    if not math.isfinite(core_hours):
        raise InputError(f"--core-hours = {core_hours}, expected a finite number")
    if not name or Path(name).name != name:
        raise InputError(f"--name = {name!r}, expected a short name of the hammer, which names its file too")
    rows = read_judged(judged, some=True)
    searches = [{**heading, "candidates": len(tried)} for heading, tried in map(read_search, logs)]
    hammer = shipped_hammer(best_of(rows)["constants"], name)
    folder = make_folder(out)
    written = [folder / f"{name}.toml", folder / "search.json"]
    check_outputs(written, job.inputs)
    job.check_new(written)
    announce_compiling()
    hammer.save(folder / f"{name}.toml")
    with job.progress_bar("judging") as count:

        def tell(claim: str) -> None:
            count(list(claims()).index(claim), len(claims()), claim.replace("_", " "))

        table = search_json(hammer, rows, searches=searches, core_hours=core_hours, progress=tell)
    write_file(folder / "search.json", _json(table))
    job.wrote(folder / "search.json")
    job.wrote(f"{folder / name}.toml; failing: {', '.join(table['failing']) or 'none'}")
    return Answer()


VERBS: Final = (search, judge, base_rates, schemes, front, predictions, family, ship)
