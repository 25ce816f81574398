"""The solver compiled, if need be, before any run: by one worker, so that the others find it on disk.

On this machine other processes compile parts of it while the workers start.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from multiprocessing.process import BaseProcess
from time import monotonic, sleep

from pipeline.batch.interrupts import Interrupts, deaf
from solver.forms import Kind
from solver.run import PIECES
from solver.warmup import compile_kernels, not_compiled

# Loading takes a second, compiling half a minute: what takes longer than this is compiling.
LOADING_SECONDS = 3.0
MESSAGE = "compiling the solver (once after installing or upgrading)"


def leave_out_blas() -> None:
    """Keep Numba from looking for BLAS in this process; it imports `scipy.linalg` for that.

    No kernel of the solver calls it. Compiled code that does cannot be used afterwards.
    """
    name = "scipy.linalg.cython_blas"
    if name not in sys.modules:
        sys.modules[name] = None  # type: ignore[assignment]
        try:
            import_module("numba.np.arraymath")
        finally:
            del sys.modules[name]


def cores() -> int:
    """Count the cores that this process may use."""
    # takes a tenth of a second to load
    from dask.system import CPU_COUNT

    return int(CPU_COUNT)


@contextmanager
def head_start(kinds: Collection[Kind]) -> Iterator[list[BaseProcess]]:
    """Have processes compile the pieces of what is not compiled yet, a core each; gives and ends them."""
    missing = not_compiled(kinds)
    if missing and cores() < PIECES:
        missing = []
    spawn = multiprocessing.get_context("spawn")
    processes: list[BaseProcess] = [
        spawn.Process(target=compile_kernels, args=(missing, piece), daemon=True)
        for piece in range(PIECES if missing else 0)
    ]
    try:
        with deaf():
            for process in processes:
                process.start()
        yield processes
    finally:
        for process in processes:
            process.terminate()


def compile_once(
    start: Callable[[Callable[[], None]], Callable[[], bool]],
    tell: Callable[[str], None],
    interrupts: Interrupts,
    compile_: Callable[[], None],
    before: Sequence[BaseProcess] = (),
) -> None:
    """Have one worker compile the kernels, or load them; the others load them with their first run.

    What goes wrong is left to the runs, which meet it again and report it.

    Parameters
    ----------
    start : callable
        Has a worker do something, and gives what says whether it is done, as of `scheduling.Pool`.
    tell : callable
        Told that the solver is being compiled, where it is.
    interrupts : Interrupts
        Whether the user asked to stop.
    compile_ : callable
        Compiles the kernels, or loads them where they are compiled.
    before : sequence of process
        Waited for first: what they compile need not be compiled again.

    Raises
    ------
    KeyboardInterrupt
        If the user asks to stop meanwhile: nothing is under way that would be worth finishing.
    """
    began, told = monotonic(), False

    def wait(done: Callable[[], bool]) -> None:
        nonlocal told
        while not done():
            if interrupts.asked:
                raise KeyboardInterrupt
            if not told and monotonic() - began > LOADING_SECONDS:
                tell(MESSAGE)
                told = True
            sleep(0.02)

    wait(lambda: not any(process.is_alive() for process in before))
    wait(start(compile_))
