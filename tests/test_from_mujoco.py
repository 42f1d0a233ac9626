"""Robots from MJCF and URDF: what MuJoCo says of the same files, closed forms of gaps, refusals."""

import importlib.metadata
import importlib.util
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
import signorini as sg
from signorini.bodies import Imported, from_mjcf, from_urdf
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.frontend.validate import freeze

mujoco = pytest.importorskip("mujoco", reason="pip install 'signorini[robots]'")
Build = Callable[..., sg.Stepper]

ARM = """<mujoco model="bent arm"><compiler angle="radian"/><worldbody>
<body name="base" pos=".1 .2 .3" quat=".9 .1 .2 .3">
 <inertial pos=".01 .02 .03" mass="2" diaginertia=".02 .03 .04" quat=".8 .1 .3 .2"/>
 <joint name="yaw" axis="0 0 1" pos=".05 0 0" armature=".02" damping=".3" stiffness="2"
        springref=".3"/>
 <body name="upper" pos="0 .1 .4" quat=".7 .7 0 0">
  <inertial pos="0 .1 .2" mass="1.5" fullinertia=".02 .03 .015 .001 .002 -.001"/>
  <joint name="pitch/2" axis="0 1 .2" ref=".2"/>
  <joint name="slide" type="slide" axis="1 0 .3"/>
  <body name="tip" pos=".3 0 0"><inertial pos="0 0 .1" mass=".7" diaginertia=".003 .004 .005"/>
   <joint name="roll" axis="1 0 0" pos="0 .02 .01"/></body>
 </body></body></worldbody>
<actuator><motor joint="yaw" name="drive" gear="3" ctrllimited="true" ctrlrange="-1 .5"/>
 <position joint="pitch/2" name="servo" kp="5" kv=".4"/></actuator></mujoco>"""

FLYER = """<mujoco model="flyer"><option gravity=".3 .1 -9"/><worldbody>
<body name="hull" pos="0 0 1"><freejoint name="free"/>
 <inertial pos=".05 -.02 .03" mass="2" diaginertia=".05 .06 .04" quat=".9 .3 .2 .1"/>
 <body name="leg" pos=".2 0 0" quat=".8 0 .6 0"><joint name="hip" axis="0 1 0" pos=".01 0 .02"/>
  <inertial pos="0 0 -.1" mass=".5" diaginertia=".004 .005 .001"/>
  <body name="foot" pos="0 0 -.2"><joint name="ankle" type="ball" pos="0 .01 .02"/>
   <inertial pos=".02 0 -.03" mass=".3" diaginertia=".002 .003 .001"/></body></body>
</body></worldbody></mujoco>"""


class Values:
    """Functions of a model at any place, before C: nothing is compiled."""

    def __init__(self, imported: Imported) -> None:
        self.derived = Derivation(freeze(imported.model))
        self.contacts = [c.name for c in self.derived.data.contacts]
        self.coordinates = self.derived.data.coordinates

    def __call__(self, name: str, q: np.ndarray, v: np.ndarray | None = None) -> np.ndarray:
        of = self.derived.data
        par = [p.default for p in of.parameters]
        function = ca.Function("f", [of.t, of.q, of.v, of.par], [self.derived[name]])
        found = np.array(function(0, q, np.zeros(len(q)) if v is None else v, par))
        return found[:, 0] if found.shape[1] == 1 else found


def drawn(m: Any, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A configuration and velocities of MuJoCo's model."""
    rng = np.random.default_rng(seed)
    q, v = np.array(m.qpos0), rng.normal(size=m.nv)
    mujoco.mj_integratePos(m, q, rng.normal(size=m.nv), 0.5)
    return q, v


def rates(m: Any, q: np.ndarray) -> np.ndarray:
    """The matrix T with q_dot = T v, by central differences."""
    h, columns = 1e-5, []
    for k in range(m.nv):
        ends = []
        for sign in (1, -1):
            end, v = q.copy(), np.zeros(m.nv)
            v[k] = sign
            mujoco.mj_integratePos(m, end, v, h)
            ends.append(end)
        columns.append((ends[0] - ends[1]) / (2 * h))
    return np.array(columns).T


@pytest.mark.parametrize(("text", "tolerance"), [(ARM, 1e-12), (FLYER, 1e-7)])
def test_masses_are_mujocos(text: str, tolerance: float) -> None:
    """Mass matrices at drawn places; those of quaternions by differences."""
    imported = from_mjcf(text)
    values = Values(imported)
    m = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(m)
    assert imported.left_out == []
    for seed in range(3):
        q, _ = drawn(m, seed)
        data.qpos[:] = q
        mujoco.mj_forward(m, data)
        M = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, data, M)
        T = rates(m, q) if m.nq > m.nv else np.eye(m.nv)
        np.testing.assert_allclose(T.T @ values("p_v", q) @ T, M, rtol=0, atol=tolerance)


