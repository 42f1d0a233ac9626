"""Structs of the C interface: one table for the header, the manifest and the loader."""

from collections.abc import Sequence
from dataclasses import dataclass

from signorini.codegen.c.sizes import Sizes
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.program import COEFFICIENTS, Point, Scheme

STATUSES: tuple[tuple[str, str], ...] = (
    ("OK", "solved"),
    ("OK_RESCUED", "solved after a rescue"),
    ("OK_SUBSTEPPED", "solved in substeps"),
    ("BAD_ARGUMENT", "an argument, option or coefficient is out of its range"),
    ("NONFINITE", "a state, input or model function is infinite or not a number"),
    (
        "SINGULAR",
        "the mass matrix is singular or indefinite, or the smooth part of the Jacobian singular",
    ),
    ("NOT_CONVERGED", "the iteration did not converge"),
    ("REJECTED", "the solutions found do not satisfy the scheme"),
    ("INCONSISTENT_START", "the initial state violates a constraint or penetrates a contact"),
    (
        "CROWDED",
        "more contacts between bodies may act at once than there is room for: generate with a "
        "larger max_couplings",
    ),
)

# States of a contact at the end of a step; SLIP_BACK: one slip component, negative.
CONTACT_STATES = ("OPEN", "CLOSED", "STICK", "SLIP", "SLIP_BACK")
EVENT_KINDS = ("IMPACT", "CLOSE", "OPEN", "STICK", "SLIP", "REVERSE", "GUARD")

MAX_ITERATIONS = 200  # default of options.max_iterations
SPATIAL_ITERATIONS = 1000  # the same where friction has two components: small substeps help there
ITERATIONS_OF_PART = 30  # the same for each part of a model with couplings, if that is more


@dataclass(frozen=True)
class Field:
    """One member: C type without prefix (real, int, real*, const real*, int*, or a struct's
    name)."""

    name: str
    type: str
    dims: tuple[int, ...] = ()
    doc: str = ""

    @property
    def extent(self) -> int:
        """Number of elements; at least one, because C has no empty arrays."""
        size = 1
        for d in self.dims:
            size *= d
        return max(size, 1)


@dataclass(frozen=True)
class Struct:
    """One struct of the generated code."""

    name: str
    doc: str
    fields: tuple[Field, ...]


def _state(scheme: Scheme, n: Sizes) -> tuple[Field, ...]:
    """All that influences the next step of a part."""
    state: tuple[Field, ...] = (
        Field("t", "real", (), "time"),
        Field("q", "real", (n.n_q,), "coordinates"),
        Field("v", "real", (n.n_q,), "velocities"),
        Field("t_grid", "real", (), "time where steps of size h_grid began"),
        Field("h_grid", "real", (), "their size"),
        Field("n_grid", "real", (), "their number: t = t_grid + n_grid h_grid"),
        Field("warm", "int", (), "differences known below; 0: the next step starts cold"),
        Field("order", "int", (), "differences that predict the next step best; -1: v"),
        Field("h_guess", "real", (), "step size of the last step"),
        Field("x", "real", (n.n_x_kept,), "stage and end velocities of the last step"),
        Field("x_1", "real", (n.n_x_kept,), "their first backward difference"),
        Field("x_2", "real", (n.n_x_kept,), "their second backward difference"),
        Field("R", "real", (n.n_rows_kept,), "percussions of the last step"),
        Field("R_1", "real", (n.n_rows_kept,), "their first backward difference"),
        Field("R_2", "real", (n.n_rows_kept,), "their second backward difference"),
        Field("closed", "int", (n.n_contacts,), "contacts closed at the end of the last step"),
        Field(
            "contact", "int", (n.n_contacts,), "states of the contacts: OPEN, CLOSED, STICK, ..."
        ),
        Field(
            "states", "int", (n.n_problems,), "contact states of the last solution, each problem's"
        ),
        Field("choice", "int", (n.n_problems,), "how its percussions were chosen, see info"),
    )
    if scheme.located:
        state += (
            Field("t_impact", "real", (n.n_contacts,), "last located impact of each contact"),
            Field("located", "int", (), "whether the last step was cut at its events"),
            Field("segment", "int", (), "whether the last step was one segment, and which: 1, 2"),
        )
    if n.n_key:
        state += (
            Field("has_terms", "int", (), "whether the terms below are known"),
            Field("key", "real", (n.n_key,), "values of t, q and parameters that they belong to"),
            Field("terms", "real", (n.n_terms,), "terms of (t, q) at the end of the last step"),
        )
    return state


