"""What people look at: places, states and forces in a motion; pages, films and plots of it."""

import io
import itertools
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import signorini as sg
import sympy as sp
from browser import find_browser
from command import signorini
from hypothesis import given
from hypothesis import strategies as st
from signorini.bodies import Spatial
from signorini.locate import find_model
from signorini.models import (
    bouncing_ball,
    box,
    box_in_space,
    rocking_block,
    slider_crank,
    slope,
    woodpecker,
)
from signorini.runtime.errors import RunError
from signorini.view.geometry import faces, hull, meshes
from signorini.view.motion import frames, motion, pace
from signorini.view.plots import Plots, cardan
from trap_models import one_coordinate

Build = Callable[..., sg.Stepper]


@pytest.fixture(scope="module")
def ball(stepper: Build) -> sg.Trajectory:
    """It falls, hits, slips, rolls."""
    return stepper(bouncing_ball.model).simulate(t_end=1.2, dt=1e-2)


def data_of(page: Path) -> dict:
    """The numbers of a page."""
    found = re.search(r"^const M = (\{.*\});$", page.read_text(), re.M)
    assert found
    return json.loads(found.group(1))


# --- places, states, forces -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "module", [bouncing_ball, box, slope, slider_crank, woodpecker, box_in_space, rocking_block]
)
def test_arrows_point_along_the_forces(module: object, stepper: Build) -> None:
    """W_N is the transpose of d(place)/dq times the normal: virtual work of a unit force there."""
    made = stepper(module.model, 2 if module is box_in_space else 3)
    m = made.manifest
    t, q, _v = made.initial_state()
    if module is not slope:  # whose gap is a distance on the slope only
        q = q + 0.03 * np.sin(1.0 + np.arange(q.size)) * max(1e-3, np.abs(q).max())
    if "m rad rad" in " ".join(m["units"]):
        q[1:] *= 1e-3  # the woodpecker's angles are small in its equations, too

    def places(q: np.ndarray) -> np.ndarray:
        return made.evaluate("shapes", t=t, q=q)

    step = 1e-6
    slopes = np.array([(places(q + d) - places(q - d)) / 2 / step for d in step * np.eye(q.size)])
    W_N = made.evaluate("W_N", t=t, q=q)
    first, seen = 0, 0
    for shape in m["shapes"]:
        points = places(q)[first : first + shape["points"]]
        if shape["kind"] == "contact":
            normal = points[1] - points[0]
            assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
            column = next(c["normal"] for c in m["contacts"] if c["name"] == shape["name"])
            np.testing.assert_allclose(slopes[:, first] @ normal, W_N[:, column], atol=1e-6)
            seen += 1
        first += shape["points"]
    assert seen == sum(c["normal"] >= 0 for c in m["contacts"])


def test_corners_are_where_the_gaps_say(stepper: Build) -> None:
    traj = stepper(rocking_block.model).simulate(t_end=0.2, dt=1e-2)
    shown = motion(traj, fps=100, speed=1)
    area = next(thing for thing in shown.things if thing.kind == "area").points
    assert len(area) == len(traj.t)
    assert area[:, 0, 1] == pytest.approx(traj["left.g_N"], abs=1e-14)
    assert area[:, 1, 1] == pytest.approx(traj["right.g_N"], abs=1e-14)


def test_no_percussion_is_lost_between_frames(ball: sg.Trajectory) -> None:
    """Mean forces times their spans are all percussions, whatever rows are left out."""
    for fps in (7, 30, 1000):
        shown = motion(ball, fps=fps, speed=1)
        (mark,) = shown.marks
        rows = np.searchsorted(ball.t, shown.t)
        each = np.unique(rows, return_index=True)[1]
        spans = np.diff(shown.t[each], prepend=shown.t[0])
        total = (mark.force[each] * spans[:, None]).sum(axis=0)
        assert total == pytest.approx([ball.P_F.sum(), ball.P_N.sum()], rel=1e-9)
        assert mark.hit.sum() == 1
        k = int(np.flatnonzero(mark.hit)[0])
        assert shown.t[k] >= 0.43 > shown.t[k - 1] - 1e-2
        # Where it hit, not where it is at the time of the frame.
        assert mark.place[k] == pytest.approx([ball["x"][43], 0], abs=1e-12)
        assert k == 0 or shown.t[k] < 0.431 or abs(ball["x"][43] - ball["x"][rows[k]]) > 1e-3
    states = dict(zip(np.round(shown.t, 2), mark.state, strict=True))
    assert [states[t] for t in (0.0, 0.2, 0.6, 1.1)] == ["open", "open", "slip", "stick"]


