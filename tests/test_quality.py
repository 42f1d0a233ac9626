"""Lint, format, types, structure: the habits of the project as tests."""

import ast
import importlib.util
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def complaints(*command: str) -> str:
    """What a command that fails says; nothing if it succeeds."""
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return (result.stdout + result.stderr or "failed") if result.returncode else ""


def ruff(*command: str) -> str:
    """What ruff says of all files but those of virtual environments made inside the checkout."""
    inside = [f"--extend-exclude={config.parent.name}" for config in ROOT.glob("*/pyvenv.cfg")]
    return complaints(sys.executable, "-m", "ruff", *command, ".", *inside)


def test_lint() -> None:
    assert not ruff("check")


def test_format() -> None:
    assert not ruff("format", "--check")


def test_format_of_c() -> None:
    files = [str(p) for p in sorted((ROOT / "runtime" / "c").iterdir())]
    files += [str(p) for p in sorted((ROOT / "tests" / "c").iterdir())]
    import clang_format

    binary = Path(clang_format.__file__).parent / "data" / "bin" / "clang-format"
    assert not complaints(str(binary), "--dry-run", "--Werror", *files)


def test_types() -> None:
    spec = importlib.util.spec_from_file_location("typing_tree", ROOT / "tools" / "typing_tree.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.make_tree()
    assert not complaints(
        sys.executable, "-m", "mypy", "-p", "signorini", "--python-version", "3.11"
    )


def test_packages_are_listed() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    roots = set(settings["package-dir"].values())
    folders = {
        str(p.parent.relative_to(ROOT))
        for p in ROOT.glob("**/__init__.py")
        if p.relative_to(ROOT).parts[0] in roots
    }
    given = settings["package-dir"]
    listed = set()
    for name in settings["packages"]:
        parent, _, own = name.rpartition(".")
        listed.add(given[name] if name in given else f"{given[parent]}/{own}")
    assert listed == folders


def imports(folder: str) -> set[str]:
    """Sub-packages of signorini that a folder imports at any level."""
    found = set()
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("signorini."):
                found.add((node.module or "").split(".")[1])
    return found - {folder, "version"}


@pytest.mark.parametrize(
    ("folder", "allowed"),
    [
        ("codegen", set()),
        ("runtime", {"view"}),  # what Trajectory.plot, animate and view call
        ("view", set()),
        ("verify", {"codegen", "runtime"}),
        ("templates", set()),
    ],
)
def test_dependencies_point_one_way(folder: str, allowed: set[str]) -> None:
    assert imports(folder) <= allowed


# The rooms of codegen in the order of the flow; each knows those before it.
ROOMS = (
    "frontend",  # what a user writes, as SX
    "derive",  # derived functions
    "graph",
    "parts",  # what a model falls into
    "alike",  # what differs in numbers alone
    "composition",  # kinds of parts
    "sparsity",
    "program",  # what a scheme is
    "sharing",  # passes over programs
    "schemes",
    "forward",  # what differentiates them
    "c",
    "numpy",
)


def test_codegen_flows_one_way() -> None:
    found = {}
    for path in (ROOT / "codegen").rglob("*.py"):
        room = path.relative_to(ROOT / "codegen").parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("signorini."):
                parts = (node.module or "").split(".")
                if parts[1] == "codegen" and len(parts) > 2:
                    found.setdefault(room, set()).add(parts[2])
    assert set(found) <= {*ROOMS, "__init__"}
    for room, others in found.items():
        for other in others:
            assert ROOMS.index(other) <= ROOMS.index(room), (room, other)
            assert {room, other} != {"c", "numpy"}


def test_the_reference_is_independent() -> None:
    """It may read the user's declarations, nothing that derives, discretises or emits."""
    known = {
        "signorini.codegen.frontend.model",
        "signorini.codegen.frontend.table",  # points and values that a user gave
        "signorini.codegen.frontend.terms",  # a walk over SymPy's terms, without a meaning
        *(f"signorini.verify.{name}" for name in ("expressions", "laws", "reference", "splines")),
    }
    schemes = {path.stem for path in (ROOT / "verify" / "schemes").glob("*.py")} - {"__init__"}
    known |= {f"signorini.verify.schemes.{name}" for name in schemes}
    laws = {path.stem for path in (ROOT / "verify" / "laws").glob("*.py")} - {"__init__"}
    for name in (
        "expressions",
        "laws/__init__",
        *(f"laws/{n}" for n in laws),
        "reference",
        "splines",
        "judge",
        *(f"schemes/{n}" for n in schemes),
    ):
        tree = ast.parse((ROOT / "verify" / f"{name}.py").read_text())
        modules = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module}
        ours = {m for m in modules if m.startswith("signorini")}
        assert ours <= known


def test_no_machine_paths_in_tracked_files() -> None:
    listing = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listing.returncode != 0:
        pytest.skip("not a git checkout")
    pattern = re.compile(r"/(home|root|work|Users)/")
    for name in listing.stdout.split():
        path = ROOT / name
        if path.suffix in (".py", ".c", ".h", ".md", ".toml", ".jinja", ".json") and path.is_file():
            hits = [x for x in path.read_text().splitlines() if pattern.search(x)]
            assert not hits or name == "tests/test_quality.py", (name, hits[:2])


def test_modules_of_the_runtime_form_no_circle() -> None:
    """Not even behind TYPE_CHECKING."""
    needs: dict[str, set[str]] = {}
    for path in (ROOT / "runtime").glob("*.py"):
        tree = ast.parse(path.read_text())
        modules = [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        prefix = "signorini.runtime."
        needs[path.stem] = {m.removeprefix(prefix) for m in modules if m.startswith(prefix)}
    while needs:
        free = {name for name, others in needs.items() if not others & needs.keys()}
        assert free, f"a circle among {sorted(needs)}"
        needs = {name: others for name, others in needs.items() if name not in free}


def private_names(tree: ast.AST) -> set[str]:
    """Functions, classes and attributes with an underscore that a file makes."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            found.add(node.attr)
    return {name for name in found if name.startswith("_") and not name.startswith("__")}


def test_rooms_keep_their_private_parts() -> None:
    """A private name is read in the file that makes it, or through `self`."""
    rooms = (
        "api",
        "benchmarks",
        "bodies",
        "codegen",
        "runtime",
        "stress",
        "studies",
        "verify",
        "view",
    )
    paths = [path for room in rooms for path in (ROOT / room).rglob("*.py")]
    trees = {path: ast.parse(path.read_text()) for path in paths}
    ours = set().union(*map(private_names, trees.values())) - {"_t", "_L"}  # SymPy has these
    found = []
    for path, tree in trees.items():
        foreign = ours - private_names(tree)
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and node.attr in foreign:
                through = node.value.id if isinstance(node.value, ast.Name) else ""
                if through not in ("self", "cls"):
                    found.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.attr}")
    assert not found
