"""The errors that a user can cause, each one line long: what was wrong and what to do."""


class TerrainError(Exception):
    """The work failed; the command line exits with status 1."""


class UsageError(TerrainError):
    """The command was used wrongly; the command line exits with status 2."""
