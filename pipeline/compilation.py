"""The solver compiled, if need be, by one worker before any run, so that the others find it on disk."""

# distributed leaves most of its functions without types.
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

from collections.abc import Callable
from time import monotonic, sleep

from distributed import Client

from pipeline.interrupts import Interrupts

# Loading takes a second, compiling half a minute: what takes longer than this is compiling.
LOADING_SECONDS = 3.0
MESSAGE = "compiling the solver (once after installing or upgrading)"


def compile_once(
    client: Client,
    tell: Callable[[str], None],
    interrupts: Interrupts,
    compile_: Callable[[], None],
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

    Raises
    ------
    KeyboardInterrupt
        If the user asks to stop meanwhile: nothing is under way that would be worth finishing.
    """
    future = client.submit(compile_, pure=False)
    began, told = monotonic(), False
    while not future.done():
        if interrupts.asked:
            raise KeyboardInterrupt
        if not told and monotonic() - began > LOADING_SECONDS:
            tell(MESSAGE)
            told = True
        sleep(0.02)
