"""What is derived from a model, for people: sizes, sparsity, operations, expressions."""

from dataclasses import dataclass

import sympy as sp
from rich.console import Console
from rich.table import Table
from signorini.codegen.derive.quantities import QUANTITIES, Derivation
from signorini.codegen.frontend.equations import latex_name
from signorini.codegen.frontend.errors import ModelError
from signorini.codegen.frontend.model import Model
from signorini.codegen.frontend.sx_to_sympy import operations, to_sympy
from signorini.codegen.frontend.validate import freeze

# In the order of the equations of motion; mu, e_N, e_F and the like are numbers of contacts.
SHOWN = (
    *("L", "p", "p_v", "L_q", "f", "g", "W_g", "chi_g", "gamma", "W_gamma", "chi_gamma"),
    *("g_N", "W_N", "chi_N", "gamma_F", "W_F", "chi_F", "bound", "guard", "mu", "e_N", "e_F"),
    *("compliance", "relaxation"),
    *("energy", "outputs"),
)
LONG = 80  # operations above which an expression is not written out unless asked for by name


@dataclass(frozen=True)
class Derived:
    """One derived quantity."""

    name: str
    equation: str
    shape: tuple[int, int]
    nonzeros: int
    operations: int
    value: sp.Matrix | None

    @property
    def size(self) -> str:
        """Rows x columns."""
        return "x".join(str(n) for n in self.shape)


def derived(model: Model, names: tuple[str, ...] = ()) -> list[Derived]:
    """Derived quantities of a model: those asked for by name, or all that are not empty.

    Raises
    ------
    ModelError
        If there is no derived function of a name.
    """
    derivation = Derivation(freeze(model))
    found = []
    for name in names or SHOWN:
        try:
            expr = derivation[name]
        except KeyError:
            raise ModelError(
                model.name,
                f"quantity '{name}'",
                "there is no such derived function",
                f"Give one of {', '.join(SHOWN)}, or one with suffixes like g_N_q",
            ) from None
        if not expr.numel():
            continue
        count = operations(expr)
        if not names and (expr.nnz() == 0 or all(expr.nz[k].is_zero() for k in range(expr.nnz()))):
            continue
        stem = name if name in QUANTITIES else name.rpartition("_")[0]
        equation = QUANTITIES[stem].equation if name in QUANTITIES else f"derivative of {stem}"
        if name == "p_v":
            equation = "M = dp/dv"
        value = to_sympy(expr) if names or count <= LONG else None
        found.append(Derived(name, equation, expr.shape, expr.nnz(), count, value))
    return found


def show(console: Console, model: Model, quantities: list[Derived]) -> None:
    """Print a table and the expressions as text."""
    data = freeze(model)
    console.print(f"{data.name}: {data.doc}", markup=False, highlight=False)
    console.print(f"q = ({', '.join(data.coordinates)})", markup=False, highlight=False)
    if data.parameters:
        values = ", ".join(f"{p.name} = {p.default:g} {p.unit}".rstrip() for p in data.parameters)
        console.print(f"parameters: {values}", markup=False, highlight=False)
    for c in data.contacts:
        kind = "friction" if c.g_N is None else "contact"
        components = c.gamma_F.numel()
        console.print(
            f"{kind} {c.name}: {components} slip component{'s' * (components != 1)}"
            + (", guarded" if c.guard is not None else ""),
            markup=False,
            highlight=False,
        )
    table = Table()
    table.add_column("quantity")
    table.add_column("")
    for heading in ("size", "nonzeros", "operations"):
        table.add_column(heading, justify="right")
    for d in quantities:
        table.add_row(d.name, d.equation, d.size, str(d.nonzeros), str(d.operations))
    console.print(table)
    for d in quantities:
        console.print(text(d), markup=False, highlight=False, soft_wrap=True)


def text(d: Derived) -> str:
    """The expression as text, nonzero entries one by one."""
    if d.value is None:
        return f"{d.name}: {d.operations} operations, shown by --quantity {d.name}"
    if d.shape == (1, 1):
        return f"{d.name} = {d.value[0]}"
    column = d.shape[1] == 1
    lines = []
    for i in range(d.shape[0]):
        for j in range(d.shape[1]):
            if d.value[i, j] != 0:
                lines.append(f"{d.name}[{i}{'' if column else f', {j}'}] = {d.value[i, j]}")
    return "\n".join(lines) or f"{d.name} = 0"


def latex(quantities: list[Derived]) -> str:
    """The expressions as a LaTeX align environment."""
    lines = []
    for d in quantities:
        if d.value is None:
            continue
        value = d.value[0] if d.shape == (1, 1) else d.value
        names = {s: latex_name(s.name) for s in value.free_symbols}
        lines.append(f"  {_symbol(d.name)} &= {sp.latex(value, symbol_names=names)}")
    return "\\begin{align*}\n" + " \\\\\n".join(lines) + "\n\\end{align*}"


def _symbol(name: str) -> str:
    if name == "p_v":
        return "M"
    greek = {"gamma": r"\gamma", "chi": r"\chi", "mu": r"\mu", "energy": "E", "L": "L"}
    stem, _, index = name.partition("_")
    symbol = greek.get(stem, stem if len(stem) == 1 else rf"\mathrm{{{stem}}}")
    if not index:
        return symbol
    parts = [greek.get(part, part) for part in index.split("_")]
    return f"{symbol}_{{{' '.join(parts)}}}"
