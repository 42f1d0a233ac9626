"""Everything that is emitted for a model: derivation, scheme, C functions, tables."""

import hashlib
import re
from dataclasses import replace
from importlib import resources
from importlib.metadata import version

import casadi as ca
import numpy as np
from signorini.codegen import schemes
from signorini.codegen.c import external, refs
from signorini.codegen.c.elimination import UNROLLED, Elimination, eliminate
from signorini.codegen.c.functions import CFunction, CParameter, FunctionWriter
from signorini.codegen.c.layout import (
    STATUSES,
    sizes,
    structs,
)
from signorini.codegen.c.manifest import manifest_hash
from signorini.codegen.c.memory import scratch
from signorini.codegen.c.printer import PRECISIONS, Precision
from signorini.codegen.c.spec import ContactRow, EmitSpec, ForwardSpec, ProblemSpec, Step
from signorini.codegen.c.tables import CTable, c_table
from signorini.codegen.derive.influence import influence
from signorini.codegen.derive.public import PUBLIC, SLOPES, arguments_of
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.forward import with_forward
from signorini.codegen.frontend.errors import GenerationError, ModelError
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.frontend.names import FILES, HEADERS
from signorini.codegen.program import Assembly, Evaluate, Inertia, Jacobian, Problem, Scheme
from signorini.version import __version__

# What a stepper is made of; each file names those that it needs by #include.
RUNTIME = ("sg_simulate.c", "sg_cell.c")
# The same where steps can be cut at their events.
LOCATED = ("sg_simulate.c", "sg_located.c", "sg_cell.c")
# The same where a tolerance chooses the sizes of steps.
ADAPTIVE = ("sg_advance.c",)
# What differentiates steps, and what it needs beside that where they can be cut.
FORWARD = ("sg_adjoint.c",)
FORWARD_LOCATED = ("sg_forward.c",)
# What stands beside the model functions.
MODEL_RUNTIME = ("sg_stable.c", "sg_cell.c")
# Beside the stepper where steps are differentiated: what other programs call.
EXTERNAL = "sg_external.c"
ALL = (*LOCATED, *ADAPTIVE, *FORWARD_LOCATED, *FORWARD, *MODEL_RUNTIME, EXTERNAL)
# The model's tables stand behind this file, which declares what they are made of.
CONTRACT = "sg_contract.h"
# Printed into the header, with the sizes of the model; the second where steps can be cut, the third
# where they are differentiated.
SCRATCH = ("sg_work.h", "sg_segment.h", "sg_forward.h")

_INCLUDE = re.compile(r'#include "(sg_\w+\.[ch])"\n')


def runtime_file(name: str) -> str:
    """The text of one file of the runtime."""
    return (resources.files("signorini.runtime") / "c" / name).read_text(encoding="utf-8")


def runtime_order(names: tuple[str, ...] = RUNTIME) -> tuple[str, ...]:
    """The files and all that they include, each behind what it includes."""
    order: list[str] = []

    def add(name: str) -> None:
        if name not in order:
            for other in _INCLUDE.findall(runtime_file(name)):
                add(other)
            order.append(name)

    for name in names:
        add(name)
    return tuple(order)


def runtime_source(names: tuple[str, ...]) -> str:
    """Plain C files of the runtime as one text, without what includes one from another."""
    parts = []
    for name in names:
        text = _INCLUDE.sub("", runtime_file(name).replace("#pragma once\n", "")).strip()
        if name not in SCRATCH:
            parts.append(f"/* ---- {name} {'-' * (86 - len(name))} */\n\n{text}\n")
    return "\n".join(parts)


