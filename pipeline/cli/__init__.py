"""The command line: thin calls of what the packages do."""


def main() -> None:
    """Run the command line, as ``pipeline`` or ``python -m pipeline``."""
    import gc

    # modules make objects that stay: looking through them for garbage takes a tenth of the start
    gc.set_threshold(100_000, 30, 30)
    from pipeline.cli.app import main as run

    run()
