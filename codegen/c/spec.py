"""The one frozen object that templates and the manifest are made from."""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import accumulate

from signorini.codegen.c.elimination import Elimination
from signorini.codegen.c.external import Pattern
from signorini.codegen.c.footprint import (
    ADAPTIVE_FLASH,
    LOCATED_FLASH,
    Footprint,
    flash_bound,
    iteration_bound,
    located_bound,
    stack_bound,
    struct_sizes,
)
from signorini.codegen.c.functions import CFunction
from signorini.codegen.c.layout import (
    CONTACT_STATES,
    EVENT_KINDS,
    ITERATIONS_OF_PART,
    MAX_ITERATIONS,
    SPATIAL_ITERATIONS,
    Struct,
)
from signorini.codegen.c.printer import Precision
from signorini.codegen.c.share import SharedFunction
from signorini.codegen.c.sizes import MAX_EVENTS, Sizes, largest
from signorini.codegen.c.tables import CTable
from signorini.codegen.derive.influence import Influence
from signorini.codegen.frontend.model_data import Parameter

_MODEL_MACROS = (
    *("SG_N_Q", "SG_N_G", "SG_N_GAMMA", "SG_STABLE", "SG_STABLE_PHASE", "SG_TABULATED"),
    *("SG_SPATIAL", "SG_N_PARTS", "SG_MOST_Q", "SG_MOST_R"),
)
_TEMPLATE_MACROS = (
    *("SG", "SG_K", "SG_FLOAT", "SG_EXTENDED", "SG_SPATIAL", "SG_MOST_Q"),
    *("SG_MOST_CONTACTS", "SG_MOST_EVENTS", "SG_N_ELEMENTS", "SG_JOINS"),
    *("SG_UNROLLED", "SG_TABULATED", "SG_LOCATED", "SG_DERIVATIVES"),
)


# Tables of each kind of parts, and of what each part has of the model.
_TABLES = ("contacts", "slips", "problems", "one_way", "yielding", "poisson")
_SHARES = ("sg_share", "sg_shares", "sg_share_own", "sg_places", "sg_counts")


