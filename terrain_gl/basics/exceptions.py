"""The two errors a user may see: each is one line that says what was wrong and what to do."""


class TerrainError(Exception):
    """The work could not be done (exit status 1)."""


class UsageError(TerrainError):
    """The request itself makes no sense (exit status 2)."""
