"""What is installed is what was tested: contents of wheel and sdist, the suite from the wheel."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PYTHONS = ("3.11", "3.12", "3.13")
# One file of every kind that a command needs when the repository is not there.
NEEDED = (
    "api/cli.py",
    "api/py.typed",
    "bodies/planar.py",
    "codegen/schemes/lobatto.py",
    "models/slider_crank.py",
    "runtime/c/sg_newton.c",
    "runtime/c/sg_real.h",
    "templates/stepper.c.jinja",
    "verify/reference.py",
    "view/motion.py",
    "templates/player.html.jinja",
)


def run(*command: object, cwd: Path, env: dict[str, str] | None = None) -> str:
    result = subprocess.run(
        [str(c) for c in command], cwd=cwd, env=env, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-4000:]
    return result.stdout


def clean_copy(folder: Path) -> Path:
    """The files under version control, without anything that was built."""
    names = run("git", "ls-files", cwd=ROOT).split()
    for name in names:
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    return folder


def interpreter(version: str) -> str:
    if f"{sys.version_info.major}.{sys.version_info.minor}" == version:
        return sys.executable
    roots = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    for found in (shutil.which(f"python{version}"), *sorted(roots.glob(f"{version}.*/bin/python"))):
        if found and subprocess.run([found, "-c", ""], check=False).returncode == 0:
            return str(found)
    pytest.skip(f"python{version} is not installed")


def build(kind: str, folder: Path) -> Path:
    source = clean_copy(folder / "source")
    run(sys.executable, "-m", "build", f"--{kind}", "--outdir", folder / "dist", cwd=source)
    (made,) = (folder / "dist").iterdir()
    return made


def test_wheel_and_sdist_are_complete(tmp_path: Path) -> None:
    with tarfile.open(build("sdist", tmp_path / "s")) as sdist:
        inside = {name.split("/", 1)[-1] for name in sdist.getnames()}
    assert set(NEEDED) <= inside, set(NEEDED) - inside
    # the sdist alone makes a wheel; not every 3.11 has the filters of extractall
    unpacked = tmp_path / "unpacked"
    run(sys.executable, "-m", "tarfile", "-e", sdist.name, unpacked, cwd=tmp_path)
    (source,) = unpacked.iterdir()
    run(sys.executable, "-m", "build", "--wheel", "--outdir", tmp_path / "w", cwd=source)
    (wheel,) = (tmp_path / "w").iterdir()
    names = set(zipfile.ZipFile(wheel).namelist())
    needed = {"signorini/" + name.removeprefix("api/") for name in NEEDED}
    assert needed <= names, needed - names
    assert not {n for n in names if n.startswith(("tests", "generated", "docs"))}
    assert all(n.startswith("signorini") for n in names)
    # the studies are in the sdist, and a wheel of their own
    assert {"studies/reproduce.py", "stress/sift.c", "benchmarks/steps.c"} <= inside
    left_out = ("signorini/studies", "signorini/stress", "signorini/benchmarks")
    assert not {n for n in names if n.startswith(left_out)}
    _wheel_is_consistent(wheel, tmp_path / "target")
    run(
        sys.executable,
        "-m",
        "build",
        "--wheel",
        "-C",
        "part=studies",
        "-o",
        tmp_path / "p",
        cwd=source,
    )
    (part,) = (tmp_path / "p").iterdir()
    studies = zipfile.ZipFile(part).namelist()
    assert {"signorini/stress/sift.c", "signorini/benchmarks/instructions.json"} <= set(studies)
    assert all(n.startswith((*left_out, "signorini_studies-")) for n in studies)
    _the_studies_go_with_it(wheel, part, tmp_path / "both")


def _the_studies_go_with_it(wheel: Path, part: Path, target: Path) -> None:
    """Installed beside the wheel they are its commands."""
    pip = (sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", target)
    run(*pip, wheel, part, cwd=target.parent)
    code = (
        "import sys; sys.meta_path[:] = [f for f in sys.meta_path if 'editable' not in "
        "getattr(f, '__module__', '')]; from signorini.cli import main; main()"
    )
    env = os.environ | {"PYTHONPATH": str(target), "SIGNORINI_CACHE": str(target / "cache")}
    words = ("stress", "--scenes", "rocking", "--runs", "1", "--stages", "2", "--workers", "1")
    said = run(sys.executable, "-c", code, *words, cwd=target, env=env)
    assert "rocking" in said


def _wheel_is_consistent(wheel: Path, target: Path) -> None:
    """pip installs it; commands of the studies say where they are."""
    pip = (sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target")
    run(*pip, target, wheel, cwd=target.parent)
    record = next(target.glob("signorini-*.dist-info")) / "RECORD"
    listed = {line.split(",")[0] for line in record.read_text().splitlines()}
    assert all((target / name).is_file() for name in listed if name.startswith("signorini/"))
    code = (
        "import sys; sys.meta_path[:] = [f for f in sys.meta_path if 'editable' not in "
        "getattr(f, '__module__', '')]; from signorini.cli import main; main()"
    )
    for command in (("stress",), ("reproduce", "orders", "--out", "o"), ("bench",)):
        done = subprocess.run(
            [sys.executable, "-c", code, *command],
            cwd=target, env=os.environ | {"PYTHONPATH": str(target)},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 1, (command, done.stderr)
        assert f"'signorini {command[0]}' belongs to the studies" in " ".join(done.stderr.split())


@pytest.mark.slow
@pytest.mark.parametrize("version", PYTHONS)
def test_suite_from_the_wheel(version: str, tmp_path: Path) -> None:
    """The golden files among the tests make this a proof of equal bytes under every Python, too."""
    python = interpreter(version)
    wheel = build("wheel", tmp_path / "wheel")
    run(python, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    own = tmp_path / "venv" / "bin" / "python"
    constraints = ROOT / "constraints.txt"
    run(own, "-m", "pip", "install", "-q", f"{wheel}[test]", "-c", constraints, cwd=tmp_path)
    copy = clean_copy(tmp_path / "copy")
    (package,) = (tmp_path / "venv").glob("lib/python*/site-packages/signorini")
    for studies in ("benchmarks", "stress", "studies"):  # they come with the source
        shutil.copytree(copy / studies, package / studies)
    run("git", "init", "-q", cwd=copy)
    run("git", "add", ".", cwd=copy)
    env = os.environ | {
        "PATH": f"{own.parent}:{os.environ['PATH']}",
        "SIGNORINI_CACHE": str(tmp_path / "cache"),
    }
    where = run(own, "-c", "import signorini; print(signorini.__file__)", cwd=copy, env=env)
    assert "site-packages" in where
    print(run(own, "-m", "pytest", "-q", cwd=copy, env=env)[-1500:])
