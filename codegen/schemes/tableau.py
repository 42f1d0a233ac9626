"""Lobatto IIIA-IIIB tableaux for any number of stages, to 50 digits, rounded once."""

from dataclasses import dataclass
from functools import cache
from math import comb

import mpmath as mp
import numpy as np

DIGITS = 50
MAX_STAGES = 12


@dataclass(frozen=True, eq=False)
class Tableau:
    """A Lobatto IIIA-IIIB pair.

    Attributes
    ----------
    s : int
        Number of stages.
    c, b : tuple of mpf, length s
        Nodes and weights.
    a, a_hat : tuple of rows of mpf, s x s
        Lobatto IIIA and IIIB coefficients, the latter by (46).
    """

    s: int
    c: tuple[mp.mpf, ...]
    b: tuple[mp.mpf, ...]
    a: tuple[tuple[mp.mpf, ...], ...]
    a_hat: tuple[tuple[mp.mpf, ...], ...]

    @property
    def a_a_hat(self) -> list[list[mp.mpf]]:
        """The product A A_hat: response of the positions to the forces."""
        with mp.workdps(DIGITS):
            s = range(self.s)
            return [[mp.fsum(self.a[i][k] * self.a_hat[k][j] for k in s) for j in s] for i in s]

    def arrays(self) -> dict[str, np.ndarray]:
        """The coefficients rounded to double: ``c``, ``b``, ``a``, ``a_hat``."""
        return {
            name: np.array(
                [[float(x) for x in row] if isinstance(row, tuple) else float(row) for row in rows]
            )
            for name, rows in (("c", self.c), ("b", self.b), ("a", self.a), ("a_hat", self.a_hat))
        }


@cache
def lobatto(s: int) -> Tableau:
    """Return the s-stage Lobatto IIIA-IIIB pair.

    Parameters
    ----------
    s : int
        Number of stages, 2 <= s <= 12.

    Raises
    ------
    ValueError
        If `s` is out of range.

    Notes
    -----
    The nodes are 0, 1 and the roots of the derivative of the shifted Legendre polynomial of
    degree s - 1; a_ij = int_0^c_i l_j, b_j = int_0^1 l_j with the Lagrange basis l; the second
    tableau is a_hat_ij = b_j - b_j a_ji / b_i (46).
    """
    if not isinstance(s, (int, np.integer)) or isinstance(s, bool) or not 2 <= s <= MAX_STAGES:
        raise ValueError(f"stages = {s!r}: Lobatto IIIA-IIIB takes 2 to {MAX_STAGES} stages")
    s = int(s)
    with mp.workdps(DIGITS + 20):
        c = _nodes(s)
        basis = [_lagrange(c, j) for j in range(s)]
        a = tuple(tuple(_integral(l_j, c_i) for l_j in basis) for c_i in c)
        b = a[-1]
        a_hat = tuple(
            tuple(mp.mpf(0) if j == s - 1 else b[j] - b[j] * a[j][i] / b[i] for j in range(s))
            for i in range(s)
        )
    return Tableau(s, tuple(c), b, a, a_hat)


@cache
def dense_positions(s: int) -> np.ndarray:
    """Polynomials of a dense output of positions, shape (s + 2, s + 2), the constant first.

    Row i < s takes the value 1 at node c_i, 0 at the others, and has slope 0 at 0 and 1; the last
    two rows vanish at all nodes and have slope 1 at 0 or at 1.
    """
    with mp.workdps(DIGITS):
        c = lobatto(s).c
        values = [[x**k for k in range(s + 2)] for x in c]
        slopes = [
            [k * x ** (k - 1) if k else mp.mpf(0) for k in range(s + 2)] for x in (c[0], c[-1])
        ]
        inverse = mp.matrix([*values, *slopes]) ** -1
        return np.array([[float(inverse[k, i]) for k in range(s + 2)] for i in range(s + 2)])


