"""Sparsity of the derivatives of a step, as CasADi takes it."""

from signorini.codegen.derive.influence import Influence

Pattern = tuple[int, ...]

INPUTS = ("q", "v", "u", "par", "t", "h")
RESULTS = ("q_next", "v_next")


def columns(sizes: dict[str, int]) -> tuple[tuple[str, Pattern], ...]:
    """Patterns of the arguments, which are columns without zeros.

    Parameters
    ----------
    sizes : dict
        Numbers of q, v, u, par.
    """
    found = []
    for name in INPUTS:
        n = sizes.get(name, 1)
        found.append((name, (n, 1, 0, n, *range(n))))
    return tuple(found)


def blocks(by: Influence, sizes: dict[str, int]) -> tuple[tuple[str, Pattern], ...]:
    """Patterns of the derivatives of each result by each argument, column by column."""
    n = sizes["q"]
    found = []
    for result in RESULTS:
        for name in INPUTS:
            entries: list[list[int]] = []
            for column in range(sizes.get(name, 1)):
                if name in ("t", "h"):
                    rows = list(range(n))
                else:
                    reads = getattr(by, name)
                    itself = {column} if (result, name) == ("q_next", "q") else set()
                    rows = [i for i in range(n) if column in reads[i] or i in itself]
                entries.append(rows)
            found.append((f"{result}_{name}", compressed(n, entries)))
    return tuple(found)


def compressed(rows: int, entries: list[list[int]]) -> Pattern:
    """Rows, columns, first entry of each column, rows of the entries."""
    starts = [0]
    for column in entries:
        starts.append(starts[-1] + len(column))
    return (rows, len(entries), *starts, *(row for column in entries for row in column))