@pytest.mark.thorough
@pytest.mark.parametrize("text", [ARM, FLYER])
def test_motions_are_mujocos(text: str) -> None:
    """A run without contact, with inputs, against fine steps of MuJoCo."""
    stepper = sg.build(from_mjcf(text).model, stages=3)
    m = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(m)
    q, v = drawn(m, 2)
    data.qpos[:], data.qvel[:] = q, v
    inputs = np.array([0.7, 0.4])[: m.nu]
    data.ctrl[:] = inputs
    m.opt.timestep, m.opt.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_RK4
    for _ in range(3000):
        mujoco.mj_step(m, data)
    T = rates(m, q) if m.nq > m.nv else np.eye(m.nv)
    traj = stepper.simulate(
        t_end=0.3, dt=1e-3, q0=q, v0=T @ v, inputs=(lambda t, q, v: inputs) if m.nu else None
    )
    np.testing.assert_allclose(traj.q[-1], data.qpos, rtol=0, atol=1e-7)


# --- public robots, from packages that bring them -------------------------------------------------


IMPOSSIBLE = "anymal_c_simple_description/urdf/anymal.urdf"


@pytest.mark.slow
def test_a_robot_with_an_inertia_that_no_body_has_is_refused() -> None:
    with pytest.raises(sg.ModelError, match=r"A \+ B >= C.*\s.*depth_camera_front_camera"):
        from_urdf(robot_file(IMPOSSIBLE))


def robot_file(name: str) -> Path:
    """A file of a package; the test is skipped where the package is missing."""
    if name.endswith(".xml"):
        pytest.importorskip("dm_control", reason="pip install dm_control")
        found = importlib.util.find_spec("dm_control")
        assert found is not None and found.submodule_search_locations
        return Path(found.submodule_search_locations[0]) / "suite" / name
    try:
        robots = importlib.metadata.distribution("example-robot-data")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("pip install example-robot-data")
    share = Path("cmeel.prefix/share/example-robot-data/robots")
    return Path(str(robots.locate_file(share / name)))


ROBOTS = (
    ("panda_description/urdf/panda.urdf", False),
    ("a1_description/urdf/a1.urdf", True),
    ("go2_description/urdf/go2.urdf", True),
    ("ur_description/urdf/ur5_robot.urdf", False),
    ("laikago_description/urdf/laikago.urdf", True),
    ("go1_description/urdf/go1.urdf", True),
    ("solo_description/robots/solo12.urdf", True),
    ("cheetah.xml", None),
    ("hopper.xml", None),
    ("walker.xml", None),
    ("acrobot.xml", None),
    ("quadruped.xml", None),
)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "floating"), ROBOTS)
def test_public_robots(name: str, floating: bool | None) -> None:
    """Mass matrices and forces of gravity and springs at drawn places are MuJoCo's."""
    path = robot_file(name)
    if floating is None:
        imported, m = from_mjcf(path, contacts=False), mujoco.MjModel.from_xml_path(str(path))
    else:
        placeholder = ["base"] if "go1" in name else []
        imported = from_urdf(path, floating=floating, massless=placeholder)
        text = path.read_text()
        if floating:
            root = ET.fromstring(text).find("link").attrib["name"]
            free = (
                '<link name="W"/><joint name="F" type="floating"><parent link="W"/>'
                f'<child link="{root}"/></joint></robot>'
            )
            text = text.replace("</robot>", free)
        for link in placeholder:
            first = text.index("<inertial>", text.index(f'<link name="{link}"'))
            last = text.index("</inertial>", first) + len("</inertial>")
            text = text[:first] + text[last:]
        spec = mujoco.MjSpec.from_string(text)
        for thing in [*spec.geoms, *spec.meshes]:
            spec.delete(thing)
        m = spec.compile()
    values = Values(imported)
    data = mujoco.MjData(m)
    for seed in range(3):
        q, _ = drawn(m, seed)
        data.qpos[:] = q
        mujoco.mj_forward(m, data)
        M = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, data, M)
        T = rates(m, q) if m.nq > m.nv else np.eye(m.nv)
        np.testing.assert_allclose(
            T.T @ np.atleast_2d(values("p_v", q)) @ T, M, rtol=0, atol=1e-8 * np.abs(M).max()
        )
        exact = data.qfrc_spring - data.qfrc_bias
        np.testing.assert_allclose(
            T.T @ values("L_q", q), exact, rtol=0, atol=1e-8 * max(1, np.abs(exact).max())
        )