@cache
def dense_velocities(s: int) -> np.ndarray:
    """Lagrange polynomials on the nodes, shape (s, s), the constant first."""
    with mp.workdps(DIGITS):
        inverse = mp.matrix([[x**k for k in range(s)] for x in lobatto(s).c]) ** -1
        return np.array([[float(inverse[k, i]) for k in range(s)] for i in range(s)])


@cache
def first_instability(s: int) -> float:
    """The smallest z = h omega above 0 at which the s-stage pair amplifies q'' = -omega^2 q.

    The step is a matrix of determinant one; it amplifies where half its trace exceeds 1 in size.
    Above the first such window there are stable step sizes again, and further windows.
    """
    a, a_hat, b = (lobatto(s).arrays()[name] for name in ("a", "a_hat", "b"))

    def half_trace(z: np.ndarray) -> np.ndarray:
        x = np.asarray(z, dtype=float)[..., None, None] ** 2
        one = np.ones(s)
        # V + x A_hat A V = v 1 - x q A_hat 1, with h = M = 1
        system = np.eye(s) + x * (a_hat @ a)
        from_q = np.linalg.solve(system, (-x * (a_hat @ one)[:, None]))[..., 0]
        from_v = np.linalg.solve(system, np.broadcast_to(one[:, None], (*x.shape[:-2], s, 1)))[
            ..., 0
        ]
        q_q = 1 + from_q @ b
        v_v = 1 - x[..., 0, 0] * (from_v @ (a.T @ b))
        return (q_q + v_v) / 2

    z = np.linspace(1e-3, 8.0, 8000)
    size = np.abs(half_trace(z))
    for k in range(1, len(z) - 1):
        if size[k] >= size[k - 1] and size[k] >= size[k + 1]:
            # a maximum of |trace| / 2: narrow windows show only there
            fine = np.linspace(z[k - 1], z[k + 1], 2001)
            values = np.abs(half_trace(fine))
        elif size[k] > 1:
            fine = np.linspace(z[k - 1], z[k], 2001)
            values = np.abs(half_trace(fine))
        else:
            continue
        outside = np.flatnonzero(values > 1 + 1e-12)
        if outside.size:
            return float(fine[max(int(outside[0]) - 1, 0)])
    return float(z[-1])


def _nodes(s: int) -> list[mp.mpf]:
    n = s - 1
    # P_n(x) = 2^-n sum_k (-1)^k C(n, k) C(2n - 2k, n) x^(n - 2k); its derivative, highest first.
    slope = [mp.mpf(0)] * n
    for k in range((n - 1) // 2 + 1):
        power = n - 2 * k
        factor = (-1) ** k * comb(n, k) * comb(2 * n - 2 * k, n)
        slope[2 * k] = mp.mpf(power * factor)
    roots = mp.polyroots(slope, maxsteps=500, extraprec=300) if n > 1 else []
    half = sorted((mp.re(x) + 1) / 2 for x in roots)
    for k in range(len(half) // 2):  # the nodes are symmetric: make them so to the last digit
        half[-1 - k] = 1 - half[k]
    if len(half) % 2:
        half[len(half) // 2] = mp.mpf(1) / 2
    return [mp.mpf(0), *half, mp.mpf(1)]


def _lagrange(c: list[mp.mpf], j: int) -> list[mp.mpf]:
    """Coefficients, constant first, of the Lagrange polynomial of node j."""
    poly = [mp.mpf(1)]
    for k, c_k in enumerate(c):
        if k != j:
            scale = c[j] - c_k
            shifted = [mp.mpf(0), *poly]
            poly = [
                (up - c_k * low) / scale
                for up, low in zip(shifted, [*poly, mp.mpf(0)], strict=True)
            ]
    return poly


def _integral(poly: list[mp.mpf], x: mp.mpf) -> mp.mpf:
    return mp.fsum(p * x ** (k + 1) / (k + 1) for k, p in enumerate(poly))