_OF_RUN = ("t_grid", "h_grid", "n_grid")  # of a state that all parts have in common
# What a coupling has of the state of its island.
_OF_COUPLING = ("R", "R_1", "R_2", "closed", "contact", "t_impact")


def _states(scheme: Scheme, n: Sizes, most: Sizes, island: Sizes) -> tuple[Struct, ...]:
    doc = "All that influences the next step; plain data."
    if n.n_parts == 1:
        return (Struct("state", doc, _state(scheme, n)),)
    whole = {f.name: f for f in _state(scheme, n)}
    common = tuple(whole[name] for name in ("t", "q", "v", *_OF_RUN, "contact"))
    if not n.n_couplings:
        return (
            Struct("part", "What a part of the model goes on from.", _state(scheme, most)),
            Struct("state", doc, (*common, Field("part", "part", (n.n_parts,), "its parts"))),
        )
    own = tuple(f for f in _state(scheme, most) if f.name in _OF_COUPLING)
    print_of = Field("island", "int", (), "which parts and couplings were its island, as a number")
    return (
        Struct(
            "part",
            "What an island goes on from.",
            tuple(f for f in _state(scheme, island) if f.name not in _RECALLED),
        ),
        Struct("kept", "What a part of the model goes on from.", (*_state(scheme, most), print_of)),
        Struct(
            "link",
            "What a coupling that acted, or might have, goes on from.",
            (Field("coupling", "int", (), "its number"), *own),
        ),
        Struct(
            "state",
            doc,
            (
                *common,
                Field("part", "kept", (n.n_parts,), "its parts"),
                Field("n_links", "int", (), "couplings that joined parts in the last step"),
                Field("link", "link", (n.n_joined,), "these couplings, ascending"),
            ),
        ),
    )


_RECALLED = ("has_terms", "key", "terms")  # of a state, those of each part by itself


def _info(scheme: Scheme, n: Sizes) -> tuple[Field, ...]:
    info: tuple[Field, ...] = (
        Field("status", "int", (), "status code of the step"),
        Field("iterations", "int", (), "Newton iterations, all problems and attempts"),
        Field("substeps", "int", (), "substeps taken; 0: the step was solved whole"),
        Field(
            "rescues", "int", (), "1 cold start, 4 path, held, 8 soft contacts, 16 relaxation, sum"
        ),
        Field("percussions", "int", (), "0 unique, 1 of least norm, 2 one of several"),
        Field("lost_impacts", "int", (), "contacts that pushed at a stage but not over the step"),
        Field("residual", "real", (), "largest scaled residual accepted"),
        Field("smallest_gap", "real", (), "smallest gap at any stage"),
        Field("P", "real", (n.n_R,), "percussions of the step: P_g, P_gamma, P_N, P_F"),
        Field(
            "contact", "int", (n.n_contacts,), "states of the contacts: OPEN, CLOSED, STICK, ..."
        ),
        Field("impacts", "int", (n.n_contacts,), "impacts of each contact in the step"),
    )
    if scheme.located:
        info += (
            Field("captured", "int", (), "1: the rest of the step was captured, 2: all of it"),
            Field("t_captured", "real", (), "from when on"),
            Field("n_events", "int", (), "events of a located step, listed below"),
            Field("events", "event", (n.n_events,), "the first of them"),
        )
    return info


def _infos(scheme: Scheme, n: Sizes, island: Sizes) -> tuple[Struct, ...]:
    doc = "What a step reports."
    if n.n_parts == 1:
        return (Struct("info", doc, _info(scheme, n)),)
    of_islands = (
        Field("islands", "int", (), "islands that the step was taken in"),
        Field("largest", "int", (), "parts of the largest island"),
        Field("rescued", "int", (), "part of the first island that needed a rescue; -1: none"),
        Field("failed", "int", (), "part of the island that was not solved; -1: none"),
    )
    return (
        Struct("report", "What the step of one island reports.", _info(scheme, island)),
        Struct("info", doc, (*_info(scheme, n), *of_islands)),
    )


