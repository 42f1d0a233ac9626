"""Residual and Jacobian of one problem of a compiled scheme, put together from its parts."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from signorini.runtime.errors import RunError
from signorini.runtime.library import SUCCESS, Library


@dataclass(frozen=True)
class _Places:
    """Where the numbers of a part stand among those of the model, block by block."""

    own: np.ndarray
    whole: int

    @classmethod
    def of(cls, members: Sequence[int], width: int, blocks: int) -> "_Places":
        """The members of each of some blocks; the model has blocks of `width`."""
        own = [block * width + k for block in range(blocks) for k in members]
        return cls(np.array(own, dtype=int), blocks * width)


def _known(array: str, rows: Sequence[int], n: Mapping[str, int]) -> list[int]:
    """What a part knows at the start of a segment, among `array` of the model: of its slip rows,
    and of its rows of gamma before them."""
    slip = n["n_R"] - n["n_F"]
    gamma = [row - n["n_g"] for row in rows if n["n_g"] <= row < n["n_g"] + n["n_gamma"]]
    before = n["n_gamma"] if array == "given" else 0
    return [*(gamma if array == "given" else ()), *(before + r - slip for r in rows if r >= slip)]


@dataclass(frozen=True)
class _Island:
    """What is evaluated at once: its number, and coordinates and rows among those of the model."""

    number: tuple[int, ...]
    coordinates: list[int]
    rows: list[int]
    problems: list[dict[str, Any]]  # of a part that stands alone with their tables


_TABLES = ("K_order", "K_start", "K_column", "B_start", "B_row", "C_start", "C_column")


class Evaluation:
    """Problems of a compiled scheme at unknowns that are given.

    Parameters
    ----------
    library : Library
        The compiled model.
    """

    def __init__(self, library: Library) -> None:
        self.library = library
        self.manifest = library.manifest
        self.sizes = library.sizes

    def of(
        self,
        problem: int,
        given: tuple[np.ndarray, np.ndarray, np.ndarray],
        at: tuple[Any, ...],
        known: Mapping[str, np.ndarray],
    ) -> dict[str, np.ndarray]:
        """The problem of the whole model at (x, R, u), from the state, parameters, options and step
        size `at`.

        Raises
        ------
        RunError
            If it cannot be evaluated.
        """
        islands = self._joined() if self.sizes["n_couplings"] else self._apart()
        found: dict[str, np.ndarray] = {}
        alone: dict[str, np.ndarray] = {}
        for island in islands:
            own = self._evaluate(island, problem, given, at, known)
            for key, (value, places) in own.items():
                if key not in found:
                    found[key] = np.zeros([p.whole for p in places], dtype=value.dtype)
                where = np.ix_(*(p.own for p in places))
                # what parts say of the momenta is in every share of the couplings: here the first
                share = island.number[0] if self.sizes["n_couplings"] else 0
                if share and key in ("r", "A"):
                    found[key][where] += value - alone[key]
                else:
                    found[key][where] = value
            if island is islands[0]:
                alone = {key: value for key, (value, _) in own.items()}
        return found

    def _apart(self) -> list[_Island]:
        """Parts that nothing joins."""
        parts = self.manifest["parts"]
        return [
            _Island(
                (k,) if len(parts) > 1 else (),
                list(part["coordinates"]),
                list(part["rows"]),
                self.manifest["kinds"][part["kind"]]["problems"],
            )
            for k, part in enumerate(parts)
        ]

    def _joined(self) -> list[_Island]:
        """All parts as one island: without couplings, then with as many at a time as C has room
        for."""
        n = self.sizes
        parts = [p for p in self.manifest["parts"] if not p["couples"]]
        couplings = [p for p in self.manifest["parts"] if p["couples"]]
        coordinates = [j for p in parts for j in p["coordinates"]]
        first = self.manifest["kinds"][parts[0]["kind"]]
        own = first["sizes"]["n_q"]
        problems = [p | {"n_x": p["n_x"] // own * n["n_q"]} for p in first["problems"]]
        ends = np.cumsum([0, n["n_g"], n["n_gamma"], n["n_N"], n["n_F"]])
        islands = []
        for share in range(-1, -(-len(couplings) // n["n_joined"])):
            members = [*parts]
            if share >= 0:
                members += couplings[share * n["n_joined"] : (share + 1) * n["n_joined"]]
            rows = [
                row
                for low, high in itertools.pairwise(ends)
                for p in members
                for row in p["rows"]
                if low <= row < high
            ]
            islands.append(_Island((share + 1,), coordinates, rows, problems))
        return islands

    def _evaluate(
        self,
        island: _Island,
        problem: int,
        given: tuple[np.ndarray, np.ndarray, np.ndarray],
        at: tuple[Any, ...],
        known: Mapping[str, np.ndarray],
    ) -> dict[str, tuple[np.ndarray, tuple[_Places, ...]]]:
        """The problem of one island, and where its numbers stand among those of the model."""
        lib, n = self.library, self.sizes
        work = lib.structs["work"]()
        for array, values in known.items():
            own = [values[k] for k in _known(array, island.rows, n)]
            for k, value in enumerate(own):
                getattr(work, array)[k] = float(value)
        x, R, u = given
        state, params, options, h = at
        n_q, n_R = len(island.coordinates), len(island.rows)
        problems = island.problems
        velocities = sum(p["n_x"] // n_q for p in problems)
        unknowns = _Places.of(island.coordinates, n["n_q"], velocities)
        slots = sum(p["n_slots"] for p in problems)
        percussions = _Places.of(island.rows, n["n_R"], slots)
        arrays = [lib.array(a) for a in (u, x[unknowns.own], R[percussions.own])]
        status = lib.call["problem"](
            state,
            work,
            params,
            options,
            lib.pointer(arrays[0]),
            h,
            *island.number,
            problem,
            lib.pointer(arrays[1]),
            lib.pointer(arrays[2]),
        )
        p = problems[problem]
        if status > SUCCESS:
            raise RunError(f"problem '{p['name']}': {lib.status_texts[status]}")
        n_x, n_rows = p["n_x"], p["n_slots"] * n_R
        smooth = _Places.of(island.coordinates, n["n_q"], n_x // n_q)
        rows = _Places.of(island.rows, n["n_R"], p["n_slots"])
        if n["n_couplings"]:
            # tables of an island that is put together stand in the scratch
            first = list(work.tables)[len(_TABLES) * problem :]
            table = list(work.table)
            tables = {name: table[first[k] :] for k, name in enumerate(_TABLES)}
        else:
            tables = p["tables"]

        def take(field: Any, count: int) -> np.ndarray:
            return lib.kept(field)[:count]

        return {
            "r": (take(work.r, n_x), (smooth,)),
            "y": (take(work.y, n_rows), (rows,)),
            "phi": (take(work.rows.phi, n_rows), (rows,)),
            "prox_r": (take(work.scales.prox_r, n_rows), (rows,)),
            "A": (
                _matrix(work.K, tables, "K_start", "K_column", True, (n_x, n_x)),
                (smooth, smooth),
            ),
            "B": (
                _matrix(work.B, tables, "B_start", "B_row", False, (n_rows, n_x)).T,
                (smooth, rows),
            ),
            "C": (
                _matrix(work.C, tables, "C_start", "C_column", False, (n_rows, n_x)),
                (rows, smooth),
            ),
        }


def _matrix(
    values: Any,
    tables: Mapping[str, Sequence[int]],
    start: str,
    index: str,
    reordered: bool,
    shape: tuple[int, int],
) -> np.ndarray:
    """A matrix from its rows with columns in elimination order; `reordered`: the rows too."""
    order, begins, columns = tables["K_order"], tables[start], tables[index]
    full = np.zeros(shape)
    for i in range(shape[0]):
        for k in range(begins[i], begins[i + 1]):
            if columns[k] < shape[1]:
                full[order[i] if reordered else i, order[columns[k]]] = values[k]
    return full
