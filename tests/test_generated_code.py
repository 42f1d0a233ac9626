"""The generated C as a product: warnings, symbols, sanitizers, reproducibility, golden files."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import signorini as sg
import sympy as sp
from compilers import (
    ALLOWED,
    FIRMWARE,
    GOLDEN,
    MODELS,
    SMALL,
    STRICT,
    all_of,
    compiler,
    identify,
    run,
)
from signorini.codegen.c.build import emit_spec, runtime_order, runtime_source
from signorini.codegen.c.emit import (
    RUNTIME_BEGIN,
    RUNTIME_END,
    TABLES_BEGIN,
    TABLES_END,
    render,
)
from signorini.codegen.c.loops import Entry
from signorini.codegen.c.printer import PRECISIONS, statements
from signorini.codegen.frontend.validate import freeze
from signorini.codegen.graph import Graph, Operations
from signorini.models import bouncing_ball, box_in_space, slope
from trap_models import (
    mixed_contacts,
    one_coordinate,
    rheonomic,
)

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize(
    "make", all_of(MODELS, (slope.model, rheonomic, mixed_contacts)), ids=identify
)
def test_no_warnings_and_only_libm(
    make: Callable[[], sg.Model], precision: str, tmp_path: Path
) -> None:
    model = make()
    folder = sg.generate(model, tmp_path / "c", stages=3, precision=precision)
    assert needed_of(model, folder) <= libm(precision)


@pytest.mark.parametrize(
    ("make", "precision"),
    [
        (mixed_contacts, "double"),
        (slope.model, "float"),
        (slope.model, "extended"),
        (one_coordinate, "double"),
        pytest.param(rheonomic, "double", marks=pytest.mark.thorough),
        pytest.param(box_in_space.model, "double", marks=pytest.mark.thorough),
    ],
)
def test_no_warnings_in_located_steps(
    make: Callable[[], sg.Model], precision: str, tmp_path: Path
) -> None:
    model = make()
    folder = sg.generate(model, tmp_path / "c", stages=2, precision=precision, events="located")
    assert needed_of(model, folder) <= libm(precision)


@pytest.mark.parametrize(
    ("make", "precision"),
    [
        (slope.model, "double"),
        pytest.param(mixed_contacts, "float", marks=pytest.mark.thorough),
        pytest.param(one_coordinate, "double", marks=pytest.mark.thorough),
        pytest.param(box_in_space.model, "double", marks=pytest.mark.slow),
    ],
)
def test_no_warnings_in_derivatives(
    make: Callable[[], sg.Model], precision: str, tmp_path: Path
) -> None:
    model = make()
    folder = sg.generate(model, tmp_path / "c", stages=2, precision=precision, derivatives=True)
    assert needed_of(model, folder) <= libm(precision)


def libm(precision: str) -> set[str]:
    """Functions that a stepper may need."""
    suffix = {"double": "", "float": "f", "extended": "l"}[precision]
    memory = {name for name in ALLOWED if name.startswith("mem")}
    return {name + suffix for name in ALLOWED - memory} | memory


def needed_of(model: sg.Model, folder: Path) -> set[str]:
    """What all files need of others, compiled under the strictest flags of two compilers, as C99,
    C11 and beside C++."""
    source = folder / f"{model.name}.c"
    functions = folder / f"{model.name}_model.c"
    # gcc finds what depends on the flow of data only when it optimises; clang does not need to.
    for name, how in (("gcc", ("-O2", "-c")), ("clang", ("-fsyntax-only",))):
        for file in (source.name, functions.name, "example.c"):
            run(compiler(name), *STRICT, *how, file, cwd=folder)
    newer = [f.replace("c99", "c11") for f in STRICT]
    run(compiler("gcc"), *newer, "-fsyntax-only", source.name, functions.name, cwd=folder)
    header = source.with_suffix(".h").name
    (folder / "user.cpp").write_text(
        f'#include <cmath>\n#include "{header}"\nint main() {{ return 0; }}\n'
    )
    run(
        compiler("g++"),
        "-std=c++98",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-c",
        "user.cpp",
        cwd=folder,
    )
    return {name for file in (source, functions) for name in _needed(file, source.stem, folder)}


def _needed(file: Path, prefix: str, folder: Path) -> set[str]:
    """What a file needs of others; what it defines begins with the prefix, and is no data."""
    symbols = run("nm", file.with_suffix(".o").name, cwd=folder).splitlines()
    defined = {line.split()[-1]: line.split()[-2] for line in symbols if " U " not in line}
    assert all(
        name.startswith(prefix + "_")
        for name, kind in defined.items()
        if kind.isupper() and kind != "R"
    )
    # no writable data; constants that hold addresses are relocated where code may stand anywhere
    sections = run("nm", "-f", "sysv", file.with_suffix(".o").name, cwd=folder).splitlines()
    where = {
        line.split("|")[0].strip(): line.split("|")[-1].strip()
        for line in sections
        if line.count("|") == 6
    }
    writable = {name for name, kind in defined.items() if kind in "BDbdC"}
    assert not {name for name in writable if not where[name].startswith(".data.rel.ro")}
    return {line.split()[-1] for line in symbols if " U " in line}


@pytest.mark.parametrize("make", all_of(MODELS, (slope.model, rheonomic)), ids=identify)
def test_sanitizers(make: Callable[[], sg.Model], tmp_path: Path) -> None:
    model = make()
    folder = sg.generate(model, tmp_path / "c", stages=2)
    source = f"{model.name}.c"
    flags = "-std=c99 -O1 -g -fno-sanitize-recover=all"
    flags += " -fsanitize=address,undefined,float-divide-by-zero"
    run(compiler("gcc"), *flags.split(), "-o", "checked", "example.c", source, "-lm", cwd=folder)
    lines = run("./checked", cwd=folder).splitlines()
    grid = {"dt": 1e-3, "t_end": 1.0} | model.suggested
    assert len(lines) == 1 + min(1000, round(grid["t_end"] / grid["dt"])) // 10
    assert "nan" not in lines[-1]


@pytest.mark.parametrize("events", ["captured", "located"])
@pytest.mark.parametrize(
    "make",
    [
        pytest.param(m, marks=pytest.mark.thorough if m in SMALL else pytest.mark.slow)
        for m in FIRMWARE
    ],
    ids=identify,
)
def test_static_analysis(make: Callable[[], sg.Model], events: str, tmp_path: Path) -> None:
    """gcc's analyser and cppcheck find nothing; of MISRA C:2012 only the deviations in docs."""
    folder = sg.generate(make(), tmp_path / "c", stages=3, prefix="m", events=events)
    both = ("m.c", "m_model.c")
    out = run(compiler("gcc"), "-std=c99", "-O1", "-fanalyzer", "-c", *both, cwd=folder)
    assert "warning" not in out
    check = (compiler("cppcheck"), "--std=c99", "--quiet", "--suppress=missingIncludeSystem")
    enabled = "--enable=warning,performance,portability"
    run(*check, enabled, "--error-exitcode=3", *both, cwd=folder)
    reported = set(
        re.findall(r"misra-c2012-([0-9.]+)", run(*check, "--addon=misra", *both, cwd=folder))
    )
    page = (ROOT / "docs" / "misra.md").read_text()
    assert reported == set(re.findall(r"^\| ([0-9]+\.[0-9]+) \|", page, re.MULTILINE))


