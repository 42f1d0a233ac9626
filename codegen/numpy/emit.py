"""The module of a model's functions: spec, text, file."""

import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from signorini import templates
from signorini.codegen.derive.public import PUBLIC, arguments_of
from signorini.codegen.derive.quantities import MATRICES, QUANTITIES, Derivation
from signorini.codegen.frontend.errors import GenerationError
from signorini.codegen.frontend.model_data import ModelData, Parameter
from signorini.codegen.graph import Graph, Operations
from signorini.codegen.numpy.printer import identifier, statements
from signorini.version import __version__

_FIXED = frozenset({"np", "math", "t", "q", "v", "u", "R", "par", "out", "PARAMETERS"})


@dataclass(frozen=True)
class NumpyFunction:
    """One function of the module."""

    name: str
    arguments: tuple[str, ...]
    doc: str
    shape: tuple[int, ...]
    aliases: tuple[str, ...]
    lines: tuple[str, ...]
    entries: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class NumpyTable:
    """Points and cells of a table."""

    name: str
    letters: tuple[str, ...]
    points: tuple[str, ...]
    cells: str


@dataclass(frozen=True)
class NumpySpec:
    """Everything the template sees."""

    version: str
    model: str
    doc: str
    model_hash: str
    coordinates: tuple[str, ...]
    velocities: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    functions: tuple[NumpyFunction, ...]
    tables: tuple[NumpyTable, ...]


def numpy_spec(data: ModelData) -> NumpySpec:
    """Derive and print all functions of a model."""
    d = Derivation(data)
    functions = tuple(
        _function(d, name, arguments_of(declared, d[name], data))
        for name, declared in PUBLIC
        if d[name].numel()
    )
    tables = tuple(
        NumpyTable(
            name,
            tuple("xy"[: t.dimension]),
            tuple(repr(p.tolist()) for p in t.points),
            repr(t.cells.tolist()),
        )
        for name, t in data.tables
    )
    content = repr((functions, tables, data.parameters))
    return NumpySpec(
        version=__version__,
        model=data.name,
        doc=data.doc,
        model_hash=hashlib.sha256(content.encode()).hexdigest(),
        coordinates=data.coordinates,
        velocities=data.velocities,
        inputs=data.inputs,
        parameters=data.parameters,
        functions=functions,
        tables=tables,
    )


def _function(d: Derivation, name: str, arguments: tuple[str, ...]) -> NumpyFunction:
    data = d.data
    value = d[name]
    rows, columns = value.shape
    is_vector = name in QUANTITIES and name not in MATRICES
    sparsity = value.sparsity()
    places = list(zip(sparsity.row(), sparsity.get_col(), strict=True))
    entries = [value.nz[k] for k in range(value.nnz())]
    operations = Operations(entries)
    used = {s.element_hash() for s in operations.used()}
    taken = set(_FIXED) | {name for name, _ in PUBLIC} | {name for name, _ in data.tables}
    names: dict[int, str] = {data.t.element_hash(): "t"}
    aliases = []
    for column, source in ((data.q, "q"), (data.v, "v"), (data.u, "u"), (d.R, "R")):
        for k in range(column.numel()):
            if column[k].element_hash() in used:
                plain = f"{source}_{k}" if source == "R" else column[k].name()
                local = identifier(plain, taken)
                names[column[k].element_hash()] = local
                aliases.append(f"{local} = {source}[..., {k}]")
    for k, parameter in enumerate(data.parameters):
        if data.par[k].element_hash() in used:
            local = identifier(parameter.name, taken)
            names[data.par[k].element_hash()] = local
            aliases.append(f'{local} = par["{parameter.name}"]')
    tables = {t.function: f"_{name}" for name, t in data.tables}
    lines, texts = statements(Graph(operations, names, tables))
    return NumpyFunction(
        name=name,
        arguments=tuple(arguments),
        doc=QUANTITIES[name].doc if name in QUANTITIES else f"derivative: {name}",
        shape=(rows,) if is_vector else (rows, columns),
        aliases=tuple(aliases),
        lines=tuple(lines),
        entries=tuple(
            (str(i) if is_vector else f"{i}, {j}", text)
            for (i, j), text in zip(places, texts, strict=True)
        ),
    )


def render(data: ModelData) -> str:
    """The text of the module."""
    return templates.environment().get_template("model.py.jinja").render(spec=numpy_spec(data))


def write(data: ModelData, out_dir: str | os.PathLike[str], prefix: str) -> Path:
    """Write ``prefix_model.py`` into a folder; what else stands in it stays.

    Raises
    ------
    GenerationError
        If the folder cannot be written.
    """
    text = render(data)
    folder = Path(out_dir)
    target = folder / f"{prefix}_model.py"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".", suffix=".py", dir=folder)
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        Path(name).chmod(0o644)
        Path(name).replace(target)
    except OSError as error:
        raise GenerationError(f"cannot write {target}: {error.strerror or error}") from None
    return target
