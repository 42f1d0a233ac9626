"""A motion in the plane as one HTML page that needs nothing else."""

import io
import json
from typing import Any

import numpy as np
from signorini import templates
from signorini.view.motion import Motion, Thing

_STEPS = 100_000  # whole numbers that the larger side of the picture has
FAR = 8.0  # a way of so many sizes of the bodies: the picture goes with them


def page(motion: Motion) -> str:
    """The page as text."""
    data = json.dumps(_data(motion), separators=(",", ":"), allow_nan=False)
    # Text of a script element must not close it.
    return (
        templates.environment()
        .get_template("player.html.jinja")
        .render(title=motion.title, data=data.replace("</", "<\\/"))
    )


def curves(title: str, figure: Any) -> str:
    """A page for a model that draws nothing: curves over time, and how it would be drawn."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg")
    picture = stream.getvalue()
    return (
        templates.environment()
        .get_template("curves.html.jinja")
        .render(title=title, picture=picture[picture.index("<svg") :])
    )


def force_scale(motion: Motion) -> float:
    """A force that most of the contact forces stay below [N]: the length of an arrow."""
    forces = [np.linalg.norm(m.force, axis=1) for m in motion.marks if m.force is not None]
    acting = np.concatenate([np.zeros(0), *forces])
    acting = acting[acting > 0]
    return float(np.median(acting)) * 1.2 if acting.size else 1.0


def pace_in_words(motion: Motion) -> str:
    """How fast the film runs, if not as fast as the clock."""
    speed = motion.speed
    if speed == 1:
        return ""
    return f", {speed:g} times as fast" if speed > 1 else f", slowed down {1 / speed:g} times"


def _data(motion: Motion) -> dict[str, Any]:
    low, high = motion.box()
    size = motion.size()
    unit = max(float((high - low).max()), size, 1e-9) / _STEPS

    def packed(points: np.ndarray) -> list[int]:
        return [int(x) for x in np.rint((points - low) / unit).ravel()]

    def thing(t: Thing) -> dict[str, Any]:
        return {
            "kind": t.kind,
            "name": t.name,
            "n": t.points.shape[1],
            "rests": t.rests,
            "p": packed(t.points),
        }

    states = sorted({str(s) for m in motion.marks for s in m.state})
    scale = force_scale(motion)
    marks = [
        {
            "name": m.name,
            "s": [states.index(str(s)) for s in m.state],
            "h": [int(x) for x in m.hit],
            "p": None if m.place is None else packed(m.place),
            "f": None if m.force is None else [float(f"{x / scale:.3g}") for x in m.force.ravel()],
        }
        for m in motion.marks
    ]
    return {
        "t": [float(f"{t:.7g}") for t in motion.t],
        "fps": motion.fps,
        "pace": pace_in_words(motion),
        "low": low.tolist(),
        "unit": unit,
        "box": [*low.tolist(), *high.tolist()],
        "size": size,
        "follows": bool((high - low).max() > FAR * max(size, 1e-9)) and size > 0,
        "states": states,
        "things": [thing(t) for t in motion.things],
        "marks": marks,
    }