def test_names_and_where_they_are_from() -> None:
    imported = from_mjcf(ARM, name="arm-2")
    assert imported.model.name == "arm_2" and from_mjcf(ARM).model.name == "bent_arm"
    assert imported.coordinates["pitch/2"] == ("pitch_2",)
    assert list(imported.frames) == ["base", "upper", "tip"]
    assert imported.model.input_names == ["drive", "servo"]
    # body, joint, geom and motor have one name; so have two joints, but for what C does not know
    text = """<mujoco model="same"><worldbody><geom name="floor" type="plane" size="1 1 1"/>
    <body name="hip" pos="0 0 1"><joint name="hip" axis="0 1 0"/><joint name="knee-1"/>
    <joint name="knee 1" axis="1 0 0"/><geom name="hip" size=".1" pos=".3 0 .1"/></body></worldbody>
    <actuator><motor name="hip" joint="hip"/><motor name="knee 1" joint="knee 1"/></actuator>
    </mujoco>"""
    model = from_mjcf(text).model
    assert model.coordinate_names == ["hip", "knee_1", "knee_1_2"]
    assert model.input_names == ["u_hip", "u_knee_1"]
    assert [c.name for c in freeze(model).contacts] == ["hip_contact"]


TILTED = """<mujoco model="shapes"><worldbody>
<geom name="floor" type="plane" size="1 1 1" euler="0 30 0" friction=".2 0 0"/>
<body pos="1 0 2"><joint name="a" type="slide" axis="0 0 1"/>
 <geom name="ball" type="sphere" size=".2" pos=".1 0 0" mass="1" friction=".7 0 0"/></body>
<body pos="1 0 2" quat=".8 .6 0 0"><joint name="b" type="slide" axis="0 0 1"/>
 <geom name="rod" type="capsule" size=".1 .3" mass="1"/></body>
<body pos="1 0 2"><joint name="c" type="slide" axis="0 0 1"/>
 <geom name="brick" type="box" size=".1 .2 .3" euler="10 20 30" mass="1"/></body>
<body pos="1 0 2"><joint name="d" type="slide" axis="0 0 1"/>
 <geom name="egg" type="ellipsoid" size=".1 .2 .3" euler="10 20 30" mass="1"/></body>
<body pos="1 0 2"><joint name="e" type="slide" axis="0 0 1"/>
 <geom name="drum" type="cylinder" size=".2 .3" euler="10 20 30" mass="1"/></body>
</worldbody></mujoco>"""


def test_gaps_of_all_primitives_to_a_tilted_plane() -> None:
    """The least distance over what a geom can touch the plane with is what MuJoCo says."""
    imported = from_mjcf(TILTED)
    values = Values(imported)
    m = mujoco.MjModel.from_xml_string(TILTED)
    data = mujoco.MjData(m)
    q = np.array([0.1, -0.2, 0.3, 0.0, -0.1])
    data.qpos[:] = q
    mujoco.mj_forward(m, data)
    gaps = dict(zip(values.contacts, values("g_N", q), strict=True))
    for geom, count in (("ball", 1), ("rod", 2), ("brick", 8), ("egg", 1), ("drum", 2)):
        own = [gap for name, gap in gaps.items() if name.split("_")[0] == geom]
        assert len(own) == count
        ids = [mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_GEOM, x) for x in ("floor", geom)]
        exact = mujoco.mj_geomDistance(m, data, ids[0], ids[1], 10.0, None)
        assert min(own) == pytest.approx(exact, abs=1e-6), geom
    mu = values("mu", q)
    assert mu[list(gaps).index("ball")] == 0.7
    named = from_mjcf(TILTED, contacts=["egg", "ball"])
    assert Values(named).contacts == ["ball", "egg"]
    with pytest.raises(sg.ModelError, match="contact of 'hand': the file has no geom"):
        from_mjcf(TILTED, contacts=["hand"])
    # ten pairs of the five geoms could meet each other
    assert imported.left_out == [
        "10 pairs of geoms that may collide: name some in pairs=[(one, other)], or give pairs=True"
    ]


def test_directions_in_which_nothing_moves_have_no_friction() -> None:
    """A monopod that only goes up and down, a cart that rolls in a plane."""
    text = """<mujoco model="m"><worldbody><geom name="floor" type="plane" size="1 1 1"/>
    <body pos="0 0 1"><joint name="lift" type="slide" axis="0 0 1"/>
    <geom name="foot" size=".1" mass="1"/>
    <body pos="2 0 0"><joint name="drive" type="slide" axis="1 0 0"/>
     <geom name="wheel" size=".2" mass="1"/>
    </body></body></worldbody></mujoco>"""
    contacts = freeze(from_mjcf(text).model).contacts
    assert [(c.name, c.n_F) for c in contacts] == [("foot", 0), ("wheel", 1)]


