"""Tests of the verbs of the study."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studies.reconstruction import shipping
from studies.reconstruction.judging import base_rates as rates
from studies.reconstruction.judging import shortlist
from studies.reconstruction.judging.judged import FIGURE_11, SLOW, STATED
from studies.reconstruction.search import search
from studies.reconstruction.search.search import known_starts
from studies.reconstruction.tests.samples import constants_in
from studies.reconstruction.verbs import EXAMPLE, VERBS
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.claims import claims, judge_all
from printhammer.report.reconstruction.results import BaseRates, Predictions, Search

HEADING = {"format": 1, "aim": "stated", "seed": 4}
BRIEF = ("--minutes", "0.00001", "--workers", "1")
SHAPE = "settle_out"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace losses and verdicts by constants."""

    def scored(points: list[Any], _aim: str, _pool: Any, _shape: str) -> list[dict[str, Any]]:
        return [
            {
                "point": [float(share) for share in point],
                "total": float(np.sum(point)),
                "losses": {"settle_out": 0.5, "single_pulse_stroke": 0.0},
                "measured": {"panels": 7},
                "constants": {"mass": 1e-3 * (1.0 + float(point[0]))},
            }
            for point in points
        ]

    monkeypatch.setattr(search, "scored", scored)
    for module in (shortlist, rates):
        monkeypatch.setattr(module, "row_of", held)
    monkeypatch.setattr(
        rates, "draw", lambda count, seed: [{"mass": 1e-3 + 1e-5 * (seed + k)} for k in range(count)]
    )
    monkeypatch.setattr(shipping, "judge_all", lambda _hammer, progress: [])


def held(constants: dict[str, float], names: list[str], *, panels: bool = True) -> dict[str, Any]:
    figure = claims()[FIGURE_11]
    wanted = zip(figure.settings["strobe_times_s"], figure.band["verdicts"], strict=True)
    return {
        "constants": constants,
        "verdicts": dict.fromkeys([*names, *([FIGURE_11] if panels else [])], True),
        "values": {},
        "panels": 9 if panels else None,
        "panel_verdicts": {f"{period * 1e3:.2f} ms": verdict for period, verdict in wanted},
    }


def judged_rows(path: Path, *rows: dict[str, Any]) -> Path:
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return path


def test_a_search_is_noted_and_gone_on_with(cli: Callable, here: Path, cheap: None) -> None:
    del cheap
    words = shlex.split(EXAMPLE.partition("reconstruction ")[2])[:2]
    done = cli(*words, *BRIEF, "--seed", "5")
    assert done.status == 0
    assert "128 candidates; least loss" in done.out
    assert "settle_out 0.500" in done.out
    assert "single_pulse_stroke" not in done.out
    assert "wrote all.jsonl" in done.out
    first = (here / "all.jsonl").read_bytes()
    heading = json.loads(first.partition(b"\n")[0])
    assert (heading["aim"], heading["seed"]) == ("all", 5)
    (here / "all.jsonl").write_bytes(first[:-300])
    assert cli(*words, *BRIEF, "--seed", "5").status == 0
    assert (here / "all.jsonl").read_bytes() == first


def test_a_search_begins_from_another(cli: Callable, here: Path, cheap: None) -> None:
    del cheap
    done = cli("search", "stated.jsonl", "--aim", "stated", *BRIEF)
    assert done.status == 0
    assert cli("search", "all.jsonl", "--from", "stated.jsonl", *BRIEF).status == 0
    # Claims that do not guide the search have no loss.
    assert "least loss" in done.out
    assert "settle_out" not in done.out
    with (here / "all.jsonl").open() as file:
        heading, first = json.loads(file.readline()), json.loads(file.readline())
    assert heading["starts"][0] == first["point"]
    assert cli("search", "known.jsonl", "--from", "family", *BRIEF).status == 0
    with (here / "known.jsonl").open() as file:
        heading, *rows = map(json.loads, file)
    assert heading["starts"] == [list(start) for start in known_starts("all")]
    assert [row["point"] for row in rows[: len(heading["starts"])]] == heading["starts"][: len(rows)]
    # Predicted claims must not have guided the search on which the predictions are based.
    done = cli("search", "more.jsonl", "--aim", "stated", "--from", "all.jsonl", *BRIEF)
    assert done.status == 2
    assert "all.jsonl: aim = 'all', expected the log of a search on stated claims" in done.err
    assert not (here / "more.jsonl").exists()


