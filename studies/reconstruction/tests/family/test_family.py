import csv
import itertools
import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from studies.reconstruction.family import family
from studies.reconstruction.family.family import csv_text, family_hammers, write_family
from studies.reconstruction.family.picture import family_picture
from studies.reconstruction.judging.judged import STATED
from studies.reconstruction.search.space import hammer_of, template
from studies.reconstruction.verbs import VERBS

import printhammer as ph
from printhammer.errors import InputError
from printhammer.report.reconstruction.results import FamilyMember, Results
from printhammer.units import to_si

VARIED = ("waveform.rise", "waveform.decay", "backstop.damping", "backstop.stiffness")


def constants_of(hammer: ph.Hammer, *factors: float) -> dict[str, float]:
    shipped = {
        key: constant.si for key, constant in hammer.constants.items() if constant.status == "reconstructed"
    }
    return {**shipped, **{key: shipped[key] * factor for key, factor in zip(VARIED, factors, strict=True)}}


@pytest.fixture(scope="module")
def log(hammer: ph.Hammer, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "search.jsonl"
    rows = []
    for number, factors in enumerate(itertools.product((1.0, 1.2), repeat=len(VARIED))):
        verdicts = {"geometry": True, "settle_out": number % 2 == 0}
        rows.append(
            {
                "constants": constants_of(hammer, *factors),
                "verdicts": verdicts,
                "values": {},
                "panels": 8 + number % 3,
            }
        )
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    return path


def judged(hammer: ph.Hammer) -> dict[str, Any]:
    """Return the judgement of a hammer, in place of the slow claims; one hammer is not in the family."""
    rise = hammer.constants["waveform.rise"].si
    conclusions = {
        "safe_rate_Hz": 1e7 * rise,
        "chaos_onset_s": None if hammer.constants["backstop.damping"].si > 4.5e8 else 1.2e-3,
        "flight_time_spread_s": 250e-6,
        "engraved_limit_Hz": 700.0,
        "dot_matrix_limit_Hz": 900.0,
        "energy_per_dot_J": 1.2e-3,
        "pack_loss_J": 0.5e-3,
        "backstop_loss_J": 0.7e-3,
        "settle_out_s": 0.8e-3,
        "print_force_N": 20.0,
    }
    verdicts = {"geometry": "holds", "poincare": "fails"}
    return {"member": True, "verdicts": verdicts, "panels": 9, "conclusions": conclusions}


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    found: list[str] = []

    def record(hammer: ph.Hammer) -> dict[str, Any]:
        found.append(hammer.fingerprint)
        return judged(hammer)

    monkeypatch.setattr(family, "_judge", record)
    return found


def test_a_family_is_written_and_read_back(log: Path, tmp_path: Path, calls: list[str]) -> None:
    told: list[str] = []
    members = write_family([log], tmp_path / "new", told.append, least=2)
    assert len(members) == len(calls) == len(told) - 1
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["family.csv", "family.json"]
    hammers = family_hammers(tmp_path / "new")
    assert [h.name for h in hammers] == [f"hendriks-1983-family-{n + 1:02d}" for n in range(len(members))]
    assert [h.fingerprint for h in hammers] == [hammer_of(member.constants).fingerprint for member in members]
    for member, hammer in zip(members, hammers, strict=True):
        for key in member.constants:
            assert hammer.constants[key].status == "reconstructed"
            assert hammer.constants[key].source
        hammer.check()
    for one, other in itertools.combinations(members, 2):
        apart = [abs(one.constants[k] / other.constants[k] - 1.0) > 0.099 for k in one.constants]
        assert sum(apart) >= 3


def test_the_verb_writes_what_its_example_says(
    cli: Callable[..., Any], log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calls: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (verb,) = (verb for verb in VERBS if verb.name == "family")
    words = shlex.split(verb.example.rpartition(" && ")[2])
    name = words[words.index("family") + 1]
    (tmp_path / name).write_bytes(log.read_bytes())
    done = cli(*words[words.index("family") :])
    assert done.status == 0
    assert done.out.splitlines()[-1] == "1 hammers; wrote family"
    assert len(calls) > 0
    assert sorted(path.name for path in (tmp_path / "family").iterdir()) == ["family.csv", "family.json"]
    assert len(family_hammers(tmp_path / "family")) == 1


def test_the_table_says_the_same_as_the_json(log: Path, tmp_path: Path, calls: list[str]) -> None:
    write_family([log], tmp_path, least=2)
    document = json.loads((tmp_path / "family.json").read_text("utf-8"))
    with (tmp_path / "family.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == [entry["name"] for entry in document["hammers"]]
    for row, entry in zip(rows, document["hammers"], strict=True):
        for heading, text in row.items():
            name, _, unit = heading.removesuffix("]").partition(" [")
            if name in entry["constants"]:
                assert (
                    to_si(float(text), unit, template().constants[name].si_unit) == entry["constants"][name]
                )
            elif heading.startswith("claim "):
                assert text == entry["verdicts"][heading.removeprefix("claim ")]
        assert row["chaos onset [s]"] == ("" if entry["conclusions"]["chaos_onset_s"] is None else "0.0012")
        assert float(row["safe rate [Hz]"]) == entry["conclusions"]["safe_rate_Hz"]
    # For claims that are not judged again, the verdicts of the search are stored.
    assert {entry["verdicts"]["settle_out"] for entry in document["hammers"]} <= {"holds", "fails"}


def test_work_that_was_interrupted_goes_on(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []

    def interrupted(hammer: ph.Hammer) -> dict[str, Any]:
        if len(done) == 1:
            raise KeyboardInterrupt
        done.append(hammer.fingerprint)
        return judged(hammer)

    monkeypatch.setattr(family, "_judge", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_family([log], tmp_path, least=2)
    assert [path.name for path in tmp_path.iterdir()] == ["family.part.jsonl"]
    with (tmp_path / "family.part.jsonl").open("a", encoding="utf-8") as file:
        file.write('\n{"version": "0.')
    again: list[str] = []
    monkeypatch.setattr(family, "_judge", lambda hammer: again.append(hammer.fingerprint) or judged(hammer))
    members = write_family([log], tmp_path, least=2)
    assert done[0] not in again
    assert len(again) == len(members) - 1
    write_family([log], tmp_path / "other", least=2)
    for name in ("family.json", "family.csv"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "other" / name).read_bytes()


def test_too_few_hammers_are_told_and_nothing_is_overwritten(
    log: Path, tmp_path: Path, calls: list[str]
) -> None:
    (tmp_path / "family.json").write_text("old", encoding="utf-8")
    with pytest.raises(InputError, match="clearly different hammers are in the logs, expected 20"):
        write_family([log], tmp_path)
    assert (tmp_path / "family.json").read_text("utf-8") == "old"


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (
            {"constants": {"mass": 4e-4}, "verdicts": {}, "values": {}, "panels": 7},
            "0 clearly different hamm",
        ),
        ({"constants": {"mas": 4e-4}, "verdicts": {}, "values": {}, "panels": 9}, "mas"),
        ({"seed": 3}, "expected the constants of a judged candidate"),
        (None, "expected judged candidates, and there are none"),
    ],
)
def test_no_hammer_at_all_is_told_and_leaves_nothing_behind(tmp_path: Path, row: Any, said: str) -> None:
    path = tmp_path / "judged.jsonl"
    path.write_text("" if row is None else json.dumps(row) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=said):
        write_family([path], tmp_path / "new" / "family")
    assert list(tmp_path.iterdir()) == [path]


def test_a_hammer_that_is_no_member_is_left_out(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(family, "_judge", lambda hammer: {**judged(hammer), "member": False})
    with pytest.raises(InputError, match="0 clearly different hammers"):
        write_family([log], tmp_path, least=1)


def test_a_folder_without_a_family_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"family\.json"):
        family_hammers(tmp_path)


def test_a_constant_that_a_hammer_lacks_is_left_empty_in_the_table() -> None:
    conclusions = judged(template())["conclusions"]
    first, second = (
        FamilyMember(name=name, constants={"mass": mass}, verdicts={}, panels=panels, conclusions=conclusions)
        for name, mass, panels in (("family-01", 4e-4, 8), ("family-02", 3e-4, 9))
    )
    text = csv_text([first, second])
    heading, *rows = text.splitlines()
    assert heading.startswith("name,mass [kg],waveform.amplitude [A],panels of Fig. 11 as printed [1],")
    assert rows[0].startswith("family-01,0.0004,,8,")
    assert rows[1].startswith("family-02,0.0003,,9,")


@pytest.mark.slow
def test_the_claims_decide_who_is_a_member(hammer: ph.Hammer) -> None:
    found = family._judge(hammer)
    held = {name for name, verdict in found["verdicts"].items() if verdict == "holds"}
    assert found["member"] == (set(STATED) <= held and found["panels"] >= 8)


def test_the_picture_has_a_dot_for_each_member_in_each_row(
    hammer: ph.Hammer, log: Path, tmp_path: Path, calls: list[str]
) -> None:
    members = write_family([log], tmp_path, least=2)
    figure = family_picture(hammer, Results(tmp_path))
    rows = {
        found.get_gid(): found.get_offsets()
        for ax in figure.findobj(lambda artist: hasattr(artist, "collections"))
        for found in ax.collections
    }
    assert set(VARIED) <= set(rows)
    for key in VARIED:
        assert len(rows[key]) == len(members)
    with pytest.raises(InputError, match=r"the key 'magnet\.F0' is missing"):
        family_picture(hammer.replace({"magnet": None}), Results(tmp_path))
    with pytest.raises(InputError, match="the hammer does not print"):
        family_picture(hammer.replace("waveform.amplitude", "0.01 A"), Results(tmp_path))
