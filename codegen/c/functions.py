"""C functions as data for the templates: signature, aliases, temporaries, headed sections."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import casadi as ca
from signorini.codegen.c import refs
from signorini.codegen.c.loops import Entry
from signorini.codegen.c.printer import Precision, statements
from signorini.codegen.derive.quantities import MATRICES, QUANTITIES, Derivation
from signorini.codegen.graph import Graph, Known, Operations
from signorini.codegen.program import ARGUMENT, Assembly, Memory, Point, Ref

_LOCAL = frozenset(
    {"t", "q", "v", "u", "par", "own", "h", "R", "terms", "out", "at", "w", "real", "i_fill"}
)


@dataclass(frozen=True)
class Section:
    """Lines of C below one equation."""

    equation: str
    fills: tuple[tuple[str, int], ...]
    lines: tuple[str, ...]


@dataclass(frozen=True)
class CParameter:
    """One parameter of a C function.

    Attributes
    ----------
    name : str
        Its name.
    struct : str
        Struct that it points to, without the model's prefix; "" for reals.
    array : bool
        Whether it is an array of reals; one real otherwise.
    const : bool
        Whether the function leaves it alone.
    """

    name: str
    struct: str = ""
    array: bool = False
    const: bool = True

    def text(self, prefix: str, real: str) -> str:
        """The declaration."""
        const = "const " if self.const and (self.struct or self.array) else ""
        if self.struct:
            return f"{const}{prefix}_{self.struct} *{self.name}"
        return f"{const}{real} {self.name}" + ("[]" if self.array else "")

    @property
    def is_output(self) -> bool:
        """Whether the function writes through it."""
        return not self.const and bool(self.struct or self.array)


@dataclass(frozen=True)
class CFunction:
    """One C function as the template prints it."""

    name: str
    parameters: tuple[CParameter, ...]
    doc: tuple[str, ...]
    unused: tuple[str, ...]
    aliases: tuple[str, ...]
    temporaries: tuple[str, ...]
    sections: tuple[Section, ...]
    operations: int
    arguments: tuple[str, ...] = ()
    shape: tuple[int, ...] = ()
    scratch: int = 0  # numbers that its pieces hand on

    def declaration(self, prefix: str, real: str) -> tuple[str, ...]:
        """Parameters as the header and the source write them."""
        return tuple(p.text(prefix, real) for p in self.parameters)

    @property
    def needs_fill(self) -> bool:
        """Whether an array is filled with zeros first."""
        return any(s.fills for s in self.sections)

    @property
    def needs_loop(self) -> bool:
        """Whether statements stand in a loop over k."""
        return any(line.startswith("for (k = 0;") for s in self.sections for line in s.lines)


@dataclass(frozen=True, eq=False)
class _Block:
    equation: str
    targets: tuple[str, ...]
    values: tuple[ca.SX, ...]
    comments: tuple[str, ...]
    fills: tuple[tuple[str, int], ...] = ()
    through: tuple[str, ...] = ("out",)  # parameters that it writes through


class FunctionWriter:
    """Writes C functions of one model.

    Parameters
    ----------
    d : Derivation
        Derived functions.
    prefix : str
        Prefix of every C name.
    precision : Precision
        Real type.
    memory : Memory
        What the symbols of the scheme stand for.
    seeds : mapping from name to SX
        Symbols for changes of arguments, where the scheme is differentiated.
    kind : str
        Prefix of functions and points of one kind of parts, empty for a model that is one part.
    """

    def __init__(
        self,
        d: Derivation,
        prefix: str,
        precision: Precision,
        memory: Memory,
        seeds: Mapping[str, ca.SX],
        kind: str = "",
    ) -> None:
        self.d = d
        self.kind = kind
        self.memory = memory
        self.prefix = prefix
        self.real = "real"  # the typedef that the runtime makes in the .c file
        self.precision = precision
        data = d.data
        self._tables = {t.function: f"{prefix}_{name}" for name, t in data.tables}
        self._aliases: dict[int, tuple[str, str, str]] = {}
        self._changes = tuple(f"d{name}" for name in seeds)
        self._local = _LOCAL | set(self._changes)
        used = set(self._local)
        groups: tuple[tuple[str, ca.SX, str], ...] = (
            ("q", data.q, "q[{k}]"),
            ("v", data.v, "v[{k}]"),
            ("u", data.u, "u[{k}]"),
            ("par", data.par, "par->{name}"),
        )
        for argument, symbols, source in groups:
            for k in range(symbols.numel()):
                name = symbols[k].name()
                local = name
                while local in used:
                    local += "_"
                used.add(local)
                self._aliases[symbols[k].element_hash()] = (
                    argument,
                    local,
                    source.format(k=k, name=name),
                )
        self._terms: tuple[str, ...] = ()
        self._taken = used
        self._plain = {data.t.element_hash(): ("t", "t"), d.h.element_hash(): ("h", "h")}
        for k in range(d.R.numel()):
            self._plain[d.R[k].element_hash()] = ("R", f"R[{k}]")
        for k in range(data.own.numel()):
            self._plain[data.own[k].element_hash()] = ("own", f"own[{k}]")
        for name, seed in seeds.items():
            for k in range(seed.numel()):
                source = f"d{name}" if name in ("t", "h") else f"d{name}[{k}]"
                if name == "par":
                    source = f"dpar->{data.par[k].name()}"
                self._plain[seed[k].element_hash()] = (f"d{name}", source)

    def name_terms(self, terms: ca.SX) -> None:
        """Names under which functions read the terms of a place, from what they are."""
        names: list[str] = []
        for k in range(terms.numel()):
            name = _spoken(str(terms[k])) or f"term_{k}"
            while name in self._taken:
                name += "_"
            self._taken.add(name)
            names.append(name)
        self._terms = tuple(names)

    # --- functions of the model ------------------------------------------------------------------

    def model_function(self, name: str, arguments: Sequence[str]) -> CFunction:
        """A public function ``prefix_name(..., out)``, matrices dense and row by row."""
        return self._matrix(self.kind + name, name, self.d[name], arguments)

    def rows_of(self, name: str, chosen: Sequence[int], arguments: Sequence[str]) -> CFunction:
        """Some rows of a model function; all others are filled with zeros."""
        value = self.d[name]
        only = ca.SX(*value.shape)
        only[list(chosen), :] = value[list(chosen), :]
        return self._matrix(f"rest_of_{name}", name, only, arguments)

    def _matrix(self, named: str, name: str, value: ca.SX, arguments: Sequence[str]) -> CFunction:
        rows, columns = value.shape
        sparsity = value.sparsity()
        entries = sorted(
            (
                (i * columns + j, value.nz[k], (i, j))
                for k, (i, j) in enumerate(zip(sparsity.row(), sparsity.get_col(), strict=True))
            ),
            key=lambda e: e[0],
        )
        full = len(entries) == rows * columns
        block = _Block(
            equation_of(name),
            tuple(f"out[{k}]" for k, _, _ in entries),
            tuple(v for _, v, _ in entries),
            tuple(self._label(name, i, j, columns) for _, _, (i, j) in entries),
            () if full else (("out", rows * columns),),
        )
        shape = self.shape_of(name)
        return self._write(named, arguments, (block,), _OUT, shape, doc=(doc_of(name),))

    def shape_of(self, name: str) -> tuple[int, ...]:
        """Shape of a model function: a vector's has one number."""
        rows, columns = self.d[name].shape
        is_vector = name in QUANTITIES and name not in MATRICES
        return (rows,) if is_vector else (rows, columns)

    def point_function(self, point: Point) -> CFunction:
        """A static function that evaluates all fields of a point."""
        blocks = []
        for name, value in point.fields.items():
            stored = point.stored(name)
            if stored:
                sparsity = value.sparsity()
                rows, cols = sparsity.row(), sparsity.get_col()
                blocks.append(
                    _Block(
                        equation_of(name),
                        tuple(f"out->{name}[{i}]" for i in range(len(stored))),
                        tuple(value.nz[k] for k in stored),
                        tuple(self._label(name, rows[k], cols[k], value.shape[1]) for k in stored),
                    )
                )
        out = (CParameter("out", struct=self.kind + point.name, const=False),)
        doc = (", ".join(name for name in point.fields if point.stored(name)),)
        return self._write(
            f"{self.kind}evaluate_{point.name}",
            point.arguments,
            blocks,
            out,
            (),
            doc=doc,
            at=self.kind + point.after,
            known=point.known,
        )

    def of_place(self, name: str, column: ca.SX, equation: str) -> CFunction:
        """A static function of t, q and parameters with a column of results."""
        count = column.numel()
        block = _Block(
            equation,
            tuple(f"out[{k}]" for k in range(count)),
            tuple(column[k] for k in range(count)),
            ("",) * count,
        )
        return self._write(self.kind + name, ("t", "q", "par"), (block,), _OUT, ())

    def part_energy(self) -> CFunction:
        """The energy of a part at a state."""
        block = _Block(equation_of("energy"), ("out[0]",), (self.d["energy"],), ("",))
        return self._write(f"{self.kind}energy", ("t", "q", "v", "par"), (block,), _OUT, ())

    def initial_state(self) -> CFunction:
        """The model's initial state as a function of its parameters."""
        data = self.d.data
        blocks = [
            _Block("initial time", ("t[0]",), (data.t0,), ("",), (), ("t",)),
            _Block(
                "initial coordinates",
                tuple(f"q[{k}]" for k in range(data.n_q)),
                tuple(ca.densify(data.q0).nz[k] for k in range(data.n_q)),
                data.coordinates,
                (),
                ("q",),
            ),
            _Block(
                "initial velocities",
                tuple(f"v[{k}]" for k in range(data.n_q)),
                tuple(ca.densify(data.v0).nz[k] for k in range(data.n_q)),
                data.velocities,
                (),
                ("v",),
            ),
        ]
        out = tuple(CParameter(name, array=True, const=False) for name in "tqv")
        return self._write(
            "initial_state", ("par",), blocks, out, (), doc=("Initial state of the model file.",)
        )

    def consistency(self) -> tuple[CFunction, CFunction]:
        """Constraints and gaps, then their velocities, each with its terms summed up."""
        d = self.d
        zero = ca.SX.zeros
        u = d.data.u
        n_gamma, n_F = d.data.n_gamma, d.data.n_F
        q, v = ca.fabs(d.data.q), ca.fabs(d.data.v)
        chi = ca.vertcat(d["chi_g"], d["chi_gamma"], d["chi_N"], d["chi_F"])
        directions = ca.fabs(d["W"].T)
        gaps = ca.densify(d["g_N"])
        for k, is_velocity in enumerate(d.one_way):
            if is_velocity:
                gaps[k] = 0  # a velocity may be anything at the start: it is struck
        position = ca.vertcat(ca.densify(d["g"]), zero(n_gamma, 1), gaps, zero(n_F, 1))
        speed = ca.densify(ca.vertcat(d["g_dot"], d["gamma"], d["g_N_dot"], d["gamma_F"]))
        for c in d.data.compliances:
            position[c.row] = speed[c.row] = 0  # what yields may be compressed
        places = {
            "value": ("g, g_N", position),
            "size": ("|W^T| |q|", directions @ q),
            "guard": ("guards", d["guard"]),
        }
        rates = {
            "value": (
                "g_dot, gamma, g_N_dot, gamma_F",
                speed,
            ),
            "size": ("|W^T| |v| + |chi|", directions @ v + ca.fabs(chi)),
        }
        # inputs stand in slip velocities alone, which are free at the start
        rates = {
            field: (title, ca.substitute(value, u, zero(u.numel(), 1)))
            for field, (title, value) in rates.items()
        }
        return (
            self._consistency(f"{self.kind}evaluate_places", ("t", "q", "par"), places),
            self._consistency(f"{self.kind}evaluate_rates", ("t", "q", "v", "par"), rates),
        )

    def _consistency(
        self, name: str, arguments: Sequence[str], columns: dict[str, tuple[str, ca.SX]]
    ) -> CFunction:
        blocks = []
        for field, (title, value) in columns.items():
            full = ca.densify(value)
            count = full.numel()
            if count:
                targets = tuple(f"out->{field}[{k}]" for k in range(count))
                entries = tuple(full.nz[k] for k in range(count))
                blocks.append(_Block(title, targets, entries, ("",) * count))
        out = (CParameter("out", struct="consistency", const=False),)
        return self._write(name, arguments, blocks, out, (), doc=("Start of a run.",))

    # --- functions of the scheme -----------------------------------------------------------------

    def assembly(self, assembly: Assembly, parameters: Sequence[CParameter]) -> CFunction:
        """A static function on the work struct."""
        blocks = []
        for t in assembly.targets:
            if t.size:
                array = refs.array(t.array, t.owner)
                filled = t.fill and len(t.entries) < t.size
                blocks.append(
                    _Block(
                        t.equation,
                        tuple(f"{array}[{k}]" for k, _ in t.entries),
                        tuple(v for _, v in t.entries),
                        t.labels or ("",) * len(t.entries),
                        ((array, t.size),) if filled else (),
                        (refs.base(t.array, t.owner),),
                    )
                )
        operations = Operations([v for b in blocks for v in b.values])
        found = {s.element_hash(): self.memory.ref(s) for s in operations.used()}
        kind = self.kind
        names = {key: refs.lvalue(ref, kind) for key, ref in found.items() if ref is not None}
        read = [ref for ref in found.values() if ref is not None]
        written = [Ref(t.array, k, t.owner) for t in assembly.targets for k, _ in t.entries]
        entries = {refs.lvalue(ref, kind): refs.entry(ref, kind) for ref in (*read, *written)}
        return self._finish(
            kind + assembly.name,
            operations,
            tuple(parameters),
            blocks,
            names,
            set(self._local),
            (),
            (),
            (),
            (),
            entries={text: entry for text, entry in entries.items() if entry is not None},
        )

    # --- text ------------------------------------------------------------------------------------

    def _with_own(self, arguments: Sequence[str]) -> tuple[str, ...]:
        """Arguments of a function, with the constants of a part where its kind has some."""
        return (*arguments, *(("own",) if self.d.data.own.numel() else ()))

    def _label(self, name: str, i: int, j: int, columns: int) -> str:
        if columns == 1:
            return ""
        stem, _, variable = name.rpartition("_")
        if variable in ("q", "v", "u", "par") and stem in {*QUANTITIES}:
            return f"d{stem}[{i}]/d{variable}[{j}]"
        return f"[{i}][{j}]"

    def _write(
        self,
        name: str,
        arguments: Sequence[str],
        blocks: Sequence[_Block],
        out: tuple[CParameter, ...],
        shape: tuple[int, ...],
        doc: tuple[str, ...] = (),
        at: str = "",
        known: Known = (),
    ) -> CFunction:
        real = self.real
        arguments = self._with_own(arguments)
        declared = {
            **{name: CParameter(name) for name in ("t", "h")},
            **{name: CParameter(name, array=True) for name in (*"qvuR", "own", "terms")},
            "par": CParameter("par", struct="params"),
            "at": CParameter("at", struct=at),
        }
        declared |= {f"d{key}": replace(p, name=f"d{key}") for key, p in declared.items()}
        operations = Operations([v for b in blocks for v in b.values], known)
        symbols = {s.element_hash(): s for s in operations.used()}
        names: dict[int, str] = {}
        used: set[str] = set()
        aliases = []
        read: list[tuple[int, str]] = []
        for key, (argument, local, source) in self._aliases.items():
            if key in symbols:
                names[key] = local
                used.add(argument)
                aliases.append(f"const {real} {local} = {source};")
        for key, (argument, text) in self._plain.items():
            if key in symbols:
                names[key] = text
                used.add(argument)
        for key, s in symbols.items():
            ref = self.memory.ref(s)
            if ref is None or ref.owner != ARGUMENT:
                continue
            used.add(ref.array)
            names[key] = refs.lvalue(ref)
            if ref.array == "terms" and ref.index is not None:
                local = self._terms[ref.index]
                read.append((ref.index, f"const {real} {local} = {names[key]};"))
                names[key] = local
        aliases += [text for _, text in sorted(read)]
        missing = [s.name() for key, s in symbols.items() if key not in names]
        if missing:
            raise AssertionError(f"{name}: symbols {missing} are not arguments")
        outside = used - set(arguments)
        if outside:
            raise AssertionError(f"{name} depends on {sorted(outside)}")
        unused = tuple(a for a in arguments if a not in used)
        taken = {*self._local, *self._terms, *(local for _, local, _ in self._aliases.values())}
        parameters = (*(declared[a] for a in arguments), *out)
        return self._finish(
            name,
            operations,
            parameters,
            blocks,
            names,
            taken,
            tuple(aliases),
            unused,
            tuple(arguments),
            shape,
            doc,
        )

    def _finish(
        self,
        name: str,
        what: Operations,
        parameters: tuple[CParameter, ...],
        blocks: Sequence[_Block],
        names: dict[int, str],
        taken: set[str],
        aliases: tuple[str, ...],
        unused: tuple[str, ...],
        arguments: tuple[str, ...],
        shape: tuple[int, ...],
        doc: tuple[str, ...] = (),
        entries: Mapping[str, Entry] = MappingProxyType({}),
    ) -> CFunction:
        graph = Graph(what, names, self._tables)
        targets = [t for b in blocks for t in b.targets]
        temporaries, lines, operations = statements(
            graph,
            targets,
            [c for b in blocks for c in b.comments],
            self.real,
            self.precision,
            taken,
            entries,
        )
        written = {name for b in blocks if b.targets or b.fills for name in b.through}
        read = {ref.split("->")[0] for ref in names.values()}
        idle = tuple(p.name for p in parameters if p.is_output and p.name not in written | read)
        return CFunction(
            name=name,
            parameters=parameters,
            doc=doc,
            unused=unused + idle,
            aliases=aliases,
            temporaries=tuple(temporaries),
            sections=tuple(_sections(blocks, lines)),
            operations=operations,
            arguments=arguments,
            shape=shape,
        )