@pytest.mark.thorough
def test_it_falls_and_rests() -> None:
    """A box on the floor, a hinge against its limit with dry friction: no penetration, at rest."""
    text = """<mujoco model="rests"><compiler angle="radian"/><worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="box" pos="0 0 .5"><freejoint/>
     <geom name="g" type="box" size=".1 .15 .2" mass="2"/></body>
    <body name="arm" pos="3 0 2"><joint name="hinge" axis="0 1 0" range="-.4 1" frictionloss=".05"/>
     <geom type="capsule" size=".05" fromto="0 0 0 .5 0 0" mass="1" contype="0" conaffinity="0"/>
    </body></worldbody></mujoco>"""
    imported = from_mjcf(text)
    traj = sg.build(imported.model, stages=2).simulate(t_end=1.5, dt=5e-3)
    assert imported.left_out == []
    assert traj.smallest_gap.min() > -1e-9
    assert traj["box_free_z"][-1] == pytest.approx(0.2, abs=1e-9)
    assert traj["hinge"][-1] == pytest.approx(1.0, abs=1e-9)
    assert traj["hinge_upper.state"][-1] == "closed"
    assert np.abs(traj.v[-1]).max() < 1e-9


def test_constraints_of_a_file() -> None:
    """A point that is held, a joint that follows another by a polynomial."""
    text = """<mujoco model="tied"><worldbody>
    <body name="a"><joint name="p" axis="0 1 0"/><geom name="x" size=".1" pos=".5 0 0"/></body>
    <body name="b" pos="1 0 0"><joint name="q" axis="0 1 0"/><geom size=".1" pos="-.5 .3 0"/></body>
    </worldbody><equality>
    <joint joint1="p" joint2="q" polycoef="0 2 .5 0 0"/>
    <connect body1="a" body2="b" anchor=".5 0 0"/>
    <weld body1="a" body2="b" active="false"/></equality></mujoco>"""
    imported = from_mjcf(text, contacts=False)
    p, q = 0.3, 0.7
    g = Values(imported)("g", np.array([p, q]))
    assert g[0] == pytest.approx(p - (2 * q + 0.5 * q**2), abs=1e-15)
    one = np.array([0.5 * np.cos(p), 0, -0.5 * np.sin(p)])
    other = np.array([1 - 0.5 * np.cos(q), 0, 0.5 * np.sin(q)])
    # in the third direction nothing moves: there is no row for it
    np.testing.assert_allclose(np.abs(g[1:]), np.abs(one - other)[[0, 2]], atol=1e-15)
    assert imported.left_out == [
        "equality 'number 2': it is not active",
        "1 pairs of geoms that may collide: name some in pairs=[(one, other)], or give pairs=True",
    ]


HAND = """<mujoco model="hand"><compiler angle="radian"/><worldbody>
<body name="one"><joint name="a" axis="0 1 0" actuatorfrcrange="-.8 .9" actuatorfrclimited="true"/>
 <inertial pos=".1 0 0" mass="1" diaginertia=".01 .02 .02"/>
 <body name="two" pos=".2 0 0"><joint name="b" axis="0 1 .3"/>
  <inertial pos=".1 0 0" mass=".5" diaginertia=".005 .006 .007"/>
  <body name="three" pos=".2 0 0"><joint name="c" type="slide" axis="1 0 .2"/>
   <inertial pos=".05 0 0" mass=".3" diaginertia=".002 .003 .002"/></body></body></body></worldbody>
<tendon><fixed name="pull" range="-1.1 1.3" limited="true" stiffness="7" springlength="-.1 .2"
  damping=".4" armature=".03" frictionloss=".2" actuatorfrcrange="-.5 .7"
  actuatorfrclimited="true"><joint joint="a" coef="1.2"/><joint joint="b" coef="-.7"/></fixed>
 <fixed name="other" stiffness="3" springlength=".05"><joint joint="b" coef=".5"/>
  <joint joint="c" coef="2"/></fixed></tendon>
<equality><tendon tendon1="pull" tendon2="other" polycoef="0 .8 .3 0 0"/></equality>
<actuator><motor name="m" joint="a" gear="2" forcerange="-.35 .3" forcelimited="true"/>
 <position name="p" tendon="pull" kp="4" kv=".3" gear="1.5"/>
 <motor name="s" joint="c" ctrlrange="-1 1" ctrllimited="true"/></actuator></mujoco>"""


