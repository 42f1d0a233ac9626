"""The one frozen object that templates and the manifest are made from."""

import hashlib
import json
import re
from dataclasses import asdict, dataclass
from importlib import resources
from importlib.metadata import version
from typing import Any

import casadi as ca
import numpy as np
from signorini.codegen import schemes
from signorini.codegen.c import refs
from signorini.codegen.c.elimination import UNROLLED, Elimination, eliminate
from signorini.codegen.c.footprint import (
    DIRECTIONS,
    Footprint,
    flash_bound,
    iteration_bound,
    stack_bound,
    struct_sizes,
)
from signorini.codegen.c.functions import CFunction, CParameter, FunctionWriter, Section
from signorini.codegen.c.layout import (
    CONTACT_STATES,
    EVENT_KINDS,
    MAX_ITERATIONS,
    STATUSES,
    Field,
    Sizes,
    Struct,
    sizes,
    structs,
)
from signorini.codegen.c.printer import PRECISIONS, Precision
from signorini.codegen.c.tables import CTable, c_table
from signorini.codegen.derive.public import PUBLIC
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.frontend.errors import GenerationError, ModelError
from signorini.codegen.frontend.model_data import ModelData, Parameter
from signorini.codegen.frontend.names import FILES, HEADERS
from signorini.codegen.program import Assembly, Evaluate, Inertia, Jacobian, Problem, Scheme
from signorini.version import __version__

RUNTIME_FILES = (
    "sg_real.h",
    "sg_linalg.c",
    "sg_sparse.c",
    "sg_prox.c",
    "sg_cell.c",
    "sg_types.h",
    "sg_calls.h",
    "sg_scale.c",
    "sg_smooth.c",
    "sg_newton.c",
    "sg_path.c",
    "sg_central.c",
    "sg_least.c",
    "sg_check.c",
    "sg_solve.c",
    "sg_step.c",
    "sg_simulate.c",
    "sg_stable.c",
)

_TYPES = RUNTIME_FILES.index("sg_types.h") + 1  # the model's tables stand behind these
_TEMPLATE_MACROS = (
    *("SG", "SG_K", "SG_FLOAT", "SG_NQ", "SG_NU", "SG_NG", "SG_NGAMMA", "SG_NN", "SG_NF", "SG_NC"),
    *("SG_NK", "SG_NB", "SG_SPATIAL", "SG_DIRECTIONS", "SG_STAGES", "SG_NX_TOTAL", "SG_NL_TOTAL"),
    *("SG_PROBLEMS", "SG_TERMS", "SG_KEY", "SG_STABLE", "SG_STABLE_PHASE", "SG_MOBILITY"),
    "SG_TABULATED",
)


@dataclass(frozen=True)
class ContactRow:
    """One contact as the tables of C and Python need it."""

    name: str
    normal: int
    friction: int
    components: int
    bound: int
    guarded: bool  # exists only while its entry of work.guard is >= 0
    has_guard: bool  # the model gives a guard


@dataclass(frozen=True)
class Step:
    """One statement of a generated routine: a call of an evaluating function, or an assembly."""

    function: str
    arguments: tuple[str, ...]


@dataclass(frozen=True)
class ProblemSpec:
    """One nonlinear problem as the templates print it."""

    name: str
    equations: str
    n_x: int
    n_slots: int
    x: int
    lam: int
    response_row: int
    gap_slots: int
    last_rows: int
    follows: bool
    n_border: int
    response: tuple[tuple[str, str], ...]
    tables: tuple[tuple[str, tuple[int, ...]], ...]
    places: tuple[int, ...]
    elimination: Elimination
    unrolled: bool
    values: tuple[Step, ...]
    derivatives: tuple[Step, ...]


def _rows(group: str, blocks: tuple[tuple[str, int], ...]) -> list[tuple[str, int]]:
    """First row of every block."""
    rows, at = [], 0
    for name, count in blocks:
        rows.append((f"{group}_{name}", at))
        at += count
    return rows


def _spelled(names: list[tuple[str, int]]) -> tuple[tuple[str, int], ...]:
    """In capitals, but for names that differ by capitals alone."""
    capitals = [name.upper() for name, _ in names]
    return tuple(
        (name if capitals.count(name.upper()) > 1 else name.upper(), k) for name, k in names
    )