@dataclass(frozen=True, eq=False)
class Scratch:
    """What the parts of one kind need of the scratch of a step: their scheme, and the prefix of its
    points, empty for a model that is one part."""

    prefix: str
    scheme: Scheme


def structs(
    data: ModelData,
    kinds: Sequence[Scratch],
    n: Sizes,
    most: Sizes,
    island: Sizes,
    scratch: tuple[Struct, ...],
    adaptive: bool,
) -> tuple[Struct, ...]:
    """All structs, in the order in which C must see them.

    `n` are the sizes of the model, `most` those of its largest part, `island` those of what may be
    stepped at once, which is more where there are couplings; `scratch` is the runtime's, `adaptive`
    says whether a tolerance can choose step sizes.
    """
    scheme = kinds[0].scheme
    params = tuple(
        Field(
            p.name, "real", (), " ".join(x for x in (f"[{p.unit}]" if p.unit else "", p.doc) if x)
        )
        for p in data.parameters
    ) or (Field("unused", "real", (), "the model has no parameters"),)
    options: tuple[Field, ...] = (
        Field("tol", "real", (), "relative tolerance of every row; 0 iterates to round-off"),
        Field("r", "real", (), "prox parameter of the contact laws; 0 chooses one per contact"),
        Field("max_iterations", "int", (), "Newton iterations of a step with all its rescues"),
        Field(
            "max_halvings", "int", (), "halvings of a step that is not solved otherwise, at most 10"
        ),
        Field("active_set", "int", (), "ACTIVE_ANY_STAGE or ACTIVE_END, rule (67)"),
        Field("scaling", "int", (), "SCALING_ROWS or SCALING_NONE: tol is absolute"),
    )
    if scheme.located:
        options += (
            Field("events", "int", (), "EVENTS_CAPTURED or EVENTS_LOCATED"),
            Field("max_events", "int", (), f"events of a step, at most {most.n_events}"),
        )
    event = (
        Field("t", "real", (), "its time: the end of the step where that is captured"),
        Field("contact", "int", (), "which contact"),
        Field("kind", "int", (), "EVENT_IMPACT, EVENT_CLOSE, ..."),
        Field("P_N", "real", (), "normal percussion of the step"),
        Field("P_F", "real", (n.n_slip,), "friction percussion of the step"),
        Field("energy", "real", (), "change of the energy in the step of an impact, else 0"),
    )
    record = (
        Field("t", "real*", (), "rows of 1, the last step's; any pointer may be NULL"),
        Field("q", "real*", (), "rows of N_Q, the last step's"),
        Field("v", "real*", (), "rows of N_Q, the last step's"),
        Field("P", "real*", (), "rows of N_R, summed up"),
        Field("residual", "real*", (), "rows of 1, the largest"),
        Field("smallest_gap", "real*", (), "rows of 1, the smallest"),
        Field("energy", "real*", (), "rows of 2, the smallest and the largest at the steps' ends"),
        Field(
            "counts",
            "int*",
            (),
            "rows of 10: status, iterations, substeps, rescues, percussions, lost_impacts, "
            "impacts, captured, islands, parts of the largest; worst status, sums, all rescues, "
            "worst choice, whether any was captured, fewest islands, the largest of all",
        ),
        Field("contact", "int*", (), "rows of N_CONTACTS, states at the end of the last step"),
        Field("events", "event*", (), "changes of contact states, the first max_events of them"),
        Field("n_events", "int*", (), "how many there were; the caller sets it to 0"),
        Field("max_events", "int", (), "events that have room"),
        Field("begun", "int", (), "steps of an earlier call that belong to row 0"),
        Field("stage_t", "real*", (), "rows of N_STAGES, the last step's; NaN if it has substeps"),
        Field("stage_q", "real*", (), "rows of N_STAGES * N_Q"),
        Field("stage_v", "real*", (), "rows of N_STAGES * N_Q"),
        Field("stage_R", "real*", (), "rows of N_STAGES * N_R"),
    )
    control = (
        Field("error", "real", (), "wanted error of q in units of `scale`, summed up over `span`"),
        Field("scale", "real", (n.n_q,), "what 1 means of each coordinate"),
        Field("span", "real", (), "time of the run; velocities count by what they make of q in it"),
        Field("h", "real", (), "size of the next step; 0 on entry: a first guess"),
        Field("t_start", "real", (), "simulate_within: start of its rows, set by the caller"),
        Field("t_end", "real", (), "end of a run whose rows are the steps"),
        Field("intervals", "real", (), "rows before; the caller sets it to 0"),
        Field("estimates", "real*", (), "rows of 1, the estimate so far; or NULL"),
        Field("estimate", "real", (), "estimated errors of all steps, summed up; set it to 0"),
        Field("taken", "real", (), "size of the last step"),
        Field("t_missed", "real", (), "end of the first step whose error is larger than wanted"),
        Field("missed", "int", (), "how many there are; the caller sets these three to 0"),
        Field("steps", "int", (), "steps taken, each in two parts, in more where it has events"),
        Field("rejected", "int", (), "attempts that were not good enough"),
        Field("iterations", "int", (), "Newton iterations of the last step with all attempts"),
        Field("whole", "state", (), "scratch: the end of a step taken as a whole"),
        Field("split", "state", (), "scratch: the end of a step taken in parts"),
        Field("n_parts", "int", (), "in how many parts the last step was taken"),
        Field("parts", "real", (n.n_events + 2,), "where they end, counted from its start"),
        Field("sum", "info", (), "scratch: what its parts report"),
        Field("before", "info", (), "scratch: what earlier steps report"),
    )
    points = tuple(
        Struct(
            kind.prefix + point.name,
            f"Model functions at one point ({', '.join(point.fields)}); numbers are left out.",
            tuple(
                Field(name, "real", (len(point.stored(name)),))
                for name in point.fields
                if point.stored(name)
            ),
        )
        for kind in kinds
        for point in (*kind.scheme.points, *_forward_points(kind.scheme))
        if any(point.stored(name) for name in point.fields)
    )
    consistency = (
        Field("value", "real", (most.n_R,), "rows of constraints and contacts"),
        Field("size", "real", (most.n_R,), "their terms, summed up"),
        Field("guard", "real", (most.n_contacts,)),
    )
    adjoint = (
        Struct(
            "adjoint",
            "Gradient of a number: what it changes by if something changes.",
            (
                Field("q", "real", (n.n_q,), "by the coordinates of the state"),
                Field("v", "real", (n.n_q,), "by its velocities"),
                Field("late", "real", (), "by the time of the state alone, which its step keeps"),
                Field("t", "real", (), "by that time and all times behind it"),
                Field("h", "real", (), "by the step size, summed up over the steps"),
                Field("par", "real", (len(data.parameters),), "by the parameters, summed up"),
                Field("u", "real", (n.n_u,), "by the inputs of the step"),
            ),
        ),
        Struct(
            "checkpoint",
            "A state that an adjoint run keeps.",
            (
                Field("state", "state", (), "the state"),
                Field("step", "int", (), "steps before it"),
            ),
        ),
    )
    return (
        Struct("params", "Parameters in declared order.", params),
        Struct("options", "Options of the step.", options),
        *_states(scheme, n, most, island),
        Struct("event", "A change of a contact's state.", event),
        *_infos(scheme, n, island),
        Struct(
            "record",
            "Buffers of the caller for many steps; a row stands for `every` steps.",
            record,
        ),
        *((Struct("control", "How exact steps are to be.", control),) if adaptive else ()),
        *(adjoint if scheme.forward else ()),
        *points,
        Struct("consistency", "Constraints and gaps at the start.", consistency),
        *scratch,
        *(_forward(scheme, n, points) if scheme.forward else ()),
        *((*_element(kinds, most, points), _large(most, island)) if n.n_couplings else ()),
        Struct(
            "work",
            "Scratch of one step; nothing survives in it.",
            _work(kinds, n, most, island, points, scratch),
        ),
    )


