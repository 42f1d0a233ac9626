"""Generated folders, the cache, names: nothing found is believed, nothing is half written."""

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from command import signorini
from compilers import compiler, run
from signorini.models import bouncing_ball
from signorini.runtime import compile as compiling
from signorini.workflow import drift
from trap_models import mixed_contacts

CLI = [sys.executable, "-m", "signorini"]


def point(name: str = "point") -> sg.Model:
    m = sg.Model(name)
    _x, y = m.coordinates("x y")
    vx, vy = m.velocities
    (mass,) = m.parameters(mass=1.0)
    m.lagrangian = mass * (vx**2 + vy**2) / 2 - 9.81 * mass * y
    m.contact("floor", g_N=y, gamma_F=vx, mu=0.3)
    m.initial_state(q=[0, 1])
    return m


def falls(stepper: sg.Stepper) -> bool:
    """One second of free fall from 1 m ends on the floor."""
    traj = stepper.simulate(t_end=0.2, dt=0.01)
    return bool(traj.q[-1, 1] == pytest.approx(1 - 9.81 * 0.02, abs=1e-12))


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SIGNORINI_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


# --- the folder ----------------------------------------------------------------------------------


@pytest.mark.parametrize("prefix", ["../precious", "/etc/passwd", "a/b", "..", 5, None])
def test_a_manifest_names_no_files(prefix: object, tmp_path: Path) -> None:
    (tmp_path / "precious.c").write_text("int mine;")
    out = tmp_path / "out"
    out.mkdir()
    (out / "manifest.json").write_text(json.dumps({"prefix": prefix, "generator": "signorini"}))
    folder = sg.generate(point(), out, stages=2)
    assert (tmp_path / "precious.c").read_text() == "int mine;"
    assert json.loads((folder / "manifest.json").read_text())["prefix"] == "point"


def test_files_of_others_are_neither_written_over_nor_lost(tmp_path: Path) -> None:
    out = tmp_path / "out"
    (out / "notes").mkdir(parents=True)
    (out / "notes" / "mine.txt").write_text("kept")
    (out / "main.c").write_text("int main(void) { return 0; }")
    sg.generate(point(), out, stages=2)
    sg.generate(point(), out, stages=3, prefix="other")
    assert (out / "notes" / "mine.txt").read_text() == "kept"
    assert (out / "main.c").is_file()
    assert {p.name for p in out.glob("*.h")} == {"other.h", "other_unity.h"}  # no older ones
    (out / "third.c").write_text("/* by hand */")
    with pytest.raises(sg.GenerationError, match=r"third\.c that this generator did not write"):
        sg.generate(point(), out, stages=2, prefix="third")
    assert (out / "third.c").read_text() == "/* by hand */"
    assert falls(sg.load(out))


