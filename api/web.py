"""A model as one page for a browser: its stepper in WebAssembly, a picture, plots, sliders."""

import base64
import gzip
import json
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from signorini import templates
from signorini.runtime.compile import compile_wasm
from signorini.runtime.errors import RunError, StepError
from signorini.runtime.files import write_whole
from signorini.runtime.stepper import Stepper
from signorini.runtime.trajectory import Trajectory
from signorini.version import __version__
from signorini.view.geometry import faces
from signorini.view.motion import Motion, motion, pace
from signorini.view.page import FAR, force_scale

# What the page asks for, and the model function that answers.
_FUNCTIONS = (("energy", "energy"), ("gaps", "g_N"), ("outputs", "outputs"), ("points", "shapes"))
_OBSTACLES = ("plane", "curve", "net")
_MOST_STEPS = 100_000  # of the run that says how large the picture is


def write_page(stepper: Stepper, folder: Path, **about: Any) -> Path:
    """Write index.html into a folder: a page that opens from the file, without a server.

    Parameters
    ----------
    stepper : Stepper
        Of double precision.
    folder : Path
        Made if it is not there.
    **about
        As `page_of` takes them.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    RunError
        For arguments that cannot be used, a run that does not begin, or a folder that cannot be
        made.
    CompilerError
        If there is no compiler for WebAssembly or it fails.
    """
    text = page_of(stepper, **about)
    path = folder / "index.html"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(f"{folder}: the folder cannot be made ({error.strerror})") from None

    def save(file: Path) -> None:
        file.write_text(text, encoding="utf-8")

    write_whole(path, save)
    return path


def page_of(
    stepper: Stepper,
    *,
    dt: float = 1e-2,
    t_end: float = 2.0,
    inputs: Any = None,
    parameters: dict[str, float] | None = None,
) -> str:
    """The page as text.

    Parameters
    ----------
    stepper : Stepper
        Of double precision.
    dt : float
        Step size of the page [s].
    t_end : float
        The picture shows what a run up to here reaches [s].
    inputs : optional
        Of that run, as `Stepper.simulate` takes them; those of the page begin with 0.
    parameters : dict, optional
        Values that the page begins with, where they differ from the defaults.

    Raises
    ------
    RunError
        For arguments that cannot be used, or a run that does not begin.
    CompilerError
        If there is no compiler for WebAssembly or it fails.
    """
    m = stepper.manifest
    if m["precision"] != "double":
        raise RunError(f"model '{stepper.name}': a page has doubles, and this is {m['precision']}")
    if not 0 < dt < t_end:
        raise RunError(f"dt = {dt:g}, t_end = {t_end:g}: give a step size > 0 and a later end")
    given = stepper.check_parameters(parameters or {})
    run = _first_run(stepper, dt, t_end, inputs, given)
    data = json.dumps(_data(stepper, dt, given, run), separators=(",", ":"), allow_nan=False)
    return (
        templates.environment()
        .get_template("web.html.jinja")
        .render(
            title=m["doc"] or stepper.name,
            version=__version__,
            dimension=_dimension(m),
            # Text of a script element must not close it.
            data=data.replace("</", "<\\/"),
            wasm=base64.b64encode(gzip.compress(_module(stepper), mtime=0)).decode("ascii"),
        )
    )


def page_sources(stepper: Stepper) -> dict[str, bytes]:
    """The C files of a page, by name."""
    m = stepper.manifest
    heading = templates.environment().get_template("web_model.h.jinja").render(
        m=m, version=__version__, upper=m["prefix"].upper(), functions=_FUNCTIONS,
        n_points=_dimension(m) * sum(shape["points"] for shape in m["shapes"]),
    )  # fmt: skip
    own = resources.files("signorini.runtime") / "web" / "web.c"
    files = {"web.c": own.read_bytes(), "web_model.h": heading.encode()}
    for ending in (".c", ".h", "_model.c"):
        name = f"{m['prefix']}{ending}"
        files[name] = (stepper.folder / name).read_bytes()
    return files


def _module(stepper: Stepper) -> bytes:
    """The stepper in WebAssembly."""
    files = page_sources(stepper)
    compiled = [name for name in files if name.endswith(".c")]
    return compile_wasm(f"{stepper.manifest['prefix']}_web", files, compiled).read_bytes()


def _dimension(m: dict[str, Any]) -> int:
    return int(m["functions"]["shapes"]["shape"][1]) if m["shapes"] else 2


def _first_run(
    stepper: Stepper, dt: float, t_end: float, inputs: Any, parameters: Any
) -> Trajectory:
    """What the picture has to show; as far as the model gets."""
    end = min(t_end, _MOST_STEPS * dt)
    try:
        return stepper.simulate(dt=dt, t_end=end, inputs=inputs, parameters=parameters)
    except StepError as error:
        if error.trajectory is None or len(error.trajectory) < 1:
            raise
        return error.trajectory