def emit_spec(
    data: ModelData,
    *,
    stages: int = 3,
    scheme: str = "lobatto",
    velocity_constraints: str | None = None,
    prefix: str | None = None,
    precision: str = "double",
    events: str = "captured",
    derivatives: bool = False,
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
    precision : {"double", "float", "extended"}
        Real type of the generated code.
    events : {"captured", "located"}
        Whether steps can be cut at their events, see `build`.
    derivatives : bool
        Whether steps can be differentiated; they can be cut at their events then, too.

    Raises
    ------
    GenerationError
        For options out of range.
    """
    if derivatives:
        events = "located"
    try:
        schemes.find(scheme, "paper", events)
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
        used = events if data.contacts else "captured"  # without contacts there are no events
        form = schemes.velocity_form(data, scheme, velocity_constraints, used)
        registered, value = schemes.find(scheme, form, used)
        number = int(stages) if isinstance(stages, np.integer) else stages
        plan = registered.make(d, number, value)
        poisson = [c.name for c in data.contacts if c.poisson]
        varying = [c.name for c in data.contacts if c.varies]
        if derivatives and data.compliances:
            raise ValueError(
                f"model '{data.name}', derivatives=True: '{data.compliances[0].name}' is "
                "compliant, and compliance is not differentiated. Write the spring as a potential."
            )
        if derivatives and varying:
            raise ValueError(
                f"model '{data.name}', derivatives=True: the coefficient of '{varying[0]}' is "
                "taken at the stages, and that is not differentiated. Use mu_at='start'."
            )
        if derivatives and poisson:
            raise ValueError(
                f"model '{data.name}', derivatives=True: impacts of '{poisson[0]}' are Poisson's, "
                "and these are not differentiated. Use impact='newton'."
            )
        plan = with_forward(d, plan) if derivatives else plan
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
        seeds = plan.forward.seeds if plan.forward else {}
        self.writer = FunctionWriter(d, prefix, precision, plan.memory, seeds)
        self.sizes = sizes(data, plan)
        self.public = (*PUBLIC, *(SLOPES if plan.forward else ()))
        has = (True, bool(plan.located), bool(plan.forward))
        files = tuple(name for name, wanted in zip(SCRATCH, has, strict=True) if wanted)
        own = tuple(s for name in files for s in scratch(runtime_file(name), self.sizes, name))
        self.structs = structs(data, plan, self.sizes, own)
        self.helpers: list[CFunction] = []
        self.known_points = {s.name for s in self.structs}

    def spec(self) -> EmitSpec:
        data, plan = self.data, self.plan
        if self.sizes.n_terms:
            self.known_points.add("terms")
            self.writer.name_terms(plan.terms.values)
            self.helpers.append(
                self.writer.of_place("evaluate_terms", plan.terms.values, "terms of (t, q)")
            )
        if self.sizes.n_key:
            equation = "what the terms depend on"
            self.helpers.append(self.writer.of_place("key", plan.terms.key, equation))
        further = plan.forward.points if plan.forward else ()
        for point in (*plan.points, *further):
            if point.name in self.known_points:
                self.helpers.append(self.writer.point_function(point))
        start = self.steps(plan.start)
        problems = self.problems()
        watch = self.steps(plan.located.watch) if plan.located else ()
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
            self.writer.model_function(name, (*arguments_of(declared, self.d[name], data), "par"))
            for name, declared in self.public
            if self.d[name].numel() and (name in _CALLED or not self.d[name].is_zero())
        )
        located = plan.located
        files = runtime_order(_files(plan))
        behind = files.index(CONTRACT) + 1
        number = self.precision.number
        curves = tuple(c_table(name, t, self.precision) for name, t in data.tables)
        spec = EmitSpec(
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
            units=data.units,
            inputs=data.inputs,
            parameters=data.parameters,
            defaults=tuple(number(p.default) for p in data.parameters),
            g_blocks=data.g_blocks,
            gamma_blocks=data.gamma_blocks,
            contacts=tuple(contact_rows(data, plan.guarded)),
            compliant=tuple(c.name for c in self.data.compliances),
            yields=tuple(
                int(any(c.row == k for c in self.data.compliances)) for k in range(self.d.R.numel())
            ),
            outputs=tuple(name for name, _ in data.outputs),
            shapes=data.shapes,
            statuses=STATUSES,
            structs=self.structs,
            functions=functions,
            zeros=self._zeros(),
            helpers=tuple(self.helpers),
            consistency=self.writer.consistency(),
            bilateral=self.writer.of_place(
                "bilateral_directions",
                ca.vec(self.d.rigid_directions),
                "W_g, W_gamma by columns; zero where a row yields",
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
            watch=watch,
            adaptive=plan.adaptive,
            finish_segment=self.writer.assembly(located.finish, (_WORK,)) if located else None,
            forward=self._forward(),
            polynomials=self._polynomials(),
            types=runtime_source(files[:behind]),
            runtime=runtime_source(files[behind:]),
            model_runtime=runtime_source(runtime_order(MODEL_RUNTIME)),
            runtime_hash=hashlib.sha256(
                "".join(
                    map(
                        runtime_file,
                        runtime_order(ALL),
                    )
                ).encode()
            ).hexdigest(),
            model_hash=_model_hash(functions, data, curves),
            tools=(("SymPy", version("sympy")), ("CasADi", version("casadi"))),
            example_h=number(data.dt),
            example_steps=min(1000, round(data.t_end / data.dt)),
        )
        return replace(spec, manifest_hash=manifest_hash(spec))

    def _forward(self) -> ForwardSpec | None:
        """What differentiates a step."""
        forward = self.plan.forward
        if forward is None:
            return None
        segment = forward.finish_segment
        n = self.sizes
        sizes = {"q": n.n_q, "v": n.n_q, "u": n.n_u, "par": n.n_par}
        by = influence(self.d)
        first = len(self.helpers)
        steps = (
            self.steps(forward.start),
            tuple(self.steps(values) for values in forward.values),
            self.steps(forward.watch),
        )
        # these functions are there already: they belong to the values of a problem
        places = tuple(
            Step(part.name, ("w",)) for part in forward.places if any(t.size for t in part.targets)
        )
        helpers = tuple(self.helpers[first:])
        del self.helpers[first:]
        return ForwardSpec(
            *steps,
            places,
            helpers,
            self.writer.assembly(forward.finish, (_WORK,)),
            None if segment is None else self.writer.assembly(segment, (_WORK,)),
            by,
            tuple(int(any(k in reads for reads in by.q)) for k in range(n.n_q)),
            external.columns(sizes),
            external.blocks(by, sizes),
            runtime_source((EXTERNAL,)),
        )

    def _polynomials(self) -> tuple[tuple[str, tuple[tuple[str, ...], ...]], ...]:
        """Coefficients of the dense output by the names that they have in C."""
        located = self.plan.located
        if located is None:
            return ()
        number = self.precision.number
        return tuple(
            (name, tuple(tuple(number(float(x)) for x in row) for row in rows))
            for name, rows in (("q", located.positions), ("v", located.velocities))
        )

    def _zeros(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """Public functions with entries that are all zero, and their shapes: no C for these."""
        found = []
        for name, _ in self.public:
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
        x = R = row = 0
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
                    R=R,
                    response_row=row,
                    gap_slots=p.gap_slots,
                    last_rows=(
                        self.sizes.n_g + self.sizes.n_gamma if p.last_rows is None else p.last_rows
                    ),
                    follows=2 if p.alone else int(p.follows),
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
            R += p.n_slots * self.sizes.n_R
            row += p.n_slots
            at += sum(len(values) for _, values in _tables(p.jacobian))
        return tuple(specs)


def _files(plan: Scheme) -> tuple[str, ...]:
    """What the stepper of a scheme is made of."""
    files = (*(LOCATED if plan.located else RUNTIME), *(ADAPTIVE if plan.adaptive else ()))
    if plan.forward:
        files = (*files, *(FORWARD_LOCATED if plan.located else ()), *FORWARD)
    return files


def contact_rows(data: ModelData, guarded: tuple[bool, ...] | None = None) -> list[ContactRow]:
    """Rows of each contact in the percussion vectors."""
    rows: list[ContactRow] = []
    normal = friction = bound = 0
    varying = sum(c.bound is not None for c in data.contacts)  # behind the given bounds
    for k, c in enumerate(data.contacts):
        is_contact = c.g_N is not None
        given = c.bound is not None
        pressed = (j for j, d in enumerate(data.contacts) if j > k and d.presser == c.presser)
        rows.append(
            ContactRow(
                c.name,
                normal if is_contact else -1,
                friction,
                c.n_F,
                bound if given else -1,
                -1 if c.presser is None else c.presser,
                -1 if c.presser is None else normal if is_contact else rows[c.presser].normal,
                -1 if c.presser is None else next(pressed, -1),
                *(c.load or (0, 0)),
                varying if c.varies else -1,
                c.one_way,
                c.poisson,
                c.guard is not None if guarded is None else guarded[k],
                c.guard is not None and c.presser in (None, k),
                c.law,
            )
        )
        normal += is_contact
        bound += given
        varying += 2 * c.varies
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
    what = tuple(f for f in functions if f.name != "shapes")  # a look changes no motion
    text = repr((what, data.coordinates, data.parameters, data.inputs, curves))
    return hashlib.sha256(text.encode()).hexdigest()