def _names(
    text: str, macros: tuple[str, ...], words: tuple[str, ...] = ()
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Macros, and other names, that a text of the runtime defines or uses."""
    defined = set(re.findall(r"#define (\w+)", text)) | set(macros)
    used = set(re.findall(r"\b(?:sg|SG)_\w+", re.sub(r"/\*.*?\*/", " ", text, flags=re.S)))
    return tuple(sorted(defined)), tuple(sorted((used | {*words, "real"}) - defined))


@dataclass(frozen=True)
class ContactRow:
    """One contact as the tables of C and Python need it."""

    name: str
    normal: int
    friction: int
    components: int
    bound: int
    presser: int  # contact that presses its friction, -1: the bound is given
    pressing: int  # normal row of that contact
    next: int  # next element that the same contact presses, -1: none
    load: int  # first bilateral row that presses its friction
    loads: int  # their number, 0: none
    varies: int  # where its coefficient stands among the radii, -1: it holds for the step
    one_way: bool  # its normal row is a velocity
    poisson: bool  # restitution is of percussions
    guarded: bool  # exists only while its entry of work.guard is >= 0
    has_guard: bool  # the model gives a guard
    law: str  # of its friction: none, coulomb, elliptic or bound


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
    R: int
    response_row: int
    gap_slots: int
    last_rows: int
    follows: int  # 0 no, 1 the problem before, 2 what is said from outside
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
class ForwardSpec:
    """Changes of a step along a direction: calls, problem by problem, and what they call."""

    start: tuple[Step, ...]
    values: tuple[tuple[Step, ...], ...]
    watch: tuple[Step, ...]
    places: tuple[Step, ...]
    helpers: tuple[CFunction, ...]
    finish: CFunction
    finish_segment: CFunction | None
    influence: Influence
    read: tuple[int, ...]  # whether anything depends on the place of a coordinate
    columns: tuple[tuple[str, Pattern], ...]  # of the arguments of an external function
    blocks: tuple[tuple[str, Pattern], ...]  # of its derivative
    external: str  # what stands in its file besides


@dataclass(frozen=True)
class KindSpec:
    """Parts of a model that are alike; a model that is one part has one kind, without a name."""

    name: str
    sizes: Sizes
    coordinates: tuple[str, ...]  # of the first of them
    contacts: tuple[ContactRow, ...]
    yields: tuple[int, ...]  # for every percussion whether its row does
    mobility: bool
    tables: tuple[tuple[str, tuple[int, ...]], ...]
    mass_places: tuple[int, ...]
    helpers: tuple[CFunction, ...]
    start: tuple[Step, ...]
    problems: tuple[ProblemSpec, ...]
    finish: CFunction
    record: CFunction
    watch: tuple[Step, ...]
    finish_segment: CFunction | None
    consistency: tuple[CFunction, ...]
    bilateral: CFunction

    @property
    def prefix(self) -> str:
        """What its functions begin with, behind the prefix of the model."""
        return f"{self.name}_" if self.name else ""

    @property
    def slips(self) -> tuple[tuple[int, int], ...]:
        """Contact and component of every slip row."""
        return tuple((k, d) for k, c in enumerate(self.contacts) for d in range(c.components))

    @property
    def one_way(self) -> tuple[int, ...]:
        """Whether each normal row is a velocity."""
        return tuple(int(c.one_way) for c in self.contacts if c.normal >= 0)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Its numbers as the struct sg_kind holds them."""
        n = self.sizes
        return (
            *(n.n_q, n.n_g, n.n_gamma, n.n_N, n.n_F, n.n_R, n.n_contacts, n.n_bounds),
            *(n.n_compliance, n.n_loads, n.n_key, n.n_terms),
            *(int(n.spatial), int(self.mobility)),
        )

    @property
    def written(self) -> tuple[CFunction, ...]:
        """All functions, in the order in which C must see them."""
        segment = (self.finish_segment,) if self.finish_segment else ()
        return (*self.helpers, self.finish, self.record, *segment, *self.consistency)


@dataclass(frozen=True)
class PartSpec:
    """One part of a model: name, kind, and places among those of the model."""

    name: str
    kind: int
    coordinates: tuple[int, ...]
    contacts: tuple[int, ...]
    rows: tuple[int, ...]
    shares: tuple[tuple[int, ...], ...]  # space by space, as SPACES counts them
    couples: bool = False  # contacts between parts, which have the coordinates
    constants: tuple[str, ...] = ()  # of its kind, as C writes them


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
    island: Sizes  # of what may be stepped at once
    max_couplings: int | None  # as it was asked for
    coordinates: tuple[str, ...]
    velocities: tuple[str, ...]
    units: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    defaults: tuple[str, ...]
    g_blocks: tuple[tuple[str, int], ...]
    gamma_blocks: tuple[tuple[str, int], ...]
    contacts: tuple[ContactRow, ...]
    compliant: tuple[str, ...]  # constraint or contact of every row that yields
    outputs: tuple[str, ...]
    shapes: tuple[tuple[str, str, int], ...]
    statuses: tuple[tuple[str, str], ...]
    structs: tuple[Struct, ...]
    functions: tuple[CFunction, ...]
    shared: Mapping[str, SharedFunction]  # those that are made of what they are of each part
    zeros: tuple[tuple[str, tuple[int, ...]], ...]
    kinds: tuple[KindSpec, ...]
    parts: tuple[PartSpec, ...]
    initial_state: CFunction
    index_type: str
    curves: tuple[CTable, ...]
    adaptive: bool
    forward: ForwardSpec | None
    polynomials: tuple[tuple[str, tuple[tuple[str, ...], ...]], ...]
    types: str
    runtime: str
    model_runtime: str
    runtime_hash: str
    model_hash: str
    tools: tuple[tuple[str, str], ...]
    example_h: str
    example_steps: int
    manifest_hash: str = ""

    @property
    def single(self) -> bool:
        """Whether the model is one part."""
        return len(self.parts) == 1

    @property
    def joins(self) -> bool:
        """Whether contacts join parts step by step."""
        return self.sizes.n_couplings > 0

    @property
    def joined_macros(self) -> tuple[tuple[str, int], ...]:
        """Sizes of what parts keep and, where contacts join parts, of islands."""
        n, most = self.island, self.most
        own = (
            ("SG_OWN_X_KEPT", most.n_x_kept),
            ("SG_OWN_ROWS_KEPT", most.n_rows_kept),
            ("SG_OWN_KEY", most.n_key),
            ("SG_OWN_TERMS", most.n_terms),
        )
        if not self.joins:
            return own
        return (
            *own,
            ("SG_OWN_Q", most.n_q),
            ("SG_ISLAND_SLIPS", max(n.n_F, 1)),
            ("SG_ISLAND_GAPS", max(n.n_N, 1)),
            ("SG_BLOCKS_KEPT", n.n_x_kept // n.n_q),
            ("SG_SLOTS_KEPT", n.n_rows_kept // n.n_R),
        )

    @property
    def element(self) -> str:
        """The struct that generated functions work on."""
        return f"{self.prefix}_{'element' if self.joins else 'work'}"

    @property
    def first_members(self) -> tuple[int, ...]:
        """Where the places of each part begin in the table of all parts."""
        counts = (len(p.coordinates) + len(p.contacts) + len(p.rows) for p in self.parts)
        return tuple(accumulate(counts, initial=0))

    @property
    def constants(self) -> bool:
        """Whether a kind stands for parts that differ in numbers."""
        return any(part.constants for part in self.parts)

    @property
    def first_constants(self) -> tuple[int, ...]:
        """Where the constants of each part begin in the table of all; 0 where it has none."""
        firsts = accumulate((len(part.constants) for part in self.parts), initial=0)
        return tuple(
            first if part.constants else 0 for first, part in zip(firsts, self.parts, strict=False)
        )

    @property
    def first_shares(self) -> tuple[tuple[int, ...], ...]:
        """Where the places of each part begin, space by space."""
        found, at = [], 0
        for part in self.parts:
            first = []
            for places in part.shares:
                first.append(at)
                at += len(places)
            found.append(tuple(first))
        return tuple(found)

    @property
    def share_counts(self) -> tuple[tuple[int, ...], ...]:
        """How many places a part of each kind has, space by space."""
        first = {part.kind: part for part in reversed(self.parts)}
        return tuple(
            tuple(len(places) for places in first[k].shares) for k in range(len(self.kinds))
        )

    def calls(self, kind: KindSpec, name: str) -> bool:
        """Whether parts of a kind have a function."""
        return kind.sizes.n_key > 0 or name not in ("key", "evaluate_terms")

    @property
    def tables(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """Where the entries of all sparse matrices stand."""
        return tuple(table for kind in self.kinds for table in kind.tables)

    @property
    def problems(self) -> tuple[ProblemSpec, ...]:
        """The problems of all kinds."""
        return tuple(p for kind in self.kinds for p in kind.problems)

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
    def located(self) -> bool:
        """Whether steps can be cut at their events."""
        return self.kinds[0].finish_segment is not None

    @property
    def events(self) -> str:
        """What happens at an impact within a step, as `build` is asked for it."""
        return "located" if self.located else "captured"

    @property
    def most(self) -> Sizes:
        """Sizes of the largest part."""
        return largest([kind.sizes for kind in self.kinds])

    @property
    def energy(self) -> tuple[CFunction, ...]:
        """Public functions that the stepper itself calls, and that stand in its file."""
        return tuple(f for f in self.functions if f.name == "energy")

    @property
    def model_functions(self) -> tuple[CFunction, ...]:
        """Public functions that have a file of their own."""
        return tuple(f for f in self.functions if f.name != "energy")

    @property
    def model_names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Macros, and other names, of the file of model functions; for two files in one unit."""
        macros = ("SG", "SG_K", "SG_FLOAT", "SG_EXTENDED", *_MODEL_MACROS)
        return _names(self.model_runtime, macros, () if self.single else _SHARES)

    @property
    def size_macros(self) -> tuple[tuple[str, int], ...]:
        """Sizes that the runtime asks for, by the names that they have there."""
        names = re.findall(r"\bSG_N_\w+", self.types + self.runtime)
        sizes = {f"SG_{name.upper()}": size for name, size in asdict(self.sizes).items()}
        return tuple((name, size) for name, size in sizes.items() if name in names)

    @property
    def own_names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Macros, and other names, that every generated C file has; for two in one unit."""
        sizes = (name for name, _ in self.size_macros)
        owners = ("", *(kind.prefix for kind in self.kinds if kind.prefix))
        return _names(
            self.types + self.runtime,
            (*_TEMPLATE_MACROS, *sizes, *(name for name, _ in self.joined_macros)),
            ("sg_table", "sg_index", *(f"sg_{own}{name}" for own in owners for name in _TABLES)),
        )

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
        return max(
            2 * n.n_q**2 + n.n_q * max(n.n_q, n.n_g + n.n_gamma) + 2 * n.n_q
            for n in (kind.sizes for kind in self.kinds)
        )

    @property
    def max_iterations(self) -> int:
        """Default of options.max_iterations: more in space, and where many bodies may be one."""
        joined = ITERATIONS_OF_PART * self.sizes.n_parts if self.joins else 0
        spatial = SPATIAL_ITERATIONS if self.sizes.spatial else MAX_ITERATIONS
        return max(spatial, joined)

    @property
    def footprint(self) -> Footprint:
        """Memory and operations of the stepper; its model functions have a file of their own."""
        real = self.precision.size
        sizes = struct_sizes(self.structs, real)
        written = (
            *self.energy,
            *(f for kind in self.kinds for f in kind.written),
            self.initial_state,
        )
        works = [self._work_of(self.kinds[part.kind]) for part in self.parts]
        step, start = (sum(work[name] for work in works) for name in ("step", "start"))
        iteration = max(work["iteration"] for work in works)
        look = sum(work["look"] for work in works)
        unrolled = [p.elimination for p in self.problems if p.unrolled]
        lines = sum(len(section.lines) for f in written for section in f.sections)
        lines += sum(len(e.first) + len(e.border) + len(e.solve) for e in unrolled)
        return Footprint(
            **{name: sizes[name] for name in ("state", "work", "params", "options", "info")},
            control=sizes.get("control", 0),
            stack=stack_bound(
                real,
                max(len(f.temporaries) + len(f.aliases) for f in written)
                + max(f.scratch for f in written),
                lines,
                sizes["consistency"],
                self.sizes.n_contacts,
            )
            + (sizes["info"] if self.located else 0),
            flash=flash_bound(
                lines,
                sum(max(f.operations, 0) for f in written),
                sum(e.products for e in unrolled),
                self.sizes.n_contacts > 1 or any(c.law != "none" for c in self.contacts),
                any(c.law == "elliptic" for c in self.contacts),
            )
            + sum(real * c.numbers for c in self.curves)
            + (LOCATED_FLASH if self.located else 0)
            + (ADAPTIVE_FLASH if self.adaptive else 0),
            start=start,
            **{
                name: sum(work[name] for work in works)
                for name in ("values", "derivatives", "products")
            },
            iteration=iteration,
            step=step,
            located=located_bound(
                step,
                self.max_iterations,
                iteration,
                start,
                look,
                self.sizes.n_contacts,
                MAX_EVENTS,
            )
            if self.located
            else 0,
        )

    def _work_of(self, kind: KindSpec) -> dict[str, int]:
        """Operations that a part of a kind takes in a step."""
        operations = {f.name: f.operations for f in kind.helpers}

        def count(steps: tuple[Step, ...]) -> int:
            return sum(operations[step.function] for step in steps)

        n = kind.sizes
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
            for p in kind.problems
        )
        start = count(kind.start)
        if n.n_key:
            start += operations[f"{kind.prefix}evaluate_terms"]
        return {
            "start": start,
            "iteration": iteration,
            "step": start + (self.max_iterations + len(kind.problems)) * iteration,
            # positions and velocities on the dense output, then what the model says there
            "look": 8 * (self.stages + 2) * n.n_q + count(kind.watch),
            "values": sum(count(p.values) for p in kind.problems),
            "derivatives": sum(count(p.derivatives) for p in kind.problems),
            "products": sum(p.elimination.products for p in kind.problems),
        }