def test_tendons_and_limits_of_forces() -> None:
    """Masses and forces are MuJoCo's, in every clamp; gaps and the tie of two tendons as written in
    the file.
    """
    imported = from_mjcf(HAND)
    assert imported.left_out == []
    of = Derivation(freeze(imported.model))
    data = of.data
    par = [p.default for p in data.parameters]
    f = ca.Function("f", [data.t, data.q, data.v, data.par, data.u], [of["f"]])
    values = Values(imported)
    m = mujoco.MjModel.from_xml_string(HAND)
    theirs = mujoco.MjData(m)
    rng = np.random.default_rng(3)
    clamped = set()
    names = [c.name for c in data.contacts if c.g_N is not None]
    for _ in range(40):
        q, v, u = rng.normal(size=3) * 0.6, rng.normal(size=3), rng.normal(size=3)
        theirs.qpos[:], theirs.qvel[:], theirs.ctrl[:] = q, v, u
        mujoco.mj_forward(m, theirs)
        M = np.zeros((3, 3))
        mujoco.mj_fullM(m, theirs, M)
        np.testing.assert_allclose(values("p_v", q), M, rtol=0, atol=1e-12)
        found = np.array(f(0, q, v, par, u))[:, 0]
        np.testing.assert_allclose(
            found, theirs.qfrc_actuator + theirs.qfrc_passive, rtol=0, atol=1e-12
        )
        clamped.add(round(float(theirs.qfrc_actuator[0]), 9))
        pull, other = 1.2 * q[0] - 0.7 * q[1], 0.5 * q[1] + 2 * q[2]
        gaps = dict(zip(names, values("g_N", q), strict=True))
        assert gaps["pull_lower"] == pytest.approx(pull + 1.1, abs=1e-14)
        assert gaps["pull_upper"] == pytest.approx(1.3 - pull, abs=1e-14)
        tie = pull - (0.8 * other + 0.3 * other**2)
        assert values("g", q).item() == pytest.approx(tie, abs=1e-14)
    assert clamped & {-0.8, 0.9}  # the limit of the joint was met


def test_welds_hold_what_mujocos_hold() -> None:
    """Where MuJoCo's weld has no error ours has none, and both leave the same motions."""
    text = """<mujoco model="welded"><worldbody>
    <body name="a" pos=".1 .2 1"><freejoint/>
     <inertial pos=".1 0 0" mass="1" diaginertia=".01 .02 .02"/></body>
    <body name="b" pos=".5 -.1 1.2" quat=".6 .3 .7 .1"><freejoint/>
     <inertial pos="0 .1 0" mass="2" diaginertia=".03 .02 .02"/></body></worldbody>
    <equality><weld name="glue" body1="a" body2="b" anchor=".1 .2 .3"/></equality></mujoco>"""
    imported = from_mjcf(text)
    assert imported.left_out == []
    values = Values(imported)
    m = mujoco.MjModel.from_xml_string(text)
    m.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(m)
    rng = np.random.default_rng(5)
    start = np.array(m.qpos0)
    for _ in range(3):
        # turn and move both bodies as one
        turn, shift = rng.normal(size=4), rng.normal(size=3)
        turn /= np.linalg.norm(turn)
        q = start.copy()
        for first in (0, 7):
            mujoco.mju_rotVecQuat(q[first : first + 3], start[first : first + 3], turn)
            q[first : first + 3] += shift
            mujoco.mju_mulQuat(q[first + 3 : first + 7], turn, start[first + 3 : first + 7])
        data.qpos[:] = q
        mujoco.mj_forward(m, data)
        np.testing.assert_allclose(data.efc_pos, 0, atol=1e-12)
        np.testing.assert_allclose(values("g", q), 0, atol=1e-12)
        T = rates(m, q)
        J = np.array(data.efc_J).reshape(-1, m.nv)
        W = values("W_g", q).T @ T  # lengths of quaternions do not change along T
        assert np.linalg.matrix_rank(J, tol=1e-6) == 6
        assert np.linalg.matrix_rank(W, tol=1e-6) == 6
        assert np.linalg.matrix_rank(np.vstack([J, W]), tol=1e-6) == 6


def test_balls_that_touch_each_other() -> None:
    text = """<mujoco model="balls"><worldbody>
    <body><joint name="a" type="slide"/><geom name="one" size=".1" friction=".3 0 0"/></body>
    <body pos="0 0 1"><joint name="b" type="slide" axis="1 0 0"/><geom name="two" size=".2"/></body>
    </worldbody></mujoco>"""
    imported = from_mjcf(text, pairs=[("one", "two")], e_N=0.5)
    assert imported.left_out == []
    values = Values(imported)
    assert values("g_N", np.array([0.1, 0.25]))[0] == pytest.approx(
        np.hypot(0.9, 0.25) - 0.3, abs=1e-15
    )
    assert values("e_N", np.zeros(2))[0] == 0.5
    with pytest.raises(sg.ModelError, match="pairs of name 'three': the file has no geom of it"):
        from_mjcf(text, pairs=[("one", "three")])


CROWD = """<mujoco model="crowd"><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="a" pos="0 0 1"><freejoint/><geom name="cap" type="capsule" size=".1 .2" group="3"/>
 <geom type="sphere" size=".1" pos=".3 0 0" quat=".9 .1 .2 .3"/>
 <body name="child"><joint/><geom name="inner" size=".05"/></body></body>
<body name="b" pos="0 0 2"><freejoint/><geom name="other" type="capsule" size=".1 .2" group="3"
  quat=".7 .7 .1 0" pos=".1 .2 .3"/></body>
<body name="c" pos="0 0 3"><freejoint/><geom name="crate" type="box" size=".1 .2 .3"/>
 <geom name="can" type="cylinder" size=".1 .2" pos="0 1 0"/></body></worldbody>
<contact><exclude body1="child" body2="c"/></contact></mujoco>"""


