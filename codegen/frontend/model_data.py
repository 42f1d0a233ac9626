"""The frozen model: what the user wrote, checked, as CasADi SX."""

from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
from signorini.codegen.frontend.table import Table


@dataclass(frozen=True)
class Parameter:
    """A run-time parameter with its default and bounds."""

    name: str
    default: float
    unit: str = ""
    min: float | None = None
    max: float | None = None
    doc: str = ""


@dataclass(frozen=True, eq=False)
class Contact:
    """A unilateral contact, or (``g_N is None``) a friction element.

    Attributes
    ----------
    g_N : SX scalar or None
        Gap, ``g_N(t, q) >= 0``; with `one_way` a velocity, affine in v.
    gamma_F : SX, shape (0 | 1 | 2, 1)
        Slip velocity, affine in v.
    mu, e_N, e_F : SX scalar
        Friction and restitution coefficients, functions of the parameters; of two friction
        coefficients the larger one.
    mu_F : SX, shape (n_F, 1), or None
        Friction coefficient of each slip component where they differ.
    presser : int or None
        Contact whose normal percussion, times mu, bounds friction: its own place among the
        contacts, for an element that of a contact before it; None where no contact does.
    load : (int, int) or None
        First bilateral row, and their number, whose percussions press friction instead.
    one_way : bool
        What may not become negative is a velocity, not a gap.
    poisson : bool
        e_N gives back percussions of the compression, not velocities.
    varies : bool
        mu is taken at every stage, not at the start of the step.
    bound : SX scalar or None
        Largest friction force of an element that nothing presses.
    guard : SX scalar or None
        The contact exists in a step iff ``guard(t_n, q_n) >= 0``.
    """

    name: str
    g_N: ca.SX | None
    gamma_F: ca.SX
    mu: ca.SX
    e_N: ca.SX
    e_F: ca.SX
    bound: ca.SX | None = None
    guard: ca.SX | None = None
    mu_F: ca.SX | None = None
    presser: int | None = None
    load: tuple[int, int] | None = None
    one_way: bool = False
    poisson: bool = False
    varies: bool = False

    @property
    def law(self) -> str:
        """The law of its friction: none, coulomb, elliptic or bound."""
        if self.bound is not None:
            return "bound"
        if not self.n_F:
            return "none"
        return "coulomb" if self.mu_F is None else "elliptic"

    @cached_property
    def n_F(self) -> int:
        """Number of slip components."""
        return int(self.gamma_F.numel())


@dataclass(frozen=True, eq=False)
class Compliance:
    """How a row of g or g_N yields: 0 <= g + relaxation dg/dt + compliance force, see
    docs/theory.md.

    Attributes
    ----------
    name : str
        Of the constraint or contact.
    row : int
        Among the percussions R = (R_g, R_gamma, R_N, R_F).
    normal : bool
        Whether it is the gap of a contact, which only presses.
    compliance, relaxation : SX scalar
        Inverse of the stiffness, and the damping over the stiffness [s].
    """

    name: str
    row: int
    normal: bool
    compliance: ca.SX
    relaxation: ca.SX


@dataclass(frozen=True, eq=False)
class ModelData:
    """A validated model in one representation.

    `t`, `q`, `v`, `u`, `par` are columns of SX symbols; every expression depends on them alone.
    `units` are those of the coordinates, empty where none were given.
    `bodies` has the names of what was declared as a body, and its coordinates.
    `shapes` has kind, name and number of points of what is drawn, `places` the points in rows.
    `own` has constants of a part that stands for several which differ in numbers: none in a model.
    """

    name: str
    symbols: str
    t: ca.SX
    q: ca.SX
    v: ca.SX
    u: ca.SX
    par: ca.SX
    coordinates: tuple[str, ...]
    velocities: tuple[str, ...]
    units: tuple[str, ...]
    bodies: tuple[tuple[str, tuple[int, ...]], ...]
    inputs: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    L: ca.SX
    f: ca.SX
    g: ca.SX
    gamma: ca.SX
    g_blocks: tuple[tuple[str, int], ...]
    gamma_blocks: tuple[tuple[str, int], ...]
    contacts: tuple[Contact, ...]
    compliances: tuple[Compliance, ...]
    outputs: tuple[tuple[str, ca.SX], ...]
    shapes: tuple[tuple[str, str, int], ...]
    places: ca.SX
    tables: tuple[tuple[str, Table], ...]
    q0: ca.SX
    v0: ca.SX
    t0: ca.SX
    doc: str = field(default="")
    dt: float = 1e-3
    t_end: float = 1.0
    own: ca.SX = field(default_factory=lambda: ca.SX(0, 1))

    @property
    def explicit_time(self) -> bool:
        """Whether forces, constraints or contacts depend on t otherwise than through the motion."""
        laws = [
            x for c in self.contacts for x in (c.g_N, c.gamma_F, c.bound, c.guard) if x is not None
        ]
        return bool(ca.depends_on(ca.vertcat(self.L, self.f, self.g, self.gamma, *laws), self.t))

    @property
    def n_q(self) -> int:
        return len(self.coordinates)

    @cached_property
    def n_g(self) -> int:
        return int(self.g.numel())

    @cached_property
    def n_gamma(self) -> int:
        return int(self.gamma.numel())

    @cached_property
    def n_N(self) -> int:
        return sum(c.g_N is not None for c in self.contacts)

    @cached_property
    def n_F(self) -> int:
        return sum(c.n_F for c in self.contacts)
