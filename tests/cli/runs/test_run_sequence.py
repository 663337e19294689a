from pathlib import Path

FILE = """format = 1
[sequence]
at = ["0 ms", "2 ms"]
waveforms = ["print", "spent"]
[waveforms.print]
shape = "rectangle"
amplitude = "0.93 A"
width = "352 us"
rise = "11 us"
decay = "24 us"
[waveforms.spent]
shape = "chain"
parts = [
  { at = "0 us", shape = "half-sine", amplitude = "0.1 A", width = "200 us" },
  { at = "300 us", shape = "half-sine", amplitude = "0.1 A", width = "200 us" },
]
"""


def test_a_sequence_runs_from_a_file(cli, tmp_path: Path) -> None:
    path, crude = tmp_path / "sequence.toml", Path(__file__).parents[2] / "data" / "hendriks-1983.toml"
    path.write_text(FILE)
    outcome = cli("run", str(crude), "--drive", str(path))
    assert (outcome.status, outcome.err) == (0, "")
    assert "PulseSequence: 2 waveforms of current, 2 firings" in outcome.out
    assert "1 struck, 1 lost" in outcome.out


def test_a_name_without_a_waveform_is_bad_input(cli, tmp_path: Path) -> None:
    path = tmp_path / "sequence.toml"
    path.write_text(FILE.replace('"spent"]', '"soft"]'))
    outcome = cli("run", "hendriks-1983", "--drive", str(path))
    assert outcome.status == 2
    assert "\n" not in outcome.err
    assert "sequence.waveforms: 'soft' does not name a waveform of the file" in outcome.err
