"""Figures of the studies, one function each."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from signorini.studies.paper import Study

COLOURS = {2: "#1b6ca8", 3: "#d1495b", 4: "#2e933c", 5: "#8d5a97", 6: "#e08e0b", 7: "#3d3d3d"}


def _tolerances(study: Study, plt: Any) -> Any:
    fig, ((wish, work, energy),) = _axes(plt, 1, 3, (14, 4.4))
    for name, c in study.curves.items():
        if "wish" in c:
            s = _stages(name)
            wish.loglog(c["wish"], c["error"], ".-", lw=0.5, ms=4, color=COLOURS[s])
        elif "evaluations" in c:
            ours = "s =" in name
            work.loglog(
                c["error"], c["evaluations"], "o-" if ours else "s--", ms=3, lw=1,
                color=COLOURS[_stages(name)] if ours else None, label=name.removeprefix("planet, "),
            )  # fmt: skip
        else:
            colour = COLOURS[3] if "chosen" in name else COLOURS[2]
            energy.plot(c["t"], c["energy"], color=colour, lw=0.8, label=f"{name[8:]} steps")
    ends = np.array([1e-10, 1e-3])
    wish.loglog(ends, ends, "k-", lw=1, label="error = wish")
    for s in sorted({_stages(n) for n, c in study.curves.items() if "wish" in c}):
        wish.plot([], [], ".-", color=COLOURS[s], label=f"s = {s}")
    wish.set_ylim(1e-15, 1e-1)
    wish.set(xlabel="error asked for", ylabel="error of q at the end", title="Shipped models")
    work.set(xlabel="error of q", ylabel="evaluations of forces", title="A planet, three periods")
    energy.set(xlabel="periods", ylabel="relative error of the energy", title="s = 3")
    energy.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2))
    for axis in (wish, work, energy):
        axis.legend(fontsize=8)
    return fig


def draw(study: Study, folder: Path) -> list[Path]:
    """Write a study's figure as PNG and PDF."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    fig = FIGURES[study.name](study, plt)
    stem = study.name.replace(" ", "_")
    paths = [folder / f"{stem}.png", folder / f"{stem}.pdf"]
    for path in paths:
        # no date inside, so that equal data give equal files
        fig.savefig(path, dpi=130, metadata={"CreationDate": None} if path.suffix == ".pdf" else {})
    plt.close(fig)
    return paths


def _stages(name: str) -> int:
    return int(name.rsplit("=", 1)[1])


def _axes(plt: Any, rows: int, columns: int, size: tuple[float, float]) -> tuple[Any, Any]:
    fig, axes = plt.subplots(rows, columns, figsize=size, squeeze=False, layout="constrained")
    for axis in axes.flat:
        axis.grid(alpha=0.25)
    return fig, axes


def _fig3(study: Study, plt: Any) -> Any:
    fig, ((axis,),) = _axes(plt, 1, 1, (7, 3.6))
    for name, c in study.curves.items():
        s = _stages(name)
        axis.plot(c["t"], c["g_N"], color=COLOURS[s], lw=1.6 if s == 3 else 0.8, label=name)
    axis.set_xlabel("t [s]")
    axis.set_ylabel("gap $g_N$ [m]")
    axis.set_title("Bouncing ball, case 1: ω = 0, e_N = 0.5, Δt = 0.01")
    axis.legend()
    return fig


def _fig4(study: Study, plt: Any) -> Any:
    fig, axes = _axes(plt, 2, 2, (10, 5.6))
    for column, (case, omega) in enumerate(((2, 50), (3, 10))):
        for name, c in study.curves.items():
            if not name.startswith(f"case {case},"):
                continue
            s = _stages(name)
            style = {"color": COLOURS[s], "lw": 1.6 if s == 3 else 0.8, "label": f"s = {s}"}
            axes[0, column].step(c["t"][1:], c["P_N"][1:], where="pre", **style)
            axes[1, column].step(c["t"][1:], c["P_F"][1:], where="pre", **style)
        axes[0, column].set_title(f"case {case}: ω = {omega}, e_N = 0")
        for row, (label, linear) in enumerate((("$ΔP_N$ [N s]", 0.12), ("$ΔP_F$ [N s]", 0.03))):
            axis = axes[row, column]
            # the impact is two orders above the percussions of lasting contact
            axis.set_yscale("symlog", linthresh=linear)
            axis.set_ylabel(label)
            axis.set_xlabel("t [s]")
            axis.legend(fontsize=8)
    return fig


