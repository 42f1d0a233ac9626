"""Directional derivatives of a scheme: every evaluation and every assembly has a twin that says how
its results change along one direction.

What changes stands in the same arrays of another owner, so that nothing here knows a scheme.
"""

from collections.abc import Iterable
from dataclasses import replace

import casadi as ca
from signorini.codegen.derive.quantities import Derivation
from signorini.codegen.program import (
    FORWARD,
    STATE,
    Argument,
    Assembly,
    Evaluate,
    Forward,
    Place,
    Point,
    Problem,
    Ref,
    Scheme,
    Target,
)

# What is measured and factorised at the start of a step has no derivative that anything asks for.
_UNASKED = frozenset({"mass", "direction", "mass_pivot", "mobility", "drift", "force_size", "no_R"})
_SUFFIX = "_forward"


def with_forward(d: Derivation, scheme: Scheme) -> Scheme:
    """The scheme with what differentiates its steps.

    Parameters
    ----------
    d : Derivation
        Derived functions of the model.
    scheme : Scheme
        Any scheme.

    Notes
    -----
    For a problem F(z, a) = 0 with unknowns z = (x, R) and data a the twin of its values gives
    F_z dz + F_a da. With dz = 0 that is the right-hand side of F_z dz = -F_a da; with the solution
    it is zero, and the fields that it went through are those that the next problem reads.
    """
    return replace(scheme, forward=_Twins(d, scheme).forward())


class _Twins:
    def __init__(self, d: Derivation, scheme: Scheme) -> None:
        data = d.data
        self.scheme = scheme
        self.symbols = {
            "t": data.t, "q": data.q, "v": data.v, "u": data.u, "par": data.par, "h": d.h, "R": d.R,
        }  # fmt: skip
        self.seeds = {name: ca.SX.sym(f"d{name}", x.numel(), 1) for name, x in self.symbols.items()}
        self.points = {point.name: point for point in scheme.points}
        self.twins = {name: self.point(point) for name, point in self.points.items()}
        self.places = {place: point for point, place, _ in scheme.places}

    def forward(self) -> Forward:
        scheme = self.scheme
        located = scheme.located
        start = self.steps(scheme.start)
        values = tuple(self.steps(p.values) for p in scheme.problems)
        watch = self.steps(located.watch) if located else ()
        segment = located.finish if located else None
        places: tuple[Assembly, ...] = ()
        if located and segment:
            places = self.places_for(scheme.problems[located.chain], segment)
        used = {
            step.point for part in (start, *values, watch) for step in part
            if isinstance(step, Evaluate)
        }  # fmt: skip
        return Forward(
            seeds=self.seeds,
            points=tuple(p for p in self.twins.values() if p.name in used),
            start=start,
            values=values,
            watch=watch,
            finish=self.assembly(scheme.finish),
            places=places,
            finish_segment=self.assembly(segment) if segment else None,
        )

    def places_for(self, problem: Problem, finish: Assembly) -> tuple[Assembly, ...]:
        """The assemblies of a problem that its end is made of."""
        values = ca.vertcat(*(entry for t in finish.targets for _, entry in t.entries))
        refs = [self.scheme.memory.ref(symbol) for symbol in ca.symvar(values)]
        read = {ref.array for ref in refs if ref is not None}
        return tuple(
            self.assembly(part)
            for part in problem.values
            if isinstance(part, Assembly) and any(t.array in read for t in part.targets)
        )

    def point(self, point: Point) -> Point:
        """How the fields of a point change with its arguments."""
        names = self.arguments(point)
        x = ca.vertcat(*(self.symbols[name] for name in names))
        dx = ca.vertcat(*(self.seeds[name] for name in names))
        fields = {}
        for name, value in point.fields.items():
            if name != "common":  # only the derivatives of the same point read it
                change = ca.jtimes(ca.vec(ca.densify(value)), x, dx)
                fields[name] = ca.sparsify(ca.reshape(change, *value.shape))
        return Point(f"{point.name}{_SUFFIX}", (*names, *(f"d{name}" for name in names)), fields)

    def arguments(self, point: Point) -> list[str]:
        """Arguments that are numbers; terms that are shared are computed anew."""
        return [name for name in point.arguments if name in self.symbols]

    def steps(self, parts: Iterable[Evaluate | Assembly]) -> tuple[Evaluate | Assembly, ...]:
        twins: list[Evaluate | Assembly] = []
        for part in parts:
            if isinstance(part, Assembly):
                twins.append(self.assembly(part))
            elif part.point != "terms":
                twins.append(self.call(part))
        return tuple(twins)

    def call(self, part: Evaluate) -> Evaluate:
        point = self.points[part.point]
        own = [
            a for a, name in zip(part.arguments, point.arguments, strict=True)
            if name in self.symbols
        ]  # fmt: skip
        assert isinstance(part.into, Place)
        return Evaluate(
            f"{part.point}{_SUFFIX}",
            (*own, *map(_change, own)),
            replace(part.into, owner=FORWARD),
        )

    def assembly(self, part: Assembly) -> Assembly:
        """How entries change with the numbers that they are made of."""
        memory = self.scheme.memory
        targets = []
        for target in part.targets:
            if target.array in _UNASKED:
                continue
            value = ca.vertcat(ca.SX(0, 1), *(entry for _, entry in target.entries))
            symbols = ca.symvar(value)
            changes = []
            for symbol in symbols:
                ref = memory.ref(symbol)
                assert ref is not None
                changes.append(self.change(ref))
            change = ca.SX.zeros(value.numel(), 1)
            if symbols:
                change = ca.jtimes(value, ca.vertcat(*symbols), ca.vertcat(*changes))
            entries = tuple((k, change[i]) for i, (k, _) in enumerate(target.entries))
            targets.append(
                Target(target.array, target.size, entries, target.fill,
                       f"change of {target.array}", FORWARD)
            )  # fmt: skip
        return Assembly(f"{part.name}{_SUFFIX}", tuple(targets))

    def change(self, ref: Ref) -> ca.SX:
        """The change of a number, or of an entry of a field, which may be none."""
        if ref.owner == STATE or ref.array in _UNASKED:
            return ca.SX(0)
        if not ref.field:
            return self.scheme.memory[replace(ref, owner=FORWARD)]
        name, index = ref.field
        point = self.places[ref.array]
        own, twin = self.points[point].fields[name], self.twins[point].fields[name]
        k = self.points[point].stored(name)[index]
        row, column = own.sparsity().row()[k], own.sparsity().get_col()[k]
        nonzero = twin.sparsity().get_nz(row, column)
        if nonzero < 0:
            return ca.SX(0)
        if twin.nz[nonzero].is_constant():
            return twin.nz[nonzero]
        field = (name, self.twins[point].stored(name).index(nonzero))
        return self.scheme.memory[replace(ref, owner=FORWARD, field=field)]


def _change(argument: Argument) -> Argument:
    """The change of an argument, where it stands."""
    if isinstance(argument, Ref) and argument.array in _UNASKED:
        return argument  # zeros, whatever happens
    return replace(argument, owner=FORWARD)
