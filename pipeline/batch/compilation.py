"""The solver compiled, if need be, before any run: by one worker, so that the others find it on disk.

On this machine other processes compile parts of it while the workers start.
"""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from time import monotonic, sleep

from dask.system import CPU_COUNT
from distributed import Client

from pipeline.batch.interrupts import Interrupts
from pipeline.batch.local_workers import deaf
from solver.forms import Kind
from solver.run import PIECES
from solver.warmup import compile_kernels, not_compiled

# Loading takes a second, compiling half a minute: what takes longer than this is compiling.
LOADING_SECONDS = 3.0
MESSAGE = "compiling the solver (once after installing or upgrading)"


@contextmanager
def head_start(kinds: Collection[Kind]) -> Iterator[list[BaseProcess]]:
    """Have processes compile the pieces of what is not compiled yet, a core each; gives and ends them."""
    missing = not_compiled(kinds) if CPU_COUNT >= PIECES else []
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
    client: Client,
    tell: Callable[[str], None],
    interrupts: Interrupts,
    compile_: Callable[[], None],
    before: Sequence[BaseProcess] = (),
) -> None:
    """Have one worker compile the kernels, or load them; the others load them with their first run.

    What goes wrong is left to the runs, which meet it again and report it.

    Parameters
    ----------
    client : Client
        Of the workers.
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
    wait(client.submit(compile_, pure=False).done)