def test_two_models_and_two_stage_counts_in_one_program(tmp_path: Path) -> None:
    names = []
    for make, stages, prefix in (
        (slope.model, 2, "slope_2"),
        (slope.model, 3, "slope_3"),
        (bouncing_ball.model, 3, "ball"),
    ):
        folder = sg.generate(make(), tmp_path / prefix, stages=stages, prefix=prefix)
        names.append(folder / f"{prefix}.c")
    body = "".join(f'#include "{n.parent.name}/{n.stem}.h"\n' for n in names)
    stages = " + ".join(f"{n.stem}_meta().stages" for n in names)
    body += f"int main(void) {{ return {stages} - 8; }}\n"
    (tmp_path / "main.c").write_text(body)
    run(compiler("gcc"), *STRICT, "-o", "all", "main.c", *names, "-lm", cwd=tmp_path)
    assert run("./all", cwd=tmp_path) == ""  # its status is 0


def test_runtime_stands_verbatim_in_the_output() -> None:
    text = render(emit_spec(freeze(slope.model())))["slope.c"]
    types, tables_and_rest = text.split(RUNTIME_BEGIN)[1].split(RUNTIME_END)[0].split(TABLES_BEGIN)
    rest = tables_and_rest.split(TABLES_END)[1]
    assert f"{types.strip()}\n\n{rest.strip()}" == runtime_source(runtime_order()).strip()


def _generated_part(files: dict[str, str]) -> dict[str, str]:
    """Files with the runtime cut out: it is compared with runtime/c."""
    kept = {}
    for name, text in files.items():
        if RUNTIME_BEGIN in text:
            tables = text.split(TABLES_BEGIN)[-1].split(TABLES_END)[0] if TABLES_END in text else ""
            before, after = text.split(RUNTIME_BEGIN)[0], text.split(RUNTIME_END)[1]
            text = f"{before}{RUNTIME_BEGIN}\n{tables}\n{RUNTIME_END}{after}"
        text = re.sub(r"(runtime +sha256 )[0-9a-f]{64}", r"\1-", text)
        text = re.sub(r'("?(runtime|manifest)_hash"?(?: =|:) ")[0-9a-f]{64}', r"\1-", text)
        kept[name] = text
    return kept


