"""The verb `reconstruct`: the search for the hammer of the paper, and what is made of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer

EXAMPLE: Final = "Example: printhammer reconstruct search all.jsonl --minutes 1"

app = typer.Typer(
    help="Search for hammers that do what the paper tells, judge them, and make tables of what was found.",
    epilog=EXAMPLE,
    no_args_is_help=True,
)

WorkersOption = Annotated[int, typer.Option(min=1, metavar="N", help="Processes to compute in.")]
SeedOption = Annotated[int, typer.Option(min=0, help="Decides on everything random.")]
LogArgument = Annotated[Path, typer.Argument(metavar="LOG", help="Log of a search.", show_default=False)]
JudgedArgument = Annotated[
    Path, typer.Argument(metavar="JUDGED", help="Log of judged candidates.", show_default=False)
]


@app.command("search", epilog=EXAMPLE)
def search(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG",
            help="JSON lines, one for each candidate; a search begun there goes on.",
            show_default=False,
        ),
    ],
    aim: Annotated[
        str, typer.Option(metavar="stated|all", help="Claims that lead: stated ones alone, or shapes too.")
    ] = "all",
    seed: SeedOption = 1,
    start_from: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="LOG", help="Another search, from whose best candidates to begin too."
        ),
    ] = None,
    minutes: Annotated[float, typer.Option(min=0.0, help="How long to search; 0: until interrupted.")] = 60.0,
    workers: WorkersOption = 2,
) -> None:
    """Try candidates, led by the claims, and note every one of them; Ctrl-C loses nothing."""
    from time import monotonic

    from printhammer.cli.progress import telling
    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import announce_compiling, console
    from printhammer.cli.workers import worker_pool
    from printhammer.errors import InputError
    from printhammer.reconstruction.search.evaluation import WEIGHTS
    from printhammer.reconstruction.search.search import Plan, starts_of
    from printhammer.reconstruction.search.search import search as candidates
    from printhammer.support.outputs import check_outputs

    check_outputs([log])
    if aim not in ("stated", "all"):
        raise InputError(f"--aim = {aim!r}, expected stated or all")
    wanted: Literal["stated", "all"] = "stated" if aim == "stated" else "all"
    starts = () if start_from is None else starts_of(start_from, wanted)
    plan = Plan(wanted, seed, starts=starts)
    announce_compiling()
    start = monotonic()
    screen = console()
    count: int = 0
    best: dict[str, Any] | None = None
    with telling("compiling and sampling") as say:

        def tell(noted: int, least: float, row: dict[str, Any]) -> None:
            nonlocal count, best
            count, best = noted, row
            panels = row["measured"].get("panels")
            told = "" if panels is None else f", {panels} panels of Fig. 11 as printed"
            say(f"{noted} candidates, least loss {least:.3f}{told}")

        with worker_pool(workers) as pool:
            for _row in candidates(plan, log, pool=pool, tell=tell):
                if minutes and monotonic() - start > 60.0 * minutes:
                    break
    if best is not None:
        known = best["losses"]
        left = ", ".join(f"{name} {known[name]:.3f}" for name in WEIGHTS[plan.aim] if known.get(name))
        screen.print(f"{count} candidates; least loss {best['total']:.4f}: {left or 'none left'}")
    say_written(screen, log)


@app.command("judge", epilog="Example: printhammer reconstruct judge all.jsonl judged.jsonl --best 20")
def judge(
    log: LogArgument,
    judged: JudgedArgument,
    best: Annotated[int, typer.Option(min=1, help="Number of candidates to judge.")] = 100,
    every_claim: Annotated[
        bool, typer.Option("--every-claim", help="Judge all claims, not the stated ones alone.")
    ] = False,
    workers: WorkersOption = 2,
) -> None:
    """Judge the best candidates of a search by the claims themselves, at the default tolerance."""
    from printhammer.claims import claims
    from printhammer.cli.progress import counting
    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import announce_compiling, console
    from printhammer.cli.workers import worker_pool
    from printhammer.errors import InputError
    from printhammer.reconstruction.judging.judged import STATED
    from printhammer.reconstruction.judging.shortlist import judge_candidates, rounded, shortlist
    from printhammer.reconstruction.search.log import read_search
    from printhammer.support.outputs import check_outputs

    check_outputs([judged], [log])
    _heading, rows = read_search(log)
    chosen = [rounded(row["constants"]) for row in shortlist(rows, best)]
    if not chosen:
        raise InputError(f"{log}: expected candidates that print, and there are none")
    announce_compiling()
    screen = console()
    names = list(claims()) if every_claim else list(STATED)
    with counting("judging") as count, worker_pool(workers) as pool:

        def tell(done: int, of: int, _row: dict[str, Any]) -> None:
            count(len(chosen) - of + done, len(chosen))

        found = judge_candidates(chosen, judged, names=names, pool=pool, tell=tell)
    whole = sum(all(row["verdicts"].get(name) for name in STATED) for row in found)
    panels = max((row["panels"] or 0 for row in found), default=0)
    screen.print(
        f"{len(found)} candidates judged: {whole} meet all stated claims outside Fig. 11; up to {panels}"
        " panels of Fig. 11 as printed"
    )
    say_written(screen, judged)


@app.command("base-rates", epilog="Example: printhammer reconstruct base-rates base_rates.json --hammers 10")
def base_rates(
    out: Annotated[Path, typer.Argument(metavar="FILE", help="JSON file to write.", show_default=False)],
    hammers: Annotated[int, typer.Option(min=1, help="Number of random hammers.")] = 100,
    slow: Annotated[int, typer.Option(min=0, help="For how many of them slow claims are judged too.")] = 3,
    seed: SeedOption = 1,
    workers: WorkersOption = 2,
) -> None:
    """Count for how many random plausible hammers each claim holds."""
    from printhammer.cli.progress import counting
    from printhammer.cli.terminal import announce_compiling, console
    from printhammer.cli.workers import worker_pool
    from printhammer.reconstruction.judging.base_rates import base_rates as count
    from printhammer.support.outputs import check_outputs

    check_outputs([out])
    announce_compiling()
    with counting("random hammers") as tell, worker_pool(workers) as pool:
        table = count(hammers, seed, slow=slow, pool=pool, tell=tell)
    _write_json(out, table)
    for name, entry in table["claims"].items():
        console().print(f"{name}: {entry['holds']} of {entry['measured']}")


def _write_json(out: Path, table: dict[str, Any]) -> None:
    import json

    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import console
    from printhammer.support.outputs import write_file

    write_file(out, json.dumps(table, indent=1, allow_nan=False) + "\n")
    say_written(console(), out)


@app.command(
    "predictions",
    epilog="Example: printhammer reconstruct predictions stated.jsonl judged.jsonl predictions.json",
)
def predictions(
    log: LogArgument,
    judged: JudgedArgument,
    out: Annotated[Path, typer.Argument(metavar="FILE", help="JSON file to write.", show_default=False)],
) -> None:
    """Tell what hammers found on the stated claims alone say about the claims that did not lead."""
    from printhammer.errors import InputError
    from printhammer.reconstruction.judging.log import read_judged
    from printhammer.reconstruction.judging.predictions import predictions as count
    from printhammer.reconstruction.search.log import read_search
    from printhammer.support.outputs import check_outputs

    check_outputs([out], [log, judged])
    heading, rows = read_search(log)
    if heading["aim"] != "stated":
        raise InputError(f"{log}: aim = {heading['aim']!r}, expected the log of a search on stated claims")
    _write_json(out, count(read_judged(judged, some=True), heading["seed"], len(rows)))


@app.command("family", epilog="Example: printhammer reconstruct family judged.jsonl --out family")
def family(
    judged: Annotated[
        list[Path], typer.Argument(metavar="JUDGED...", help="Logs of judged candidates.", show_default=False)
    ],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where to write.")] = Path("build/family"),
) -> None:
    """Choose clearly different hammers that do equally well, and tell which conclusions hold for all."""
    from printhammer.cli.terminal import announce_compiling, console
    from printhammer.reconstruction.family.family import write_family

    announce_compiling()
    members = write_family(judged, out, lambda text: console().print(f"[dim]{text}[/dim]", soft_wrap=True))
    console().print(f"{len(members)} hammers; [dim]wrote[/dim] {out}", soft_wrap=True)


@app.command("ship", epilog="Example: printhammer reconstruct ship judged.jsonl all.jsonl --out build/hammer")
def ship(
    judged: JudgedArgument,
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs of the searches.", show_default=False)
    ],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where to write.")] = Path("build/hammer"),
    name: Annotated[str, typer.Option(help="Name of the hammer.")] = "hendriks-1983",
    core_hours: Annotated[float, typer.Option(min=0.0, help="Time that the searches took.")] = 0.0,
) -> None:
    """Write the best judged candidate as a hammer file, and for each claim that fails the best for it."""
    import math

    from printhammer.claims import claims
    from printhammer.cli.progress import telling
    from printhammer.cli.terminal import announce_compiling, console
    from printhammer.errors import InputError
    from printhammer.reconstruction.judging.log import read_judged
    from printhammer.reconstruction.search.log import read_search
    from printhammer.reconstruction.shipping import best_of, search_json, shipped_hammer
    from printhammer.support.outputs import check_outputs, make_folder

    if not math.isfinite(core_hours):
        raise InputError(f"--core-hours = {core_hours}, expected a finite number")
    if not name or Path(name).name != name:
        raise InputError(f"--name = {name!r}, expected a short name of the hammer, which names its file too")
    rows = read_judged(judged, some=True)
    searches = [{**heading, "candidates": len(tried)} for heading, tried in map(read_search, logs)]
    hammer = shipped_hammer(best_of(rows)["constants"], name)
    folder = make_folder(out)
    check_outputs([folder / f"{name}.toml", folder / "search.json"], [judged, *logs])
    announce_compiling()
    hammer.save(folder / f"{name}.toml")
    with telling("judging") as say:

        def tell(claim: str) -> None:
            say(f"judging {claim.replace('_', ' ')}, {list(claims()).index(claim) + 1} of {len(claims())}")

        table = search_json(hammer, rows, searches=searches, core_hours=core_hours, progress=tell)
    _write_json(folder / "search.json", table)
    console().print(
        f"[dim]wrote[/dim] {folder / name}.toml; failing: {', '.join(table['failing']) or 'none'}"
    )
