"""Everything that is emitted for a model: derivation, scheme, C functions, tables."""

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import resources
from importlib.metadata import version

import numpy as np
from signorini.codegen import schemes
from signorini.codegen.c import external
from signorini.codegen.c.functions import CFunction, FunctionWriter
from signorini.codegen.c.kind import Kind, KindBuilder, contact_rows, work_of
from signorini.codegen.c.layout import STATUSES, Scratch, structs
from signorini.codegen.c.manifest import manifest_hash
from signorini.codegen.c.memory import scratch
from signorini.codegen.c.printer import PRECISIONS, Precision
from signorini.codegen.c.share import SPACES, SharedFunction
from signorini.codegen.c.shared import members, shared_function, spaces_of
from signorini.codegen.c.sizes import largest, of_island, sizes, together, with_scratch_of
from signorini.codegen.c.spec import EmitSpec, ForwardSpec, KindSpec, PartSpec, Step
from signorini.codegen.c.tables import CTable, c_table
from signorini.codegen.composition import Composition, compose
from signorini.codegen.derive.influence import influence
from signorini.codegen.derive.public import PUBLIC, SLOPES, arguments_of
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.forward import with_forward
from signorini.codegen.frontend.errors import GenerationError, ModelError
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.frontend.names import FILES, HEADERS
from signorini.codegen.program import Scheme
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
# The same where contacts join parts step by step.
JOINED = ("sg_join.c",)
JOINED_LOCATED = ("sg_assemble_segment.c",)
# What stands beside the model functions.
MODEL_RUNTIME = ("sg_stable.c", "sg_cell.c")
# Beside the stepper where steps are differentiated: what other programs call.
EXTERNAL = "sg_external.c"
ALL = (
    *(*LOCATED, *ADAPTIVE, *FORWARD_LOCATED, *FORWARD, *JOINED, *JOINED_LOCATED, *MODEL_RUNTIME),
    EXTERNAL,
)
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
    max_couplings: int | None = None,
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
    max_couplings : int, optional
        Couplings between parts that have room in a step, see `build`.

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
    if max_couplings is not None and (not isinstance(max_couplings, int) or max_couplings < 1):
        raise GenerationError(f"max_couplings = {max_couplings!r}: give a number of at least 1")
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
    try:
        used = events if data.contacts else "captured"  # without contacts there are no events
        form = schemes.velocity_form(data, scheme, velocity_constraints, used)
        registered, value = schemes.find(scheme, form, used)
        number = int(stages) if isinstance(stages, np.integer) else stages
        if derivatives:
            _refuse_derivatives(data)

        def planned(d: Derivation) -> Scheme:
            made = registered.make(d, number, value)
            return with_forward(d, made) if derivatives else made

        d = Derivation(data)
        composition = None if derivatives else compose(data)
        kinds = _kinds(composition, d, planned)
    except ValueError as error:
        raise GenerationError(str(error)) from None
    builder = _Builder(d, kinds, composition, prefix, PRECISIONS[precision], form, max_couplings)
    return builder.spec()


def _refuse_derivatives(data: ModelData) -> None:
    """Say what is not differentiated."""
    poisson = [c.name for c in data.contacts if c.poisson]
    varying = [c.name for c in data.contacts if c.varies]
    if data.compliances:
        raise ValueError(
            f"model '{data.name}', derivatives=True: '{data.compliances[0].name}' is "
            "compliant, and compliance is not differentiated. Write the spring as a potential."
        )
    if varying:
        raise ValueError(
            f"model '{data.name}', derivatives=True: the coefficient of '{varying[0]}' is "
            "taken at the stages, and that is not differentiated. Use mu_at='start'."
        )
    if poisson:
        raise ValueError(
            f"model '{data.name}', derivatives=True: impacts of '{poisson[0]}' are Poisson's, "
            "and these are not differentiated. Use impact='newton'."
        )


def _kinds(
    composition: Composition | None, d: Derivation, planned: Callable[[Derivation], Scheme]
) -> tuple[Kind, ...]:
    """The kinds of parts of a model, each with its scheme."""
    if composition is None or len(composition.parts) == 1:
        return (Kind("", d, planned(d)),)
    names = composition.names
    derived = [Derivation(data) for data in composition.kinds]
    return tuple(Kind(names[k], own, planned(own)) for k, own in enumerate(derived))


# Public functions that the runtime calls, whatever they are.
_CALLED = frozenset({"energy", "p_v", "f_q", "L_q_q", "WR_q"})


