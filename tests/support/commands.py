"""Commands called in this process."""

from __future__ import annotations

from typer.testing import CliRunner, Result

from pipeline.cli.app import app


def pipeline(*arguments: object) -> Result:
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result
