"""What the result of a run needs in memory, said before the first step."""

import math
from collections.abc import Iterable
from pathlib import Path

from signorini.runtime.errors import RunError

_INT = 4
_SHARE = 0.6  # of the free memory; quantities derived from the rows need some, too


def check_memory(rows: int, shapes: Iterable[tuple[int, ...]], real: int, every: int) -> None:
    """Raise if so many recorded rows do not fit into the memory that is free.

    Raises
    ------
    RunError
        With the sizes, and the `every` that fits.
    """
    row = real * (sum(math.prod(shape) for shape in shapes) + _INT)
    needed, free = row * (rows + 1), free_memory()
    if free is None or needed <= _SHARE * free:
        return
    fitting = math.ceil(every * needed / (_SHARE * free))
    raise RunError(
        f"the run would record {rows} rows of {row} bytes, {size_text(needed)}, but "
        f"{size_text(free)} are free: record every {fitting}th step or fewer "
        f"(every={fitting}, on the command line --every {fitting})"
    )


def size_text(size: float) -> str:
    """A number of bytes as people write it."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.0f} MB"


def free_memory() -> int | None:
    """Bytes that this process may still take; None where the system does not say."""
    found = []
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        table = dict(line.split(":", 1) for line in lines)
        found.append(int(table["MemAvailable"].split()[0]) * 1024)
    except (OSError, KeyError, ValueError, IndexError):
        pass
    try:
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
            found.append(max(limit - pages * resource.getpagesize(), 0))
    except (ImportError, OSError, ValueError, IndexError):
        pass
    return min(found) if found else None