@given(st.floats(1e-6, 1e6))
def test_a_film_lasts_some_seconds(duration: float) -> None:
    """1, 2 or 5 times a power of ten, and no choice that fits better is left out."""
    speed = pace(duration)
    assert f"{speed:.0e}"[0] in "125"
    assert 3 - 1e-9 <= duration / speed <= 20 + 1e-9
    if speed != 1:
        assert duration < 3 or duration > 20


@given(st.integers(2, 400), st.floats(0.5, 200), st.floats(1e-3, 1e3), st.floats(-50, 50))
def test_frames_show_what_has_happened(n: int, fps: float, speed: float, start: float) -> None:
    t = start + np.linspace(0, 1, n)
    _, rows = frames(t, fps, speed)
    assert 1 <= len(rows) <= 900
    assert rows[0] == 0
    assert np.all(np.diff(rows) >= 0)
    if len(rows) > 1:
        assert rows[-1] == n - 1
        times = np.linspace(t[0], t[-1], len(rows))
        assert np.all(t[rows] <= times + 1e-6)
        assert np.all(times - t[rows] < 1 / (n - 1) + 1e-6)


# --- bodies ---------------------------------------------------------------------------------------


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 2), min_size=3, max_size=12))
def test_hulls_in_the_plane(points: list[tuple[float, float]]) -> None:
    """Every point is on the left of every edge."""
    ring = hull(np.array(points))
    for a, b in itertools.pairwise(ring):
        for p in points:
            area = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
            assert area >= -1e-12


def test_hulls_in_space() -> None:
    """Euler's formula; every edge has two faces, once in each direction; normals point outwards."""
    rng = np.random.default_rng(3)
    cube = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    inside = 0.3 * rng.normal(size=(4, 3)).clip(-2, 2)
    bodies = [np.vstack([cube, inside]), cube[[0, 1, 2, 4]]]
    bodies += [rng.normal(size=(k, 3)) for k in (5, 9, 14)]
    for points in bodies:
        found = faces(points)
        edges = [pair for face in found for pair in itertools.pairwise([*face, face[0]])]
        assert len(set(edges)) == len(edges)
        assert {(b, a) for a, b in edges} == set(edges)
        corners = {a for a, _ in edges}
        assert len(corners) - len(edges) // 2 + len(found) == 2
        middle = points.mean(axis=0)
        for face in found:
            a, b, c = points[face[:3]]
            assert np.cross(b - a, c - a) @ (a - middle) > 0
    assert sorted(map(len, faces(bodies[0]))) == [4] * 6
    assert faces(np.zeros((4, 3)) + np.arange(3)) == []


def test_attitudes() -> None:
    """Cardan angles of products of three quaternions, and no jump at half a turn."""
    yaw = np.linspace(0, 7, 40)
    p = np.array([_product(_turn(2, c), _turn(1, 0.3), _turn(0, -0.8)) for c in yaw])
    found = cardan(p)
    assert found[0] == pytest.approx(np.full(40, -0.8))
    assert found[1] == pytest.approx(np.full(40, 0.3))
    assert found[2] == pytest.approx(yaw)


def _turn(axis: int, angle: float) -> np.ndarray:
    p = np.zeros(4)
    p[0], p[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    return p


def _product(*factors: np.ndarray) -> np.ndarray:
    """Hamilton's product."""
    a = factors[0]
    for b in factors[1:]:
        vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
        a = np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])
    return a


# --- files ----------------------------------------------------------------------------------------