def test_pairs_by_name_by_body_by_group_and_all() -> None:
    """Which contacts there are, and that what is left is counted."""

    def of(pairs: Any) -> tuple[set[str], int]:
        imported = from_mjcf(CROWD, contacts=False, pairs=pairs)
        names = [c.name for c in imported.model.contacts]
        left = [line for line in imported.left_out if "may collide" in line]
        return set(names), int(left[0].split()[0]) if left else 0

    five = {f"cap_other_{w}" for w in ("a_start", "a_end", "b_start", "b_end", "sides")}
    # 6 geoms: 15 pairs, less those of a with itself and its child (3), of c (1), the excluded (2)
    assert of(False) == (set(), 9)
    assert of([("cap", "other")]) == (five, 8)
    assert of([(3, 3)]) == (five, 8)
    assert of([("inner", "crate")]) == ({"inner_crate"}, 9)  # excluded, but named
    assert of([("child", "c")]) == (set(), 9)
    ball = {"a_geom2_crate", "a_geom2_can"}
    side = {f"cap_crate_{end}" for end in ("start", "end")}
    side |= {f"cap_crate_corner{k}" for k in range(8)}
    side |= {f"cap_crate_edge{k}{k | b}" for b in (1, 2, 4) for k in range(8) if not k & b}
    assert of([("a", "c")]) == (ball | side, 6)  # its capsule has no rule with a cylinder
    rest = {"a_geom2_other", "inner_other"} | {x.replace("cap", "other", 1) for x in side}
    assert of(True) == (five | ball | side | rest, 2)  # capsules with the cylinder
    with pytest.raises(sg.ModelError, match="is a capsule and a cylinder, for which there is no r"):
        of([("cap", "can")])
    twice = CROWD.replace('<geom name="can" type="cylinder"', '<geom name="can" type="sphere"')
    with pytest.raises(sg.ModelError, match="of two parts of one body"):
        from_mjcf(twice, pairs=[("crate", "can")])
    with pytest.raises(sg.ModelError, match="pairs of group 7: the file has no geom of it"):
        of([(7, "cap")])


def test_gaps_of_pairs_are_distances() -> None:
    """Of all pairs, frames of geoms turned in their bodies: the smallest gaps are MuJoCo's."""
    imported = from_mjcf(CROWD, contacts=False, pairs=True)
    values, m = Values(imported), mujoco.MjModel.from_xml_string(CROWD)
    data = mujoco.MjData(m)
    names = [c.name for c in imported.model.contacts]
    geoms = {"cap": 1, "a_geom2": 2, "inner": 3, "other": 4, "crate": 5, "can": 6}
    rng = np.random.default_rng(4)
    for _ in range(50):
        q = np.array(m.qpos0) + rng.uniform(-0.5, 0.5, m.nq)
        for first in (3, 11, 18):
            q[first : first + 4] /= np.linalg.norm(q[first : first + 4])
        data.qpos[:] = q
        mujoco.mj_kinematics(m, data)
        gaps = values("g_N", q)
        guard = values("guard", q)
        for one, other in (("cap", "other"), ("a_geom2", "crate"), ("a_geom2", "can"),
                           ("a_geom2", "other"), ("inner", "other"), ("cap", "crate")):  # fmt: skip
            distance = mujoco.mj_geomDistance(m, data, geoms[one], geoms[other], 5.0, None)
            rows = [k for k, n in enumerate(names) if n.startswith(f"{one}_{other}")]
            smallest = min(gaps[k] for k in rows if guard[k] >= 0)
            if distance > 1e-3:
                assert smallest == pytest.approx(distance, abs=2e-6)


URDF = """<robot name="two_links"><link name="base"><inertial><mass value="3"/>
<origin xyz="0 0 .1"/><inertia ixx=".02" iyy=".03" izz=".04" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="absent.stl"/></geometry></visual></link>
<joint name="knee-1" type="revolute"><parent link="base"/><child link="leg"/>
<origin xyz="0 .1 .2" rpy=".1 .2 .3"/><axis xyz="0 1 0"/><limit lower="-1" upper="2" effort="1"
velocity="1"/><dynamics damping=".2" friction=".1"/></joint>
<link name="leg"><inertial><mass value="1"/><origin xyz="0 0 -.2"/>
<inertia ixx=".01" iyy=".012" izz=".005" ixy=".001" ixz="0" iyz="0"/></inertial>
<collision name="foot"><origin xyz="0 0 -.4"/><geometry><sphere radius=".05"/></geometry>
</collision></link></robot>"""