def test_the_best_are_judged_once(cli: Callable, here: Path, cheap: None) -> None:
    del cheap
    cli("search", "stated.jsonl", "--aim", "stated", *BRIEF)
    judge = ("judge", "stated.jsonl", "judged.jsonl", "--workers", "1")
    done = cli(*judge, "--best", "3")
    assert done.status == 0
    assert "3 candidates judged: 3 meet all stated claims outside Fig. 11; up to 9 panels" in done.out
    before = (here / "judged.jsonl").read_bytes()
    assert cli(*judge, "--best", "2").status == 0
    assert (here / "judged.jsonl").read_bytes() == before
    assert cli(*judge, "--best", "3", "--every-claim").status == 0
    rows = [json.loads(line) for line in (here / "judged.jsonl").read_text().splitlines()]
    assert len(rows) == 6
    assert set(rows[0]["verdicts"]) == {*STATED, FIGURE_11}
    # The last row contains only the new verdicts.
    assert set(rows[-1]["verdicts"]) == set(claims()) - {*STATED, FIGURE_11}
    # A candidate judged twice counts once.
    done = cli("predictions", "stated.jsonl", "judged.jsonl", "predictions.json")
    assert done.status == 0
    table = Predictions.model_validate_json((here / "predictions.json").read_text())
    assert table.hammers == 3
    assert table.candidates == 128
    assert table.claims[SHAPE].measured == 3
    # All hammers have equal counts of panels and claims, so that all are on the front.
    done = cli("front", "judged.jsonl", "--core-hours", "2", "--out", "front.csv")
    assert done.status == 0
    assert "3 judged hammers, 3 on the front" in done.out
    lines = (here / "front.csv").read_text().splitlines()
    assert [line.split(",")[1:3] for line in lines[-3:]] == [["9", str(len(claims()) - 1)]] * 3


def test_base_rates_are_counted(cli: Callable, here: Path, cheap: None) -> None:
    del cheap
    done = cli("base-rates", "base_rates.json", "--hammers", "4", "--slow", "1", "--workers", "1")
    assert done.status == 0
    assert "settle_out: 4 of 4" in done.out
    assert f"{SLOW[0]}: 1 of 1" in done.out
    table = BaseRates.model_validate_json((here / "base_rates.json").read_text())
    assert (table.hammers, table.seed) == (4, 1)