def test_page_in_the_plane(ball: sg.Trajectory, tmp_path: Path) -> None:
    """Its numbers are the motion's; nothing is asked of the network."""
    page = ball.animate(tmp_path / "ball.html", fps=25, speed=0.5)
    text = page.read_text()
    assert not re.search(r"(src|href)\s*=|https?://|import\(|fetch\(", text)
    found = data_of(page)
    assert found["pace"] == ", slowed down 2 times"
    assert len(found["t"]) == 61
    low, unit = np.array(found["low"]), found["unit"]
    (mark,) = found["marks"]
    places = low + unit * np.array(mark["p"]).reshape(-1, 2)
    rows = np.searchsorted(ball.t, np.array(found["t"]) - 1e-9)
    quiet = ~np.array(mark["h"], dtype=bool)
    assert places[quiet, 0] == pytest.approx(ball["x"][rows][quiet], abs=unit)
    assert places[quiet, 1] == pytest.approx(ball["y"][rows][quiet] - 0.1, abs=unit)
    assert [found["states"][s] for s in mark["s"]] == list(ball["floor.state"][np.maximum(rows, 1)])


def test_titles_do_not_get_out_of_the_page(tmp_path: Path) -> None:
    m = sg.Model("sly")
    m.doc = "</script><script>alert(1)</script> & <b>"
    (x,) = m.coordinates("x")
    m.lagrangian = m.velocities[0] ** 2 / 2
    m.contact("wall", g_N=x + 1, at=(x, 0), normal=(1, 0))
    m.shape([(x, 0)], radius=1)
    m.initial_state(q=[0], v=[1])
    page = sg.build(m, stages=2).simulate(t_end=0.1, dt=0.1).animate(tmp_path / "p.html")
    assert page.read_text().count("<script") == 1
    assert "&lt;/script&gt;" in page.read_text()


def test_films(ball: sg.Trajectory, tmp_path: Path) -> None:
    """As many frames as the motion has, and they differ."""
    from PIL import Image

    path = ball.animate(tmp_path / "ball.gif", fps=5)
    with Image.open(path) as film:
        assert film.n_frames == len(motion(ball, fps=5).t) > 10
        film.seek(2)
        early = np.asarray(film.convert("L"), dtype=float)
        film.seek(film.n_frames - 1)
        assert np.abs(np.asarray(film.convert("L")) - early).max() > 100


