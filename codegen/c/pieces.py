"""Long straight-line functions in pieces: compilers take more than linear time over long ones."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from signorini.codegen.c.functions import CFunction, CParameter, Section

LONGEST = 2400  # lines of a function that is left in one piece
_PIECE = 300  # lines of a piece
_WORD = re.compile(r"[A-Za-z_]\w*")
_DEFINES = re.compile(r"const real (\w+) =")
_OTHER = re.compile(r"const (?!real \w+ =)")  # truth values and cells of tables are not handed on


def in_pieces(f: CFunction, prefix: str) -> tuple[CFunction, ...]:
    """The function behind the pieces that it calls; a short one is left as it is.

    Every statement stays as it is and where it is. Terms that a later piece needs stand in an array
    that is handed from piece to piece.

    Parameters
    ----------
    f : CFunction
        What computes terms, then outputs from them.
    prefix : str
        Prefix of all names of the model.
    """
    statements = [*_statements(f.temporaries)]
    equations: list[tuple[int, Section]] = []
    for section in f.sections:
        equations.append((len(statements), section))
        statements += _statements(section.lines)
    if sum(len(x) for x in statements) <= LONGEST or any(
        _OTHER.match(x[0].strip()) for x in statements
    ):
        return (f,)
    pieces = list(_cut(statements))
    defined = {m[1]: k for k, piece in enumerate(pieces) for m in _definitions(piece)}
    aliases = {_name(a): a for a in f.aliases}
    uses = [_words(piece) for piece in pieces]
    crossing = sorted(
        name for name, k in defined.items() if any(name in used for used in uses[k + 1 :])
    )
    place = {name: i for i, name in enumerate(crossing)}
    s = "terms_between"
    while s in set().union(*uses) | set(aliases):
        s += "_"
    made = []
    at = 0
    for k, piece in enumerate(pieces):
        used = uses[k]
        read = [n for n in crossing if n in used and defined[n] < k]
        kept = [n for n in crossing if defined[n] == k]
        own = [a for name, a in aliases.items() if name in used]
        lines = [line for statement in piece for line in statement]
        lines += [f"{s}[{place[name]}] = {name};" for name in kept]
        whole = _words([[*own, *lines]]) | ({s} if read else set())
        made.append(
            replace(
                f,
                name=f"{f.name}_{k + 1}",
                doc=(f"piece {k + 1} of {len(pieces)}",),
                parameters=(*f.parameters, CParameter(s, array=True, const=False)),
                unused=tuple(p.name for p in f.parameters if p.name not in whole)
                + (() if s in whole else (s,)),
                aliases=(*own, *(f"const real {name} = {s}[{place[name]}];" for name in read)),
                temporaries=(),
                sections=(Section(_title(equations, at, f), (), tuple(lines)),),
                operations=-1,
            )
        )
        at += len(piece)
    arguments = ", ".join([*(p.name for p in f.parameters), s])
    calls = tuple(f"{prefix}_{piece.name}({arguments});" for piece in made)
    fills = tuple(fill for section in f.sections for fill in section.fills)
    body = replace(
        f,
        unused=(),
        aliases=(f"real {s}[{max(len(crossing), 1)}];",),
        temporaries=(),
        sections=(Section("piece by piece", fills, calls),),
        scratch=len(crossing),
    )
    return (*made, body)


def _statements(lines: Sequence[str]) -> Iterator[list[str]]:
    """Whole statements and loops, each with its lines."""
    found: list[str] = []
    depth = 0
    for line in lines:
        found.append(line)
        code = re.sub(r"/\*.*?\*/", "", line).rstrip()
        depth += code.count("{") - code.count("}")
        if depth == 0 and code.endswith((";", "}")):
            yield found
            found = []
    assert not found, found


def _cut(statements: Sequence[list[str]]) -> Iterator[list[list[str]]]:
    piece: list[list[str]] = []
    size = 0
    for statement in statements:
        piece.append(statement)
        size += len(statement)
        if size >= _PIECE:
            yield piece
            piece, size = [], 0
    if piece:
        yield piece


def _definitions(piece: list[list[str]]) -> Iterator[re.Match[str]]:
    for statement in piece:
        found = _DEFINES.match(statement[0].strip())
        if found:
            yield found


def _words(piece: list[list[str]]) -> set[str]:
    return {word for statement in piece for line in statement for word in _WORD.findall(line)}


def _name(alias: str) -> str:
    found = _DEFINES.match(alias)
    assert found, alias
    return found[1]


def _title(equations: list[tuple[int, Section]], at: int, f: CFunction) -> str:
    """What a piece that begins with a statement computes."""
    before = [section.equation for first, section in equations if first <= at]
    return before[-1] if before else "common terms"