@pytest.mark.parametrize("floating", [False, pytest.param(True, marks=pytest.mark.thorough)])
def test_urdf(floating: bool, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(URDF)
    start = {"base_free_z": 0.9} if floating else {"knee_1": 2.0}
    imported = from_urdf(path, floating=floating, ground=True, start=start)
    values = Values(imported)
    q = np.array([0.4, 0.1, 0.9, 0.5, 0.5, -0.5, 0.5, 0.3] if floating else [0.3])
    M = np.atleast_2d(values("p_v", q))
    # about the knee: the leg's own moment and that of its distance
    assert M[-1, -1] == pytest.approx(0.012 + 0.2**2, abs=1e-15)
    assert values.coordinates[-1] == "knee_1"
    names = values.contacts
    assert names == ["knee_1_dry", "knee_1_lower", "knee_1_upper", "foot"]
    if floating:
        np.testing.assert_allclose(M[:3, :3], 4 * np.eye(3), atol=1e-12)
        assert values.coordinates[:3] == tuple(f"base_free_{c}" for c in "xyz")


def test_friction_is_mixed_as_in_the_file() -> None:
    """Priority, contacts without friction, torsional friction, pairs that are excluded."""
    text = """<mujoco model="mixed"><option><flag limit="disable"/></option><worldbody>
    <geom name="floor" type="plane" size="1 1 1" friction=".5 0 0" condim="1"/>
    <body name="A" pos="0 0 1"><freejoint/><geom name="high" size=".1" friction=".2 0 0" condim="3"
      priority="1"/></body>
    <body name="B" pos="1 0 1"><freejoint/><geom name="smooth" size=".1" condim="1"/></body>
    <body name="C" pos="2 0 1"><freejoint/><geom name="torsion" size=".1" condim="4"
      friction=".1 .01 0"/></body>
    <body name="D" pos="3 0 1"><freejoint/><geom name="ghost" size=".1"/></body>
    </worldbody><contact><exclude body1="world" body2="D"/><pair geom1="high" geom2="smooth"/>
    </contact></mujoco>"""
    imported = from_mjcf(text)
    contacts = freeze(imported.model).contacts
    assert [(c.name, c.n_F) for c in contacts] == [("high", 2), ("smooth", 0), ("torsion", 2)]
    mu = Values(imported)("mu", np.tile([0, 0, 1, 1, 0, 0, 0.0], 4))
    np.testing.assert_array_equal(mu[[0, 2]], [0.2, 0.5])
    assert imported.left_out == [
        "torsional or rolling friction of 'torsion' and 'floor': sliding friction alone is taken",
        "6 pairs of geoms that may collide: name some in pairs=[(one, other)], or give pairs=True",
        "contacts of pairs that the file lists: there is no counterpart",
        "the flag that disables limit: the model has it all the same",
    ]


def test_what_has_no_counterpart_is_listed() -> None:
    text = """<mujoco model="odd"><asset>
    <mesh name="wedge" vertex="0 0 0 .2 0 0 0 .4 0 0 0 .6"/></asset>
    <worldbody><geom name="floor" type="plane" size="1 1 1"/>
    <body name="a" pos="0 0 2"><joint name="spin" type="ball" range="0 1" limited="true"
      damping=".1"/><geom name="w" type="mesh" mesh="wedge"/></body>
    <body name="b" gravcomp="1"><joint name="h" actuatorfrcrange="-1 1" actuatorfrclimited="true"/>
      <geom name="s" size=".1" pos="0 0 1" contype="0" conaffinity="0"/>
      <site name="here" pos="0 0 1"/></body><site name="there"/></worldbody>
    <tendon><spatial name="t"><site site="here"/><site site="there"/></spatial></tendon>
    <actuator><motor name="pull" tendon="t"/><motor name="turn" joint="h"/></actuator></mujoco>"""
    assert from_mjcf(text).left_out == [
        "damping and stiffness of joint 'spin': it has a quaternion",
        "limit of joint 'spin': it has a quaternion",
        "tendon 't': only tendons along joints are taken",
        "actuator 'pull': only gains on hinges, slides and tendons along joints are taken",
        "contact of geom 'w': it is a mesh (meshes='box' takes its box)",
        "gravity compensation: add a force of your own",
    ]
    boxed: Imported = from_mjcf(text, meshes="box")
    assert not any("mesh" in line for line in boxed.left_out)
    q = np.array([1.0, 0, 0, 0, 0])
    assert 1.5 < min(Values(boxed)("g_N", q)) <= 2.0  # the wedge begins at 2


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: from_mjcf("<mujoco><worldbody><body/>"), "MuJoCo cannot read it"),
        (lambda: from_mjcf("absent.xml"), "there is no file absent.xml"),
        (lambda: from_mjcf(ARM, keyframe="home"), "keyframe 'home': is not in the file"),
        (lambda: from_mjcf(ARM, meshes="ball"), "meshes='ball': is no choice"),
        (lambda: from_urdf("<robot name='x'>"), "is no XML"),
        (lambda: from_urdf(URDF, massless=["hand"]), "massless link 'hand': is not in the file"),
        (
            lambda: from_urdf(URDF.replace('name="leg"', 'name="other"', 1), floating=True),
            "has 2 links that no joint moves",
        ),
    ],
)
def test_what_cannot_be_read_is_refused(call: Callable[[], Imported], says: str) -> None:
    with pytest.raises(sg.ModelError, match=says):
        call()