def _forward_points(scheme: Scheme) -> tuple[Point, ...]:
    return scheme.forward.points if scheme.forward else ()


def _forward(scheme: Scheme, n: Sizes, points: tuple[Struct, ...]) -> tuple[Struct, ...]:
    """Changes of the scratch along a direction: arrays of the same names."""
    known = {p.name for p in points}
    own = {
        *("t", "h", "q", "v", "u", "p", "guard", "Q", "q_end", "v_end", "P", "R_stage", "x", "R"),
        *("r", "y", "radius", *(name for name, _ in COEFFICIENTS)),
    }
    looks = {f.name for f in _looks(scheme, n)}
    alone = (Scratch("", scheme),)
    fields = [f for f in _work(alone, n, n, n, (), ()) if f.name in own or f.name in looks]
    places = tuple(
        Field(place, f"{point}_forward", (count,) if count else ())
        for point, place, count in scheme.places
        if f"{point}_forward" in known
    )
    return (
        Struct(
            "forward",
            "How the scratch of a step changes along one direction.",
            (*fields, Field("par", "params", (), "parameters"), *places),
        ),
    )


def _terms(recalls: bool, n: Sizes) -> tuple[Field, ...]:
    if not n.n_terms:
        return ()
    if not recalls:
        return (Field("terms", "real", (n.n_terms,), "terms of (t, q) at the middle"),)
    return (
        Field("key", "real", (n.n_key,), "values of t, q and parameters that terms depend on"),
        Field("terms", "real", (n.n_stages - 1, n.n_terms), "terms of (t, q), the later stages"),
    )


