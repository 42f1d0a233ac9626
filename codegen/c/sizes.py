"""Every size of the C interface and of the scratch of a step: of a model, of its parts, of what
contacts may join."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.program import Scheme

MAX_EVENTS = 64  # of one step that is cut at its events
MAX_ACTING = 1200  # percussions in a dense system of an island; those of more go row by row
MAX_JOINED = 64  # couplings that may act in one step, for each part four if that is more


@dataclass(frozen=True)
class Sizes:
    """Every size the runtime and the templates need."""

    n_q: int
    n_u: int
    n_par: int
    n_g: int
    n_gamma: int
    n_N: int
    n_F: int
    n_contacts: int
    n_bounds: int
    n_R: int
    n_x: int
    n_rows: int
    n_acting: int
    n_x_total: int
    n_rows_total: int
    n_problems: int
    n_stages: int
    n_mass: int
    n_direction: int
    n_border: int
    n_K: int
    n_B: int
    n_C: int
    n_C_radius: int
    n_axes: int
    n_factors: int
    n_radii_total: int
    n_relax: int
    n_relax_x: int
    n_outputs: int
    n_terms: int
    n_key: int
    n_chain: int
    n_x_kept: int
    n_rows_kept: int
    n_dense: int
    n_events: int
    n_ways: int
    n_slip: int
    n_varying: int
    n_expanded: int
    n_expanded_x: int
    n_one_way: int
    n_loads: int
    n_compliance: int
    n_slack: int
    n_parts: int
    n_couplings: int
    n_joined: int
    n_table: int
    n_own: int
    spatial: bool


def sizes(data: ModelData, scheme: Scheme) -> Sizes:
    """Collect the sizes of a model under a scheme."""
    n_R = data.n_g + data.n_gamma + data.n_N + data.n_F
    n_x = max(p.n_x for p in scheme.problems)
    n_rows = max(p.n_slots for p in scheme.problems) * n_R
    n_K = max(p.jacobian.K.size for p in scheme.problems)
    # given bounds, then the coefficient and the rest of the radius of contacts whose mu varies
    n_bounds = sum((c.bound is not None) + 2 * c.varies for c in data.contacts)
    located = scheme.located
    kept = scheme.problems[: located.kept if located else None]
    spatial = any(c.n_F > 1 for c in data.contacts)
    return Sizes(
        n_q=data.n_q,
        n_u=len(data.inputs),
        n_par=len(data.parameters),
        n_g=data.n_g,
        n_gamma=data.n_gamma,
        n_N=data.n_N,
        n_F=data.n_F,
        n_contacts=len(data.contacts),
        n_bounds=n_bounds,
        n_R=n_R,
        n_x=n_x,
        n_rows=n_rows,
        n_acting=n_rows,
        n_x_total=sum(p.n_x for p in scheme.problems),
        n_rows_total=sum(p.n_slots for p in scheme.problems) * n_R,
        n_problems=len(scheme.problems),
        n_stages=scheme.stages,
        n_mass=scheme.inertia.mass.size,
        n_direction=scheme.inertia.direction.size,
        n_border=max(len(p.jacobian.order) for p in scheme.problems),
        n_K=n_K,
        n_B=max(p.jacobian.B.size for p in scheme.problems),
        n_C=max(p.jacobian.C.size for p in scheme.problems),
        n_C_radius=max(p.jacobian.radius.size for p in scheme.problems),
        n_axes=data.n_F if any(c.mu_F is not None for c in data.contacts) else 0,
        n_factors=max(n_K, scheme.inertia.mass.size),
        n_radii_total=sum(p.n_slots for p in scheme.problems) * n_bounds,
        n_relax=n_rows if spatial else 0,
        n_relax_x=n_x if spatial else 0,
        n_outputs=len(data.outputs),
        n_terms=scheme.terms.values.numel(),
        n_key=scheme.terms.key.numel() if scheme.recalls else 0,
        n_chain=located.chain if located else len(scheme.problems),
        n_x_kept=sum(p.n_x for p in kept),
        n_rows_kept=sum(p.n_slots for p in kept) * n_R,
        n_dense=scheme.stages if located else 0,
        n_events=MAX_EVENTS if located else 0,
        # start, parameters, inputs, three times; and the length of a segment
        n_expanded=n_R if any(c.poisson for c in data.contacts) else 0,
        n_expanded_x=data.n_q if any(c.poisson for c in data.contacts) else 0,
        n_varying=sum(c.varies for c in data.contacts),
        n_slip=max([2, *(c.n_F for c in data.contacts)]),
        n_one_way=sum(c.one_way for c in data.contacts),
        n_loads=sum(c.load is not None for c in data.contacts),
        n_compliance=sum(p.n_slots for p in scheme.problems) * n_R if data.compliances else 0,
        n_slack=n_R if data.compliances else 0,
        n_parts=1,
        n_couplings=0,
        n_joined=0,
        n_table=0,
        n_own=data.own.numel(),
        n_ways=2 * data.n_q + len(data.parameters) + len(data.inputs) + 4 if scheme.forward else 0,
        spatial=spatial,
    )


# Of these a model has as many as all its parts together; of all else what its largest part has.
_OF_MODEL = (
    *("n_q", "n_g", "n_gamma", "n_N", "n_F", "n_contacts", "n_R"),
    *("n_x_total", "n_rows_total"),
)


def largest(kinds: Sequence[Sizes]) -> Sizes:
    """Sizes that every kind of parts fits into."""
    return Sizes(**{f.name: max(getattr(n, f.name) for n in kinds) for f in fields(Sizes)})


def together(
    kinds: Sequence[Sizes],
    kind_of: Sequence[int],
    data: ModelData,
    n_couplings: int = 0,
    max_couplings: int | None = None,
) -> Sizes:
    """Sizes of a model of several parts: scratch is that of the largest."""
    total = {name: sum(getattr(kinds[k], name) for k in kind_of) for name in _OF_MODEL}
    n_parts = len(kind_of) - n_couplings
    total["n_q"] = data.n_q
    n = replace(largest(kinds), **total, n_outputs=len(data.outputs), n_parts=n_parts)
    room = max(MAX_JOINED, 4 * n_parts) if max_couplings is None else max_couplings
    return replace(
        n,
        n_u=len(data.inputs),
        n_events=n.n_events * n_parts,
        n_couplings=n_couplings,
        n_joined=min(n_couplings, room),
    )


# Of these an island has as many as its parts and the couplings that join them.
_OF_ISLAND = (
    *("n_g", "n_gamma", "n_N", "n_F", "n_contacts", "n_bounds", "n_direction"),
    *("n_B", "n_C", "n_C_radius", "n_loads", "n_varying"),
)


def of_island(
    kinds: Sequence[Sizes], kind_of: Sequence[int], scheme: Scheme, whole: Sizes
) -> Sizes:
    """Sizes that every island of a model with couplings fits into.

    `scheme` is that of any part: all have the same problems.
    """
    parts, couplings = kind_of[: whole.n_parts], kind_of[whole.n_parts :]
    total = {}
    for name in _OF_ISLAND:
        sizes_of = sorted((getattr(kinds[k], name) for k in couplings), reverse=True)
        total[name] = sum(getattr(kinds[k], name) for k in parts) + sum(sizes_of[: whole.n_joined])
    n_q = whole.n_q
    n_R = total["n_g"] + total["n_gamma"] + total["n_N"] + total["n_F"]
    own = kinds[parts[0]].n_q
    blocks = [p.n_x // own for p in scheme.problems]
    slots = [p.n_slots for p in scheme.problems]
    kept = scheme.located.kept if scheme.located else len(blocks)
    bilateral = total["n_g"] + total["n_gamma"]
    n_border = max(b * n_q + s * bilateral for b, s in zip(blocks, slots, strict=True))
    n_rows = max(slots) * n_R
    n_mass = sum(kinds[k].n_mass for k in parts)
    most = largest(kinds)
    tables = sum(
        (b * n_q + s * bilateral + 3) ** 2
        + 2 * (s * n_R + 1)
        + s * total["n_bounds"]
        + total["n_B"]
        + total["n_C"]
        + total["n_C_radius"]
        + 4
        for b, s in zip(blocks, slots, strict=True)
    )
    return replace(
        most,
        **total,
        n_q=n_q,
        n_R=n_R,
        n_x=max(blocks) * n_q,
        n_rows=n_rows,
        n_acting=max(most.n_rows, min(n_rows, MAX_ACTING)),
        n_x_total=sum(blocks) * n_q,
        n_rows_total=sum(slots) * n_R,
        n_radii_total=sum(slots) * total["n_bounds"],
        n_mass=n_mass,
        n_border=n_border,
        n_K=n_border**2,
        n_factors=max(n_border**2, n_mass),
        n_x_kept=sum(blocks[:kept]) * n_q,
        n_rows_kept=sum(slots[:kept]) * n_R,
        n_relax=n_rows if most.spatial else 0,
        n_relax_x=max(blocks) * n_q if most.spatial else 0,
        n_parts=whole.n_parts,
        n_couplings=whole.n_couplings,
        n_joined=whole.n_joined,
        n_table=tables + 3 * n_q + n_mass + n_R + total["n_direction"] + 3,
    )


def with_scratch_of(island: Sizes, whole: Sizes) -> Sizes:
    """Sizes of a model with couplings: of its interface as they are, of scratch the island's."""
    interface = (
        *("n_q", "n_u", "n_g", "n_gamma", "n_N", "n_F", "n_contacts", "n_R"),
        *("n_outputs", "n_events", "n_parts", "n_couplings", "n_joined"),
    )
    return replace(island, **{name: getattr(whole, name) for name in interface})
