"""The package as a user installs it: public names, start-up, and the built wheel in a fresh environment."""

import re
import shlex
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest
from hatch_build import compiled_code

import printhammer as ph
from printhammer.hammer.hammer import shipped
from printhammer.kernel.compile import link
from printhammer.kernel.compile.modules import KINDS
from printhammer.kernel.compile.specialise import specialise
from printhammer.kernel.model.laws import LAW_FUNCTIONS
from printhammer.run.plain.entries import entries, page_module
from printhammer.run.problem import laws_of

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src"
SCRIPTS = Path(sysconfig.get_path("scripts"))
HEAVY = {"jinja2", "matplotlib", "numba", "numpy", "pandas", "pint", "pydantic", "scipy", "xarray"}


def output_of(*command: str | Path, cwd: Path) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def heavy_after(code: str, cwd: Path) -> set[str]:
    listing = output_of(sys.executable, "-c", f"{code}\nimport sys\nprint(*sys.modules)", cwd=cwd)
    return HEAVY & set(listing.splitlines()[-1].split())


@pytest.mark.parametrize("name", ph.__all__)
def test_every_public_name_resolves(name: str) -> None:
    assert getattr(ph, name) is not None
    assert name in dir(ph)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = ph.no_such_name


def test_a_function_stays_one_when_the_package_of_its_name_is_imported(tmp_path: Path) -> None:
    code = (
        "import printhammer.sweep.api, printhammer.sweep.spec, printhammer as ph;"
        "print(ph.sweep.__name__, type(ph.sweep))"
    )
    assert output_of(sys.executable, "-c", code, cwd=tmp_path).strip() == "sweep <class 'function'>"


def test_the_stub_holds_the_public_names_and_no_other() -> None:
    names = re.findall(
        r"^from \.\S+ import (\w+) as \1$", (SOURCE / "printhammer/__init__.pyi").read_text(), re.M
    )
    assert sorted([*names, "__version__"]) == sorted(ph.__all__)


def test_bad_input_is_a_value_error_of_ours() -> None:
    assert issubclass(ph.InputError, ValueError)
    assert issubclass(ph.InputError, ph.PrinthammerError)


