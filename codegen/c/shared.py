"""Public functions of a model of several parts: each part has its share of rows and columns."""

from collections.abc import Sequence

from signorini.codegen.c.functions import CFunction, CParameter, Section, equation_of
from signorini.codegen.c.kind import KindBuilder
from signorini.codegen.c.share import SharedFunction
from signorini.codegen.derive.public import arguments_of
from signorini.codegen.frontend.model_data import ModelData
from signorini.codegen.parts import Part

_ROWS = {
    **dict.fromkeys(("L", "energy"), "one"),
    **dict.fromkeys(("p", "L_q", "f", "WR"), "q"),
    **dict.fromkeys(("g", "g_dot", "chi_g"), "g"),
    **dict.fromkeys(("gamma", "chi_gamma"), "gamma"),
    **dict.fromkeys(("g_N", "g_N_dot", "chi_N"), "N"),
    **dict.fromkeys(("gamma_F", "chi_F", "mu_F"), "F"),
    **dict.fromkeys(("guard", "mu", "e_N", "e_F"), "contacts"),
    **dict.fromkeys(("compliance", "relaxation"), "compliances"),
    "bound": "bounds",
}
_DIRECTIONS = {"W_g": "g", "W_gamma": "gamma", "W_N": "N", "W_F": "F"}
_COLUMNS = {"q": "q", "v": "q"}


def spaces_of(name: str) -> tuple[str, str] | None:
    """What the rows and columns of a function count; None where no part has a share of its own."""
    if name in _DIRECTIONS:
        return "q", _DIRECTIONS[name]
    if name == "shapes":
        return "points", "axes"
    if name in _ROWS:
        return _ROWS[name], "one"
    stem, _, variable = name.rpartition("_")
    inner = spaces_of(stem) if stem else None
    if inner is None or variable not in _COLUMNS:
        return None
    rows, columns = inner
    return (rows if rows != "one" else columns), _COLUMNS[variable]


def members(part: Part, data: ModelData) -> dict[str, tuple[int, ...]]:
    """Places of a part among those of the model, space by space."""
    n_b = data.n_g + data.n_gamma
    ends = (0, data.n_g, n_b, n_b + data.n_N, n_b + data.n_N + data.n_F)
    rows = {
        name: tuple(r - first for r in part.rows if first <= r < end)
        for name, first, end in zip(("g", "gamma", "N", "F"), ends, ends[1:], strict=False)
    }
    bounds = [k for k, c in enumerate(data.contacts) if c.bound is not None]
    yields = {y.row: k for k, y in enumerate(data.compliances)}
    return {
        "one": (0,),
        "q": part.coordinates,
        **rows,
        "contacts": part.contacts,
        "bounds": tuple(i for i, k in enumerate(bounds) if k in set(part.contacts)),
        "compliances": tuple(yields[row] for row in part.rows if row in yields),
        "R": part.rows,
        "points": part.points,
        "axes": tuple(range(data.places.shape[1])),
    }


def counts(data: ModelData) -> dict[str, int]:
    """How much of each space there is."""
    return {
        "one": 1,
        "q": data.n_q,
        "g": data.n_g,
        "gamma": data.n_gamma,
        "N": data.n_N,
        "F": data.n_F,
        "contacts": len(data.contacts),
        "bounds": sum(c.bound is not None for c in data.contacts),
        "compliances": len(data.compliances),
        "R": data.n_g + data.n_gamma + data.n_N + data.n_F,
        "points": int(data.places.shape[0]),
        "axes": int(data.places.shape[1]),
    }


def shared_function(
    name: str, declared: str, builders: Sequence[KindBuilder], data: ModelData, called: bool
) -> SharedFunction:
    """A public function by what it is of each kind.

    Parameters
    ----------
    name, declared : str
        The function and its arguments besides the parameters.
    builders : sequence of KindBuilder
        The kinds.
    data : ModelData
        The whole model.
    called : bool
        Whether every kind has it, even where it is zero: the runtime calls it.
    """
    found = spaces_of(name)
    assert found is not None, name
    rows, columns = found
    needed = {a for b in builders for a in arguments_of(declared, b.kind.d[name], b.kind.data)}
    arguments = (*(a for a in "tqvuR" if a in needed), "par")
    kinds = tuple(
        (k, b.writer.model_function(name, arguments))
        for k, b in enumerate(builders)
        if b.kind.d[name].numel() and (called or not b.kind.d[name].is_zero())
    )
    total = counts(data)
    width = total[columns]
    shape = (total[rows],) if columns == "one" else (total[rows], width)
    most = {
        "q": max(b.kind.data.n_q for b in builders),
        "R": max(int(b.kind.d.R.numel()) for b in builders),
    }
    taken = [("q", "q"), ("v", "q"), ("R", "R")]
    buffers = [(a, most[space]) for a, space in taken if a in arguments]
    # also of kinds that have nothing but zeros of it
    buffers.append(("out", max(1, *(b.kind.d[name].numel() for b in builders))))
    parameters = tuple(
        CParameter("par", struct="params") if a == "par" else CParameter(a, array=a != "t")
        for a in arguments
    )
    public = CFunction(
        name=name,
        parameters=(*parameters, CParameter("out", array=True, const=False)),
        doc=(),
        unused=(),
        aliases=(),
        temporaries=(),
        sections=(Section(equation_of(name), (), ()),),
        operations=sum(f.operations for _, f in kinds),
        arguments=arguments,
        shape=shape,
    )
    sparse = len(kinds) < len(builders)
    return SharedFunction(public, rows, columns, kinds, tuple(buffers), width, sparse)