def _pinned() -> bool:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = dict(line.split("==") for line in lines if "==" in line)
    return pins["sympy"] == sp.__version__ and pins["casadi"] == ca.__version__


@pytest.mark.parametrize("make", GOLDEN, ids=identify)
def test_golden_steppers(make: Callable[[], sg.Model], request: pytest.FixtureRequest) -> None:
    if not _pinned():
        pytest.skip("SymPy or CasADi differ from constraints.txt: the text may differ")
    spec = emit_spec(freeze(make()), stages=3)
    files = render(spec)
    folder = ROOT / "generated" / spec.prefix
    if request.config.getoption("--update-golden"):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for name, text in files.items():
            (folder / name).write_bytes(text.encode())
    stored = {p.name: p.read_text() for p in folder.iterdir()} if folder.is_dir() else {}
    command = (
        "if the change is intended run: pytest tests/test_generated_code.py --update-golden -n 0"
    )
    assert set(stored) == set(files), command
    expected, found = _generated_part(stored), _generated_part(files)
    for name in files:
        assert found[name] == expected[name], f"generated/{spec.prefix}/{name} differs; {command}"


def test_no_stale_golden_folder() -> None:
    assert {p.name for p in (ROOT / "generated").iterdir()} == {make().name for make in GOLDEN}


def test_same_bytes_for_any_hash_seed(tmp_path: Path) -> None:
    code = (
        "import sys; sys.path.insert(0, sys.argv[2]); import signorini as sg, trap_models as t\n"
        "from signorini.models import slider_crank\n"
        "for m in (slider_crank.model, t.rheonomic, t.mixed_contacts):\n"
        "    m = m(); sg.generate(m, sys.argv[1] + '/' + m.name, stages=3)\n"
    )
    outputs = []
    for seed in ("0", "1", "42"):
        target = tmp_path / seed
        env = os.environ | {"PYTHONHASHSEED": seed}
        subprocess.run(
            [sys.executable, "-c", code, str(target), str(ROOT / "tests")], env=env, check=True
        )
        outputs.append(
            {
                str(p.relative_to(target)): p.read_bytes()
                for p in sorted(target.rglob("*"))
                if p.is_file()
            }
        )
    assert outputs[0] == outputs[1] == outputs[2]
    everything = b"".join(outputs[0].values())
    for forbidden in (str(tmp_path).encode(), str(ROOT).encode(), os.uname().nodename.encode()):
        assert forbidden not in everything


def _collide(names: tuple[str, str, str, str]) -> sg.Model:
    coordinates, parameters, inputs, contact = (x.split() for x in names)
    m = sg.Model("collide")
    q, h = m.coordinates(" ".join(coordinates))
    dq, dh = m.velocities
    values = (1.0, 2.0, 0.5, 1.5, 1.0, 0.1, 0.2, 0.3)
    w0, out, R, par, real, sin_q, u, i_fill = m.parameters(
        **dict(zip(parameters, values, strict=True))
    )
    m.inputs(" ".join(inputs))
    m.lagrangian = (
        w0 * dq**2 + out * dh**2 * (2 + sp.sin(q)) - R * sp.sin(q) * par - real * h * sin_q
    )
    m.force([u * sp.sin(q) * m.u[0], i_fill * m.u[1] * m.u[2]])
    m.contact(contact[0], g_N=h + 1, gamma_F=dq, mu=R)
    m.constraint(contact[1], q - 0.1 * sp.sin(m.time) - h**2)
    m.initial_state(q=[0, 0], v=[0.1, 0])
    return m


def test_temporaries_and_aliases_do_not_collide() -> None:
    """Names that the generated code uses itself, given by a user, change no bit of a run."""
    taken = ("q h", "w0 out R par real sin_q u i_fill", "v w L", "default for")
    plain = ("alpha beta", "p1 p2 p3 p4 p5 p6 p7 p8", "i1 i2 i3", "one two")
    one, other = (
        sg.build(_collide(names), stages=3).simulate(t_end=0.3, dt=0.01, inputs=[0.1, 0.2, 0.3])
        for names in (taken, plain)
    )
    np.testing.assert_array_equal(one.q, other.q)
    np.testing.assert_array_equal(one.P_N, other.P_N)
    assert np.ptp(one.q[:, 1]) > 1e-4


