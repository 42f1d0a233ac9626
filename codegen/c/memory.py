"""Scratch that the runtime declares in C, e.g. in sg_work.h, with the sizes of a model."""

import re
from dataclasses import asdict

from signorini.codegen.c.layout import Field, Struct
from signorini.codegen.c.sizes import Sizes

_STRUCT = re.compile(
    r"/\*(?P<doc>(?:(?!\*/).)*)\*/\s*typedef struct \{(?P<body>[^}]*)\} SG\((?P<name>\w+)\);",
    re.DOTALL,
)
_FIELD = re.compile(
    r"\s*(?P<type>real|int) (?P<name>\w+)(?:\[(?P<dims>[^\]]*)\])?;\s*/\*(?P<doc>.*?)\*/",
    re.DOTALL,
)


def scratch(text: str, sizes: Sizes, file: str = "sg_work.h") -> tuple[Struct, ...]:
    """The structs of a file of the runtime, in its order.

    Raises
    ------
    ValueError
        If the file says something that this reader does not know: nothing is left out.
    """
    known = {f"SG_{name.upper()}": size for name, size in asdict(sizes).items()}
    found = []
    for s in _STRUCT.finditer(text):
        fields = []
        rest = s["body"]
        while rest.strip():
            f = _FIELD.match(rest)
            if f is None:
                raise ValueError(f"{file}, struct {s['name']}: cannot read {rest.strip()!r}")
            names = [] if f["dims"] is None else f["dims"].split(" * ")
            if unknown := [name for name in names if name not in known]:
                raise ValueError(f"{file}, {s['name']}.{f['name']}: no size {unknown[0]}")
            dims = tuple(known[name] for name in names)
            fields.append(Field(f["name"], f["type"], dims, _line(f["doc"])))
            rest = rest[f.end() :]
        found.append(Struct(s["name"], _line(s["doc"]), tuple(fields)))
    if len(found) != text.count("typedef"):
        raise ValueError(f"{file}: a typedef cannot be read")
    return tuple(found)


def _line(comment: str) -> str:
    return " ".join(comment.split())