def _looks(scheme: Scheme, n: Sizes) -> tuple[Field, ...]:
    if scheme.located is None:
        return ()
    return (
        Field("look_t", "real", (), "where the step looks for events: time"),
        Field("look_q", "real", (n.n_q,), "coordinates"),
        Field("look_v", "real", (n.n_q,), "velocities"),
        Field("gap", "real", (n.n_N,), "gaps there"),
        Field("gap_rate", "real", (n.n_N,), "their rates"),
        Field("slip_rate", "real", (n.n_F,), "slip velocities there"),
        Field("guard_there", "real", (n.n_contacts,), "guards there"),
        Field("share", "real", (n.n_F,), "friction over the normal percussion, at a stage's start"),
        Field("given", "real", (n.n_gamma + n.n_F,), "known percussions of the first stage"),
    )


def _islands(whole: Sizes, most: Sizes, island: Sizes) -> tuple[Field, ...]:
    """What a model of several parts needs besides: the part at hand, and where all will be."""
    if whole.n_parts == 1:
        return (Field("trial", "state", (), "state at the start of the (sub)step"),)
    joins = whole.n_couplings > 0
    return (
        Field("number", "int", (), "of the part that is being stepped"),
        Field("kind", "int", (), "its kind"),
        *(() if joins else _own(most)),
        Field("trial", "part", (), "its state at the start of the (sub)step"),
        Field("report", "report", (), "what its step reports"),
        Field(
            "next",
            "kept" if joins else "part",
            (whole.n_parts,),
            "all parts at the end of the step",
        ),
        *(_of_couplings(whole, most, island) if joins else ()),
        Field("exists", "int", (whole.n_contacts,), "guard >= 0 at the start, of all contacts"),
        Field("staged", "int", (), "whether all parts were stepped whole: there are stages"),
        Field("stage_t", "real", (whole.n_stages,), "t^i"),
        Field("stage_q", "real", (whole.n_stages, whole.n_q), "Q^i"),
        Field("stage_v", "real", (whole.n_stages, whole.n_q), "V^i"),
        Field("stage_R", "real", (whole.n_stages, whole.n_R), "R^i"),
        Field("part_q", "real", (most.n_stages, most.n_q), "Q^i of one part"),
        Field("part_v", "real", (most.n_stages, most.n_q), "V^i of one part"),
        Field("part_R", "real", (most.n_stages, most.n_R), "R^i of one part"),
    )


def _own(most: Sizes) -> tuple[Field, ...]:
    """The constants of a part, where kinds have some."""
    return (Field("own", "const real*", (), "its constants"),) if most.n_own else ()