def test_verdicts_of_the_schemes_are_counted(
    cli: Callable, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Test the verb only; judging/test_schemes.py tests the slow count."""
    asked: dict[str, Any] = {}

    def counted(hammer: ph.Hammer, hammers: int, seed: int, **how: Any) -> dict[str, Any]:
        asked.update(hammer=hammer.name, hammers=hammers, seed=seed)
        how["tell"](hammers, hammers)
        change = {"first": "exact", "second": "trapezoid", "panels": 40, "differ": 17}
        return {"hammers": hammers, "changes": [change]}

    monkeypatch.setattr("studies.reconstruction.judging.schemes.schemes_json", counted)
    done = cli("schemes", "schemes.json", "--hammers", "2", "--workers", "1")
    assert done.status == 0
    assert "exact to trapezoid: 17 of 40 verdicts differ" in done.out
    assert asked == {"hammer": "hendriks-1983", "hammers": 2, "seed": 1}
    assert json.loads((here / "schemes.json").read_text())["hammers"] == 2


def test_the_best_ships(cli: Callable, here: Path, cheap: None) -> None:
    del cheap
    best, other = constants_in(CRUDE), constants_in(CRUDE)
    other["mass"] *= 1.1
    judged_rows(
        here / "judged.jsonl",
        held(other, [*STATED[1:]]),
        held(best, [*STATED]),
    )
    row = {"point": [0.5], "total": 1.0, "constants": None}
    judged_rows(here / "a.jsonl", HEADING, row, row)
    judged_rows(here / "b.jsonl", {**HEADING, "aim": "all", "seed": 9}, row)
    done = cli("ship", "judged.jsonl", "a.jsonl", "b.jsonl", "--core-hours", "2.5")
    assert done.status == 0
    assert "failing: none" in done.out
    hammer = ph.load(here / "build" / "hammer" / "hendriks-1983.toml")
    assert {key: hammer.constants[key].si for key in best} == best
    found = Search.model_validate_json((here / "build" / "hammer" / "search.json").read_text())
    assert found.shipped == hammer.fingerprint
    assert [(one.aim, one.seed, one.candidates) for one in found.searches] == [
        ("stated", 4, 2),
        ("all", 9, 1),
    ]
    assert found.core_hours == 2.5


@pytest.fixture
def files(here: Path) -> Path:
    """Write a short search, its judged candidates, and a text file; return the folder."""
    row = {"point": [0.5], "total": 1.0, "constants": None}
    judged_rows(here / "search.jsonl", {**HEADING, "aim": "all"}, row)
    judged_rows(here / "stated.jsonl", HEADING, row)
    judged_rows(here / "judged.jsonl", held(constants_in(CRUDE), [*STATED]))
    (here / "notes.txt").write_text("one\ntwo\n")
    return here


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("search no/a.jsonl", "no/a.jsonl: expected a file in a folder that exists"),
        ("search .", ".: expected a file to write, not a folder"),
        ("search a.jsonl --aim shape", "--aim = 'shape': expected stated or all"),
        ("search a.jsonl --from none.jsonl", "none.jsonl: the log cannot be read"),
        ("search a.jsonl --from notes.txt", "notes.txt, line 1: expected the heading of the log of a search"),
        ("search search.jsonl --seed 3", "search.jsonl: the log of another search"),
        ("search notes.txt", "notes.txt: expected JSON lines of a search"),
        ("search a.jsonl --minutes -1", "'--minutes'"),
        ("search a.jsonl --workers 0", "'--workers'"),
        ("judge none.jsonl a.jsonl", "none.jsonl: the log cannot be read"),
        (
            "judge search.jsonl search.jsonl",
            "search.jsonl: expected an output file that is not an input file",
        ),
        ("judge search.jsonl a.jsonl", "search.jsonl: expected candidates that print, and there are none"),
        ("judge search.jsonl no/a.jsonl", "no/a.jsonl: expected a file in a folder that exists"),
        ("judge search.jsonl a.jsonl --best 0", "'--best'"),
        ("base-rates no/a.json", "no/a.json: expected a file in a folder that exists"),
        ("base-rates a.json --hammers 0", "'--hammers'"),
        ("predictions search.jsonl judged.jsonl a.json", "aim = 'all', expected the log of a search on stat"),
        ("predictions stated.jsonl none.jsonl a.json", "none.jsonl: expected judged candidates, and there"),
        ("predictions stated.jsonl notes.txt a.json", "notes.txt, line 1: expected a judged candidate"),
        (
            "predictions stated.jsonl judged.jsonl judged.jsonl",
            "expected an output file that is not an input",
        ),
        ("predictions stated.jsonl judged.jsonl no/a.json", "expected a file in a folder that exists"),
        ("ship search.jsonl search.jsonl", "search.jsonl, line 1: constants = None, expected the constants"),
        ("ship none.jsonl search.jsonl", "none.jsonl: expected judged candidates, and there are none"),
        ("ship judged.jsonl notes.txt", "notes.txt, line 1: expected the heading of the log of a search"),
        ("ship judged.jsonl search.jsonl --out notes.txt", "notes.txt: expected a writable folder"),
        ("ship judged.jsonl search.jsonl --name ../a", "--name = '../a', expected a short name"),
        ("ship judged.jsonl search.jsonl --name ''", "--name = '', expected a short name"),
        ("ship judged.jsonl search.jsonl --core-hours inf", "--core-hours = inf, expected a finite number"),
        ("family none.jsonl", "none.jsonl: expected judged candidates, and there are none"),
        (
            "family judged.jsonl search.jsonl",
            "search.jsonl, line 1: constants = None, expected the constants",
        ),
    ],
)
@pytest.mark.usefixtures("files")
def test_bad_input_is_one_sentence(refused: Callable, words: str, said: str) -> None:
    refused(*shlex.split(words), said=said)


@pytest.mark.usefixtures("files")
def test_a_family_needs_a_folder(cli: Callable) -> None:
    done = cli("family", "judged.jsonl", "--out", "notes.txt")
    assert done.status == 2
    assert "notes.txt: expected a writable folder" in done.err


@pytest.mark.slow
def test_ctrl_c_leaves_a_log_that_is_gone_on_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[3]), prepend=os.pathsep)
    program = [sys.executable, "-m", "studies.reconstruction", "search", "all.jsonl", "--workers", "2"]
    log = tmp_path / "all.jsonl"
    run = subprocess.Popen(
        [*program, "--minutes", "0"], cwd=tmp_path, stderr=subprocess.PIPE, start_new_session=True, text=True
    )
    try:
        while run.poll() is None and not (log.exists() and log.read_bytes().count(b"\n") > 1):
            time.sleep(0.2)
        # A terminal sends Ctrl-C to all processes of the group.
        os.killpg(run.pid, signal.SIGINT)
        _, told = run.communicate()
    finally:
        run.kill()
    assert run.returncode == 130
    assert told.splitlines()[-1] == "printhammer: interrupted"
    assert "Traceback" not in told
    before = log.read_bytes()
    subprocess.run([*program[:-1], "1", "--minutes", "0.00001"], cwd=tmp_path, check=True)
    assert log.read_bytes().startswith(before[: before.rindex(b"\n") + 1])


@pytest.mark.slow
def test_from_the_search_to_the_hammer(cli: Callable, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "_TOGETHER", 8)
    # Some claims take minutes for a hammer unlike that of the paper.
    monkeypatch.setattr(shipping, "judge_all", lambda hammer, progress: judge_all(hammer, STATED, progress))
    words = ("search", "stated.jsonl", "--aim", "stated", *BRIEF)
    assert cli(*words).status == 0
    judge = ("judge", "stated.jsonl", "judged.jsonl", "--best", "1", "--workers", "1")
    assert cli(*judge).status == 0
    assert cli("predictions", "stated.jsonl", "judged.jsonl", "p.json").status == 0
    done = cli("ship", "judged.jsonl", "stated.jsonl", "--name", "first")
    assert done.status == 0
    found = Search.model_validate_json((here / "build" / "hammer" / "search.json").read_text())
    hammer = ph.load(here / "build" / "hammer" / "first.toml")
    assert found.shipped == hammer.fingerprint
    (row,) = [json.loads(line) for line in (here / "judged.jsonl").read_text().splitlines()]
    # The shipped hammer is judged again, with the same verdicts.
    assert set(found.failing) == {name for name in STATED if not row["verdicts"][name]}
    assert Predictions.model_validate_json((here / "p.json").read_text()).hammers == int(
        all(row["verdicts"][name] for name in STATED)
    )


def test_words_of_options_are_those_of_the_library() -> None:
    from studies.reconstruction.search.evaluation import AIMS
    from studies.reconstruction.search.space import SHAPES

    verbs = {verb.name: verb for verb in VERBS}
    known = {("search", "aim"): AIMS, ("search", "waveform"): SHAPES}
    for (name, option), words in known.items():
        metavar = verbs[name].options[option].metavar
        assert metavar is not None
        assert sorted(metavar.split("|")) == sorted(words)