@dataclass(frozen=True)
class EmitSpec:
    """Everything the templates see."""

    version: str
    model: str
    doc: str
    prefix: str
    upper: str
    symbols: str
    explicit_time: bool
    scheme: str
    title: str
    stages: int
    stable_phase: float
    velocity_constraints: str
    precision: Precision
    sizes: Sizes
    coordinates: tuple[str, ...]
    velocities: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    defaults: tuple[str, ...]
    g_blocks: tuple[tuple[str, int], ...]
    gamma_blocks: tuple[tuple[str, int], ...]
    contacts: tuple[ContactRow, ...]
    outputs: tuple[str, ...]
    statuses: tuple[tuple[str, str], ...]
    structs: tuple[Struct, ...]
    functions: tuple[CFunction, ...]
    zeros: tuple[tuple[str, tuple[int, ...]], ...]
    helpers: tuple[CFunction, ...]
    consistency: tuple[CFunction, ...]
    bilateral: CFunction
    initial_state: CFunction
    index_type: str
    mobility: bool
    tables: tuple[tuple[str, tuple[int, ...]], ...]
    curves: tuple[CTable, ...]
    mass_places: tuple[int, ...]
    start: tuple[Step, ...]
    problems: tuple[ProblemSpec, ...]
    finish: CFunction
    record: CFunction
    types: str
    runtime: str
    runtime_hash: str
    model_hash: str
    tools: tuple[tuple[str, str], ...]
    example_h: str
    example_steps: int

    @property
    def slips(self) -> tuple[tuple[int, int], ...]:
        """Contact and component of every slip row."""
        return tuple((k, d) for k, c in enumerate(self.contacts) for d in range(c.components))

    @property
    def indices(self) -> tuple[tuple[str, tuple[tuple[str, int], ...]], ...]:
        """Names of places in the vectors of the interface, in groups: what of, names, indices."""
        n = self.sizes
        normal = n.n_g + n.n_gamma
        percussions = []
        for c in self.contacts:
            if c.normal >= 0:
                percussions.append((f"P_{c.name}_N", normal + c.normal))
            if c.components:
                percussions.append((f"P_{c.name}_F", normal + n.n_N + c.friction))
        groups = (
            ("coordinates in q", [(f"Q_{x}", k) for k, x in enumerate(self.coordinates)]),
            ("velocities in v", [(f"V_{x}", k) for k, x in enumerate(self.velocities)]),
            ("inputs in u", [(f"U_{x}", k) for k, x in enumerate(self.inputs)]),
            ("contacts", [(f"CONTACT_{c.name}", k) for k, c in enumerate(self.contacts)]),
            ("their first rows in P", percussions),
            ("first rows of constraints in g, and in P", _rows("G", self.g_blocks)),
            ("first rows of velocity constraints in gamma", _rows("GAMMA", self.gamma_blocks)),
            ("outputs", [(f"OUTPUT_{x}", k) for k, x in enumerate(self.outputs)]),
        )
        return tuple((what, _spelled(names)) for what, names in groups if names)

    @property
    def own_names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Macros, and other names, that every generated C file has; for two in one unit."""
        text = self.types + self.runtime
        macros = set(re.findall(r"#define (\w+)", text)) | set(_TEMPLATE_MACROS)
        words = set(re.findall(r"\b(?:sg|SG)_\w+", re.sub(r"/\*.*?\*/", " ", text, flags=re.S)))
        words |= {"sg_table", "sg_index", "real"}
        return tuple(sorted(macros)), tuple(sorted(words - macros))

    @property
    def contact_states(self) -> tuple[str, ...]:
        """Names of the states of a contact, from 0."""
        return CONTACT_STATES

    @property
    def event_kinds(self) -> tuple[str, ...]:
        """Names of the kinds of events, from 0."""
        return EVENT_KINDS

    @property
    def stable_scratch(self) -> int:
        """Reals that p_stable_step needs from its caller."""
        n = self.sizes
        return 2 * n.n_q**2 + n.n_q * max(n.n_q, n.n_g + n.n_gamma) + 2 * n.n_q

    @property
    def directions(self) -> int:
        """Most directions of a central path."""
        return DIRECTIONS

    @property
    def max_iterations(self) -> int:
        """Default of options.max_iterations."""
        return MAX_ITERATIONS

    @property
    def footprint(self) -> Footprint:
        """Memory and operations."""
        real = self.precision.size
        sizes = struct_sizes(self.structs, real)
        written = (
            *(*self.functions, *self.helpers),
            *(self.finish, self.record, *self.consistency, self.bilateral, self.initial_state),
        )
        operations = {f.name: f.operations for f in self.helpers}

        def count(steps: tuple[Step, ...]) -> int:
            return sum(operations[step.function] for step in steps)

        n = self.sizes
        scales = 6 * (n.n_mass + n.n_direction) + 20 * n.n_R
        iteration = max(
            iteration_bound(
                p.n_x,
                p.n_border,
                p.n_slots * n.n_R,
                p.n_slots * n.n_contacts,
                count(p.values) + 10 * p.n_x + 60 * p.n_slots * n.n_R + scales,
                count(p.derivatives),
                p.elimination.products,
                n.spatial,
            )
            for p in self.problems
        )
        start = count(self.start)
        if n.n_key:
            start += operations["evaluate_terms"]
        unrolled = [p.elimination for p in self.problems if p.unrolled]
        lines = sum(len(section.lines) for f in written for section in f.sections)
        lines += sum(len(e.first) + len(e.border) + len(e.solve) for e in unrolled)
        return Footprint(
            **{name: sizes[name] for name in ("state", "work", "params", "options", "info")},
            stack=stack_bound(
                real,
                max(len(f.temporaries) + len(f.aliases) for f in written),
                lines,
                sizes["consistency"],
                n.n_contacts,
            ),
            flash=flash_bound(
                lines,
                sum(f.operations for f in written),
                sum(e.products for e in unrolled),
            )
            + sum(real * c.numbers for c in self.curves),
            start=start,
            values=sum(count(p.values) for p in self.problems),
            derivatives=sum(count(p.derivatives) for p in self.problems),
            products=sum(p.elimination.products for p in self.problems),
            iteration=iteration,
            step=start + (MAX_ITERATIONS + len(self.problems)) * iteration,
        )

    @property
    def manifest_hash(self) -> str:
        """Hash of the manifest; the C code carries it, so that a loader sees any edit."""
        return hashlib.sha256(json.dumps(_manifest(self), sort_keys=True).encode()).hexdigest()


def runtime_source(names: tuple[str, ...] = RUNTIME_FILES) -> str:
    """The plain C files of the runtime, in the order in which they stand in the output."""
    folder = resources.files("signorini.runtime") / "c"
    parts = []
    for name in names:
        text = (folder / name).read_text(encoding="utf-8")
        parts.append(f"/* ---- {name} {'-' * (86 - len(name))} */\n\n{text.rstrip()}\n")
    return "\n".join(parts)


def emit_spec(
    data: ModelData,
    *,
    stages: int = 3,
    scheme: str = "lobatto",
    velocity_constraints: str | None = None,
    prefix: str | None = None,
    precision: str = "double",
) -> EmitSpec:
    """Derive everything that is emitted for a model.

    Parameters
    ----------
    data : ModelData
        The checked model.
    stages : int
        Number of stages s >= 2.
    scheme : str
        Name of a scheme of `signorini.codegen.schemes`, or ``name=number``.
    velocity_constraints : {"paper", "full_order"}, optional
        Where gamma = 0 holds, see `build`.
    prefix : str, optional
        Prefix of the C names; the model's name by default.
    precision : {"double", "float"}
        Real type of the generated code.

    Raises
    ------
    GenerationError
        For options out of range.
    """
    try:
        schemes.find(scheme, "paper")
    except ValueError as error:
        raise GenerationError(str(error)) from None
    if precision not in PRECISIONS:
        raise GenerationError(
            f"precision {precision!r} is unknown; choose one of: {', '.join(PRECISIONS)}"
        )
    prefix = data.name if prefix is None else prefix
    if not isinstance(prefix, str):
        raise GenerationError(f"prefix {prefix!r} is no text: give an identifier")
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,40}", prefix):
        raise GenerationError(f"prefix {prefix!r} is no C identifier of at most 41 characters")
    if prefix.startswith("sg_") or prefix == "sg" or "__" in prefix or prefix.endswith("_"):
        raise GenerationError(
            f"prefix {prefix!r} would collide: names starting with sg_, ending in _ or holding __ "
            "are taken"
        )
    for names, what in (
        (HEADERS, "a header of the C library"),
        (FILES, "a file of the generated folder"),
    ):
        if prefix in names:
            raise GenerationError(
                f"prefix {prefix!r} is the name of {what}: give the model another name, or a prefix"
            )
    for name in (
        *data.coordinates,
        *data.velocities,
        *data.inputs,
        *(p.name for p in data.parameters),
    ):
        if name.startswith(f"{prefix.upper()}_"):
            raise ModelError(
                data.name,
                f"the name '{name}'",
                f"begins like the macros of the generated header, {prefix.upper()}_...",
                "Choose another name, or give another prefix",
            )
    if precision == "float":
        for p in data.parameters:
            if abs(p.default) > float(np.finfo(np.float32).max):
                raise ModelError(
                    data.name,
                    f"parameter '{p.name}'",
                    f"is {p.default:g}, which single precision does not hold",
                    "Scale the model's units, or generate in double precision",
                )
    d = Derivation(data)
    try:
        form = schemes.velocity_form(data, scheme, velocity_constraints)
        registered, value = schemes.find(scheme, form)
        number = int(stages) if isinstance(stages, np.integer) else stages
        plan = registered.make(d, number, value)
    except ValueError as error:
        raise GenerationError(str(error)) from None
    return _Builder(data, d, plan, prefix, PRECISIONS[precision], form).spec()


_WORK = CParameter("w", struct="work", const=False)
# Public functions that the runtime calls, whatever they are.
_CALLED = frozenset({"energy", "p_v", "f_q", "L_q_q", "WR_q"})


class _Builder:
    def __init__(
        self,
        data: ModelData,
        d: Derivation,
        plan: Scheme,
        prefix: str,
        precision: Precision,
        velocity_constraints: str,
    ) -> None:
        self.velocity_constraints = velocity_constraints
        self.data = data
        self.d = d
        self.plan = plan
        self.prefix = prefix
        self.precision = precision
        self.writer = FunctionWriter(d, prefix, precision, plan.memory)
        self.sizes = sizes(data, plan)
        self.structs = structs(data, plan, self.sizes)
        self.helpers: list[CFunction] = []
        self.known_points = {s.name for s in self.structs}

    def spec(self) -> EmitSpec:
        data, plan = self.data, self.plan
        if self.sizes.n_terms:
            self.known_points.add("terms")
            self.helpers.append(
                self.writer.of_place("evaluate_terms", plan.terms.values, "terms of (t, q)")
            )
        if self.sizes.n_key:
            equation = "what the terms depend on"
            self.helpers.append(self.writer.of_place("key", plan.terms.key, equation))
        for point in plan.points:
            if point.name in self.known_points:
                self.helpers.append(self.writer.point_function(point))
        start = self.steps(plan.start)
        problems = self.problems()
        mass_tables = _mass_tables(plan.inertia)
        tables = (
            *mass_tables,
            *((f"{p.name} problem: {name}", values) for p in problems for name, values in p.tables),
        )
        finish = self.writer.assembly(plan.finish, (_WORK,))
        stages = ("stage_t", "stage_q", "stage_v", "stage_R")
        record = self.writer.assembly(
            plan.record,
            (
                CParameter("w", struct="work"),
                *(CParameter(name, array=True, const=False) for name in stages),
            ),
        )
        functions = tuple(
            self.writer.model_function(name, (*arguments, "par"))
            for name, arguments in PUBLIC
            if self.d[name].numel() and (name in _CALLED or not self.d[name].is_zero())
        )
        runtime = runtime_source()
        number = self.precision.number
        curves = tuple(c_table(name, t, self.precision) for name, t in data.tables)
        return EmitSpec(
            version=__version__,
            model=data.name,
            doc=data.doc,
            prefix=self.prefix,
            upper=self.prefix.upper(),
            symbols=data.symbols,
            explicit_time=data.explicit_time,
            scheme=plan.name,
            title=plan.title,
            stages=plan.stages,
            stable_phase=plan.stable_phase,
            velocity_constraints=self.velocity_constraints,
            precision=self.precision,
            sizes=self.sizes,
            coordinates=data.coordinates,
            velocities=data.velocities,
            inputs=data.inputs,
            parameters=data.parameters,
            defaults=tuple(number(p.default) for p in data.parameters),
            g_blocks=data.g_blocks,
            gamma_blocks=data.gamma_blocks,
            contacts=tuple(contact_rows(data, plan.guarded)),
            outputs=tuple(name for name, _ in data.outputs),
            statuses=STATUSES,
            structs=self.structs,
            functions=functions,
            zeros=self._zeros(),
            helpers=tuple(self.helpers),
            consistency=self.writer.consistency(),
            bilateral=self.writer.of_place(
                "bilateral_directions",
                ca.vec(ca.densify(ca.horzcat(self.d["W_g"], self.d["W_gamma"]))),
                "W_g, W_gamma by columns",
            ),
            initial_state=self.writer.initial_state(),
            index_type=_index_type(tables),
            mobility=plan.inertia.mobility,
            tables=tables,
            curves=curves,
            mass_places=_places(mass_tables, 0),
            start=start,
            problems=problems,
            finish=finish,
            record=record,
            types=runtime_source(RUNTIME_FILES[:_TYPES]),
            runtime=runtime_source(RUNTIME_FILES[_TYPES:]),
            runtime_hash=hashlib.sha256(runtime.encode()).hexdigest(),
            model_hash=_model_hash(functions, data, curves),
            tools=(("SymPy", version("sympy")), ("CasADi", version("casadi"))),
            example_h=number(data.dt),
            example_steps=min(1000, round(data.t_end / data.dt)),
        )

    def _zeros(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """Public functions with entries that are all zero, and their shapes: no C for these."""
        found = []
        for name, _ in PUBLIC:
            value = self.d[name]
            if value.numel() and value.is_zero() and name not in _CALLED:
                found.append((name, self.writer.shape_of(name)))
        return tuple(found)

    def steps(self, parts: tuple[Evaluate | Assembly, ...]) -> tuple[Step, ...]:
        steps = []
        for part in parts:
            if isinstance(part, Evaluate):
                if part.point in self.known_points:
                    values = (*part.arguments, part.into)
                    arguments = tuple(refs.argument(a, self.precision) for a in values)
                    steps.append(Step(f"evaluate_{part.point}", arguments))
            elif any(t.size for t in part.targets):
                self.helpers.append(self.writer.assembly(part, (_WORK,)))
                steps.append(Step(part.name, ("w",)))
        return tuple(steps)

    def elimination(self, p: Problem) -> Elimination:
        K = next(t for t in p.jacobian.assembly.targets if t.array == "K")
        entries = frozenset(place for place, _ in K.entries)
        return eliminate(p.jacobian.K, p.n_x, entries)

    def problems(self) -> tuple[ProblemSpec, ...]:
        specs = []
        x = lam = row = 0
        at = sum(len(values) for _, values in _mass_tables(self.plan.inertia))
        for p in self.plan.problems:
            elimination = self.elimination(p)
            specs.append(
                ProblemSpec(
                    name=p.name,
                    equations=p.equations,
                    n_x=p.n_x,
                    n_slots=p.n_slots,
                    x=x,
                    lam=lam,
                    response_row=row,
                    gap_slots=p.gap_slots,
                    last_rows=(
                        self.sizes.n_g + self.sizes.n_gamma if p.last_rows is None else p.last_rows
                    ),
                    follows=p.follows,
                    response=tuple(
                        (self.precision.number(a), self.precision.number(b)) for a, b in p.response
                    ),
                    n_border=len(p.jacobian.order),
                    tables=_tables(p.jacobian),
                    places=_places(_tables(p.jacobian), at),
                    elimination=elimination,
                    unrolled=elimination.products <= UNROLLED,
                    values=self.steps(p.values),
                    derivatives=self.steps((*p.derivatives, p.jacobian.assembly)),
                )
            )
            x += p.n_x
            lam += p.n_slots * self.sizes.n_R
            row += p.n_slots
            at += sum(len(values) for _, values in _tables(p.jacobian))
        return tuple(specs)


def contact_rows(data: ModelData, guarded: tuple[bool, ...] | None = None) -> list[ContactRow]:
    """Rows of each contact in the percussion vectors."""
    rows = []
    normal = friction = bound = 0
    for k, c in enumerate(data.contacts):
        is_contact = c.g_N is not None
        rows.append(
            ContactRow(
                c.name,
                normal if is_contact else -1,
                friction,
                c.n_F,
                -1 if is_contact else bound,
                c.guard is not None if guarded is None else guarded[k],
                c.guard is not None,
            )
        )
        normal += is_contact
        bound += not is_contact
        friction += c.n_F
    return rows


_Tables = tuple[tuple[str, tuple[int, ...]], ...]


def _tables(j: Jacobian) -> _Tables:
    """Where the entries of K, B, C and of the derivatives of the radii stand."""
    return (
        ("K_order", j.order),
        ("K_start", j.K.start),
        ("K_column", j.K.index),
        ("K_diagonal", j.K.diagonal),
        ("B_start", j.B.start),
        ("B_row", j.B.index),
        ("C_start", j.C.start),
        ("C_column", j.C.index),
        ("radius_start", j.radius.start),
        ("radius_column", j.radius.index),
    )


def _mass_tables(inertia: Inertia) -> _Tables:
    """Where the entries of the mass matrix and of W^T stand."""
    return (
        ("mass_order", inertia.order),
        ("mass_start", inertia.mass.start),
        ("mass_column", inertia.mass.index),
        ("mass_diagonal", inertia.mass.diagonal),
        ("direction_start", inertia.direction.start),
        ("direction_column", inertia.direction.index),
    )


def _places(tables: _Tables, at: int) -> tuple[int, ...]:
    """Where each of the tables begins if the first begins at `at`."""
    places = []
    for _, values in tables:
        places.append(at)
        at += len(values)
    return tuple(places)


def _index_type(tables: _Tables) -> str:
    """Smallest C type that holds every entry of the tables."""
    top = max(max(values, default=0) for _, values in tables)
    if top < 256:
        return "unsigned char"
    return "unsigned short" if top < 65536 else "unsigned long"


def _model_hash(
    functions: tuple[CFunction, ...], data: ModelData, curves: tuple[CTable, ...]
) -> str:
    """Content hash of what the model says, independent of its source text."""
    text = repr((functions, data.coordinates, data.parameters, data.inputs, curves))
    return hashlib.sha256(text.encode()).hexdigest()


def manifest(spec: EmitSpec) -> dict[str, Any]:
    """What a loader needs: names, sizes, struct layouts, function signatures, its own hash."""
    return _manifest(spec) | {"manifest_hash": spec.manifest_hash}


def _manifest(spec: EmitSpec) -> dict[str, Any]:
    return {
        "generator": f"signorini {spec.version}",
        "model": spec.model,
        "doc": spec.doc,
        "prefix": spec.prefix,
        "scheme": spec.scheme,
        "stages": spec.stages,
        "velocity_form": spec.velocity_constraints,
        "precision": spec.precision.name,
        "explicit_time": spec.explicit_time,
        "stable_phase": spec.stable_phase,
        "stable_scratch": spec.stable_scratch,
        "sizes": asdict(spec.sizes),
        "coordinates": list(spec.coordinates),
        "velocities": list(spec.velocities),
        "inputs": list(spec.inputs),
        "parameters": [asdict(p) for p in spec.parameters],
        "constraints": [list(b) for b in spec.g_blocks],
        "velocity_constraints": [list(b) for b in spec.gamma_blocks],
        "contacts": [asdict(c) for c in spec.contacts],
        "outputs": list(spec.outputs),
        "statuses": [list(s) for s in spec.statuses],
        "contact_states": list(spec.contact_states),
        "event_kinds": list(spec.event_kinds),
        "structs": {s.name: [_field(f) for f in s.fields] for s in spec.structs},
        "functions": {
            f.name: {"arguments": list(f.arguments), "shape": list(f.shape)} for f in spec.functions
        },
        "zeros": {name: list(shape) for name, shape in spec.zeros},
        "problems": [
            {
                "name": p.name,
                "n_x": p.n_x,
                "n_slots": p.n_slots,
                "x": p.x,
                "lambda": p.lam,
                "tables": {name: list(values) for name, values in p.tables},
            }
            for p in spec.problems
        ],
        "footprint": asdict(spec.footprint),
        "runtime_hash": spec.runtime_hash,
        "model_hash": spec.model_hash,
        "tools": dict(spec.tools),
    }


def _field(f: Field) -> dict[str, Any]:
    return {"name": f.name, "type": f.type, "extent": f.extent if f.dims else 0}


__all__ = ["CFunction", "EmitSpec", "Section", "emit_spec", "manifest", "runtime_source"]
