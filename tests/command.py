"""The command ``signorini`` as a process of its own that has nothing left to import."""

import os
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path

import casadi
import matplotlib.pyplot
import numpy
import sympy
from signorini import cli

LOADED = (casadi, matplotlib.pyplot, numpy, sympy)


def signorini(folder: Path, *words: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """What ``signorini WORDS`` returns and prints in `folder`.

    A fork of the test's process: as separate as a new interpreter, without two seconds of imports.
    """
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        child = os.fork()
        if child == 0:
            _run(folder, [str(word) for word in words], environment, out.fileno(), err.fileno())
        _, status = os.waitpid(child, 0)
        out.seek(0)
        err.seek(0)
        code = os.waitstatus_to_exitcode(status)
        return subprocess.CompletedProcess(words, code, out.read(), err.read())


def _run(folder: Path, words: list[str], environment: dict[str, str], out: int, err: int) -> None:
    """The child: never returns."""
    code = 1
    try:
        os.chdir(folder)
        os.environ.update(environment)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(err, 2)
        sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w")
        sys.argv = ["signorini", *words]
        sys.path.insert(0, str(folder))
        cli.main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