def _places(kinds: Sequence[Scratch], points: tuple[Struct, ...]) -> tuple[Field, ...]:
    """Where the results of points stand."""
    known = {p.name for p in points}
    return tuple(
        Field(kind.prefix + place, kind.prefix + point, (count,) if count else ())
        for kind in kinds
        for point, place, count in kind.scheme.places
        if kind.prefix + point in known
    )


def _element(
    kinds: Sequence[Scratch], most: Sizes, points: tuple[Struct, ...]
) -> tuple[Struct, ...]:
    """What generated functions read and write of one part or coupling, before it is added up."""
    scheme = kinds[0].scheme
    recalls = any(kind.scheme.recalls for kind in kinds)
    own = {f.name: f for f in _state(scheme, most)}
    recalled = tuple(own[name] for name in _RECALLED if name in own)
    return (
        *((Struct("recalled", "Terms at the start of a step.", recalled),) if recalled else ()),
        Struct(
            "element",
            "One part or coupling of an island.",
            (
                *((Field("trial", "recalled", (), "terms known before"),) if recalled else ()),
                *_own(most),
                *_model_work(kinds, most, _terms(recalls, most)),
                *_places(kinds, points),
            ),
        ),
    )


def _work(
    kinds: Sequence[Scratch],
    whole: Sizes,
    most: Sizes,
    island: Sizes,
    points: tuple[Struct, ...],
    scratch: tuple[Struct, ...],
) -> tuple[Field, ...]:
    scheme = kinds[0].scheme
    terms = _terms(any(kind.scheme.recalls for kind in kinds), most)
    joins = whole.n_couplings > 0
    return (
        *_islands(whole, most, island),
        *_model_work(kinds, island, () if joins else terms),
        *(() if joins else _places(kinds, points)),
        *(Field(s.name, s.name, (), s.doc) for s in scratch),
        *(
            (Field("forward", "forward", (), "its change along a direction"),)
            if scheme.forward
            else ()
        ),
    )


