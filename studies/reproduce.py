"""All studies by one call: figures, data and the table of claims."""

import json
from collections.abc import Callable
from pathlib import Path

from signorini.codegen.frontend.errors import GenerationError
from signorini.runtime.compile import describe_machine
from signorini.studies import (
    figures,
    invariants,
    law_orders,
    limits,
    located,
    located_orders,
    paper,
    tolerances,
)
from signorini.studies.claims import Claim, markdown
from signorini.studies.paper import Progress, Study

STUDIES: dict[str, Callable[..., Study]] = {
    **paper.STUDIES,
    **limits.STUDIES,
    **invariants.STUDIES,
    **located_orders.STUDIES,
    **law_orders.STUDIES,
    **located.STUDIES,
    **tolerances.STUDIES,
}
NAMES = tuple(name.replace(" ", "_") for name in STUDIES)


def chosen(names: tuple[str, ...]) -> list[str]:
    """Names of studies, 'all' for every one.

    Raises
    ------
    GenerationError
        If there is no study of a name.
    """
    if not names or "all" in names:
        return list(STUDIES)
    found = {name.replace(" ", "_"): name for name in STUDIES}
    for name in names:
        if name not in found:
            raise GenerationError(
                f"there is no study '{name}'. Give all or some of {', '.join(found)}."
            )
    return [found[name] for name in names]


def reproduce(names: tuple[str, ...], folder: Path, report: Progress) -> list[Claim]:
    """Run studies, write figures (PNG, PDF), results.md and results.json; return the claims."""
    wanted = chosen(names)
    folder.mkdir(parents=True, exist_ok=True)
    claims: list[Claim] = []
    for name in wanted:
        study: Study = STUDIES[name](report)
        figures.draw(study, folder)
        claims += study.claims
    machine = describe_machine()
    measured_on = "Measured on " + ", ".join(machine.values()) + ".\n\n"
    (folder / "results.md").write_text(measured_on + markdown(claims), encoding="utf-8")
    rows = [
        {"study": c.study, "claim": c.text, "measured": float(c.measured), "how": c.how,
         "limit": float(c.limit), "met": bool(c.met)}
        for c in claims
    ]  # fmt: skip
    result = {"machine": machine, "claims": rows}
    (folder / "results.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return claims
