"""A model as a page: the stepper in WebAssembly, sliders, inputs, plots; in a browser."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import signorini as sg
from browser import find_browser
from command import signorini
from signorini.commands.ways import events_of
from signorini.locate import find_model
from signorini.models import bouncing_ball, box, box_in_space, pendulum_with_wall, servo
from signorini.runtime.compile import find_wasm_compiler
from signorini.runtime.errors import CompilerError
from signorini.web import page_sources, write_page

Build = Callable[..., sg.Stepper]
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


def shown(page: Path) -> dict[str, Any]:
    """The numbers of a page."""
    found = re.search(r"^const M = (.*);$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert found is not None
    return dict(json.loads(found[1]))


@contextmanager
def opened(page: Path, width: int = 1100, height: int = 700) -> Iterator[Any]:
    """A page in a browser that waits; nothing may be asked for, no error may be thrown."""
    manager, chromium = find_browser()
    errors: list[str] = []
    with manager as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": width, "height": height})
        tab.on("pageerror", lambda e: errors.append(str(e)))
        tab.on("request", lambda r: errors.append(r.url) if "file://" not in r.url else None)
        tab.goto(page.as_uri())
        tab.wait_for_function("window.signorini && C !== null && plots.length > 0")
        tab.evaluate("signorini.pause()")
        yield tab
        browser.close()
    assert errors == []


def test_without_a_compiler_for_it_the_page_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(CompilerError, match=r"no compiler for WebAssembly found\. Install one"):
        find_wasm_compiler()
    monkeypatch.setenv("SIGNORINI_WASM_CC", "absent-cc --target=wasm32")
    with pytest.raises(CompilerError, match="SIGNORINI_WASM_CC='absent-cc --target=wasm32' is not"):
        find_wasm_compiler()
    monkeypatch.setenv("SIGNORINI_WASM_CC", shutil.which("sh", path="/bin:/usr/bin") or "sh")
    assert len(find_wasm_compiler()) == 1


def test_what_cannot_be_a_page_is_refused(stepper: Build, tmp_path: Path) -> None:
    compiled = stepper(bouncing_ball.model, 3, events="located")
    with pytest.raises(sg.RunError, match="give a step size > 0 and a later end"):
        write_page(compiled, tmp_path / "a", dt=0.1, t_end=0.1)
    with pytest.raises(sg.RunError, match="radius"):
        write_page(compiled, tmp_path / "a", parameters={"radius": 1.0})
    assert not (tmp_path / "a").exists()
    said = signorini(tmp_path, "web", "bouncing_ball", "--error", "1e-6")
    assert said.returncode == 1
    assert "a page takes steps of one size: give --dt instead of --error" in said.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.thorough
def test_a_page_without_warnings_and_of_equal_bytes(stepper: Build, tmp_path: Path) -> None:
    """The C of the page under strict flags; written twice it has the same bytes, and few."""
    compiled = stepper(box.model, 3, events="located")
    page = write_page(compiled, tmp_path / "one", dt=5e-3)
    assert page == tmp_path / "one" / "index.html"
    again = write_page(compiled, tmp_path / "two" / "deep", dt=5e-3)
    assert page.read_bytes() == again.read_bytes()
    assert page.stat().st_size < 150_000
    (tmp_path / "file").write_text("")
    with pytest.raises(sg.RunError, match="the folder cannot be made"):
        write_page(compiled, tmp_path / "file" / "x", dt=5e-3)
    folder = tmp_path / "c"
    folder.mkdir()
    for name, text in page_sources(compiled).items():
        (folder / name).write_bytes(text)
    for compiler in ("gcc", "clang"):
        made = subprocess.run(
            [compiler, *STRICT, "-c", "web.c"], cwd=folder, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        assert made.returncode == 0, made.stderr


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("model", "stages", "dt", "n"),
    [
        (box.model, 3, 5e-3, 120),
        (bouncing_ball.model, 3, 1e-2, 120),
        (box_in_space.model, 2, 5e-3, 90),
    ],
)
def test_the_same_motion_as_elsewhere(
    model: Callable[[], sg.Model], stages: int, dt: float, n: int, stepper: Build, tmp_path: Path
) -> None:
    """Trajectories in the browser and from the shared library: equal but for another libm."""
    compiled = stepper(model, stages, events="located")
    page = write_page(compiled, tmp_path / "page", dt=dt, t_end=n * dt)
    native = compiled.simulate(dt=dt, t_end=n * dt, events="located")
    with opened(page) as tab:
        tab.click("#reset")
        for rows in (n // 3, n - n // 3):
            assert tab.evaluate(f"signorini.run({rows})") == rows
        assert tab.evaluate("signorini.t") == pytest.approx(n * dt, abs=1e-12)
        found = [tab.evaluate(f"signorini.{name}") for name in ("q", "v", "percussions")]
        energy = tab.evaluate("C.energy()")
        gaps = tab.evaluate("[...numbers(C.gaps(), M.gaps.length)]")
    np.testing.assert_allclose(found[0], native.q[-1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found[1], native.v[-1], rtol=0, atol=1e-8)
    last = [getattr(native, name)[-1] for name in ("P_g", "P_gamma", "P_N", "P_F")]
    np.testing.assert_allclose(found[2], np.concatenate(last), rtol=0, atol=1e-8)
    assert energy == pytest.approx(native.energy[-1], abs=1e-8)
    np.testing.assert_allclose(
        gaps, compiled.evaluate("g_N", native.t[-1:], native.q[-1:])[0], rtol=0, atol=1e-9
    )


@pytest.mark.thorough
def test_buttons_keys_and_fields(stepper: Build, tmp_path: Path) -> None:
    """A slide that a servo pushes: it steps, pauses, follows its input, starts where it is told."""
    compiled = stepper(servo.model, 3, events="located")
    page = write_page(compiled, tmp_path / "page", dt=1e-2, parameters={"mass": 2.0})
    m = shown(page)
    assert [p["name"] for p in m["par"]] == [p["name"] for p in compiled.manifest["parameters"]]
    with opened(page) as tab:
        tab.click("#reset")
        assert tab.evaluate("signorini.t") == 0
        for k in range(1, 4):
            tab.click("#step")
            assert tab.evaluate("signorini.t") == pytest.approx(k * 1e-2, abs=1e-15)
        assert tab.evaluate("signorini.q") == [0]
        # a key that is held down pushes: for a step the impulse is the servo's force, 10 N
        tab.keyboard.down("ArrowRight")
        assert tab.evaluate("[...numbers(C.inputs(), 1)]") == [1]
        tab.evaluate("signorini.run(10)")
        assert tab.evaluate("signorini.v")[0] == pytest.approx(10 * 10 * 1e-2 / 2.0, abs=1e-9)
        tab.keyboard.up("ArrowRight")
        assert tab.evaluate("[...numbers(C.inputs(), 1)]") == [0]
        # a parameter, by its field and beyond its slider; its bound holds
        mass = tab.get_by_label("mass, exactly", exact=True)
        mass.fill("50"), mass.press("Enter")
        assert tab.evaluate("numbers(C.parameters(), M.par.length)[0]") == 50
        assert tab.evaluate("document.querySelector('[aria-label=mass]').value") == "50"
        e_N = tab.get_by_label("e_N, exactly", exact=True)
        e_N.fill("7"), e_N.press("Enter")
        assert e_N.input_value() == "1"
        # a start; an empty field is the model's own
        start = tab.get_by_label("start of x", exact=True)
        start.fill("0.25"), start.press("Enter")
        assert tab.evaluate("[signorini.t, signorini.q[0]]") == [0, 0.25]
        start.fill("0.75"), start.press("Enter")  # beyond the stop
        assert "cannot start there: INCONSISTENT_START" in tab.inner_text("#says")
        assert tab.evaluate("signorini.run(5)") == 0
        start.fill(""), start.press("Enter")
        assert tab.evaluate("signorini.q") == [0] and not tab.is_visible("#says")
        # time goes on, more slowly where it is told to
        tab.select_option("#pace", "0.1")
        tab.click("#play")
        tab.wait_for_function("signorini.t > 0")
        tab.click("#play")
        stopped = tab.evaluate("signorini.t")
        tab.wait_for_timeout(200)
        assert tab.evaluate("signorini.t") == stopped
        tab.evaluate("document.activeElement.blur()")
        tab.keyboard.press("Space")
        tab.wait_for_function(f"signorini.t > {stopped}")


@pytest.mark.thorough
@pytest.mark.parametrize("width", [380, 1200])
def test_what_is_seen(width: int, stepper: Build, tmp_path: Path) -> None:
    """The contact has the colour of its state where it is; the plots are drawn; nothing is wider
    than the screen; in space a drag turns the picture."""
    compiled = stepper(bouncing_ball.model, 3, events="located")
    page = write_page(compiled, tmp_path / "page", dt=1e-2)
    colour = """() => {
        const place = points[M.contacts[0].first], ratio = devicePixelRatio;
        const at = [X(place[0]) * ratio, Y(place[1]) * ratio];
        return [...scene.getContext("2d").getImageData(...at, 1, 1).data].slice(0, 3);
    }"""
    drawn = """() => plots.map(({ canvas }) => {
        const all = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
        let blue = 0;
        for (let i = 0; i < all.length; i += 4) blue += all[i] < 60 && all[i + 2] > 150;
        return blue;
    })"""
    native = compiled.simulate(dt=1e-2, t_end=2.0, events="located")
    colours = {"slip": [213, 94, 0], "stick": [0, 114, 178], "closed": [0, 114, 178]}
    rubbed: list[str] = []
    with opened(page, width) as tab:
        tab.evaluate("document.getElementById('forces').click()")
        tab.click("#reset")
        for rows in (45, 155):
            tab.evaluate(f"signorini.run({rows})")
            tab.evaluate("hits.clear(); draw()")
            state = str(native["floor.state"][200 if rows > 45 else 45])
            if state in colours:
                assert tab.evaluate(colour) == colours[state]
                rubbed.append(state)
        assert rubbed
        assert all(blue > 20 for blue in tab.evaluate(drawn))
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    space = write_page(
        stepper(box_in_space.model, 2, events="located"), tmp_path / "space", dt=5e-3
    )
    with opened(space, width) as tab:
        tab.evaluate("signorini.run(3)")
        before = tab.evaluate("seen(points[0])")
        stage = tab.locator("#scene").bounding_box()
        tab.mouse.move(stage["x"] + 100, stage["y"] + 100)
        tab.mouse.down()
        tab.mouse.move(stage["x"] + 180, stage["y"] + 120)
        tab.mouse.up()
        after = tab.evaluate("seen(points[0])")
        assert np.linalg.norm(before) == pytest.approx(np.linalg.norm(after), abs=1e-9)
        assert np.abs(np.subtract(before, after)).max() > 1e-3


@pytest.mark.thorough
def test_a_run_that_ends_says_why(stepper: Build, tmp_path: Path) -> None:
    """Parameters that cannot be: the step fails, the page says so and goes on after a reset."""
    compiled = stepper(pendulum_with_wall.model, 2, events="located")
    page = write_page(compiled, tmp_path / "page", dt=1e-2)
    first = compiled.manifest["parameters"][0]["name"]
    with opened(page) as tab:
        tab.evaluate("numbers(C.parameters(), M.par.length).fill(NaN)")
        assert tab.evaluate("signorini.run(5)") == 0
        assert "the step has failed" in tab.inner_text("#says"), first
        tab.evaluate("defaults()")
        tab.click("#reset")
        assert tab.evaluate("signorini.run(5)") == 5
        assert not tab.is_visible("#says")


def test_events_are_located_where_they_can_be() -> None:
    """Pages and units: bungee is compliant, a freewheel goes one way, a screw rubs under load."""
    names = ("hopper", "bungee", "freewheel", "screw_jack")
    found = [events_of(find_model(name)) for name in names]
    assert found == ["located", "captured", "captured", "captured"]


@pytest.mark.thorough
def test_the_command(tmp_path: Path) -> None:
    said = signorini(tmp_path, "web", "atwood", "--out", "page", "--set", "e_N=0.5")
    assert said.returncode == 0, said.stderr
    assert re.match(r"page: page/index.html \(\d+ kB\)", said.stdout)
    m = shown(tmp_path / "page" / "index.html")
    assert {p["name"]: p["value"] for p in m["par"]}["e_N"] == 0.5
