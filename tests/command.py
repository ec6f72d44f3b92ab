"""The command `carom`, run in the process of the test."""

from typer.testing import CliRunner, Result

from carom.cli import app


def carom_command(*words: object, columns: int = 200) -> Result:
    """Return the result of a command, on a terminal of some columns without colours."""
    return CliRunner(env={"COLUMNS": str(columns), "TERM": "dumb"}).invoke(app, [str(word) for word in words])


def printed_text(result: Result) -> str:
    """Return the printed text with single spaces instead of line breaks."""
    return " ".join(result.output.split())