_LONGEST = 36  # letters of a name that is made of an expression
_WORDS = {"*": "", "/": "over", "+": "plus", "-": "minus", "0.5": "half"}
_TOKEN = re.compile(r"[A-Za-z_]\w*|\d+\.?\d*|[-+*/]")


def _spoken(expression: str) -> str:
    """A short expression as an identifier: b sin(phi_3) is b_sin_phi_3; empty if it is too long."""
    words = [_WORDS.get(x, x.removesuffix(".")) for x in _TOKEN.findall(expression)]
    name = "_".join(word for word in words if word)
    whole = "@" not in expression and "<" not in expression
    return name if whole and len(name) <= _LONGEST and re.fullmatch(r"[a-zA-Z]\w*", name) else ""


_OUT = (CParameter("out", array=True, const=False),)


def _sections(blocks: Sequence[_Block], lines: Sequence[Sequence[str]]) -> Iterable[Section]:
    at = 0
    for block in blocks:
        count = len(block.targets)
        body = tuple(line for group in lines[at : at + count] for line in group)
        at += count
        if body or block.fills:
            yield Section(block.equation, block.fills, body)


def equation_of(name: str) -> str:
    """The equation of a derived function, for the heading of its block."""
    if name == "common":
        return "terms that the derivatives use, too"
    if name in QUANTITIES:
        return QUANTITIES[name].equation
    stem, _, variable = name.rpartition("_")
    return f"d({equation_of(stem).split('  (')[0].split(' = ')[0]})/d{variable}"


def doc_of(name: str) -> str:
    """One line on a derived function."""
    if name in QUANTITIES:
        return QUANTITIES[name].doc
    stem, _, variable = name.rpartition("_")
    return f"derivative of {stem} with respect to {variable}"