def test_a_keyframe_is_the_start() -> None:
    text = ARM.replace(
        "</mujoco>", '<keyframe><key name="home" qpos=".1 .2 .3 .4"/></keyframe></mujoco>'
    )
    for key, q in (("home", [0.1, 0.2, 0.3, 0.4]), (None, [0, 0.2, 0, 0])):  # ref is 0.2
        found = freeze(from_mjcf(text, keyframe=key).model).q0
        np.testing.assert_array_equal(np.array(ca.DM(found)).ravel(), q)


def test_without_mujoco_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'signorini\[robots\]'"):
        from_mjcf(ARM)


LEGS = ("FR", "FL", "RR", "RL")
STANCE = (0.0, 0.8, -1.6)  # of hip, thigh and calf [rad]


def quadruped() -> sg.Model:
    """The A1 on its feet; inputs are the angles that its joints are held at."""
    start = {f"{leg}_thigh_joint": STANCE[1] for leg in LEGS}
    start |= {f"{leg}_calf_joint": STANCE[2] for leg in LEGS} | {"base_free_z": 0.32}
    feet = [f"{leg}_foot" for leg in LEGS]
    path = robot_file("a1_description/urdf/a1.urdf")
    imported = from_urdf(path, floating=True, ground=["trunk", *feet], start=start)
    model = imported.model
    assert [line for line in imported.left_out if "start" in line] == []
    joints = [name for name in model.coordinate_names if name.endswith("_joint")]
    kp, kd = model.parameters(kp=150.0, kd=3.0)
    wanted = model.inputs(" ".join(f"u_{name}" for name in joints))
    for name, angle in zip(joints, wanted, strict=True):
        k = model.coordinate_names.index(name)
        model.force({name: kp * (angle - model.q[k]) - kd * model.velocities[k]})
    return model


@pytest.mark.slow
def test_a_quadruped_stands_trots_and_falls() -> None:
    """With all twelve joints held it carries its weight on four feet; with diagonal legs lifted
    in turn it walks on; without torques it falls on its trunk. Nothing penetrates."""
    stepper = sg.build(quadruped(), stages=2)
    text = robot_file("a1_description/urdf/a1.urdf").read_text()
    mass = sum(float(e.get("value", 0)) for e in ET.fromstring(text).iter("mass"))
    feet = [f"{leg}_foot" for leg in LEGS]

    stands = stepper.simulate(t_end=3.0, dt=1e-3, inputs=4 * STANCE)
    carried = [stands[f"{foot}.force_N"][-200:].mean() for foot in feet]
    assert sum(carried) == pytest.approx(9.81 * mass, rel=2e-3)
    assert min(carried) > 0.15 * 9.81 * mass
    assert np.abs(stands["base_free_z"][-1000:] - 0.294).max() < 2e-3
    upright = 1 - 2 * (stands.q[:, 4] ** 2 + stands.q[:, 5] ** 2)
    assert upright.min() > 0.999

    def trot(t: float, q: np.ndarray, v: np.ndarray) -> list[float]:
        angles = []
        for leg in LEGS:
            phase = 5 * np.pi * t + (0.0 if leg in ("FR", "RL") else np.pi)
            lift = max(0.0, np.sin(phase))
            angles += [0.0, 0.8 + 0.15 * np.cos(phase) + 0.35 * lift, -1.6 - 0.6 * lift]
        return angles

    walks = stepper.simulate(t_end=3.0, dt=1e-3, inputs=trot)
    assert walks["base_free_x"][-1] > 0.5
    assert walks["base_free_z"].min() > 0.25
    on = np.array([walks[f"{foot}.state"] != "open" for foot in feet])[:, 500:]
    together = np.mean(on[0] == on[3]), np.mean(on[1] == on[2])
    assert min(together) > 0.8  # feet of a diagonal
    assert np.mean(on[0] != on[1]) > 0.6  # in turn with the others

    falls = stepper.simulate(
        t_end=2.0, dt=1e-3, inputs=4 * STANCE, parameters={"kp": 0.0, "kd": 0.5}
    )
    half_height = 0.057  # of the box around the trunk
    assert falls["base_free_z"][-1] == pytest.approx(half_height, abs=1e-6)
    for run in (stands, walks, falls):
        assert run.smallest_gap[1:].min() > -1e-9