def _fig6(study: Study, plt: Any) -> Any:
    fig, axes = _axes(plt, 2, 2, (11, 7))
    name = "s = 3" if "s = 3" in study.curves else next(iter(study.curves))
    c = study.curves[name]
    t = c["t"]
    panels = (
        (axes[0, 0], "g_N1", "g_N1_dot", "(a) $P_1$", "gap [m]", "rate [m/s]"),
        (axes[0, 1], "g_N3", "g_N3_dot", "(b) $P_3$", "gap [m]", "rate [m/s]"),
        (axes[1, 0], "phi_3", "omega_3", "(c) slider", "φ₃ [rad]", "rate [rad/s]"),
    )
    for axis, value, rate, title, label, rate_label in panels:
        axis.plot(t, c[value], color=COLOURS[2], lw=1.2)
        axis.set_ylabel(label, color=COLOURS[2])
        other = axis.twinx()
        other.plot(t, c[rate], color=COLOURS[3], lw=0.7, alpha=0.8)
        other.set_ylabel(rate_label, color=COLOURS[3])
        axis.set_xlabel("t [s]")
        axis.set_title(f"{title}, {name}")
        axis.set_zorder(other.get_zorder() + 1)
        axis.patch.set_visible(False)
    axes[1, 1].plot(c["x_3"], 1e3 * c["y_3"], color=COLOURS[2], lw=0.9)
    axes[1, 1].set_xlabel("x₃ [m]")
    axes[1, 1].set_ylabel("y₃ [mm]")
    axes[1, 1].set_title(f"(d) path of $S_3$, {name}")
    return fig


def _fig8(study: Study, plt: Any) -> Any:
    fig, axes = _axes(plt, 1, 3, (13, 3.9))
    x = np.linspace(0, 3, 200)
    axes[0, 0].fill_between(x, np.exp(-x), color="0.88")
    for name, c in study.curves.items():
        case = int(name[5])
        colour = COLOURS[2] if case == 1 else COLOURS[3]
        axes[0, 0].plot(c["q"][:, 0], c["q"][:, 1], color=colour, label=f"case {case}")
        for k, letter in enumerate("xy"):
            axes[0, 1 + k].plot(c["t"], c["v"][:, k], color=colour, label=f"case {case}")
            axes[0, 1 + k].set_ylabel(f"velocity of {letter} [m/s]")
            axes[0, 1 + k].set_xlabel("t [s]")
    axes[0, 0].set_xlabel("x [m]")
    axes[0, 0].set_ylabel("y [m]")
    axes[0, 0].set_title("s = 3, Δt = 0.01")
    for axis in axes.flat:
        axis.legend(fontsize=8)
    return fig


