"""What a model says, as text and as LaTeX equations for a notebook."""

from collections.abc import Iterator
from typing import Any

import casadi as ca
import sympy as sp
from signorini.codegen.frontend.sx_to_sympy import operations, to_sympy

_LONGEST = 120  # operations of an expression that one still reads
_MOST = 12  # rows of constraints or contacts that are written out


def latex_name(name: str) -> str:
    """LaTeX of a declared symbol: a dot for default velocities, upright words."""
    if name.endswith("_dot"):
        return rf"\dot{{{latex_name(name.removesuffix('_dot'))}}}"
    stem, _, index = name.partition("_")
    latex = sp.latex(sp.Symbol(stem))
    if latex == stem and len(stem) > 1:
        latex = rf"\mathrm{{{stem}}}"
    return f"{latex}_{{{index}}}" if index else latex


def _expression(value: Any) -> str:
    """LaTeX of one expression of SymPy or CasADi; dots for a long one."""
    if isinstance(value, ca.SX):
        if operations(value) > _LONGEST:
            return r"\ldots"
        value = to_sympy(value)[0]
    value = sp.sympify(value)
    if sp.count_ops(value) > _LONGEST:
        return r"\ldots"
    names = {s: latex_name(s.name) for s in value.free_symbols}
    return str(sp.latex(value, symbol_names=names))


def _rows(model: Any) -> Iterator[tuple[str, str]]:
    """Left side and right side of every equation, named as in the literature."""
    if model.L is not None:
        yield "L", _expression(model.L)
    for force in model.forces:
        for name, entry in zip(model.coordinate_names, force, strict=True):
            right = _expression(entry)
            if right != "0":
                yield f"f_{{{latex_name(name)}}}", right
    for kind, blocks in ((r"g", model.constraints), (r"\gamma", model.velocity_constraints)):
        for name, rows in blocks:
            for entry in rows:
                yield rf"0 = {kind}_{{\mathrm{{{_upright(name)}}}}}", _expression(entry)
    for contact in model.contacts:
        index = rf"\mathrm{{{_upright(contact.name)}}}"
        if contact.g_N is not None:
            symbol = r"\gamma" if contact.one_way else "g"
            yield rf"0 \le {symbol}_{{N,{index}}}", _expression(contact.g_N)
        for entry in contact.gamma_F:
            yield rf"\gamma_{{F,{index}}}", _expression(entry)


def _upright(name: str) -> str:
    return name.replace("_", r"\_")


def text(model: Any) -> str:
    """One line: name, coordinates, constraints, contacts, inputs."""
    parts = [f"q = ({_listed(model.coordinate_names)})"]
    for what, names in (
        ("constraints", [name for name, _ in model.constraints]),
        ("velocity constraints", [name for name, _ in model.velocity_constraints]),
        ("contacts", [c.name for c in model.contacts if c.g_N is not None]),
        ("friction", [c.name for c in model.contacts if c.g_N is None]),
        ("inputs", model.input_names),
    ):
        if names:
            parts.append(f"{what} {_listed(names)}")
    return f"Model('{model.name}': {'; '.join(parts)})"


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:_MOST])
    return shown if len(names) <= _MOST else f"{shown}, ... ({len(names)})"


def markdown(model: Any) -> str:
    """Name, equations and parameters, for a notebook."""
    rows = list(_rows(model))
    lines = [rf"{left} &= {right}" for left, right in rows[: 3 * _MOST]]
    if len(rows) > len(lines):
        lines.append(rf"&\;\;\vdots \quad \text{{{len(rows) - len(lines)} more}}")
    equations = (
        "\n\n$$\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}$$" if lines else ""
    )
    table = ""
    if model.parameter_table:
        table = "\n\n| parameter | default | unit | |\n|---|---|---|---|\n" + "\n".join(
            f"| `{name}` | {p.default:g} | {p.unit} | {p.doc} |"
            for name, p in model.parameter_table.items()
        )
    doc = f": {model.doc}" if model.doc else ""
    return f"**{model.name}**{doc}\n\n`{text(model)}`{equations}{table}"
