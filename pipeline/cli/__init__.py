"""The command line: thin calls of what the packages do."""


def main() -> None:
    """Run the command line, as ``pipeline`` or ``python -m pipeline``."""
    import gc
    import os

    # matrices of the emulator are small: threads of BLAS wait for each other longer than they compute. They
    # read it when they are loaded, which is later.
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # modules make objects that stay: looking through them for garbage takes a tenth of the start
    gc.set_threshold(100_000, 30, 30)
    from pipeline.cli.app import main as run

    try:
        run()
    finally:
        # nor is it looked through before the process ends, which takes as long again
        gc.freeze()