def test_a_link_is_not_written_through(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.write_text("signorini is what I call it")
    out = tmp_path / "out"
    out.mkdir()
    (out / "point.c").symlink_to(mine)
    with pytest.raises(sg.GenerationError, match=r"point\.c"):
        sg.generate(point(), out, stages=2)
    assert mine.read_text() == "signorini is what I call it"


@pytest.mark.parametrize("exchange", [True, False])
def test_a_killed_generation_can_be_repeated(
    exchange: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed at any file: the folder is the old one or refused by name, and mended by a repeat."""
    out = tmp_path / "out"
    sg.generate(point(), out, stages=2)
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    code = (
        "import os, sys\n"
        "from pathlib import Path\n"
        "import signorini as sg\n"
        "from signorini.codegen.c import emit\n"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from test_files import point\n"
        "count, at = [0], int(sys.argv[1])\n"
        f"if not {exchange}:\n"
        "    emit._exchange = lambda one, other: False\n"
        "def dying(original):\n"
        "    def call(self, *a, **k):\n"
        "        count[0] += 1\n"
        "        if count[0] == at:\n"
        "            os._exit(9)\n"
        "        return original(self, *a, **k)\n"
        "    return call\n"
        "Path.write_bytes = dying(Path.write_bytes)\n"
        "Path.replace = dying(Path.replace)\n"
        f"sg.generate(point(), {str(out)!r}, stages=3, prefix='new')\n"
    )
    died = 0
    for at in (1, 3, 8, 10, 13, 16):
        ended = subprocess.run([sys.executable, "-c", code, str(at)], check=False)
        if ended.returncode == 0:
            break
        died += 1
        now = {p.name: p.read_bytes() for p in out.iterdir()}
        if now != before:
            assert not exchange
            with pytest.raises(sg.RunError, match=r"generate it again|no manifest"):
                sg.load(out)
        sg.generate(point(), out, stages=2)
        assert {p.name: p.read_bytes() for p in out.iterdir()} == before
        assert not list(tmp_path.glob(".signorini-*"))  # nothing hidden stays
    assert died >= 3


def test_drift_sees_bytes(tmp_path: Path) -> None:
    model = point()
    out = sg.generate(model, tmp_path / "out", stages=2)
    assert not drift(model, out)
    text = (out / "point.c").read_bytes()
    (out / "point.c").write_bytes(text.replace(b"\n", b"\r\n"))
    assert drift(model, out)
    (out / "point.c").write_bytes(text.replace(b"par.mass = 1.0;", b"par.mass = 1.0 +\n0;"))
    assert "par.mass" in drift(model, out)
    (out / "point.c").write_bytes(text)
    (out / "math.h").write_text("#define sin cos\n")
    assert "hides a header" in drift(model, out)


# --- the cache -----------------------------------------------------------------------------------


def test_damaged_libraries_and_sources_are_made_again(cache: Path) -> None:
    model = point()
    assert falls(sg.build(model, stages=2))
    (library,) = cache.rglob("*.so")
    for content in (b"", b"\x7fELF truncated", library.read_bytes()[:5000]):
        library.unlink()  # the loaded one keeps its own bytes
        library.write_bytes(content)
        assert falls(sg.build(model, stages=2))
    (source,) = cache.rglob("point.c")
    source.write_text(source.read_text()[:2000])
    library.unlink()
    assert falls(sg.build(model, stages=2))


def test_a_library_of_another_machine_is_made_again(cache: Path) -> None:
    """Its hash is right, but the system cannot load it."""
    import hashlib

    sg.build(point(), stages=2)
    (library,) = cache.rglob("*.so")
    library.unlink()
    library.write_bytes(b"of another machine")
    library.with_suffix(".sha256").write_text(hashlib.sha256(b"of another machine").hexdigest())
    assert falls(sg.build(point(), stages=2))


def test_a_header_beside_the_sources_takes_no_part(cache: Path, tmp_path: Path) -> None:
    """Neither in the folder where it lies nor in honest ones that share the cache."""
    for name in ("bad", "good"):
        sg.generate(point(), tmp_path / name, stages=2)
    (tmp_path / "bad" / "math.h").write_text("#error taken\n")
    (tmp_path / "bad" / "stdlib.h").write_text("#error taken\n")
    assert falls(sg.load(tmp_path / "bad"))
    assert falls(sg.load(tmp_path / "good"))


def test_a_default_hides_nothing_from_the_key() -> None:
    plain = b"par.mass = 1.0;\npar.k = -2.5e-3F;\n"
    assert compiling._without_defaults(plain) == b"\n\n"
    for hidden in (b"par.mass = 1.0 +\n#include <evil.h>\n0;", b"par.mass = sin(1.0);"):
        assert compiling._without_defaults(hidden) == hidden


def test_two_processes_share_one_compilation(cache: Path, tmp_path: Path) -> None:
    """A compiler that counts its calls, and takes its time."""
    count = tmp_path / "calls"
    script = tmp_path / "cc"
    script.write_text(
        f'#!/bin/sh\ncase "$*" in *--version*) echo counting; exit 0;; esac\n'
        f'echo x >> {count}\nsleep 1\nexec {compiler("gcc")} "$@"\n'
    )
    script.chmod(0o755)
    code = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import signorini as sg\nfrom test_files import point, falls\n"
        "assert falls(sg.build(point(), stages=2))\n"
    )
    env = os.environ | {"CC": str(script)}
    both = [subprocess.Popen([sys.executable, "-c", code], env=env) for _ in range(2)]
    assert [p.wait() for p in both] == [0, 0]
    # stepper, model functions, drivers of batches and of controllers, and their library: once
    assert count.read_text().count("x") == 5


def test_an_unbalanced_compiler_is_one_message(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "gcc 'x")
    with pytest.raises(sg.CompilerError, match="CC="):
        sg.build(point(), stages=2)


@pytest.mark.parametrize(
    "damage",
    [
        {"structs": {}},
        {"structs": {"params": [{"name": "x", "type": "real", "extent": -3}]}},
        {"statuses": 5},
        {"functions": []},
        {"precision": []},
        {"sizes": None},
        {"contacts": "many"},
        {"prefix": "../x"},
    ],
)
def test_damaged_manifests_are_one_message(damage: dict[str, object], tmp_path: Path) -> None:
    folder = sg.generate(point(), tmp_path / "out", stages=2)
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps(manifest | damage))
    with pytest.raises(sg.RunError, match=r"manifest|generate it again"):
        sg.load(folder)
    (folder / "manifest.json").write_text("[" * 100_000)
    with pytest.raises(sg.RunError, match="generate it again"):
        sg.load(folder)


# --- names ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["example", "float", "math", "stddef", "features", "manifest"])
def test_models_called_like_files(name: str, tmp_path: Path) -> None:
    """Refused by name; with a prefix the model is as good as any."""
    with pytest.raises((sg.GenerationError, sg.ModelError), match=name):
        sg.generate(point(name), tmp_path / "out")
    assert not (tmp_path / "out").exists()
    if name != "float":
        assert falls(sg.build(point(name), stages=2, prefix="body"))


@pytest.mark.parametrize("prefix", ["m", "all", "test", "clean", "install"])
def test_prefixes_that_tools_know(prefix: str, tmp_path: Path) -> None:
    folder = sg.generate(point(), tmp_path / "out", stages=2, prefix=prefix)
    run(compiler("make"), cwd=folder)
    run(compiler("cmake"), "-S", ".", "-B", "build", cwd=folder)
    run(compiler("cmake"), "--build", "build", cwd=folder)
    assert run("./example", cwd=folder) == run("./build/example", cwd=folder)


@pytest.mark.parametrize(
    "name",
    [*("I", "complex", "B0", "B101", "PI", "near", "far", "min", "max", "POINT_N_Q", "POINT_x")],
)
def test_symbols_that_are_macros_elsewhere(name: str) -> None:
    m = sg.Model("point")
    with pytest.raises((sg.GenerationError, sg.ModelError), match=name):
        (x,) = m.coordinates(name)
        m.lagrangian = m.velocities[0] ** 2 / 2 - x**2
        m.initial_state(q=[1])
        sg.build(m, stages=2)


def test_two_steppers_in_one_unit(tmp_path: Path) -> None:
    """Of different forms and precisions, three in a row, and they run."""
    made = (("one", "double"), ("two", "float"), ("three", "double"))
    for k, (name, precision) in enumerate(made):
        sg.generate(point(name), tmp_path / name, stages=2 + k, precision=precision)
    body = "#include <stdio.h>\n" + "".join(
        f'#include "{name}/{name}.c"\n#include "{name}/{name}_model.c"\n' for name, _ in made
    )
    calls = []
    for name, _ in made:
        body += f"static {name}_work {name}_w;\n"
        calls.append(
            f"{{ {name}_state s; {name}_info i; {name}_params p = {name}_default_params();"
            f" {name}_options o = {name}_default_options(); {name}_real t[1], q[2], v[2];"
            f" {name}_initial_state(&p, t, q, v);"
            f" if ({name}_init(&s, &p, &o, t[0], q, v) > 2) return 1;"
            f" if ({name}_step(&s, &{name}_w, &i, &p, &o, NULL, ({name}_real)0.1) > 2) return 2;"
            f' printf("%.5f\\n", (double)s.q[1]); }}'
        )
    (tmp_path / "unit.c").write_text(body + f"int main(void) {{ {' '.join(calls)} return 0; }}\n")
    run(
        compiler("gcc"), "-std=c99", "-Wall", "-Werror", "-o", "unit", "unit.c", "-lm", cwd=tmp_path
    )
    # each falls by g h^2 / 2 in the step
    assert run("./unit", cwd=tmp_path).split() == ["0.95095"] * 3


def test_no_line_is_longer_than_c99_promises(tmp_path: Path) -> None:
    """4,095 characters in a logical source line, also with hundreds of contacts."""
    m = sg.Model("many", symbols="casadi")
    x, y = m.coordinates("x y")
    m.lagrangian = sum(v**2 for v in m.velocities) / 2
    for k in range(300):
        m.contact(f"c{k}", g_N=y + x * k)
    m.initial_state(q=[1, 1])
    folder = sg.generate(m, tmp_path / "out", stages=2)
    for path in (*folder.glob("*.c"), *folder.glob("*.h")):
        logical = path.read_text().replace("\\\n", "")
        assert max(map(len, logical.splitlines())) < 4095


def test_numbers_beyond_single_precision_are_named() -> None:
    m = sg.Model("big")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    (k,) = m.parameters(k=1e40)
    m.lagrangian = v**2 / 2 - k * 1e-40 * x**2
    m.initial_state(q=[1])
    with pytest.raises(sg.ModelError, match=r"parameter 'k'.*1e.40"):
        sg.build(m, precision="float")
    m = sg.Model("big")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    m.lagrangian = v**2 / 2 - 1e39 * x**2
    m.initial_state(q=[1])
    with pytest.raises(sg.GenerationError, match=r"e\+39.*single precision"):
        sg.build(m, precision="float")


# --- the command line ----------------------------------------------------------------------------


def call(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return signorini(cwd, *words)


def test_files_with_several_models_and_helpers(tmp_path: Path) -> None:
    (tmp_path / "helper.py").write_text("MASS = 2\n")
    (tmp_path / "mine.py").write_text(
        "from __future__ import annotations\n"
        "from dataclasses import dataclass\n"
        "import signorini as sg\n"
        "@dataclass\nclass P:\n    m: float = 1\n"
        "def first():\n    import helper\n    m = sg.Model('first'); x, = m.coordinates('x')\n"
        "    m.lagrangian = helper.MASS * m.velocities[0]**2; m.initial_state(q=[1]); return m\n"
        "def second():\n    return first()\n"
        "made = first()\n"
    )
    refused = call("show", "mine.py", cwd=tmp_path)
    assert refused.returncode == 1
    assert "first, second, made: say which, mine.py:first" in " ".join(refused.stderr.split())
    for name in ("first", "second", "made"):
        assert call("show", f"mine.py:{name}", cwd=tmp_path).returncode == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--set", "mass=1_0"), "mass=1_0"),
        (("--set", "mass=١"), "mass="),
        (("--dt", "1_0e-3"), "dt"),
        (("--tol", "1"), "tol"),
        (("--out", "run.xyz"), ".xyz"),
        (("--plot", "/proc/foo.png"), "/proc/foo.png"),
        (("--dt", "0.5"), "dt = 0.5 is larger"),
    ],
)
def test_one_message_each(words: tuple[str, ...], message: str, tmp_path: Path) -> None:
    result = call("run", "bouncing_ball", "--t-end", "0.1", *words, cwd=tmp_path)
    assert result.returncode in (1, 2)
    assert "Traceback" not in result.stderr
    assert message in result.stderr + result.stdout


def test_runs_to_one_file_do_not_meet(tmp_path: Path) -> None:
    """A link with the name that a run once used for its unfinished file stays what it is."""
    mine = tmp_path / "mine"
    mine.write_text("mine")
    (tmp_path / ".p.npz.part").symlink_to(mine)
    words = [*CLI, "run", "bouncing_ball", "--t-end", "0.1", "--out", "p.npz"]
    both = [subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [p.wait() for p in both] == [0, 0]
    assert mine.read_text() == "mine"
    assert sorted(p.name for p in tmp_path.iterdir()) == [".p.npz.part", "mine", "p.npz"]
    with np.load(tmp_path / "p.npz") as data:
        assert data["q"].shape == (11, 3)


def test_an_interrupted_batch_keeps_what_is_done(tmp_path: Path) -> None:
    """Ctrl-C ends it within a second; finished runs are whole, others end where they were."""
    code = (
        f"import signal, sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        # a parent in the background (nohup, &) leaves the signal ignored
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import numpy as np, signorini as sg\nfrom test_files import point\n"
        "s = sg.build(point(), stages=2)\nprint('ready', flush=True)\n"
        "try:\n"
        "    s.simulate_batch(t_end=1e5, dt=1e-2, every=10**6,\n"
        "                     parameters={'mass': np.linspace(1, 2, 64)})\n"
        "except KeyboardInterrupt as e:\n"
        "    print(len(e.batch), int(e.batch.steps.max()), flush=True)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=tmp_path
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready"
    time.sleep(0.5)
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    try:
        out, _ = process.communicate(timeout=120)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    waited = time.monotonic() - begin
    assert process.returncode == 0
    runs, steps = map(int, out.split())
    assert runs == 64
    assert 0 < steps < 10**7
    assert waited < 30  # one second where nothing else runs


def test_a_clone_beside_a_script_does_not_hide_the_package(tmp_path: Path) -> None:
    """An editable install comes before an empty namespace package of the clone's folder."""
    root = Path(sg.__file__).resolve().parent.parent
    if not (root / "pyproject.toml").is_file():
        pytest.skip("needs an editable install: pip install -e .")
    (tmp_path / "signorini").symlink_to(root)
    code = "import signorini; print(signorini.Model.__module__)"
    assert run(sys.executable, "-c", code, cwd=tmp_path).startswith("signorini.codegen")


@pytest.mark.parametrize("make", [bouncing_ball.model, mixed_contacts], ids=["sympy", "casadi"])
def test_models_survive_a_process_pool(make: Callable[[], sg.Model], tmp_path: Path) -> None:
    """The model that comes out of another process gives the same C."""
    model = make()
    again = pickle.loads(pickle.dumps(model))
    for m, folder in ((model, "one"), (again, "two"), (copy.deepcopy(model), "three")):
        sg.generate(m, tmp_path / folder, stages=2)
    files = [p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*") if p.is_file()]
    assert len(files) > 5
    for name in files:
        text = (tmp_path / "one" / name).read_bytes()
        assert text == (tmp_path / "two" / name).read_bytes(), name
        assert text == (tmp_path / "three" / name).read_bytes(), name


def test_errors_survive_a_process_pool() -> None:
    Case = Callable[[], Exception]
    cases: tuple[Case, ...] = (
        lambda: sg.ModelError("m", "e", "p", "r"),
        lambda: sg.GenerationError("g"),
        lambda: sg.RunError("r"),
        lambda: sg.CompilerError("c"),
    )
    for make in cases:
        error = make()
        again = pickle.loads(pickle.dumps(error))
        assert (type(again), str(again)) == (type(error), str(error))
