"""The C examples: warning-free, and bit for bit what the stepper does from Python."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
from compilers import STRICT, compiler, run
from signorini.models import bouncing_ball, hopper, slope

ROOT = Path(__file__).resolve().parent.parent


def built(tmp_path: Path) -> Path:
    """The folder of examples with everything made, as its README says."""
    folder = tmp_path / "examples"
    shutil.copytree(ROOT / "examples", folder)
    sg.generate(hopper.model(), folder / "hopper_c")
    flags = [f for f in STRICT if not f.startswith("-std")]
    run(compiler("make"), f"CC={compiler('gcc')}", f"CFLAGS=-O1 {' '.join(flags)}", cwd=folder)
    return folder


def numbers(text: str, name: str) -> np.ndarray:
    return np.array([float(x) for x in re.findall(rf"\b{name} ([-\d.e+]+)", text)])


def test_examples(tmp_path: Path) -> None:
    folder = built(tmp_path)
    stepper = sg.load(folder / "hopper_c")
    closed = stepper.simulate(t_end=6, dt=1e-3, inputs=hopper.controller())
    text = run("./controller", cwd=folder)
    # NumPy's arc sine is not libm's to the last bit
    np.testing.assert_allclose(numbers(text, "x"), closed["x"][500::500], rtol=1e-9)
    np.testing.assert_allclose(numbers(text, "y"), closed["y"][500::500], rtol=1e-9)

    thrust = np.zeros((600, 2))
    thrust[300:, 0] = 30.0
    driven = stepper.simulate(t_end=0.6, dt=1e-3, inputs=thrust, max_halvings=0, every=10)
    text = run("./inputs", cwd=folder)
    np.testing.assert_array_equal(numbers(text, "y"), driven["y"][1:])
    np.testing.assert_array_equal(numbers(text, "P_N"), driven["ground.P_N"][1:])
    assert driven["ground.P_N"].max() > 0

    on, restored, forked = numbers(run("./save_restore_fork", cwd=folder), "y")
    free = stepper.simulate(t_end=0.5, dt=1e-3, max_halvings=0)
    assert on == restored == free["y"][-1]
    assert forked != on

    text = run("./real_time", "0.4", cwd=folder)
    assert "cycles: 400, steps not solved in time: 0" in text
    assert "the hopper is at t = 0.400 s" in text


@pytest.mark.parametrize(
    "sanitizer",
    ["address,undefined", pytest.param("thread", marks=pytest.mark.thorough)],
)
def test_models_and_instances_in_threads(sanitizer: str, tmp_path: Path) -> None:
    """Three steppers, two of one model, four instances of each, all at once: as one by one."""
    steppers = (("ball_2", bouncing_ball, 2), ("ball_3", bouncing_ball, 3), ("slope_3", slope, 3))
    body = ["#include <pthread.h>", "#include <stdio.h>", "#include <string.h>"]
    sources = []
    for name, module, stages in steppers:
        folder = sg.generate(module.model(), tmp_path / name, stages=stages, prefix=name)
        sources.append(folder / f"{name}.c")
        body += [
            f'#include "{name}/{name}.h"',
            f"typedef struct {{ {name}_state s; {name}_work w; int status; }} {name}_run;",
            f"static void *{name}_go(void *p) {{",
            f"    {name}_run *r = p; const {name}_params par = {name}_default_params();",
            f"    const {name}_options opt = {name}_default_options(); {name}_info info;",
            f"    const {name}_real u[1] = {{0.0}}; {name}_real t[1], q[8], v[8]; int k;",
            f"    {name}_initial_state(&par, t, q, v);",
            f"    r->status = {name}_init(&r->s, &par, &opt, t[0], q, v);",
            "    for (k = 0; k < 150 && r->status <= 2; ++k)",
            f"        r->status = {name}_step(&r->s, &r->w, &info, &par, &opt, u, 1e-2);",
            "    return NULL;",
            "}",
            f"static {name}_run {name}_alone, {name}_all[4];",
        ]
    body.append("int main(void) { pthread_t threads[12]; int k, n = 0, same = 1;")
    for name, _, _ in steppers:
        body.append(f"    {name}_go(&{name}_alone);")
        body.append(
            f"    for (k = 0; k < 4; ++k) pthread_create(&threads[n++], NULL, {name}_go, "
            f"&{name}_all[k]);"
        )
    body.append("    for (k = 0; k < n; ++k) pthread_join(threads[k], NULL);")
    for name, _, n_q in (("ball_2", 0, 3), ("ball_3", 0, 3), ("slope_3", 0, 2)):
        body.append(
            f"    for (k = 0; k < 4; ++k) same = same && {name}_all[k].status <= 2 && "
            f"memcmp({name}_all[k].s.q, {name}_alone.s.q, {n_q} * sizeof(double)) == 0;"
        )
    body.append('    puts(same ? "as alone" : "not as alone"); return 0; }')
    (tmp_path / "main.c").write_text("\n".join(body) + "\n")
    flags = ("-std=c99", "-O1", "-g", f"-fsanitize={sanitizer}", "-fno-sanitize-recover=all")
    run(compiler("gcc"), *flags, "-pthread", "main.c", *sources, "-o", "all", "-lm", cwd=tmp_path)
    assert run("./all", cwd=tmp_path) == "as alone\n"
