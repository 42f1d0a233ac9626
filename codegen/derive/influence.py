"""What a coordinate can be changed by in a step: the sparsity of the derivatives of steps."""

from dataclasses import dataclass

import casadi as ca
from signorini.codegen.derive.quantities import Derivation

_ROWS = ("g", "gamma", "g_N", "gamma_F")
_RATES = {"g": "g_dot", "g_N": "g_N_dot"}


@dataclass(frozen=True)
class Influence:
    """For each coordinate, what its place and velocity behind a step depend on.

    Attributes
    ----------
    q, v, u, par : tuple of tuples of int
        Indices of coordinates, velocities, inputs and parameters, by coordinate. Its place depends
        on its place before, too.
    """

    q: tuple[tuple[int, ...], ...]
    v: tuple[tuple[int, ...], ...]
    u: tuple[tuple[int, ...], ...]
    par: tuple[tuple[int, ...], ...]


def influence(d: Derivation) -> Influence:
    """Find what can change what, from which symbols stand where.

    Notes
    -----
    Velocities that share a term of the mass matrix or a percussion are found together; what their
    equations read moves with its own velocities. Events cut the step for all: what moves a contact
    moves everything, if only by the truncation error.
    """
    data = d.data
    n = data.n_q
    own, rows = _together(d)
    reads = []
    for group in own:
        values = [d["p"][i] for i in group] + [d["L_q"][i] + ca.densify(d["f"])[i] for i in group]
        values += [x for touched, x in rows if touched & group]
        reads.append({name: _used(values, symbols) for name, symbols in _symbols(d).items()})
    group_of = {i: k for k, group in enumerate(own) for i in group}
    contacts = {group_of[i] for touched, _ in rows[d.data.n_g + d.data.n_gamma :] for i in touched}
    found: dict[str, list[tuple[int, ...]]] = {name: [] for name in ("q", "v", "u", "par")}
    for i in range(n):
        groups, waiting = set(), {group_of[i], *contacts}
        while waiting:
            k = waiting.pop()
            groups.add(k)
            waiting |= {group_of[j] for j in reads[k]["q"] | reads[k]["v"]} - groups
        found["v"].append(tuple(sorted(set().union(*(own[k] for k in groups)))))
        for name in ("q", "u", "par"):
            found[name].append(tuple(sorted(set().union(*(reads[k][name] for k in groups)))))
    return Influence(*(tuple(found[name]) for name in ("q", "v", "u", "par")))


def _symbols(d: Derivation) -> dict[str, ca.SX]:
    return {"q": d.data.q, "v": d.data.v, "u": d.data.u, "par": d.data.par}


def _used(values: list[ca.SX], symbols: ca.SX) -> set[int]:
    """Which of the symbols stand in the values."""
    if not symbols.numel() or not values:
        return set()
    depends = ca.which_depends(ca.vertcat(*values), symbols, 1, False)
    return {i for i, is_there in enumerate(depends) if is_there}


def _together(d: Derivation) -> tuple[list[set[int]], list[tuple[set[int], ca.SX]]]:
    """Groups of velocities that are found together; rows with the velocities that they move."""
    data = d.data
    groups = [{i} for i in range(data.n_q)]

    def join(some: set[int]) -> None:
        touched = [g for g in groups if g & some]
        if len(touched) > 1:
            groups[:] = [g for g in groups if not g & some] + [set().union(*touched)]

    mass = d["p_v"].sparsity()
    for row, column in zip(mass.row(), mass.get_col(), strict=True):
        join({row, column})
    rows: list[tuple[set[int], ca.SX]] = []
    for name in _ROWS:
        W = d[f"W_{name.split('_')[-1]}" if name in ("g_N", "gamma_F") else f"W_{name}"]
        value = ca.densify(d[name])
        rate = ca.densify(d[_RATES[name]]) if name in _RATES else value
        for c in range(value.numel()):
            moved = set(W[:, c].sparsity().row())
            join(moved)
            rows.append((moved, ca.vertcat(value[c], rate[c])))
    # a contact's normal row and the slip rows that it presses are of one law
    at_N = data.n_g + data.n_gamma
    at_F = at_N + data.n_N
    normal: dict[int, int] = {}
    for k, contact in enumerate(data.contacts):
        if contact.g_N is not None:
            normal[k] = at_N
            at_N += 1
        of_contact = set() if contact.presser is None else {normal[contact.presser]}
        if contact.load is not None:
            first, count = contact.load
            of_contact |= set(range(first, first + count))
        of_contact |= set(range(at_F, at_F + contact.n_F))
        at_F += contact.n_F
        moved = set().union(*(rows[r][0] for r in of_contact))
        join(moved)
        law = (contact.mu, contact.mu_F, contact.e_N, contact.e_F, contact.guard, contact.bound)
        rows.append((moved, ca.vertcat(*(x for x in law if x is not None))))
    return groups, rows