def _triangle(axis: Any, dt: np.ndarray, errors: np.ndarray, order: float, colour: str) -> None:
    """A slope triangle below a curve, in the middle of what is above rounding."""
    use = np.flatnonzero(np.asarray(errors) > 1e-12)
    if len(use) < 2:
        return
    k = use[len(use) // 2 - 1] if len(use) > 2 else use[0]
    a, b, low = dt[k], dt[k + 1], 0.25 * errors[k]
    axis.plot([a, b, b, a], [low, low, low * (b / a) ** order, low], color=colour, lw=0.8)
    axis.annotate(f"{order:g}", (b * 1.06, low * (b / a) ** (order / 2)), fontsize=7, color=colour)


def _convergence(axis: Any, study: Study, names: Sequence[str], what: str, order: Any) -> None:
    for name in names:
        s = _stages(name)
        c = study.curves[name]
        axis.loglog(c["dt"], c[what], "o-", ms=3, lw=1, color=COLOURS[s], label=f"s = {s}")
        if order is not None:
            _triangle(axis, c["dt"], c[what], order(s), COLOURS[s])
    axis.xaxis.set_minor_formatter("")
    axis.set_xlabel("Δt [s]")
    axis.set_ylabel(f"error of {what}")
    axis.legend(fontsize=8)


def _fig9(study: Study, plt: Any) -> Any:
    fig, axes = _axes(plt, 2, 2, (11, 8))
    for row, case in enumerate((1, 2)):
        names = [n for n in study.curves if n.startswith(f"case {case},")]
        for column, what in enumerate(("q", "v")):
            axis = axes[row, column]
            _convergence(axis, study, names, what, (lambda s: 2 * s - 2) if case == 1 else None)
            axis.set_title(f"case {case}, {what}")
            if case == 2:
                c = study.curves[names[0]]
                line = np.array(c[what])[-1] * np.array(c["dt"]) / c["dt"][-1]
                axis.loglog(c["dt"], line, "k--", lw=0.8, label="order 1")
                axis.legend(fontsize=8)
    return fig


def _orders(expected: Callable[[str, int], int]) -> Callable[[Study, Any], Any]:
    """A panel for every motion, slope triangles of the expected order."""

    def figure(study: Study, plt: Any) -> Any:
        texts = list(dict.fromkeys(name.rsplit(", s =", 1)[0] for name in study.curves))
        fig, axes = _axes(plt, 1, len(texts), (4.4 * len(texts), 4))
        for axis, text in zip(axes.flat, texts, strict=True):
            names = [n for n in study.curves if n.startswith(text)]
            _convergence(axis, study, names, "q", lambda s, text=text: expected(text, s))
            axis.set_title(text, fontsize=9)
        return fig

    return figure


def _impacts(study: Study, plt: Any) -> Any:
    fig, ((axis,),) = _axes(plt, 1, 1, (6, 3.6))
    for k, (rule, c) in enumerate(study.curves.items()):
        colour = COLOURS[3] if rule == "end" else COLOURS[2]
        bars = axis.bar(c["stages"] + 0.36 * (k - 0.5), 100 * c["share"], 0.34, color=colour,
                        label=f"active_set = {rule}")  # fmt: skip
        axis.bar_label(bars, fmt="%.0f", fontsize=8)
    axis.set_xticks(next(iter(study.curves.values()))["stages"])
    axis.set_xlabel("stages s")
    axis.set_ylabel("impacts registered in their step [%]")
    axis.set_ylim(0, 135)
    axis.legend(fontsize=8, loc="upper right", ncols=2)
    return fig


def _over_time(label: str, title: str) -> Callable[[Study, Any], Any]:
    def figure(study: Study, plt: Any) -> Any:
        fig, ((axis,),) = _axes(plt, 1, 1, (7, 4))
        for name, c in study.curves.items():
            value = next(v for k, v in c.items() if k != "t")
            colour = COLOURS[_stages(name)] if "=" in name else "0.3"
            axis.semilogy(c["t"][1:], np.maximum(value[1:], 1e-17), color=colour, lw=1, label=name)
        axis.set_xlabel("t")
        axis.set_ylabel(label)
        axis.set_title(title)
        axis.legend(fontsize=8)
        return fig

    return figure


def _work(study: Study, plt: Any) -> Any:
    fig, ((axis,),) = _axes(plt, 1, 1, (6.5, 4.2))
    for name, c in study.curves.items():
        axis.loglog(1e3 * c["seconds"], c["q"], "o-", ms=3, lw=1, color=COLOURS[_stages(name)],
                    label=name)  # fmt: skip
    axis.set_xlabel("computing time of a run [ms]")
    axis.set_ylabel("error of q")
    axis.set_title("Slope, case 1")
    axis.legend(fontsize=8)
    return fig


def _moreau(study: Study, plt: Any) -> Any:
    fig, axes = _axes(plt, 1, 2, (10.5, 4))
    for name, c in study.curves.items():
        colour = COLOURS[_stages(name)] if "=" in name else "0.3"
        style = {"color": colour, "lw": 1, "ms": 3, "label": name}
        axes[0, 0].loglog(1e3 * c["seconds"], c["q"], "o-", **style)
        axes[0, 1].loglog(1e3 * c["seconds"], np.maximum(c["penetration"], 1e-17), "o-", **style)
    for axis, label in zip(axes.flat, ("error of q", "penetration [m]"), strict=True):
        axis.set_xlabel("computing time of a run [ms]")
        axis.set_ylabel(label)
        axis.legend(fontsize=8)
    return fig


def _high_orders(study: Study, plt: Any) -> Any:
    fig, ((axis,),) = _axes(plt, 1, 1, (6, 4))
    for name in study.curves:
        c, s = study.curves[name], _stages(name)
        axis.loglog(c["dt"], c["q"], "o-", ms=3, lw=1, color=COLOURS[s], label=f"{name}: order "
                    f"{2 * s - 2}")  # fmt: skip
    axis.set_xlabel("Δt [s]")
    axis.set_ylabel("error of q, 40 digits")
    axis.set_title("Pendulum")
    axis.legend(fontsize=8)
    return fig


def _located_orders(study: Study, plt: Any) -> Any:
    texts = list(dict.fromkeys(n.split(": ")[0] for n in study.curves))
    columns = min(4, len(texts))
    rows = -(-len(texts) // columns)
    fig, axes = _axes(plt, rows, columns, (4 * columns, 3.8 * rows))
    smallest = min(e for c in study.curves.values() for e in c["q"] if e > 0)
    for axis, text in zip(axes.flat, texts, strict=False):
        for name in (n for n in study.curves if n.startswith(f"{text}: ")):
            s, c = _stages(name), study.curves[name]
            is_located = ": located" in name
            axis.loglog(
                c["dt"], c["q"], "o-" if is_located else "s:", ms=3, lw=1, color=COLOURS[s],
                label=f"{'located' if is_located else 'captured'}, s = {s}",
            )  # fmt: skip
        axis.xaxis.set_minor_formatter("")
        axis.set_ylim(max(1e-20, smallest / 3), 10)
        axis.set_xlabel("Δt [s]")
        axis.set_title(text, fontsize=10)
    for axis in axes[:, 0]:
        axis.set_ylabel("error of q, v at the end")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    spare = list(axes.flat[len(texts) :])
    for axis in spare:
        axis.axis("off")
    place = spare[0] if spare else axes.flat[0]
    place.legend(handles, labels, fontsize=8, loc="center" if spare else "best")
    return fig


def _located(study: Study, plt: Any) -> Any:
    fig, axes = _axes(plt, 1, 2, (11, 4))
    for events, colour in (("captured", COLOURS[3]), ("located", COLOURS[2])):
        c = study.curves[f"energy, {events}"]
        axes[0, 0].semilogx(c["t"][1:], c["energy"][1:], color=colour, lw=1.2, label=events)
    axes[0, 0].set_xlabel("t [s]")
    axes[0, 0].set_ylabel("energy over that of the start")
    axes[0, 0].set_title("Elastic ball, s = 3, Δt = 0.01")
    axes[0, 0].legend(fontsize=8)
    c = study.curves["bifurcation"]
    axes[0, 1].plot(c["omega"], c["v"], ".", ms=1.2, color=COLOURS[2])
    axes[0, 1].set_xlabel("frequency ω")
    axes[0, 1].set_ylabel("velocity once a period")
    axes[0, 1].set_title("Impact oscillator, restitution 0.8, s = 4")
    return fig


FIGURES: dict[str, Callable[[Study, Any], Any]] = {
    "fig3": _fig3,
    "fig4": _fig4,
    "fig6": _fig6,
    "fig8": _fig8,
    "fig9": _fig9,
    "orders": _orders(lambda text, s: 1 if text.startswith("sliding") else s - 1),
    "full order": _orders(lambda text, s: 2 * s - 2),
    "lost impacts": _impacts,
    "bilateral": _over_time("difference of q [m]", "Closed contact and bilateral constraint"),
    "energy": _over_time("error of the energy", "Planet, Δt = 0.1"),
    "reversibility": _over_time("distance of q on the way back", "Planet, there and back"),
    "work": _work,
    "moreau": _moreau,
    "high orders": _high_orders,
    "located orders": _located_orders,
    "law orders": _located_orders,
    "located": _located,
    "tolerances": _tolerances,
}