def test_the_version_is_the_same_everywhere() -> None:
    version = re.escape(ph.__version__)
    assert re.search(rf"^## {version}\b", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert re.search(rf"^version: {version}$", (ROOT / "CITATION.cff").read_text("utf-8"), re.MULTILINE)


def test_every_direct_requirement_is_locked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"]
    (everything,) = extras.pop("all")
    assert everything == f"printhammer[{','.join(extras)}]"
    for lock, requirements in {
        "runtime.txt": project["dependencies"],
        "dev.txt": [*project["dependencies"], *(name for extra in extras.values() for name in extra)],
    }.items():
        locked = (ROOT / "requirements" / lock).read_text("utf-8")
        names = {re.match(r"[\w-]+", requirement).group() for requirement in requirements}
        assert {name for name in names if not re.search(rf"^{name}==", locked, re.MULTILINE)} == set()


def test_importing_the_package_imports_nothing_heavy(tmp_path: Path) -> None:
    assert heavy_after("import printhammer, printhammer.errors", tmp_path) == set()
    assert heavy_after("import numba", tmp_path) >= {"numba", "numpy"}
    assert "matplotlib" not in heavy_after("import printhammer.figures", tmp_path)


def test_help_imports_nothing_heavy(tmp_path: Path) -> None:
    call = """
import sys
from printhammer.cli.main import main
sys.argv = ["printhammer", "--help"]
try:
    main()
except SystemExit as end:
    assert not end.code
"""
    assert heavy_after(call, tmp_path) == set()


COMPILED = ("hendriks-1983", "relay-5v")
"""Shipped hammers whose machine code the wheel of the tests contains; that of all takes five minutes."""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("dist")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PRINTHAMMER_COMPILED", " ".join(COMPILED))
        output_of(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", target, cwd=ROOT)
    (built,) = target.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def elsewhere(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment with the wheel, and our locked dependencies by path; its folder of scripts."""
    folder = tmp_path_factory.mktemp("elsewhere")
    output_of(sys.executable, "-m", "venv", "--without-pip", folder / "venv", cwd=folder)
    where = {"base": str(folder / "venv"), "platbase": str(folder / "venv")}
    python = Path(sysconfig.get_path("scripts", "venv", where)) / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check", "--quiet")
    output_of(*pip, "install", "--no-deps", "--no-index", wheel, cwd=folder)
    # A path file is not followed further, so our own editable installation stays out of it.
    packages = Path(sysconfig.get_path("purelib", "venv", where))
    (packages / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n", "utf-8")
    return python.parent


@pytest.mark.slow
def test_the_wheel_holds_every_file_of_the_package_and_no_other(wheel: Path) -> None:
    ours = {
        str(path.relative_to(SOURCE))
        for path in (SOURCE / "printhammer").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    shipped = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    modules = {name for name in shipped if name.startswith("printhammer/kernel/modules/")}
    assert shipped - modules == ours
    plain = {name for name, entry in entries().items() if not entry.packing}
    kinds = {Path(name).name.rpartition("_")[0] for name in modules}
    assert kinds == {*KINDS, *LAW_FUNCTIONS, *plain, "scheme", "web"}
    assert {"printhammer/py.typed", "printhammer/hammers/hendriks-1983.toml"} <= shipped
    assert any(re.fullmatch(r"printhammer/claims/.*\.toml", name) for name in shipped)
    assert any(re.fullmatch(r"printhammer/.*\.(html|jinja|j2)", name) for name in shipped)


@pytest.mark.slow
def test_a_whole_wheel_holds_the_machine_code_of_every_shipped_hammer() -> None:
    """By the names of its files; `make test-numba` builds and runs a whole wheel."""
    names = {name for name, _make in compiled_code()}
    for hammer in map(ph.load, shipped()):
        drive = ph.PulseTrain(hammer.waveform) if hammer.waveform else ph.SineForce(1.0, 1.0)
        laws = laws_of(hammer, drive)
        assert page_module(laws).shipped.name in names
        if link.processor()[1] == link.COMMON:
            assert {entry.code.shipped.name for entry in specialise(laws).entries} <= names


@pytest.mark.slow
def test_the_wheel_runs_elsewhere(elsewhere: Path, tmp_path: Path) -> None:
    origin = output_of(
        elsewhere / "python", "-c", "import printhammer; print(printhammer.__file__)", cwd=tmp_path
    )
    assert Path(origin.strip()).is_relative_to(elsewhere.parent)
    assert "paper" in output_of(elsewhere / "printhammer", "--help", cwd=tmp_path)
    assert "paper" in output_of(elsewhere / "python", "-m", "printhammer", "--help", cwd=tmp_path)
    assert "hendriks-1983" in output_of(
        elsewhere / "printhammer", "hammer", "show", "hendriks-1983", cwd=tmp_path
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPILED)
def test_the_wheel_compiles_without_numba_and_shipped_hammers_not_at_all(
    elsewhere: Path, tmp_path: Path, name: str
) -> None:
    code = f"""
import os, sys
from pathlib import Path
os.environ["NUMBA_CACHE_DIR"] = "empty"
sys.modules["numba"] = None
import printhammer as ph
from printhammer.kernel.compile import link
hammer = ph.load({name!r})
width = hammer.waveform.width
drives = [ph.PulseTrain(hammer.waveform, period=period * width, pulses=2) for period in (4.0, 5.0)]
motion = ph.simulate(hammer, drives[0])
_ = motion.dots, motion.energy, motion.x
assert ph.Ensemble(hammer, drives, 9.0 * width).run(dots=True).ok.all()
assert not list(Path("empty").rglob("*.code")) or link.processor()[1] != link.COMMON
force = ph.SineForce(1e-3, 0.1 / width)
assert ph.simulate(hammer, force, duration=9.0 * width).ok
assert ph.simulate(hammer, force, duration=9.0 * width, scheme="runge-kutta-4").x.size
"""
    assert output_of(elsewhere / "python", "-c", code, cwd=tmp_path) == ""
    kept = [path.suffix for path in (tmp_path / "empty").rglob("*") if path.is_file()]
    assert set(kept) == {".code", ".json", ".digest"}


@pytest.mark.slow
def test_the_wheel_holds_the_kernels_of_shipped_hammers_in_webassembly(
    wheel: Path, elsewhere: Path, tmp_path: Path
) -> None:
    code = """
import os, sys
os.environ["NUMBA_CACHE_DIR"] = "empty"
sys.modules["ziglang"] = None
import printhammer as ph
from printhammer.hammer.hammer import shipped
from printhammer.kernel.compile.specialise import specialise
from printhammer.run.plain.entries import page_module
from printhammer.run.problem import laws_of
for hammer in map(ph.load, shipped()):
    drive = ph.PulseTrain(hammer.waveform) if hammer.waveform else ph.SineForce(1.0, 1.0)
    laws = laws_of(hammer, drive)
    assert page_module(laws).content().startswith(b"\\0asm")
try:
    specialise(laws).web_module(["run"]).content()
except ph.InputError as error:
    assert error.key == "page"
else:
    raise AssertionError
"""
    assert output_of(elsewhere / "python", "-c", code, cwd=tmp_path) == ""
    assert wheel.stat().st_size <= 8_000_000


@pytest.mark.slow
def test_the_readme_works_elsewhere(elsewhere: Path, tmp_path: Path) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    dots = output_of(elsewhere / "python", "-c", example, cwd=tmp_path).strip().splitlines()
    assert len(dots) == 1 + 9  # the heading, and one for each pulse of the example


@pytest.mark.slow
def test_the_commands_of_the_readme_work_elsewhere(elsewhere: Path, tmp_path: Path) -> None:
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    (commands,) = (block for block in blocks if "printhammer map" in block)
    output_of("sh", "-ec", f"PATH={shlex.quote(str(elsewhere))}:$PATH\n{commands}", cwd=tmp_path)
    made = {path.name for path in (tmp_path / "build").iterdir()}
    assert made == {"page.png", "map.png", "strobe.png", "lab"}


def test_the_readme_says_what_holds() -> None:
    from printhammer.claims.judging import claims
    from printhammer.report.reconstruction.results import shipped_results

    search = shipped_results().search
    assert search is not None
    assert search.shipped == ph.load("hendriks-1983").fingerprint
    failing = list(search.failing)
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    assert f"{len(claims()) - len(failing)} of the {len(claims())} claims" in readme
    (sentence,) = re.findall(r"These claims fail: (.*?)\. The report", readme)
    assert re.findall(r"`(\w+)`", sentence) == failing


def test_the_readme_names_files_and_targets_that_exist() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    assert readme.count("\n") <= 60
    targets = set(re.findall(r"(?:^|`)make ([a-z-]+)", readme, re.MULTILINE))
    makefile = (ROOT / "Makefile").read_text("utf-8")
    assert {"paper", "test"} <= targets
    assert {name for name in targets if not re.search(rf"^{name}:", makefile, re.MULTILINE)} == set()
    links = re.findall(r"\]\(([^):]+)\)", readme)
    assert [link for link in links if not (ROOT / link).exists()] == []
