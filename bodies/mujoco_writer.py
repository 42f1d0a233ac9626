"""One compiled model of MuJoCo, written as a model of ours."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from signorini.bodies.algebra import is_zero, subtract
from signorini.bodies.frames import Frame
from signorini.bodies.mujoco_contacts import Contacts, File, Side
from signorini.bodies.mujoco_names import clean
from signorini.bodies.mujoco_tendons import Tendons, Transmission
from signorini.bodies.spatial import Spatial
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model

# Numbers that MuJoCo has for kinds of things.
_FREE, _BALL, _SLIDE, _HINGE = range(4)
_CONNECT, _WELD, _JOINT, _TENDON = range(4)
# What is left out wherever it is not zero.
_UNREAD = (
    ("jnt_stiffnesspoly", "stiffness that is not linear"),
    ("dof_dampingpoly", "damping that is not linear"),
    ("jnt_springyield", "springs that yield"),
    ("tendon_stiffnesspoly", "stiffness of tendons that is not linear"),
    ("tendon_dampingpoly", "damping of tendons that is not linear"),
    ("tendon_springyield", "springs of tendons that yield"),
    ("actuator_damping", "damping of actuators"),
    ("actuator_armature", "armature of actuators"),
    ("actuator_delay", "delay of actuators"),
    ("geom_adhesion", "adhesion"),
    ("geom_surfacevel", "velocity of surfaces"),
    ("pair_dim", "contacts of pairs that the file lists"),
)
_DISABLED = ("contact", "limit", "frictionloss", "spring", "damper", "equality", "actuation")


@dataclass
class Imported:
    """A robot from a file.

    Attributes
    ----------
    model : Model
        Contacts, outputs and another initial state may be added to it.
    world : Spatial
        The scene that it was written with.
    frames : dict of Frame
        Of every body, by its name in the file, as the file places it.
    coordinates : dict of str to tuple of str
        Names of the coordinates of each joint.
    left_out : list of str
        What the file has and the model has not, each with the reason.
    """

    model: Model
    world: Spatial
    frames: dict[str, Frame] = field(default_factory=dict)
    coordinates: dict[str, tuple[str, ...]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)


class Writer:
    """Writes the bodies, joints, actuators and contacts of a compiled model."""

    def __init__(
        self,
        m: Any,
        name: str,
        contacts: bool | Iterable[str],
        pairs: bool | list[tuple[Side, Side]],
        e_N: float,
        meshes: str | None,
        keyframe: str | None,
        start: Mapping[str, float],
    ) -> None:
        import mujoco

        self.m, self.mujoco = m, mujoco
        self.pairs, self.meshes, self.start = pairs, meshes, start
        self.contacts = contacts if isinstance(contacts, bool) else list(contacts)
        self.taken = {"e_N"}  # of symbols, constraints and contacts
        model = Model(name, symbols="casadi")
        off = m.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
        gravity = (0.0, 0.0, 0.0) if off else tuple(map(float, m.opt.gravity))
        self.out = Imported(model, Spatial(model, gravity))
        self.model, self.world = model, self.out.world
        (self.e_N,) = model.parameters(e_N=e_N)
        self.frames: list[Frame] = [self.world.ground]
        self.joints: dict[int, list[int]] = {}  # coordinates of a joint, as numbers
        self.q0 = self._configuration(keyframe)

    def _named(self, kind: str, k: int, fallback: str) -> str:
        """A name of the file that C can have, once: a file often calls a body, its joint, its geom
        and the actuator alike.
        """
        objects = getattr(self.mujoco.mjtObj, f"mjOBJ_{kind}")
        word = clean(self.mujoco.mj_id2name(self.m, objects, k) or fallback)
        if kind == "BODY":
            return word  # no name of the model
        others = {
            "ACTUATOR": f"u_{word}",
            "GEOM": f"{word}_contact",
            "EQUALITY": f"{word}_tie",
            "TENDON": f"{word}_tendon",
        }
        base, count = others.get(kind, word), 1
        while word in self.taken:
            word = base if count == 1 and base != word else f"{base}_{count + 1}"
            count += 1
        self.taken.add(word)
        return word

    def _said(self, kind: str, k: int) -> str:
        objects = getattr(self.mujoco.mjtObj, f"mjOBJ_{kind}")
        return str(self.mujoco.mj_id2name(self.m, objects, k) or f"number {k}")

    def _leave(self, what: str, why: str) -> None:
        self.out.left_out.append(f"{what}: {why}")

    def _configuration(self, keyframe: str | None) -> np.ndarray:
        if keyframe is None:
            return np.array(self.m.qpos0)
        names = [self._said("KEY", k) for k in range(self.m.nkey)]
        if keyframe not in names:
            raise ModelError(
                self.model.name,
                f"keyframe '{keyframe}'",
                "is not in the file",
                f"Give one of: {', '.join(names) or 'it has none'}",
            )
        return np.array(self.m.key_qpos[names.index(keyframe)])

    def write(self) -> Imported:
        for body in range(1, self.m.nbody):
            self._body(body)
        self._limits()
        self.tendons = Tendons(self.m, self.model, self._coordinate)
        self._tendons()
        self._equalities()
        self._actuators()
        file = File(
            self.m, self.mujoco, self.world, self.frames, self.e_N, self.meshes,
            self._named, self._said, self._leave, self._turned,
        )  # fmt: skip
        Contacts(file).write(self.contacts, self.pairs)
        for kind, count in (
            ("skin", self.m.nskin), ("flexible body", self.m.nflex),
            ("plugin", self.m.nplugin),
        ):  # fmt: skip
            if count:
                self._leave(f"{count} {kind}(s)", "there is no counterpart")
        for name, what in _UNREAD:
            if np.any(getattr(self.m, name, 0)):
                self._leave(what, "there is no counterpart")
        for word in _DISABLED:
            flag = int(getattr(self.mujoco.mjtDisableBit, f"mjDSBL_{word.upper()}"))
            if self.m.opt.disableflags & flag:
                self._leave(f"the flag that disables {word}", "the model has it all the same")
        if np.any(self.m.body_mocapid >= 0):
            self._leave("bodies that mocap moves", "they stay where they are")
        if np.any(self.m.body_gravcomp):
            self._leave("gravity compensation", "add a force of your own")
        if self.m.opt.density or self.m.opt.viscosity or np.any(self.m.opt.wind):
            self._leave("the medium (density, viscosity, wind)", "add a force of your own")
        self._start()
        return self.out

    # --- bodies and joints ---

    def _turned(self, parent: Frame, name: str, quat: np.ndarray, at: Sequence[Any]) -> Frame:
        """A frame at rest in its parent; without turning where the file does not turn it."""
        angle = 2 * np.arccos(np.clip(abs(quat[0]), 0, 1))
        axis = np.sign(quat[0] or 1) * quat[1:]
        if np.linalg.norm(axis) < 1e-12:
            angle, axis = 0.0, np.array([0.0, 0.0, 1.0])
        if angle == 0.0:
            if not np.any(np.asarray(at, dtype=float)):
                return parent
            place = parent.point(*at)
            return Frame(
                name, parent.algebra, place.position, place.velocity, parent.axes, parent.spin
            )
        return self.world.frame(name, tuple(map(float, axis)), float(angle), tuple(at), parent)

    def _body(self, body: int) -> None:
        m, name = self.m, self._named("BODY", body, f"body_{body}")
        parent = self.frames[m.body_parentid[body]]
        at = tuple(map(float, m.body_pos[body]))
        frame = self._turned(parent, name, m.body_quat[body], at)
        first, count = m.body_jntadr[body], m.body_jntnum[body]
        for joint in range(first, first + count):
            frame = self._joint(frame, joint, body, name)
        self.frames.append(frame)
        self.out.frames[self._said("BODY", body)] = frame
        mass, inertia = float(m.body_mass[body]), np.array(m.body_inertia[body])
        if mass <= 0:
            if np.any(inertia > 0):
                self._leave(f"inertia of body '{name}'", "it has no mass")
            return
        nine = np.zeros(9)
        self.mujoco.mju_quat2Mat(nine, m.body_iquat[body])
        R = nine.reshape(3, 3)
        J = R @ np.diag(inertia) @ R.T
        place = tuple(map(float, m.body_ipos[body]))
        centre = self._turned(frame, name, np.array([1.0, 0, 0, 0]), place)
        if not np.all(inertia > 0):
            # a point, or a line: what does not turn has no energy of turning
            self.world.particle(name, mass, frame.point(*place))
            return
        rows = [[float((J[i, j] + J[j, i]) / 2) for j in range(3)] for i in range(3)]
        self.world.body(name, mass, rows, frame=centre)

    def _joint(self, frame: Frame, joint: int, body: int, owner: str) -> Frame:
        m, world = self.m, self.world
        kind = m.jnt_type[joint]
        name = self._named("JOINT", joint, f"{owner}_joint" if kind != _FREE else f"{owner}_free")
        before = len(self.model.q)
        anchor = tuple(map(float, m.jnt_pos[joint]))
        axis = tuple(map(float, m.jnt_axis[joint]))
        if kind in (_FREE, _BALL):
            # the subtree turns with it
            weight = float(np.sum(m.body_inertia[body])) + float(m.body_mass[body]) * float(
                np.sum(np.square(m.body_ipos[body]))
            )
            weight = max(weight, 1e-9)
            if kind == _FREE:
                frame = world.floating(name, weight)
            else:
                turned = world.floating(name, weight, parent=frame, at=anchor)
                back = turned.point(*(-x for x in anchor))
                frame = Frame(
                    name, turned.algebra, back.position, back.velocity, turned.axes, turned.spin
                )
            if np.any(m.dof_damping[m.jnt_dofadr[joint]]) or m.jnt_stiffness[joint]:
                self._leave(f"damping and stiffness of joint '{name}'", "it has a quaternion")
            if m.dof_armature[m.jnt_dofadr[joint]] or m.dof_frictionloss[m.jnt_dofadr[joint]]:
                self._leave(f"armature and friction of joint '{name}'", "it has a quaternion")
        else:
            (q,) = self.model.coordinates(name, units="rad" if kind == _HINGE else "m")
            moved = q - float(m.qpos0[m.jnt_qposadr[joint]])
            if kind == _HINGE:
                turned = world.frame(name, axis, moved, anchor, frame)
                frame = self._turned(
                    turned, name, np.array([1.0, 0, 0, 0]), tuple(-x for x in anchor)
                )
            else:
                frame = world.frame(name, at=tuple(x * moved for x in axis), parent=frame)
            self._scalar(joint, name, q, self.model.velocities[-1])
        self.joints[joint] = list(range(before, len(self.model.q)))
        self.out.coordinates[self._said("JOINT", joint)] = tuple(
            self.model.coordinate_names[before:]
        )
        return frame

    def _scalar(self, joint: int, name: str, q: Any, v: Any) -> None:
        """Armature, stiffness, damping and dry friction of a hinge or slide."""
        m, dof = self.m, self.m.jnt_dofadr[joint]
        if m.dof_armature[dof]:
            self.world.add_energy(float(m.dof_armature[dof]) * v**2 / 2)
        if m.jnt_stiffness[joint]:
            rest = float(m.qpos_spring[m.jnt_qposadr[joint]])
            self.world.add_energy(0, float(m.jnt_stiffness[joint]) * (q - rest) ** 2 / 2)
        if m.dof_damping[dof]:
            self.model.force({name: -float(m.dof_damping[dof]) * v})
        if m.dof_frictionloss[dof]:
            self.model.friction(f"{name}_dry", gamma_F=v, bound=float(m.dof_frictionloss[dof]))

    def _coordinate(self, joint: int) -> tuple[Any, Any, str]:
        """Coordinate, velocity and name of a hinge or slide."""
        k = self.joints[joint][0]
        return self.model.q[k], self.model.velocities[k], self.model.coordinate_names[k]

    def _limits(self) -> None:
        for joint, kind in enumerate(self.m.jnt_type):
            if not self.m.jnt_limited[joint]:
                continue
            said = self._said("JOINT", joint)
            if kind not in (_HINGE, _SLIDE):
                self._leave(f"limit of joint '{said}'", "it has a quaternion")
                continue
            q, _, name = self._coordinate(joint)
            low, high = map(float, self.m.jnt_range[joint])
            self.model.contact(f"{name}_lower", g_N=q - low, e_N=self.e_N)
            self.model.contact(f"{name}_upper", g_N=high - q, e_N=self.e_N)

    def _equalities(self) -> None:
        m = self.m
        for k in range(m.neq):
            said = self._said("EQUALITY", k)
            if not m.eq_active0[k]:
                self._leave(f"equality '{said}'", "it is not active")
                continue
            data = [float(x) for x in m.eq_data[k]]
            one, other = int(m.eq_obj1id[k]), int(m.eq_obj2id[k])
            if m.eq_type[k] == _JOINT:
                q, _, _ = self._coordinate(one)
                moved = q - float(m.qpos0[m.jnt_qposadr[one]])
                follows: Any = data[0]
                if other >= 0:
                    p, _, _ = self._coordinate(other)
                    x = p - float(m.qpos0[m.jnt_qposadr[other]])
                    follows = sum(c * x**i for i, c in enumerate(data[:5]))
                self.model.constraint(self._named("EQUALITY", k, f"equality_{k}"), moved - follows)
            elif m.eq_type[k] == _CONNECT and m.eq_objtype[k] == self.mujoco.mjtObj.mjOBJ_BODY:
                a = self.frames[one].point(*data[0:3])
                b = self.frames[other].point(*data[3:6])
                apart = subtract(a.position, b.position)
                # a mechanism that is plane has nothing to say of the third direction
                rows = [row for row in apart if not is_zero(row)]
                self.model.constraint(self._named("EQUALITY", k, f"equality_{k}"), rows)
            elif m.eq_type[k] == _WELD and m.eq_objtype[k] == self.mujoco.mjtObj.mjOBJ_BODY:
                self._weld(self._named("EQUALITY", k, f"equality_{k}"), one, other, data)
            elif m.eq_type[k] == _TENDON and {one, other} <= {-1, *self.tendons.read}:
                name = self._named("EQUALITY", k, f"equality_{k}")
                self.model.constraint(name, self.tendons.follows(one, other, m.eq_data[k]))
            else:
                self._leave(
                    f"equality '{said}'",
                    "only joints, tendons along joints, connected points and welds are taken",
                )

    def _weld(self, name: str, one: int, other: int, data: list[float]) -> None:
        """A point of each body stays with that of the other, which stays turned as it is said."""
        quat = np.array(data[6:10]) / np.linalg.norm(data[6:10])
        turned = self._turned(self.frames[one], name, quat, (0.0, 0.0, 0.0))
        a, b = self.frames[one].point(*data[3:6]), self.frames[other].point(*data[0:3])
        rows = [*subtract(a.position, b.position), *self.world.aligned(turned, self.frames[other])]
        self.model.constraint(name, [row for row in rows if not is_zero(row)])

    def _tendons(self) -> None:
        for k in range(self.m.ntendon):
            if k not in self.tendons.read:
                said = self._said("TENDON", k)
                self._leave(f"tendon '{said}'", "only tendons along joints are taken")
        names = {k: self._named("TENDON", k, f"tendon_{k}") for k in self.tendons.read}
        self.tendons.act(names, self.world.algebra, self.world.add_energy, self.e_N)

    def _clamped(self, x: Any, limits: np.ndarray) -> Any:
        low, high = map(float, limits)
        return self.world.algebra.minimum(self.world.algebra.maximum(x, low), high)

    def _transmission(self, k: int) -> tuple[Transmission, int] | None:
        """What actuator k moves, and its joint, or minus one and less for a tendon."""
        m, kinds, target = self.m, self.mujoco.mjtTrn, int(self.m.actuator_trnid[k, 0])
        if m.actuator_trntype[k] == kinds.mjTRN_JOINT and m.jnt_type[target] in (_HINGE, _SLIDE):
            q, v, name = self._coordinate(target)
            return Transmission(q, v, {name: 1.0}), target
        if m.actuator_trntype[k] == kinds.mjTRN_TENDON and target in self.tendons.read:
            return self.tendons.read[target], -1 - target
        return None

    def _actuators(self) -> None:
        m, kinds = self.m, self.mujoco
        pulls: dict[int, tuple[Transmission, list[tuple[float, Any]]]] = {}  # gears, forces
        for k in range(m.nu):
            said = self._said("ACTUATOR", k)
            moved = self._transmission(k)
            gains = (int(kinds.mjtGain.mjGAIN_FIXED), int(kinds.mjtGain.mjGAIN_AFFINE))
            biases = (int(kinds.mjtBias.mjBIAS_NONE), int(kinds.mjtBias.mjBIAS_AFFINE))
            if (
                moved is None
                or m.actuator_dyntype[k] != kinds.mjtDyn.mjDYN_NONE
                or m.actuator_gaintype[k] not in gains
                or m.actuator_biastype[k] not in biases
            ):
                self._leave(
                    f"actuator '{said}'",
                    "only gains on hinges, slides and tendons along joints are taken",
                )
                continue
            along, target = moved
            gear = float(m.actuator_gear[k, 0])
            (u,) = self.model.inputs(self._named("ACTUATOR", k, f"u_{k}"))
            if m.actuator_ctrllimited[k]:
                u = self._clamped(u, m.actuator_ctrlrange[k])
            length, rate = gear * along.length, gear * along.rate
            gain: Any = float(m.actuator_gainprm[k, 0])
            if m.actuator_gaintype[k] == kinds.mjtGain.mjGAIN_AFFINE:
                gain = gain + float(m.actuator_gainprm[k, 1]) * length
                gain = gain + float(m.actuator_gainprm[k, 2]) * rate
            force = gain * u
            if m.actuator_biastype[k] == kinds.mjtBias.mjBIAS_AFFINE:
                bias = [float(x) for x in m.actuator_biasprm[k, :3]]
                force = force + bias[0] + bias[1] * length + bias[2] * rate
            if m.actuator_forcelimited[k]:
                force = self._clamped(force, m.actuator_forcerange[k])
            pulls.setdefault(target, (along, []))[1].append((gear, force))
        on: dict[str, Any] = {}  # forces by coordinate
        for target, (along, forces) in pulls.items():
            pull = sum(gear * force for gear, force in forces)
            if target < 0 and m.tendon_actfrclimited[-1 - target]:
                pull = self._limited(-1 - target, forces)
            for name, share in along.shares.items():
                on[name] = on.get(name, 0.0) + share * pull
        for joint in range(m.njnt):
            if m.jnt_actfrclimited[joint] and m.jnt_type[joint] in (_HINGE, _SLIDE):
                name = self._coordinate(joint)[2]
                if name in on:
                    on[name] = self._clamped(on[name], m.jnt_actfrcrange[joint])
        if on:
            self.model.force(on)

    def _limited(self, tendon: int, forces: list[tuple[float, Any]]) -> Any:
        """What actuators pull along a tendon; the limit is of their forces before the gears."""
        gears = {gear for gear, _ in forces}
        if len(gears) > 1:
            said = self._said("TENDON", tendon)
            self._leave(f"limit of the forces along tendon '{said}'", "their gears differ")
            return sum(gear * force for gear, force in forces)
        total = sum(force for _, force in forces)
        return gears.pop() * self._clamped(total, self.m.tendon_actfrcrange[tendon])

    # --- the start ---

    def _within(self, joint: int, x: float) -> float:
        """A start within the range of a hinge or slide."""
        if self.m.jnt_type[joint] not in (_HINGE, _SLIDE) or not self.m.jnt_limited[joint]:
            return x
        inside = float(np.clip(x, *self.m.jnt_range[joint]))
        if inside != x:
            said = self._said("JOINT", joint)
            self._leave(f"start of joint '{said}' at {x:g}", f"moved into its range, to {inside:g}")
        return inside

    def _start(self) -> None:
        q = dict(self.start)
        for joint, numbers in self.joints.items():
            first = self.m.jnt_qposadr[joint]
            for i, k in enumerate(numbers):
                name = self.model.coordinate_names[k]
                if name not in q:
                    q[name] = self._within(joint, float(self.q0[first + i]))
        self.model.initial_state(q=q)
