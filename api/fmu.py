"""A stepper as a functional mock-up unit for co-simulation, FMI 2.0 or 3.0."""

import hashlib
import uuid
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from signorini import templates
from signorini.runtime.compile import compile_shared
from signorini.runtime.errors import RunError
from signorini.runtime.files import write_whole
from signorini.runtime.stepper import Stepper
from signorini.runtime.system import System, here, named
from signorini.version import __version__

VERSIONS = (2, 3)
_SHARED = ("fmu.h", "fmu.c")
_FUNCTIONS = {2: ("fmi2.c",), 3: ("fmi3.h", "fmi3.c", "fmi3_absent.c")}
# A time stamp for every file, so that equal units are equal bytes.
_TIME = (1980, 1, 1, 0, 0, 0)
_UNITS = ("", "quaternion")  # that are none


@dataclass(frozen=True)
class Variable:
    """One scalar of the unit.

    Attributes
    ----------
    name : str
        As columns of a trajectory are called.
    number : int
        Its value reference.
    causality, variability, initial : str
        As the standard has them; "" where it has none.
    start : float or None
        Where it begins, if it can be set.
    unit, doc : str
        Unit, "" if there is none, and what it is.
    whole : bool
        Whether it is an integer.
    """

    name: str
    number: int
    causality: str
    variability: str
    initial: str
    start: float | None
    unit: str
    doc: str
    whole: bool = False


def variables(stepper: Stepper, dt: float) -> tuple[list[Variable], list[tuple[str, int]]]:
    """All scalars of a unit, and the number of the first of each kind."""
    m, n = stepper.manifest, stepper.sizes
    _, q, v = stepper.initial_state()
    found: list[Variable] = []
    places: list[tuple[str, int]] = []

    def begin(kind: str) -> None:
        places.append((kind, len(found)))

    def add(
        name: str,
        how: tuple[str, str, str],
        start: float | None,
        unit: str,
        doc: str,
        whole: bool = False,
    ) -> None:
        if name in taken:
            raise RunError(
                f"model '{stepper.name}': '{name}' would be the name of two variables of the unit"
            )
        taken.add(name)
        used = "" if unit in _UNITS else unit
        found.append(Variable(name, len(found), *how, start, used, doc, whole))

    taken: set[str] = set()
    state, result = ("output", "continuous", "exact"), ("output", "continuous", "calculated")
    tunable = ("parameter", "tunable", "exact")
    begin("TIME")
    add("time", ("independent", "continuous", ""), None, "s", "time")
    begin("PAR")
    for p in m["parameters"]:
        add(p["name"], tunable, p["default"], p["unit"] or "", p["doc"] or "")
    begin("STEP_SIZE")
    add("solver.dt", tunable, dt, "s", "largest step; with solver.error the first one")
    begin("ERROR")
    if m["adaptive"]:
        add(
            "solver.error",
            tunable,
            0.0,
            "",
            "wanted error of the coordinates; 0: steps of solver.dt",
        )
    begin("Q")
    for name, unit, value in zip(m["coordinates"], m["units"], q, strict=True):
        add(name, state, float(value), unit or "", f"coordinate {name}")
    begin("V")
    for name, unit, value in zip(m["velocities"], m["units"], v, strict=True):
        rate = "1/s" if (unit or "") in _UNITS else f"{unit}/s"
        add(name, state, float(value), rate, f"velocity {name}")
    begin("U")
    for name in m["inputs"]:
        add(name, ("input", "continuous", ""), 0.0, "", f"input {name}, held over a step")
    begin("OUTPUT")
    for name in m["outputs"]:
        add(name, result, None, "", f"output {name}")
    begin("ENERGY")
    add("solver.energy", result, None, "J", "p^T v - L")
    begin("GAP")
    for c in m["contacts"]:
        if c["normal"] >= 0:
            add(f"{c['name']}.g_N", result, None, "m", f"gap of {c['name']}")
    begin("FORCE")
    for name, unit, doc in _forces(m):
        add(name, result, None, unit, doc)
    begin("CONTACT")
    states = ", ".join(f"{k} {s.lower()}" for k, s in enumerate(m["contact_states"]))
    for c in m["contacts"]:
        how = ("output", "discrete", "calculated")
        add(
            f"{c['name']}.state", how, None, "", f"state of {c['name']}: {states}, -1 unknown", True
        )
    assert len(found) == places[-1][1] + n["n_contacts"]
    return found, places


