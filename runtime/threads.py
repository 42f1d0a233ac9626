"""A job in C on threads, which Ctrl-C can end."""

import ctypes
import os
import threading
from typing import Any

import numpy as np
from signorini.runtime.errors import RunError


def number_of_threads(threads: Any) -> int:
    """So many as are asked for; by default as many as there are processors.

    Raises
    ------
    RunError
        If that is no number of threads.
    """
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    if not isinstance(threads, (int, np.integer)) or isinstance(threads, bool) or threads < 1:
        raise RunError(f"threads = {threads!r}: give an integer of at least 1")
    return int(threads)


def drive(call: Any, job: Any, threads: int) -> tuple[int, bool]:
    """Do a job in C, in a thread of its own so that an interruption is heard.

    Parameters
    ----------
    call : function of C
        Takes the job and the number of threads, and gives the number of runs taken up.
    job : struct
        Its member `stop` is set here.

    Returns
    -------
    tuple
        Runs taken up, and whether Ctrl-C ended them early.
    """
    stop = ctypes.c_int(0)
    job.stop = ctypes.cast(ctypes.byref(stop), ctypes.c_void_p)
    found: list[int] = []
    finished = threading.Event()

    def work() -> None:
        try:
            found.append(call(ctypes.byref(job), threads))
        finally:
            finished.set()

    threading.Thread(target=work).start()
    interrupted = False
    while not finished.is_set():
        try:
            finished.wait()  # not join: an interrupted one takes the thread for ended
        except KeyboardInterrupt:
            stop.value, interrupted = 1, True
    return found[0], interrupted