def _of_couplings(whole: Sizes, most: Sizes, island: Sizes) -> tuple[Field, ...]:
    """What the step of a model with couplings needs besides."""
    count = whole.n_parts + whole.n_joined
    return (
        Field("n_links", "int", (), "couplings that join parts in this step"),
        Field("link", "link", (whole.n_joined,), "these couplings at its end"),
        Field("joins", "int", (whole.n_couplings,), "whether a coupling does"),
        Field("there", "int", (whole.n_couplings,), "whether one of its contacts exists"),
        Field("root", "int", (whole.n_parts,), "first part of the island of each part"),
        Field("whole", "int", (whole.n_parts,), "whether its stages are those of the whole step"),
        Field("island", "void*", (), "sizes and tables of the island that is being stepped"),
        Field("n_members", "int", (), "parts and couplings that it consists of"),
        Field("n_bodies", "int", (), "how many of them, from the first, are parts"),
        Field("members", "int", (count,), "their numbers"),
        Field("first", "int", (count, 6), "first row of each of g, gamma, N, F, contacts, bounds"),
        Field("place", "int", (whole.n_q,), "where the coordinates of the model stand in it"),
        Field("first_place", "int", (count,), "first of the coordinates of each member in places"),
        Field("places", "int", (count * most.n_q,), "where they stand in it"),
        Field("first_slot", "int", (count,), "first of the rows of each member in slots"),
        Field("slots", "int", (count * most.n_R,), "where they stand in a slot of it"),
        Field("holder", "int", (whole.n_q,), "which part of the model has them"),
        Field("origin", "part", (), "state at the start of the step"),
        Field("end_q", "real", (whole.n_q,), "coordinates at its end"),
        Field("end_v", "real", (whole.n_q,), "velocities there"),
        Field("spot", "int", (most.n_border,), "where unknowns of an element stand in the island"),
        Field("tables", "int", (island.n_problems, 7), "where K, B, C of its problems begin"),
        Field("element", "element", (count,), "each of them by itself"),
        Field("graph", "int", (island.n_border, island.n_border // 30 + 1), "sets of unknowns"),
        Field("degree", "int", (island.n_border,), "how many there are in each"),
        Field("position", "int", (island.n_problems, island.n_border), "where unknowns stand in K"),
        Field("table", "int", (island.n_table,), "patterns of its matrices"),
        Field("large", "large", (), "percussions of a large island, row by row"),
    )


def _large(most: Sizes, island: Sizes) -> Struct:
    """What the direction of a large island needs besides."""
    n = island.n_rows
    return Struct(
        "large",
        "Percussions of a large island (sg_large.c): each is eliminated by itself.",
        (
            Field("drawn", "int", (), "whether K has room for what they leave"),
            Field("near", "int", (island.n_border,), "unknowns beside one of the graph"),
            Field("give", "real", (), "how soft contacts are, relative to what they move"),
            Field("inverse", "real", (n * island.n_slip,), "how they answer to the rows phi"),
            Field("weight", "real", (n * (island.n_slip + 1),), "and to kinematic rows"),
            Field("share", "real", (n,), "how friction answers to what presses it"),
            Field("base", "real", (n,), "their change while the bodies stay"),
            Field("before", "real", (n,), "their change in the pass before"),
            Field("dy", "real", (n,), "change of the kinematic rows"),
            Field("x_soft", "real", (island.n_x,), "solution with soft contacts"),
            Field("R_soft", "real", (n,), "and its percussions"),
            Field("block", "real", (most.n_x * most.n_x,), "stiffness of the rows of one element"),
            Field("stiff", "real", (island.n_K,), "K with the stiffness of all"),
        ),
    )


def _model_work(kinds: Sequence[Scratch], n: Sizes, terms: tuple[Field, ...]) -> tuple[Field, ...]:
    """What the generated functions and the runtime hand to each other."""
    scheme = kinds[0].scheme
    rows = max(p.n_slots for kind in kinds for p in kind.scheme.problems)
    return (
        Field("t", "real", (), "start of the (sub)step"),
        Field("h", "real", (), "its size"),
        Field("q", "real", (n.n_q,), "q_n"),
        Field("v", "real", (n.n_q,), "v_n"),
        Field("u", "real", (n.n_u,), "inputs"),
        Field("p", "real", (n.n_q,), "p_n"),
        Field("force_size", "real", (n.n_q,), "terms of dL/dq and f at the start, summed up"),
        Field("mass", "real", (n.n_mass,), "dp/dv at the start, as its factors are stored"),
        Field("direction", "real", (n.n_direction,), "W^T at the start, row by row"),
        Field("mass_pivot", "real", (n.n_q,), "D of M = L D L^T"),
        Field("mobility", "real", (n.n_R,), "W^T M^-1 W, direction by direction"),
        Field("drift", "real", (n.n_R,), "chi at the start"),
        *(
            Field(name, "real", (n.n_axes if name == "mu_F" else n.n_contacts,), what)
            for name, what in COEFFICIENTS
        ),
        Field("guard", "real", (n.n_contacts,), "guards"),
        Field("compliance", "real", (n.n_compliance,), "dy/dR of the rows of all problems"),
        Field("slack", "real", (n.n_slack,), "what rows that yield are compressed by at the start"),
        Field("no_R", "real", (n.n_R,), "zeros"),
        *terms,
        *_looks(scheme, n),
        Field("Q", "real", (n.n_stages, n.n_q), "positions at the stages"),
        Field("q_end", "real", (n.n_q,), "q_{n+1}"),
        Field("v_end", "real", (n.n_q,), "v_{n+1}"),
        Field("P", "real", (n.n_R,), "percussions of the (sub)step"),
        Field("R_stage", "real", (n.n_stages, n.n_R), "percussions of the stages, at full order"),
        Field("x", "real", (n.n_x_total,), "unknown velocities of all problems"),
        Field("R", "real", (n.n_rows_total,), "unknown percussions of all problems"),
        Field("r", "real", (n.n_x,), "smooth rows"),
        Field("y", "real", (n.n_rows,), "kinematic rows"),
        Field("radius", "real", (rows * n.n_bounds,), "given radii of friction"),
        Field(
            "K", "real", (n.n_K,), "dr/dx, bordered by bilateral rows, as its factors are stored"
        ),
        Field("B", "real", (n.n_B,), "dr/dR by columns"),
        Field("C", "real", (n.n_C,), "dy/dx by rows"),
        Field("C_radius", "real", (n.n_C_radius,), "d(radius)/dx by rows"),
    )