class _Builder:
    def __init__(
        self,
        d: Derivation,
        kinds: tuple[Kind, ...],
        composition: Composition | None,
        prefix: str,
        precision: Precision,
        velocity_constraints: str,
        max_couplings: int | None = None,
    ) -> None:
        self.max_couplings = max_couplings
        self.velocity_constraints = velocity_constraints
        self.composition = composition
        self.data = data = d.data
        self.d = d
        self.plan = plan = kinds[0].plan
        self.prefix = prefix
        self.precision = precision
        seeds = plan.forward.seeds if plan.forward else {}
        self.writer = FunctionWriter(d, prefix, precision, plan.memory, seeds)
        single = len(kinds) == 1 and not kinds[0].name
        self.parts = (
            _parts(composition, data, precision) if composition and not single else (_whole(d),)
        )
        each = [sizes(kind.data, kind.plan) for kind in kinds]
        couplings = sum(part.couples for part in self.parts)
        kind_of = [part.kind for part in self.parts]
        self.sizes = each[0] if single else together(each, kind_of, data, couplings, max_couplings)
        self.public = (*PUBLIC, *(SLOPES if plan.forward else ()))
        has = (True, bool(plan.located), bool(plan.forward))
        files = tuple(name for name, wanted in zip(SCRATCH, has, strict=True) if wanted)
        most = island = largest(each)
        if couplings:
            island = of_island(each, kind_of, plan, self.sizes)
            self.sizes = with_scratch_of(island, self.sizes)
        self.island = island
        own = tuple(s for name in files for s in scratch(runtime_file(name), island, name))
        used = [Scratch(f"{k.name}_" if k.name else "", k.plan) for k in kinds]
        self.adaptive = all(kind.plan.adaptive for kind in kinds)
        self.structs = structs(data, used, self.sizes, most, island, own, self.adaptive)
        known = {s.name for s in self.structs}
        self.builders: list[KindBuilder] = []
        self.kinds: list[KindSpec] = []
        at = row = 0
        for kind in kinds:
            builder = KindBuilder(kind, prefix, precision, known, at, row, couplings > 0)
            self.builders.append(builder)
            self.kinds.append(builder.spec())
            at += sum(len(values) for _, values in self.kinds[-1].tables)
            row += sum(p.n_slots for p in self.kinds[-1].problems)

    def spec(self) -> EmitSpec:
        data, plan = self.data, self.plan
        functions, shared, zeros = self._functions()
        files = runtime_order(_files(plan, self.adaptive, self.sizes.n_couplings > 0))
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
            island=self.island,
            max_couplings=self.max_couplings,
            coordinates=data.coordinates,
            velocities=data.velocities,
            units=data.units,
            inputs=data.inputs,
            parameters=data.parameters,
            defaults=tuple(number(p.default) for p in data.parameters),
            g_blocks=data.g_blocks,
            gamma_blocks=data.gamma_blocks,
            contacts=tuple(contact_rows(data, self._guarded())),
            compliant=tuple(c.name for c in self.data.compliances),
            outputs=tuple(name for name, _ in data.outputs),
            shapes=data.shapes,
            statuses=STATUSES,
            structs=self.structs,
            functions=functions,
            shared=shared,
            zeros=zeros,
            kinds=tuple(self.kinds),
            parts=self.parts,
            initial_state=self.writer.initial_state(),
            index_type=self._index_type(),
            curves=curves,
            adaptive=self.adaptive,
            forward=self._forward(),
            polynomials=self._polynomials(),
            types=runtime_source(files[:behind]),
            runtime=runtime_source(files[behind:]),
            model_runtime=runtime_source(runtime_order(MODEL_RUNTIME)),
            runtime_hash=hashlib.sha256(
                "".join(map(runtime_file, runtime_order(ALL))).encode()
            ).hexdigest(),
            model_hash=_model_hash(functions, shared, self.parts, data, curves),
            tools=(("SymPy", version("sympy")), ("CasADi", version("casadi"))),
            example_h=number(data.dt),
            example_steps=min(1000, round(data.t_end / data.dt)),
        )
        return replace(spec, manifest_hash=manifest_hash(spec))

    def _index_type(self) -> str:
        """Smallest C type that holds every entry of the tables; those of an island are int."""
        if self.sizes.n_couplings:
            return "int"
        top = max(max(v, default=0) for kind in self.kinds for _, v in kind.tables)
        if top < 256:
            return "unsigned char"
        return "unsigned short" if top < 65536 else "unsigned long"

    def _guarded(self) -> tuple[bool, ...]:
        """Which contacts exist only while their guards say so."""
        found = [False] * len(self.data.contacts)
        for part in self.parts:
            rows = self.kinds[part.kind].contacts
            for k, row in zip(part.contacts, rows, strict=True):
                found[k] = row.guarded
        return tuple(found)

    def _forward(self) -> ForwardSpec | None:
        """What differentiates a step."""
        forward = self.plan.forward
        if forward is None:
            return None
        (builder,) = self.builders
        segment = forward.finish_segment
        n = self.sizes
        sizes = {"q": n.n_q, "v": n.n_q, "u": n.n_u, "par": n.n_par}
        by = influence(self.d)
        first = len(builder.helpers)
        steps = (
            builder.steps(forward.start),
            tuple(builder.steps(values) for values in forward.values),
            builder.steps(forward.watch),
        )
        # these functions are there already: they belong to the values of a problem
        places = tuple(
            Step(part.name, ("w",)) for part in forward.places if any(t.size for t in part.targets)
        )
        return ForwardSpec(
            *steps,
            places,
            tuple(builder.helpers[first:]),
            self.writer.assembly(forward.finish, (work_of(False),)),
            None if segment is None else self.writer.assembly(segment, (work_of(False),)),
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

    def _is_shared(self, name: str) -> bool:
        """Whether the parts have shares of a function that the kinds give."""
        if name != "shapes":
            return True
        moves = any(part.shares[SPACES.index("points")] for part in self.parts)
        return moves and bool(self.composition and self.composition.drawn_alike)

    def _fixed_points(self, arguments: tuple[str, ...]) -> CFunction:
        """The points that are drawn and move with no part."""
        moving = {k for part in self.parts for k in part.shares[SPACES.index("points")]}
        fixed = [k for k in range(self.data.places.shape[0]) if k not in moving]
        return self.writer.rows_of("shapes", fixed, arguments)

    def _functions(
        self,
    ) -> tuple[
        tuple[CFunction, ...], dict[str, SharedFunction], tuple[tuple[str, tuple[int, ...]], ...]
    ]:
        """Public functions, those that parts have shares of, and those whose entries are all zero
        with their shapes: no C for these."""
        functions: list[CFunction] = []
        shared: dict[str, SharedFunction] = {}
        zeros: list[tuple[str, tuple[int, ...]]] = []
        for name, declared in self.public:
            if len(self.parts) > 1 and spaces_of(name) and self._is_shared(name):
                if not any(b.kind.d[name].numel() for b in self.builders):
                    continue
                called = name in _CALLED
                found = shared_function(name, declared, self.builders, self.data, called)
                if name == "shapes" and found.size:
                    found = replace(found, rest=self._fixed_points(found.public.arguments))
                if found.size and (found.kinds or called):
                    shared[name] = found
                    functions.append(found.public)
                elif found.size:
                    zeros.append((name, found.public.shape))
                continue
            value = self.d[name]
            if value.numel() and (name in _CALLED or not value.is_zero()):
                arguments = (*arguments_of(declared, value, self.data), "par")
                functions.append(self.writer.model_function(name, arguments))
            elif value.numel():
                zeros.append((name, self.writer.shape_of(name)))
        return tuple(functions), shared, tuple(zeros)


def _whole(d: Derivation) -> PartSpec:
    """A model that is one part."""
    data = d.data
    q, contacts, rows = (range(n) for n in (data.n_q, len(data.contacts), d.R.numel()))
    return PartSpec(data.name, 0, tuple(q), tuple(contacts), tuple(rows), ())


def _parts(composition: Composition, data: ModelData, precision: Precision) -> tuple[PartSpec, ...]:
    found = []
    for part, kind, values in zip(
        composition.parts, composition.kind_of, composition.constants, strict=True
    ):
        own = members(part, data)
        places = tuple(own[space] for space in SPACES)
        rows = (part.coordinates, part.contacts, part.rows)
        constants = tuple(precision.number(x) for x in values)
        found.append(PartSpec(part.name, kind, *rows, places, part.couples, constants))
    return tuple(found)


def _files(plan: Scheme, adaptive: bool, joins: bool) -> tuple[str, ...]:
    """What the stepper of a scheme is made of."""
    files = (*(LOCATED if plan.located else RUNTIME), *(ADAPTIVE if adaptive else ()))
    if joins:
        files = (*files, *JOINED, *(JOINED_LOCATED if plan.located else ()))
    if plan.forward:
        files = (*files, *(FORWARD_LOCATED if plan.located else ()), *FORWARD)
    return files


def _model_hash(
    functions: tuple[CFunction, ...],
    shared: Mapping[str, SharedFunction],
    parts: tuple[PartSpec, ...],
    data: ModelData,
    curves: tuple[CTable, ...],
) -> str:
    """Content hash of what the model says, independent of its source text."""
    what = tuple(f for f in functions if f.name != "shapes")  # a look changes no motion
    text = repr((what, data.coordinates, data.parameters, data.inputs, curves))
    if shared:
        text += repr((tuple(shared.values()), parts))
    return hashlib.sha256(text.encode()).hexdigest()
