import json
import re
import sysconfig
from pathlib import Path

import jsonschema
import pytest

from printhammer.cli.verbs.sweep import SweepProgress, duration_text, progress_text
from printhammer.results.store import open_store
from printhammer.sweep.plan import size_text

SCRIPTS = Path(sysconfig.get_path("scripts"))
SPEC = """
format = 1
hammer = "hendriks-1983"
drive = { train = { rate = "1 kHz", pulses = 1 } }
axis = [{ key = "pack.front", values = ["8 mil", "20 mil"] }]
outputs = { dots = ["struck"] }
"""


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "spec.toml"
    path.write_text(SPEC, "utf-8")
    return path


def test_a_sweep_tells_how_its_members_ended(cli, spec: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.zarr"
    first = cli("sweep", spec, "--out", out)
    assert (first.status, first.err) == (0, "")
    assert re.search(r"2 members: 1 ok, 1 no such hammer; 2 of them now, in \d+ s", first.out)
    assert str(out) in first.out
    assert open_store(out).struck.values.tolist() == [[True], [False]]
    second = cli("sweep", spec, "--out", out, "--threads", "1")
    assert "all of them computed before" in second.out


def test_members_that_are_not_at_rest_are_counted(cli, spec: Path, tmp_path: Path) -> None:
    """After a pulse, an armature without a spring stays at its pole; a spring returns the other armature."""
    for name, said in (("pot-magnet", "1 of them is not at rest"), ("relay-5v", "")):
        text = SPEC.replace("hendriks-1983", name).replace('"1 kHz"', '"5 Hz"')
        spec.write_text(re.sub("axis = .*", 'axis = [{ key = "mass", values = ["10 g"] }]', text), "utf-8")
        outcome = cli("sweep", spec, "--out", tmp_path / f"{name}.zarr")
        assert outcome.status == 0
        assert "1 members: 1 ok" in outcome.out
        assert ("not at rest" in outcome.out) == bool(said)
        assert said in outcome.out


def test_a_check_does_nothing(cli, spec: Path, tmp_path: Path) -> None:
    outcome = cli("sweep", spec, "--check")
    assert outcome.status == 0
    assert re.search(r"pack.front\s+2\s+0.0002032\s+0.000508\s+m", outcome.out)
    assert re.search(r"struck\s+2 × 1\s+2 B", outcome.out)
    assert "2 members in 1 block of up to 2" in outcome.out
    assert [path.name for path in tmp_path.iterdir()] == ["spec.toml"]


def test_a_sweep_without_zarr_names_the_extra(
    refused, tmp_path: Path, spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("printhammer.results.files.find_spec", lambda _name: None)
    refused("sweep", spec, "--out", "out.zarr", said="zarr, which the extra printhammer[sweep] installs")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "SPEC"),
        (["SPEC"], "--out"),
        (["SPEC", "--out", "OUT", "--threads", "no"], "threads = 'no'"),
        (["SPEC", "--out", "OUT", "--threads", "0"], "threads = 0"),
        (["SPEC", "--out", "OUT", "--threads", "1", "--dask", "x"], "--threads"),
        (["none.toml", "--out", "OUT"], "none.toml: the spec cannot be read (No such file or directory)"),
        (["SPEC", "--out", "SPEC"], "no store of printhammer"),
    ],
)
def test_bad_input_is_told_in_one_sentence(
    refused, spec: Path, tmp_path: Path, arguments: list[str], told: str
) -> None:
    places = {"SPEC": spec, "OUT": tmp_path / "out.zarr"}
    refused("sweep", *[places.get(word, word) for word in arguments], said=told)


def test_results_of_another_spec_are_refused(cli, spec: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.zarr"
    cli("sweep", spec, "--out", out)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    spec.write_text(SPEC.replace("8 mil", "8.1 mil"), "utf-8")
    outcome = cli("sweep", spec, "--out", out)
    assert outcome.status == 2
    assert f"{out}: the store was written with spec fingerprint" in outcome.err
    assert "or another folder for the results" in outcome.err
    spec.write_text("tolerance = 1e-9" + SPEC, "utf-8")
    outcome = cli("sweep", spec, "--out", out)
    assert outcome.status == 2
    assert f"{out}: the store was written with tolerance 2e-11: expected 1e-09, or another" in outcome.err
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_the_schema_is_printed(cli) -> None:
    jsonschema.Draft202012Validator.check_schema(json.loads(cli("sweep", "--schema").out))


def test_progress_tells_rate_and_time_left() -> None:
    assert progress_text(0, 0, 10, 0.0) == "0 of 10 members"
    # Members that were there before are no work of this process.
    assert progress_text(60, 40, 100, 10.0) == "60 of 100 members, 2/s, 20 s left"


def test_durations_and_sizes() -> None:
    times = [0.2, 61.0, 3600.0, 7384.0, 90000.0]
    assert [duration_text(t) for t in times] == ["1 s", "1 min 1 s", "1 h 0 min", "2 h 3 min", "1 d 1 h"]
    assert [size_text(s) for s in (12, 1.2e4, 3.4e9, 5.6e12)] == ["12 B", "12 kB", "3.4 GB", "5.6 TB"]


def test_without_a_terminal_there_is_a_line_now_and_then(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(range(0, 100, 4))
    monkeypatch.setattr("printhammer.cli.verbs.sweep.time.monotonic", lambda: float(next(clock)))
    with SweepProgress() as shown:
        for done in range(8):
            shown.tell(done, 0, 8)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("2 of 8 members, ")
