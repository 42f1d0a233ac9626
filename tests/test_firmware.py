"""What a generated folder promises to firmware: memory, stack, flash, no recursion, CMake."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import signorini as sg
from compilers import MODELS, all_of, compiler, identify, run
from footprints import check_footprint
from signorini.models import andrews_squeezer, slope
from trap_models import rheonomic


@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize(
    "make", all_of([*MODELS, andrews_squeezer.model], (slope.model, rheonomic)), ids=identify
)
def test_stated_memory(make: Callable[[], sg.Model], precision: str, tmp_path: Path) -> None:
    folder = sg.generate(make(), tmp_path / "c", stages=3, prefix="m", precision=precision)
    check_footprint(folder, "m", compiler("gcc"))
    stated = json.loads((folder / "manifest.json").read_text())["footprint"]
    names = ("state", "work", "params", "options", "info")
    values = ", ".join(f"(int)sizeof(m_{name})" for name in names)
    (folder / "sizes.c").write_text(
        f'#include <stdio.h>\n#include "m.h"\nint main(void) {{ printf("{"%d " * 5}", {values});'
        " return 0; }\n"
    )
    run(compiler("gcc"), "sizes.c", "-o", "sizes", cwd=folder)
    assert [int(x) for x in run("./sizes", cwd=folder).split()] == [stated[n] for n in names]
    text = (folder / "README.md").read_text()
    for name in (*names, "stack", "flash"):
        assert str(stated[name]) in text


def test_make_and_cmake(tmp_path: Path) -> None:
    """The folder on its own, as a subdirectory, and installed and found, without Python."""
    folder = sg.generate(MODELS[0](), tmp_path / "ball", stages=2, prefix="ball")
    run(compiler("make"), cwd=folder)
    table = run("./example", cwd=folder)
    assert len(table.splitlines()) > 5
    cmake = compiler("cmake")
    run(cmake, "-B", "build", "-DCMAKE_BUILD_TYPE=Release", cwd=folder)
    run(cmake, "--build", "build", cwd=folder)
    assert run("build/example", cwd=folder) == table
    run(cmake, "--install", "build", "--prefix", tmp_path / "stage", cwd=folder)
    source = (folder / "example.c").read_text()
    for way, text in (
        ("subdirectory", f"add_subdirectory({folder} ball)"),
        ("installed", f"find_package(ball REQUIRED PATHS {tmp_path / 'stage'})"),
        (
            "fetched",
            f"include(FetchContent)\nFetchContent_Declare(ball SOURCE_DIR {folder})\n"
            "FetchContent_MakeAvailable(ball)",
        ),
    ):
        user = tmp_path / way
        user.mkdir()
        (user / "main.c").write_text(source)
        (user / "CMakeLists.txt").write_text(
            f"cmake_minimum_required(VERSION 3.14)\nproject(user C)\n{text}\n"
            "add_executable(user main.c)\ntarget_link_libraries(user PRIVATE ball::ball)\n"
        )
        shutil.rmtree(user / "build", ignore_errors=True)
        run(cmake, "-B", "build", cwd=user)
        run(cmake, "--build", "build", cwd=user)
        assert run("build/user", cwd=user) == table
