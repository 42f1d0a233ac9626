"""What parts of one kind are stepped with: functions, problems and tables of their scheme."""

from dataclasses import dataclass, replace

import casadi as ca
from signorini.codegen.c import refs
from signorini.codegen.c.elimination import UNROLLED, Elimination, eliminate
from signorini.codegen.c.functions import CFunction, CParameter, FunctionWriter
from signorini.codegen.c.pieces import in_pieces
from signorini.codegen.c.printer import Precision
from signorini.codegen.c.sizes import Sizes, sizes
from signorini.codegen.c.spec import ContactRow, KindSpec, ProblemSpec, Step
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.program import Assembly, Evaluate, Inertia, Jacobian, Problem, Ref, Scheme


def work_of(joins: bool) -> CParameter:
    """What generated functions work on: the scratch of the step or, where parts are joined step by
    step, what there is of each element of an island."""
    return CParameter("w", struct="element" if joins else "work", const=False)


@dataclass(frozen=True, eq=False)
class Kind:
    """Parts that are alike: what one of them says, and its scheme.

    `name` stands in front of the names of its functions; empty for a model that is one part.
    """

    name: str
    d: Derivation
    plan: Scheme

    @property
    def data(self) -> ModelData:
        """The model of one part."""
        return self.d.data


class KindBuilder:
    """Writes what the parts of one kind are stepped with.

    Parameters
    ----------
    kind : Kind
        The parts.
    prefix : str
        Prefix of all names of the model.
    precision : Precision
        Real type.
    structs : set of str
        Points that have something to store.
    at : int, first_row : int
        Where its tables, and its rows of the response table, begin.
    joins : bool
        Whether the model has couplings.
    """

    def __init__(
        self,
        kind: Kind,
        prefix: str,
        precision: Precision,
        structs: set[str],
        at: int = 0,
        first_row: int = 0,
        joins: bool = False,
    ) -> None:
        plan = kind.plan
        self.work = work_of(joins)
        self.kind = kind
        self.plan = plan
        self.precision = precision
        self.model = prefix
        self.prefix = f"{kind.name}_" if kind.name else ""
        seeds = plan.forward.seeds if plan.forward else {}
        self.writer = FunctionWriter(
            kind.d, prefix, precision, plan.memory, seeds, kind=self.prefix
        )
        self.sizes: Sizes = sizes(kind.data, plan)
        self.own = (Ref("own"),) if kind.data.own.numel() else ()
        self.helpers: list[CFunction] = []
        self.known_points = {s.removeprefix(self.prefix) for s in structs}
        self.at = at
        self.first_row = first_row

    def spec(self) -> KindSpec:
        """Everything, in the order in which C must see it."""
        plan = self.plan
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
                self._add(self.writer.point_function(point))
        start = self.steps(plan.start)
        problems = self.problems()
        watch = self.steps(plan.located.watch) if plan.located else ()
        mass_tables = _mass_tables(plan.inertia)
        data = self.kind.data
        label = f"{self.kind.name}, " if self.kind.name else ""
        tables = (
            *((f"{label}{name}", values) for name, values in mass_tables),
            *(
                (f"{label}{p.name} problem: {name}", values)
                for p in problems
                for name, values in p.tables
            ),
        )
        finish = self.writer.assembly(plan.finish, (self.work,))
        stages = ("stage_t", "stage_q", "stage_v", "stage_R")
        record = self.writer.assembly(
            plan.record,
            (
                replace(self.work, const=True),
                *(CParameter(name, array=True, const=False) for name in stages),
            ),
        )
        if self.kind.name:
            self.helpers.append(self.writer.part_energy())
        located = plan.located
        return KindSpec(
            name=self.kind.name,
            sizes=self.sizes,
            coordinates=data.coordinates,
            contacts=tuple(contact_rows(data, plan.guarded)),
            yields=tuple(
                int(any(c.row == k for c in data.compliances)) for k in range(self.kind.d.R.numel())
            ),
            mobility=plan.inertia.mobility,
            tables=tables,
            mass_places=_places(mass_tables, self.at),
            helpers=tuple(self.helpers),
            start=start,
            problems=problems,
            finish=finish,
            record=record,
            watch=watch,
            finish_segment=self.writer.assembly(located.finish, (self.work,)) if located else None,
            consistency=self.writer.consistency(),
            bilateral=self.writer.of_place(
                "bilateral_directions",
                ca.vec(self.kind.d.rigid_directions),
                "W_g, W_gamma by columns; zero where a row yields",
            ),
        )

    def _add(self, function: CFunction) -> None:
        self.helpers.extend(in_pieces(function, self.model))

    def steps(self, parts: tuple[Evaluate | Assembly, ...]) -> tuple[Step, ...]:
        steps = []
        for part in parts:
            if isinstance(part, Evaluate):
                if part.point in self.known_points:
                    values = (*part.arguments, *self.own, part.into)
                    arguments = tuple(refs.argument(a, self.precision, self.prefix) for a in values)
                    steps.append(Step(f"{self.prefix}evaluate_{part.point}", arguments))
            elif any(t.size for t in part.targets):
                self._add(self.writer.assembly(part, (self.work,)))
                steps.append(Step(self.prefix + part.name, ("w",)))
        return tuple(steps)

    def elimination(self, p: Problem) -> Elimination:
        K = next(t for t in p.jacobian.assembly.targets if t.array == "K")
        entries = frozenset(place for place, _ in K.entries)
        return eliminate(p.jacobian.K, p.n_x, entries)

    def problems(self) -> tuple[ProblemSpec, ...]:
        specs = []
        x = R = 0
        row = self.first_row
        at = self.at + sum(len(values) for _, values in _mass_tables(self.plan.inertia))
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
