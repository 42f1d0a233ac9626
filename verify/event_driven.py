"""Motion with contact by events: equations of motion in the modes of the contacts, integrated by
extrapolation to round-off, cut where a mode ends.

Nothing here is a time-stepping scheme. It is what located steps are compared with.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from signorini.codegen.frontend.model import Model
from signorini.verify.reference import Reference, Rows

_TOUCH = 1e-9  # within it a gap is closed, a rate zero
_SWEEPS = 20_000
_COLUMNS = (2, 4, 6, 8, 10, 12, 14)  # steps of the midpoint rule that are extrapolated


class UndecidedError(Exception):
    """The motion has no decided continuation here."""


@dataclass
class Mode:
    """What a contact does: "open", "stick", "slip" or "closed" without friction; where it slips."""

    kind: str = "open"
    direction: np.ndarray | None = None


class EventDriven:
    """Event-driven motion of a model whose L is quadratic in v, with Coulomb friction.

    Parameters
    ----------
    model : Model
        The model as the user wrote it.
    rest : float
        An impact of a contact that comes sooner than this after its last is without restitution.
    """

    def __init__(self, model: Model, rest: float) -> None:
        self.reference = Reference(model, 2)
        self.e = self.reference.e
        self.rest = rest
        self.n = self.reference.n
        self.rows = self.reference.rows
        self.bilateral = slice(0, self.reference.n_bilateral)
        self.events: list[tuple[float, int, str]] = []

    # --- equations of motion ---------------------------------------------------------------------

    def _along(self, function: Callable[..., Any], at: tuple[Any, ...]) -> np.ndarray:
        """Derivative of a function of (t, q, v) along (1, v, 0), to fourth order and better."""
        t, q, v, u, par = at
        step = 2e-3

        def there(k: float) -> np.ndarray:
            return np.asarray(function(t + k * step, q + k * step * v, v, u, par), float)

        wide = (there(2) - there(-2)) / (4 * step)
        near = (there(1) - there(-1)) / (2 * step)
        close = (there(0.5) - there(-0.5)) / step
        first, second = (4 * near - wide) / 3, (4 * close - near) / 3
        return (16 * second - first) / 15

    def _mass(self, at: tuple[Any, ...]) -> np.ndarray:
        t, q, v, u, par = at
        columns = []
        for j in range(self.n):
            one = np.zeros(self.n)
            one[j] = 1.0
            columns.append((self.e.p(t, q, v + one, u, par) - self.e.p(t, q, v - one, u, par)) / 2)
        return np.array(columns, float).T

    def _system(self, at: tuple[Any, ...]) -> tuple[np.ndarray, ...]:
        """M, force, W and the rates of the velocities of all rows without dv/dt."""
        force = self.e.L_q(*at) + self.e.value("f", *at) - self._along(self.e.p, at)
        W = np.asarray(self.e.W(*at), float).reshape(self.n, -1)
        rate = self._along(self.e.y_dot, at) if W.size else np.zeros(0)
        return self._mass(at), np.asarray(force, float), W, rate

    def _coefficients(self, at: tuple[Any, ...]) -> tuple[np.ndarray, np.ndarray]:
        mu = np.asarray(self.e.value("mu", *at), float)
        bound = np.maximum(np.asarray(self.e.value("bound", *at), float), 0.0)
        return mu, bound

    def accelerations(
        self, at: tuple[Any, ...], modes: list[Mode]
    ) -> tuple[np.ndarray, np.ndarray]:
        """dv/dt and the forces of all rows in given modes."""
        M, force, W, rate = self._system(at)
        mu, bound = self._coefficients(at)
        slip = self._slips(at)
        columns = [W[:, self.bilateral]]
        rows = list(range(self.bilateral.stop))
        back: list[tuple[int, np.ndarray]] = []  # unknown -> forces of all rows
        for k in rows:
            one = np.zeros(W.shape[1])
            one[k] = 1.0
            back.append((k, one))
        known = np.zeros(W.shape[1])
        for k, (n, f, b, p, _) in enumerate(self.rows):
            mode = modes[k]
            if mode.kind == "open":
                continue
            if n is not None:
                one = np.zeros(W.shape[1])
                one[n] = 1.0
                for j, pressed in enumerate(self.rows):
                    if pressed.presses == n and modes[j].kind == "slip":
                        one[pressed.friction] = -mu[j] * self._direction(modes[j], slip[j])
                back.append((n, one))
                rows.append(n)
                columns.append((W @ one)[:, None])
            elif mode.kind == "slip" and p is None:
                known[f] = -bound[b] * self._direction(mode, slip[k])
            if mode.kind == "stick":
                for j in range(f.start, f.stop):
                    one = np.zeros(W.shape[1])
                    one[j] = 1.0
                    back.append((j, one))
                    rows.append(j)
                    columns.append(W[:, [j]])
        B = np.hstack(columns)
        C = W[:, rows].T
        K = np.block([[M, -B], [C, np.zeros((len(rows), len(rows)))]])
        right = np.concatenate([force + W @ known, -rate[rows]])
        scale = np.sqrt(np.max(np.abs(K), axis=1, initial=1e-300))
        solution = np.linalg.lstsq(K / scale[:, None], right / scale, rcond=1e-13)[0]
        lam = known + sum(
            (x * one for x, (_, one) in zip(solution[self.n :], back, strict=True)),
            start=np.zeros(W.shape[1]),
        )
        return solution[: self.n], lam

    @staticmethod
    def _direction(mode: Mode, slip: np.ndarray) -> np.ndarray:
        size = np.linalg.norm(slip)
        assert mode.direction is not None
        if slip.size == 1 or size <= _TOUCH:
            return mode.direction
        return slip / size

    def _slips(self, at: tuple[Any, ...]) -> list[np.ndarray]:
        rates = np.asarray(self.e.y_dot(*at), float)
        return [rates[row.friction] for row in self.rows]

    def _gaps(self, at: tuple[Any, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Gaps and their rates, contact by contact; no number for friction elements."""
        y, rates = np.asarray(self.e.y(*at), float), np.asarray(self.e.y_dot(*at), float)
        normal = [row.normal for row in self.rows]
        gap = np.array([np.nan if n is None else y[n] for n in normal])
        return gap, np.array([np.nan if n is None else rates[n] for n in normal])

    # --- contact problems ------------------------------------------------------------------------

    def _sweep(
        self,
        G: np.ndarray,
        y: np.ndarray,
        blocks: Sequence[tuple[Rows, slice, float, float]],
        back: np.ndarray | None = None,
    ) -> np.ndarray:
        """Percussions P of 0 <= y + G P and friction, by projections one contact after the other.

        A block holds the rows, the slip rows that may stick, mu and the bound; `back` presses
        friction besides P.
        """
        P = np.zeros(y.size)
        more = np.zeros(y.size) if back is None else back
        for _ in range(_SWEEPS):
            change = 0.0
            for (n, _, _, p, _), f, mu, bound in blocks:
                old = P[[*([] if n is None else [n]), *range(f.start, f.stop)]].copy()
                if n is not None and G[n, n] > 0:
                    P[n] = max(P[n] - (y[n] + G[n] @ P) / G[n, n], 0.0)
                radius = bound if p is None else mu * (P[p] + more[p])
                if f.stop > f.start:
                    largest = np.max(np.linalg.eigvalsh(G[f, f]))
                    trial = P[f] - (y[f] + G[f] @ P) / max(largest, 1e-300)
                    size = np.linalg.norm(trial)
                    P[f] = trial if size <= radius else trial * (radius / size)
                new = P[[*([] if n is None else [n]), *range(f.start, f.stop)]]
                change = max(change, float(np.max(np.abs(new - old), initial=0.0)))
            if change <= 1e-15 * max(float(np.max(np.abs(P), initial=0.0)), 1e-300):
                return P
        if change > 1e-9 * max(float(np.max(np.abs(P), initial=0.0)), 1e-300):
            raise UndecidedError("projections do not converge")
        return P

    def _responses(self, M: np.ndarray, W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """K^-1 (W; 0) of M with the bilateral rows, and what the rows of W see of it."""
        B = W[:, self.bilateral]
        m = B.shape[1]
        K = np.block([[M, -B], [B.T, np.zeros((m, m))]])
        Z = np.linalg.lstsq(K, np.vstack([W, np.zeros((m, W.shape[1]))]), rcond=1e-13)[0]
        return Z[: self.n], W.T @ Z[: self.n]

    def strike(self, at: tuple[Any, ...], touching: np.ndarray, e_N: np.ndarray) -> np.ndarray:
        """Velocities behind the impact of all contacts that touch."""
        v = at[2]
        W = np.asarray(self.e.W(*at), float).reshape(self.n, -1)
        Z, G = self._responses(self._mass(at), W)
        rates = np.asarray(self.e.y_dot(*at), float)
        mu, _ = self._coefficients(at)
        e_F = np.asarray(self.e.value("e_F", *at), float)
        y = rates.copy()
        blocks = []
        acting = [row.normal for k, row in enumerate(self.rows) if touching[k]]
        for k, row in enumerate(self.rows):
            n, f = row.normal, row.friction
            if row.presses is not None and row.presses in acting:
                if n is not None and self.e.contacts[k].impact == "newton":
                    y[n] += e_N[k] * rates[n]
                y[f] += e_F[k] * rates[f]
                blocks.append((row, f, mu[k], 0.0))
        P = self._sweep(G, y, blocks)
        given, back = np.zeros(y.size), np.zeros(y.size)
        for k, (n, f, *_) in enumerate(self.rows):
            if n is not None and self.e.contacts[k].impact == "poisson":
                back[n] = e_N[k] * P[n]
                given[n], given[f] = P[n] + back[n], P[f]
        if np.any(back > 0):
            P = given + self._sweep(G, y + G @ given, blocks, back)
        return np.asarray(v + Z @ P)

    def choose(self, at: tuple[Any, ...]) -> list[Mode]:
        """Modes from gaps, velocities and the contact problem of accelerations."""
        M, force, W, rate = self._system(at)
        mu, bound = self._coefficients(at)
        gap, gap_rate = self._gaps(at)
        guard = np.asarray(self.e.value("guard", *at), float)
        modes = []
        directions = W.copy()
        known = np.zeros(W.shape[1])
        blocks = []
        staying: dict[int | None, bool] = {None: True}  # by normal row
        for k, row in enumerate(self.rows):
            n, f, b, p, _ = row
            exists = self.e.contacts[k].guard is None or guard[k] >= 0
            if n is not None:
                staying[n] = bool(gap[k] <= _TOUCH and gap_rate[k] <= _TOUCH)
            stays = exists and staying[p]
            slip = self._slips(at)[k]
            size = float(np.linalg.norm(slip)) if slip.size else 0.0
            rubs = slip.size > 0 and (p is None or mu[k] > 0)
            if not stays:
                modes.append(Mode())
            elif not rubs:
                modes.append(Mode("closed"))
            elif size > _TOUCH:
                modes.append(Mode("slip", slip / size))
                if p is not None:
                    directions[:, p] -= mu[k] * (W[:, f] @ (slip / size))
                else:
                    known[f] = -bound[b] * slip / size
            else:
                modes.append(Mode("stick"))
            if stays:
                free = f if modes[-1].kind == "stick" else slice(f.start, f.start)
                if n is not None or free.stop > free.start:
                    blocks.append((row, free, mu[k], bound[b] if b is not None else 0.0))
        m = self.bilateral.stop
        B = W[:, self.bilateral]
        K = np.block([[M, -B], [B.T, np.zeros((m, m))]])
        right = np.concatenate([force + W @ known, -rate[self.bilateral]])
        a = np.linalg.lstsq(K, right, rcond=1e-13)[0][: self.n]
        Z = np.linalg.lstsq(K, np.vstack([directions, np.zeros((m, W.shape[1]))]), rcond=1e-13)[0]
        P = self._sweep(W.T @ Z[: self.n], W.T @ a + rate, blocks)
        top = max(float(np.max(np.abs(P), initial=0.0)), 1e-300)
        for row, f, own_mu, own_bound in blocks:
            k, p = self.rows.index(row), row.presses
            radius = float(own_bound if p is None else own_mu * P[p])
            if p is not None and P[p] <= 1e-12 * top:
                modes[k] = Mode()
            elif f.stop > f.start and np.linalg.norm(P[f]) >= radius * (1 - 1e-10):
                modes[k] = Mode("slip", -P[f] / np.linalg.norm(P[f]))
        return modes

    # --- integration -----------------------------------------------------------------------------

    def _advance(self, at: tuple[Any, ...], modes: list[Mode], h: float) -> tuple[Any, ...]:
        """The state h later, by extrapolation of the midpoint rule (Gragg, Bulirsch, Stoer)."""
        t, q, v, u, par = at
        start = np.concatenate([q, v])

        def slope(time: float, x: np.ndarray) -> np.ndarray:
            a, _ = self.accelerations((time, x[: self.n], x[self.n :], u, par), modes)
            return np.concatenate([x[self.n :], a])

        table: list[list[np.ndarray]] = []
        for count in _COLUMNS:
            step = h / count
            before, now = start, start + step * slope(t, start)
            for k in range(1, count):
                before, now = now, before + 2 * step * slope(t + k * step, now)
            row = [(before + now + step * slope(t + h, now)) / 2]
            for j, last in enumerate(table[-1] if table else []):
                ratio = (count / _COLUMNS[len(table) - 1 - j]) ** 2
                row.append(row[-1] + (row[-1] - last) / (ratio - 1))
            table.append(row)
        x = table[-1][-1]
        return t + h, x[: self.n], x[self.n :], u, par

    def _margins(self, at: tuple[Any, ...], modes: list[Mode]) -> dict[tuple[int, str], float]:
        """Event functions, positive before the event."""
        gap, _ = self._gaps(at)
        slip = self._slips(at)
        mu, bound = self._coefficients(at)
        guard = np.asarray(self.e.value("guard", *at), float)
        found: dict[tuple[int, str], float] = {}
        _, lam = self.accelerations(at, modes)
        for k, (n, f, b, p, _) in enumerate(self.rows):
            mode = modes[k]
            if mode.kind == "open":
                if n is not None and (self.e.contacts[k].guard is None or guard[k] >= 0):
                    found[k, "close"] = gap[k]
                continue
            if n is not None:
                found[k, "open"] = lam[n]
            if mode.kind == "stick":
                radius = float(bound[b] if p is None else mu[k] * lam[p])
                found[k, "slip"] = radius - float(np.linalg.norm(lam[f]))
            if mode.kind == "slip":
                assert mode.direction is not None
                found[k, "stick"] = float(slip[k] @ mode.direction)
        return found

    def _refuse_stiff(self, at: tuple[Any, ...], modes: list[Mode], h: float) -> None:
        """Friction turns a small slip in space faster than an explicit integration can follow."""
        if not any(
            m.kind == "slip" and m.direction is not None and m.direction.size > 1 for m in modes
        ):
            return
        _, lam = self.accelerations(at, modes)
        W = np.asarray(self.e.W(*at), float).reshape(self.n, -1)
        _, G = self._responses(self._mass(at), W)
        for k, (_, f, *_) in enumerate(self.rows):
            if modes[k].kind == "slip" and f.stop - f.start > 1:
                rate = float(np.linalg.norm(G[f, f] @ lam[f]))
                if h * rate > 0.5 * float(np.linalg.norm(self._slips(at)[k])):
                    raise UndecidedError("a slip in space that is too small for its friction")

    def _segment(
        self, at: tuple[Any, ...], modes: list[Mode], h: float
    ) -> tuple[tuple[Any, ...], tuple[int, str] | None]:
        """Up to h further, or up to the first event."""
        self._refuse_stiff(at, modes, h)
        start = self._margins(at, modes)
        size = {key: max(abs(x), 1.0) for key, x in start.items()}
        end = self._advance(at, modes, h)
        after = self._margins(end, modes)
        past = [key for key, x in after.items() if x < -1e-11 * size[key]]
        if not past:
            return end, None
        best: tuple[float, tuple[Any, ...], tuple[int, str]] | None = None
        for key in past:
            low, high, f_low, f_high, side = 0.0, h, max(start[key], 0.0), after[key], 0
            if start[key] <= 1e-9 * size[key]:
                low, f_low = h, -1.0
                while f_low <= 0 and low > 1e-9 * h:  # hops may be short
                    low *= 0.1
                    f_low = self._margins(self._advance(at, modes, low), modes)[key]
                if f_low <= 0:
                    raise UndecidedError(f"{key} from the start")
            here = end
            for _ in range(80):
                x = high - f_high * (high - low) / (f_high - f_low)
                here = self._advance(at, modes, x)
                f = self._margins(here, modes)[key]
                if abs(f) <= 1e-15 * size[key] or high - low <= 1e-15 * h:
                    break
                if f > 0:
                    low, f_low = x, f
                    f_high *= 0.5 if side > 0 else 1.0
                    side = 1
                else:
                    high, f_high = x, f
                    f_low *= 0.5 if side < 0 else 1.0
                    side = -1
            if best is None or x < best[0]:
                best = (x, here, key)
        assert best is not None
        return best[1], best[2]

    def run(
        self, at: tuple[Any, ...], t_end: float, step: float, most: int = 200
    ) -> tuple[np.ndarray, np.ndarray]:
        """State at `t_end`; raises `UndecidedError` where the motion cannot be followed."""
        struck: dict[int, float] = {}
        modes: list[Mode] | None = None
        for _ in range(most):
            at = self._impacts(at, struck)
            modes = self.choose(at) if modes is None else modes
            event = None
            while event is None and t_end - at[0] > 1e-15 * max(1.0, abs(t_end)):
                at, event = self._segment(at, modes, min(step, t_end - at[0]))
            if event is None:
                return at[1], at[2]
            modes = self._behind(at, modes, event)
        raise UndecidedError("too many events")

    def _impacts(self, at: tuple[Any, ...], struck: dict[int, float]) -> tuple[Any, ...]:
        t = at[0]
        gap, rate = self._gaps(at)
        guard = np.asarray(self.e.value("guard", *at), float)
        exists = np.array(
            [c.guard is None or guard[k] >= 0 for k, c in enumerate(self.e.contacts)], dtype=bool
        )
        touching = exists & (gap <= _TOUCH)
        coming = touching & (rate < -_TOUCH)
        if not np.any(coming):
            return at
        e_N = np.array(self.e.value("e_N", *at), float)
        for k in np.flatnonzero(coming):
            if t - struck.get(int(k), -np.inf) < self.rest:
                e_N[k] = 0.0
            struck[int(k)] = t
            self.events.append((t, int(k), "impact"))
        return t, at[1], self.strike(at, touching, e_N), *at[3:]

    def _behind(
        self, at: tuple[Any, ...], modes: list[Mode], event: tuple[int, str]
    ) -> list[Mode] | None:
        """Modes behind an event; None where they are to be sought."""
        k, what = event
        if what in ("close", "stick"):
            if what == "stick":
                self.events.append((at[0], k, what))
            return None
        self.events.append((at[0], k, what))
        changed = list(modes)
        if what == "open":
            changed = [
                Mode() if row.presses == self.rows[k].normal else mode
                for row, mode in zip(self.rows, modes, strict=True)
            ]
        else:
            _, lam = self.accelerations(at, modes)
            f = self.rows[k].friction
            changed[k] = Mode("slip", -lam[f] / np.linalg.norm(lam[f]))
        return changed