def _data(stepper: Stepper, dt: float, given: Any, run: Trajectory) -> dict[str, Any]:
    m = stepper.manifest
    shown: Motion | None = motion(run) if m["shapes"] else None
    low, high = shown.box() if shown else (np.zeros(2), np.ones(2))
    size = shown.size() if shown else 1.0
    things, places = _things(stepper, run, shown)
    return {
        "dt": dt,
        "pace": pace(float(run.t[-1] - run.t[0])),
        "dimension": _dimension(m),
        "points": sum(shape["points"] for shape in m["shapes"]),
        "things": things,
        "contacts": _contacts(m, places),
        "states": [s.lower().removesuffix("_back") for s in m["contact_states"]],
        "statuses": [f"{name}, {text}" for name, text in m["statuses"]],
        "good": [name for name, _ in m["statuses"]].index("OK_SUBSTEPPED"),
        "q": m["coordinates"],
        "v": m["velocities"],
        "u": m["inputs"],
        "outputs": m["outputs"],
        "gaps": [c["name"] for c in _by_gap(m)],
        "rows": _rows(m),
        "par": [_parameter(p, float(given[p["name"]])) for p in m["parameters"]],
        "box": [*map(float, low), *map(float, high)],
        "size": size,
        "follows": bool((high - low).max() > FAR * max(size, 1e-9)) and size > 0,
        "force": force_scale(shown) if shown else 1.0,
    }


def _by_gap(m: dict[str, Any]) -> list[dict[str, Any]]:
    return sorted((c for c in m["contacts"] if c["normal"] >= 0), key=lambda c: c["normal"])


def _rows(m: dict[str, Any]) -> list[str]:
    """Names of the percussion rows in their order: constraints, gaps, slips."""

    def entries(name: str, count: int) -> list[str]:
        return [name] if count == 1 else [f"{name}[{k + 1}]" for k in range(count)]

    blocks = [*m["g_blocks"], *m["gamma_blocks"]]
    rows = [entry for name, count in blocks for entry in entries(name, count)]
    rows += [f"{c['name']}.N" for c in _by_gap(m)]
    for c in m["contacts"]:
        rows += entries(f"{c['name']}.F", c["components"]) if c["components"] else []
    return rows


def _things(
    stepper: Stepper, run: Trajectory, shown: Motion | None
) -> tuple[list[dict[str, Any]], dict[str, tuple[int, int]]]:
    """What is drawn, with the place of its points among all; places of contacts by name."""
    things: list[dict[str, Any]] = []
    places: dict[str, tuple[int, int]] = {}
    if shown is None:
        return things, places
    start = stepper.evaluate("shapes", run.t[:1], run.q[:1], parameters=run.parameters)[0]
    moving = {(thing.kind, thing.name) for thing in shown.things if not thing.rests}
    first = 0
    for shape in stepper.manifest["shapes"]:
        n, kind, name = shape["points"], shape["kind"], shape["name"]
        if kind == "contact":
            places[name] = (first, n)
        else:
            solid = kind == "hull" and start.shape[1] == 3
            things.append({
                "kind": kind, "name": name, "first": first, "n": n,
                "moves": (kind, name) in moving and kind not in _OBSTACLES,
                "faces": faces(start[first : first + n]) if solid else [],
            })  # fmt: skip
        first += n
    return things, places


def _contacts(m: dict[str, Any], places: dict[str, tuple[int, int]]) -> list[dict[str, Any]]:
    """Contacts with the rows whose percussions act along the tips of their drawing."""
    n = m["sizes"]
    normal = n["n_g"] + n["n_gamma"]
    found = []
    for c in m["contacts"]:
        first, count = places.get(c["name"], (-1, 0))
        slips = [normal + n["n_N"] + c["friction"] + k for k in range(c["components"])]
        rows = [normal + c["normal"], *slips] if c["normal"] >= 0 else []
        found.append({"name": c["name"], "first": first, "n": count, "rows": rows})
    return found


def _parameter(p: dict[str, Any], value: float) -> dict[str, Any]:
    """A parameter with what its slider spans: three times its value, within its bounds."""
    far = 3 * value if value else 1.0
    least, most = min(0.0, far), max(0.0, far)
    if not value:
        least, most = -1.0, 1.0
    if p["min"] is not None:
        least = max(least, p["min"])
    if p["max"] is not None:
        most = min(most, p["max"])
    return {
        "name": p["name"], "value": value, "unit": p["unit"] or "", "doc": p["doc"] or "",
        "min": p["min"], "max": p["max"], "least": min(least, value), "most": max(most, value),
    }  # fmt: skip