def test_text_of_the_user_cannot_leave_a_comment() -> None:
    m = sg.Model("hostile")
    (x,) = m.coordinates("x")
    (v,) = m.velocities
    (k,) = m.parameters(k=sg.par(1.0, unit="*/ int evil; /*", doc="a\n#error b \\ \u2192"))
    m.doc = "*/ #error */"
    m.lagrangian = v**2 / 2 - k * x**2
    m.initial_state(q=[1])
    assert len(sg.build(m).simulate(t_end=0.1, dt=0.05)) == 3


def _row_of_masses() -> sg.Model:
    m = sg.Model("row")
    x = m.coordinates(" ".join(f"x_{k}" for k in range(18)))
    v = m.velocities
    stiffness, grav = m.parameters(stiffness=300.0, grav=9.81)
    links = sum(stiffness * (b - a - 1) ** 2 / 2 for a, b in pairwise(x))
    m.lagrangian = sum(w**2 for w in v) / 2 - links - grav * sum(x)
    for k in (0, 17):
        m.contact(f"floor_{k}", g_N=x[k], e_N=0.5)
    m.initial_state(q=[0.2 + 1.02 * k for k in range(18)])
    return m


def test_rows_that_differ_in_indices_alone_are_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    """Written out they take the same steps, to the last bit."""
    looped = sg.build(_row_of_masses(), stages=3)
    text = (looped.folder / "row.c").read_text()
    assert "    for (k = 0; k < 18; ++k) {\n        w->Q[36 + k] = w->q[k] + w->h * (" in text
    monkeypatch.setattr("signorini.codegen.c.loops._LEAST", 10**6)
    plain = sg.build(_row_of_masses(), stages=3)
    assert plain.folder != looped.folder
    one, other = (s.simulate(t_end=0.5, dt=5e-3) for s in (looped, plain))
    np.testing.assert_array_equal(one.q, other.q)
    np.testing.assert_array_equal(one.P_N, other.P_N)
    assert one.P_N.max() > 0


def test_runs_of_any_stride() -> None:
    """y[k] = a[2 k + 1] - b[5] for k = 0 ... 19, then one that does not go on."""
    a, b = ca.SX.sym("a", 41), ca.SX.sym("b")
    values = [a[2 * k + 1] - b for k in range(20)] + [a[0] - b]
    names = {a[k].element_hash(): f"a[{k}]" for k in range(41)} | {b.element_hash(): "b[5]"}
    targets = [f"y[{k}]" for k in range(21)]
    entries = {f"a[{k}]": Entry("a[{}]", k) for k in range(41)}
    entries |= {f"y[{k}]": Entry("y[{}]", k) for k in range(21)} | {"b[5]": Entry("b[{}]", 5)}
    _, lines, operations = statements(
        Graph(Operations(values), names),
        targets,
        [""] * 21,
        "real",
        PRECISIONS["double"],
        set(),
        entries,
    )
    loop = ["for (k = 0; k < 20; ++k) {", "    y[k] = a[1 + 2 * k] - b[5];", "}"]
    assert [line for group in lines for line in group] == [*loop, "y[20] = a[0] - b[5];"]
    assert operations == 21


def test_places_have_names() -> None:
    """In capitals; names that differ by capitals alone keep them."""
    m = sg.Model("two")
    x, X, phi = m.coordinates("x X phi")
    vx, vX, w = m.velocities
    m.lagrangian = (vx**2 + vX**2 + w**2) / 2
    m.constraint("rod", [x - phi, X + phi])
    m.constraint("pin", x + 2 * X)
    m.contact("wall", g_N=x, gamma_F=[vX])
    m.friction("rail", gamma_F=[vx], bound=1)
    m.initial_state(q=[0, 0, 0], v=[0, 0, 0])
    groups = dict(emit_spec(freeze(m)).indices)
    assert groups["coordinates in q"] == (("Q_x", 0), ("Q_X", 1), ("Q_PHI", 2))
    assert groups["contacts"] == (("CONTACT_WALL", 0), ("CONTACT_RAIL", 1))
    assert groups["first rows of constraints in g, and in P"] == (("G_ROD", 0), ("G_PIN", 2))
    # P holds g, gamma, N, F in turn
    assert groups["their first rows in P"] == (("P_WALL_N", 3), ("P_WALL_F", 4), ("P_RAIL_F", 5))


def test_functions_that_are_zero_are_left_out(tmp_path: Path) -> None:
    stepper = sg.build(slope.model())
    folder = sg.generate(slope.model(), tmp_path / "c")
    header = (folder / "slope.h").read_text()
    assert "void slope_f(" not in header
    assert re.search(r"Zero for this model, and left out: .*\bf, ", header)
    np.testing.assert_array_equal(stepper.evaluate("f", 0.0, [0.1] * 2), [0, 0])
    assert stepper.evaluate("L_q_v", 0.0, np.zeros((4, 2))).shape == (4, 2, 2)