def test_what_cannot_be_shown_is_refused(ball: sg.Trajectory, tmp_path: Path) -> None:
    for arguments, words in (
        (("x.avi",), "stands for no format"),
        (("x.html", {"fps": 0.4}), r"fps is 0\.4"),
        (("x.html", {"speed": float("nan")}), "speed is nan"),
    ):
        with pytest.raises(RunError, match=words):
            ball.animate(tmp_path / arguments[0], **(arguments[1] if len(arguments) > 1 else {}))
    with pytest.raises(RunError, match=r"no panel 'gap'.*gaps"):
        ball.plot(panels=["gap"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("moves", [False, True])
def test_a_surface_in_space_is_drawn(moves: bool) -> None:
    """A net around a particle lies on the surface; one at rest is drawn once, where it was seen."""
    m = sg.Model("dip")
    world = Spatial(m, gravity=(0, 0, -9.81))
    bead = world.particle("a", 1.0)
    lift = sp.sin(m.time) / 2 if moves else 0
    world.contact("bowl", bead, world.graph(lambda x, y: x**2 / 2 - x * y / 5 + lift, shown=0.4))
    world.initial_state(q={"a_x": 0.8, "a_y": 0.3, "a_z": 1.2}, v={"a_y": 1.0})
    seen = motion(sg.build(m, stages=2).simulate(t_end=1.5, dt=1e-2))
    (net,) = (thing for thing in seen.things if thing.kind == "net")
    assert net.rests != moves
    t = np.zeros(1) if net.rests else seen.t
    x, y, z = np.moveaxis(net.points, 2, 0)
    off = z - (x**2 / 2 - x * y / 5) - (np.sin(t) / 2 if moves else 0 * t)[:, None]
    side = 0.8 / 10  # chords of a curve of second derivative 1 are off by an eighth of its square
    assert np.nanmax(np.abs(off)) < (1e-12 if moves else side**2 / 4)
    (dot,) = (thing for thing in seen.things if thing.kind == "dot")
    low, high = seen.box()
    corners = net.at(0)[meshes(net.at(0), net.rows, low, high)]
    way = dot.points[:1, 0] if moves else dot.points[:, 0]
    apart = np.abs(corners.mean(axis=1)[None, :, :2] - way[:, None, :2]).max(axis=2)
    assert apart.min(axis=1).max() <= side / 2 * (1 + 1e-9)


def test_models_that_draw_nothing_say_so(stepper: Build, tmp_path: Path) -> None:
    traj = stepper(one_coordinate).simulate(t_end=0.1, dt=0.01)
    with pytest.raises(RunError, match=r"draws nothing: add m\.shape"):
        traj.animate(tmp_path / "x.gif")
    page = traj.animate(tmp_path / "x.html").read_text()
    assert "draws nothing" in page
    assert page.count("<svg") == 1
    assert "gaps g_N" in page or page.count("<path") > 30


def test_a_drawing_does_not_reach_the_step(stepper: Build, tmp_path: Path) -> None:
    """A place that is no number is named where it is drawn; the run and its messages ignore it."""

    def pole() -> sg.Model:
        m = sg.Model("pole")
        x, y = m.coordinates("x y")
        m.lagrangian = sum(v**2 for v in m.velocities) / 2 - 1 / (y - 3)
        m.contact("wall", g_N=x + 1, at=(x, 1 / y))
        m.shape([(1 / y, 0), (0, 0)])
        m.initial_state(q=[0, 1])
        return m

    made = stepper(pole, 2)
    traj = made.simulate(t_end=0.05, dt=1e-2, q0={"y": 0})
    with pytest.raises(RunError, match=r"a contact of 'wall' that is drawn has no place at t = 0:"):
        traj.animate(tmp_path / "x.html")
    with pytest.raises(sg.StepError, match="the Lagrangian is -inf"):
        made.simulate(t_end=0.05, dt=1e-2, q0={"y": 3})


def test_drawings_are_checked() -> None:
    m = sg.Model("mixed")
    x, y = m.coordinates("x y")
    m.lagrangian = sum(v**2 for v in m.velocities) / 2
    m.initial_state(q=[0, 0])
    m.shape([(x, y), (0, 0)])
    m.shape([(x, y, 0)], radius=1)
    with pytest.raises(sg.ModelError, match="points of 2 and 3 components"):
        sg.build(m)
    with pytest.raises(sg.ModelError, match="normal but no place"):
        m.contact("c", g_N=x, normal=(1, 0))
    with pytest.raises(sg.ModelError, match="2 coordinates but 1 units"):
        m.coordinates("a b", units="m")
    with pytest.raises(sg.ModelError, match=r"its points are .* two or three components"):
        m.shape((x, y))
    with pytest.raises(sg.ModelError, match="normal has 3 components, its place 2"):
        m.contact("d", g_N=x, at=(x, y), normal=(1, 0, 0))


# --- plots ----------------------------------------------------------------------------------------


def test_panels_show_the_run(ball: sg.Trajectory) -> None:
    """Curves are the numbers: friction is used up while it slips, impacts took what is missing."""
    figure = ball.plot(panels=["q", "friction", "energy", "forces"])
    places, angles, friction, energy, forces, *_ = (a for a in figure.axes if a.get_visible())
    assert [line.get_label() for line in places.lines] == ["x", "y"]
    assert [line.get_label() for line in angles.lines] == ["phi"]
    use = friction.lines[0].get_ydata()
    slips = ball["floor.state"][1:] == "slip"
    assert use[slips] == pytest.approx(1, abs=1e-9)
    assert np.nanmax(np.where(ball["floor.state"][1:] == "stick", use, 0)) < 1
    taken = energy.lines[1].get_ydata()[-1]
    assert taken == pytest.approx(sum(-e.energy for e in ball.events if e.kind == "impact"))
    assert taken > 8  # of a fall of 0.9 m with e_N = 0
    hit = np.flatnonzero(ball["floor.P_N"] > 1)
    assert len(hit) == 1
    assert np.isnan(forces.lines[0].get_ydata()[hit[0] - 1])


def test_legends_cover_nothing(stepper: Build) -> None:
    traj = stepper(box_in_space.model, 2).simulate(t_end=1.0, dt=5e-3)
    figure = traj.plot()
    figure.canvas.draw()
    seen = 0
    for axis in figure.axes:
        if axis.get_legend() is not None:
            seen += 1
            box = axis.get_legend().get_window_extent()
            for other in figure.axes:
                assert not other.get_visible() or not box.overlaps(other.bbox)
    assert seen >= 4
    panels = ["q", "v", "energy", "gaps", "forces", "friction", "states"]
    assert list(Plots(traj).available()) == panels
    assert any("attitude" in axis.get_ylabel() for axis in figure.axes)


# --- in a browser ---------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize("width", [380, 1200])
def test_pages_in_a_browser(ball: sg.Trajectory, tmp_path: Path, width: int) -> None:
    """No error; the contact lights up where it is: the pixel there has the colour of its state."""
    manager, chromium = find_browser()
    page = ball.animate(tmp_path / "ball.html")
    with manager as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": width, "height": 620})
        errors: list[str] = []
        tab.on("pageerror", lambda e: errors.append(str(e)))
        tab.on("request", lambda r: errors.append(r.url) if "file://" not in r.url else None)
        tab.goto(page.as_uri())
        tab.evaluate("if (playing) toggle(); $('forces').click()")
        for time, colour in ((0.6, [213, 94, 0]), (1.1, [0, 114, 178])):
            found = tab.evaluate(
                """time => {
                    go(M.t.findIndex(t => t >= time));
                    const m = M.marks[0], ratio = window.devicePixelRatio;
                    const x = X(m.p[2 * k]) * ratio, y = Y(m.p[2 * k + 1]) * ratio;
                    return [...scene.getContext("2d").getImageData(x, y, 1, 1).data].slice(0, 3);
                }""",
                time,
            )
            assert found == colour
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
        tab.keyboard.press("Space")
        before = tab.evaluate("k")
        tab.wait_for_function(f"k !== {before}")
        browser.close()
    assert errors == []


def test_between_coarse_rows_a_located_ball_flies_on_its_parabola(stepper: Build) -> None:
    """Twenty rows, 241 frames: each shows the ball where it is at that time, the spot of an impact
    is where and when it was."""
    made = stepper(bouncing_ball.model, 3, events="located")
    traj = made.simulate(t_end=2, dt=0.1, events="located", v0={"phi": 0}, parameters={"e_N": 1.0})
    shown = motion(traj, fps=60)
    assert len(shown.t) == 241
    ball = next(x for x in shown.things if x.kind in ("round", "circle") and not x.rests)
    fall = np.sqrt(2 * 0.9 / 9.81)
    phase = np.abs((shown.t + fall) % (2 * fall) - fall)
    np.testing.assert_allclose(ball.points[:, 0, 1], 1 - 9.81 / 2 * phase**2, atol=1e-12)
    (mark,) = shown.marks
    assert mark.place is not None and mark.hit.sum() == 2
    np.testing.assert_allclose(mark.place[mark.hit, 1], 0, atol=1e-12)


@pytest.mark.thorough
def test_a_page_in_space(stepper: Build, tmp_path: Path) -> None:
    """The scene of viser opens without an error, asks the network for nothing, and shows a body."""
    pytest.importorskip("viser", reason="pip install 'signorini[view]'")
    manager, chromium = find_browser()
    traj = stepper(box_in_space.model, 2).simulate(t_end=0.5, dt=5e-3)
    page = traj.animate(tmp_path / "box.html")
    graphics = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
    with manager as p:
        browser = p.chromium.launch(
            executable_path=chromium, args=[*graphics, "--enable-unsafe-swiftshader"]
        )
        tab = browser.new_page(viewport={"width": 800, "height": 600})
        errors: list[str] = []
        tab.on("pageerror", lambda e: errors.append(str(e)))
        asked: list[str] = []
        tab.on("request", lambda r: asked.append(r.url.split(":")[0]))
        tab.goto(page.as_uri())
        for _ in range(15):  # until a body with a colour is there; a busy machine takes its time
            tab.wait_for_timeout(4000)
            if _coloured(tab.screenshot()) > 0.01:
                break
        shown = _coloured(tab.screenshot())
        browser.close()
    assert errors == []
    assert set(asked) <= {"file", "data", "blob"}
    assert shown > 0.01


def _coloured(png: bytes) -> float:
    """Share of the middle of a picture that has a colour."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as picture:
        middle = np.asarray(picture.convert("RGB"), dtype=float)[150:500, 200:600]
    return float((np.ptp(middle, axis=2) > 12).mean())


def test_the_command(tmp_path: Path) -> None:
    made = signorini(
        tmp_path, "run", "slope", "--t-end", "0.2", "--stages", "2", "--out", "slope.npz"
    )
    assert made.returncode == 0, made.stderr
    shown = signorini(tmp_path, "view", "slope.npz", "--stages", "2", "--out", "slope.html")
    assert shown.returncode == 0, shown.stderr
    assert len(data_of(tmp_path / "slope.html")["t"]) > 10
    wrong = signorini(tmp_path, "view", "slope", "--stages", "2", "--out", "slope.avi")
    assert wrong.returncode == 1
    assert "stands for no format" in wrong.stderr
    assert find_model("slope").name == "slope"


# --- in a notebook and a console ------------------------------------------------------------------


@pytest.mark.parametrize("symbols", ["sympy", "casadi"])
def test_models_print_their_equations(symbols: str) -> None:
    """What is printed is the model: its LaTeX, read term by term."""
    m = sg.Model("cart_pole", symbols=symbols)
    x, phi = m.coordinates("x phi")
    v, omega = m.velocities
    (k,) = m.parameters(k=sg.par(3.0, unit="N/m", doc="stiffness"))
    (push,) = m.inputs("push")
    m.lagrangian = v**2 / 2 + omega**2 - k * x**2 / 2
    m.force({"x": push})
    m.constraint("rod", x - phi)
    m.contact("wall", g_N=x, gamma_F=omega, mu=0.1)
    assert (
        repr(m) == "Model('cart_pole': q = (x, phi); constraints rod; contacts wall; inputs push)"
    )
    shown = m._repr_markdown_()
    for line in (
        r"L &= ",
        r"\dot{x}^{2}",
        r"\dot{\phi}^{2}",
        r"f_{x} &= \mathrm{push}",
        r"0 = g_{\mathrm{rod}} &= ",
        r"0 \le g_{N,\mathrm{wall}} &= x",
        r"\gamma_{F,\mathrm{wall}} &= \dot{\phi}",
        "| `k` | 3 | N/m | stiffness |",
    ):
        assert line in shown, line
    assert r"f_{\phi}" not in shown


def test_runs_print_themselves(ball: sg.Trajectory) -> None:
    shown = ball._repr_html_()
    assert "<svg" in shown
    assert "2 events" in shown
    assert "lobatto, s = 3, double: n_q = 3, n_N = 1, n_F = 1" in repr(ball.stepper)


def test_friction_of_contacts_written_by_hand(stepper: Build) -> None:
    """The arrow has the friction, too: virtual power of the force is that of P_N and P_F."""
    for made in (stepper(bouncing_ball.model), stepper(box_in_space.model, 2)):
        traj = made.simulate(t_end=1.0, dt=1e-2)
        shown = motion(traj, fps=100, speed=1)
        rows = np.arange(len(traj.t))
        for mark in shown.marks:
            columns = traj.contacts[mark.name]
            P_N, P_F = traj.P_N[rows, columns["P_N"]], traj.P_F[rows][:, columns["P_F"]]
            quiet = ~mark.hit
            force = mark.force[quiet] * np.r_[1, np.diff(traj.t)][quiet, None]
            size = np.sqrt(P_N**2 + (P_F**2).sum(axis=1))[quiet]
            assert np.linalg.norm(force, axis=1) == pytest.approx(size, abs=1e-9)
            along = force[:, :-1] @ np.eye(force.shape[1] - 1)
            assert along == pytest.approx(P_F[quiet], abs=1e-9)
