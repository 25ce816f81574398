"""``python -m pipeline.cli``: the command line."""

from pipeline.cli import main

main()
