"""The command line: thin calls of what the packages do."""


def main() -> None:
    """Run the command line, as ``pipeline`` or ``python -m pipeline``."""
    from pipeline.cli.app import main as run

    run()