def _forces(m: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Names, units and meanings of the percussion rows: mean forces over a step."""
    rows: list[tuple[str, str, str]] = []
    mean = "mean force over the last communication step"
    for blocks in (m["g_blocks"], m["gamma_blocks"]):
        for name, count in blocks:
            rows += [
                (f"{name}.force{_entry(k, count)}", "", f"{mean} of {name}") for k in range(count)
            ]
    contacts = sorted((c for c in m["contacts"] if c["normal"] >= 0), key=lambda c: c["normal"])
    rows += [(f"{c['name']}.force_N", "N", f"{mean} along the normal") for c in contacts]
    for c in m["contacts"]:
        rows += [
            (f"{c['name']}.force_F{_entry(k, c['components'])}", "", f"{mean} of friction")
            for k in range(c["components"])
        ]
    return rows


def _entry(k: int, count: int) -> str:
    return f"[{k + 1}]" if count > 1 else ""


def write_fmu(
    stepper: Stepper,
    path: Path,
    *,
    fmi: int = 3,
    dt: float = 1e-2,
    t_end: float = 2.0,
    binary: bool = True,
    systems: Sequence[str] = (),
) -> Path:
    """Write a unit for co-simulation, with sources and a binary for this machine.

    Parameters
    ----------
    stepper : Stepper
        Of double precision.
    path : Path
        The file, which ends in .fmu.
    fmi : {2, 3}
        Version of the standard.
    dt, t_end : float
        Largest step and end of an experiment, as defaults [s].
    binary : bool
        Whether the binary of this machine goes into it.
    systems : sequence of str
        Others whose binaries go into it, by their names in FMI 3: "x86_64-windows",
        "aarch64-darwin" and so on. They are compiled by zig, which comes by pip.

    Returns
    -------
    Path

    Raises
    ------
    RunError
        For arguments that cannot be used.
    CompilerError
        If there is no C compiler or it fails.
    """
    m = stepper.manifest
    if fmi not in VERSIONS:
        raise RunError(f"fmi = {fmi!r}: choose 2 or 3")
    if m["precision"] != "double":
        raise RunError(f"model '{stepper.name}': a unit has doubles, and this is {m['precision']}")
    if path.suffix != ".fmu":
        raise RunError(f"{path}: give a name that ends in .fmu")
    if not 0 < dt < t_end:
        raise RunError(f"dt = {dt:g}, t_end = {t_end:g}: give a step size > 0 and a later end")
    found, places = variables(stepper, dt)
    seed = f"{m['manifest_hash']} {fmi} {dt!r} {t_end!r} {__version__}"
    digest = hashlib.sha256(seed.encode()).digest()
    token = "{" + str(uuid.UUID(bytes=digest[:16])) + "}"
    heading = templates.environment().get_template("fmu_model.h.jinja").render(
        m=m, version=__version__, token=token, dt=repr(float(dt)), t_end=repr(float(t_end)),
        upper=m["prefix"].upper(), places=places,
    )  # fmt: skip
    own = resources.files("signorini.runtime") / "fmu"
    sources = {name: (own / name).read_bytes() for name in (*_SHARED, *_FUNCTIONS[fmi])}
    sources["fmu_model.h"] = heading.encode()
    for ending in (".c", ".h", "_model.c"):
        name = f"{m['prefix']}{ending}"
        sources[name] = (stepper.folder / name).read_bytes()
    compiled = [name for name in sources if name.endswith(".c")]
    files = {f"sources/{name}": text for name, text in sources.items()}
    files["modelDescription.xml"] = _description(m, found, token, fmi, dt, t_end, compiled)
    if fmi == 3:
        files["sources/buildDescription.xml"] = _build_description(m, compiled)
    others = [named(name) for name in dict.fromkeys(systems)]
    wanted: list[System | None] = [None, *others] if binary else [*others]
    for system in wanted:
        of = here() if system is None else system
        place = of.name if fmi == 3 else of.folder_2
        file = f"binaries/{place}/{m['prefix']}{of.ending}"
        if file in files:
            raise RunError(
                f"{of.name}: FMI {fmi} calls another binary of the unit {place}, too: "
                f"{'leave one out or give fmi=3' if fmi == 2 else 'it is that of this machine'}"
            )
        files[file] = compile_shared(m["prefix"], sources, compiled, system).read_bytes()

    def save(target: Any) -> None:
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for name in sorted(files):
                archive.writestr(zipfile.ZipInfo(name, _TIME), files[name], zipfile.ZIP_DEFLATED)

    write_whole(path, save)
    return path


def _xml(root: ET.Element) -> bytes:
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True)


def _description(
    m: dict[str, Any],
    found: Sequence[Variable],
    token: str,
    fmi: int,
    dt: float,
    t_end: float,
    compiled: list[str],
) -> bytes:
    """modelDescription.xml."""
    about = {
        "fmiVersion": f"{fmi}.0", "modelName": m["model"], "description": m["doc"] or m["model"],
        "generationTool": f"signorini {__version__}", "variableNamingConvention": "structured",
        "guid" if fmi == 2 else "instantiationToken": token,
    }  # fmt: skip
    root = ET.Element("fmiModelDescription", about)
    can = {
        "modelIdentifier": m["prefix"], "canHandleVariableCommunicationStepSize": "true",
        "canGetAndSetFMUstate" if fmi == 2 else "canGetAndSetFMUState": "true",
        "canSerializeFMUstate" if fmi == 2 else "canSerializeFMUState": "true",
    }  # fmt: skip
    if fmi == 2:
        can["canNotUseMemoryManagementFunctions"] = "true"
    simulation = ET.SubElement(root, "CoSimulation", can)
    if fmi == 2:
        files = ET.SubElement(simulation, "SourceFiles")
        for name in compiled:
            ET.SubElement(files, "File", {"name": name})
    units = ET.SubElement(root, "UnitDefinitions")
    for unit in dict.fromkeys(v.unit for v in found if v.unit):
        ET.SubElement(units, "Unit", {"name": unit})
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", {"name": "logStatusError"})
    ET.SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0", "stopTime": repr(float(t_end)), "stepSize": repr(float(dt))},
    )
    listed = ET.SubElement(root, "ModelVariables")
    for v in found:
        _variable(listed, v, fmi)
    structure = ET.SubElement(root, "ModelStructure")
    outputs = [v for v in found if v.causality == "output"]
    unknown = [v for v in outputs if v.initial == "calculated"]
    if fmi == 2:
        for title, some in (("Outputs", outputs), ("InitialUnknowns", unknown)):
            if some:
                part = ET.SubElement(structure, title)
                for v in some:
                    ET.SubElement(part, "Unknown", {"index": str(v.number + 1)})
    else:
        for title, some in (("Output", outputs), ("InitialUnknown", unknown)):
            for v in some:
                ET.SubElement(structure, title, {"valueReference": str(v.number)})
    return _xml(root)


def _variable(parent: ET.Element, v: Variable, fmi: int) -> None:
    about = {"name": v.name, "valueReference": str(v.number), "causality": v.causality}
    about["variability"] = v.variability
    if v.initial:
        about["initial"] = v.initial
    if v.doc:
        about["description"] = v.doc
    typed: dict[str, str] = {}
    if v.unit:
        typed["unit"] = v.unit
    if v.start is not None:
        typed["start"] = repr(v.start)
    if fmi == 3:
        ET.SubElement(parent, "Int32" if v.whole else "Float64", about | typed)
    else:
        one = ET.SubElement(parent, "ScalarVariable", about)
        ET.SubElement(one, "Integer" if v.whole else "Real", typed)


def _build_description(m: dict[str, Any], compiled: list[str]) -> bytes:
    root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": m["prefix"]})
    files = ET.SubElement(configuration, "SourceFileSet", {"language": "C99"})
    for name in compiled:
        ET.SubElement(files, "SourceFile", {"name": name})
    return _xml(root)
