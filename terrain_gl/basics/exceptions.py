"""The errors a user may see: each is one line that says what was wrong and what to do."""


class TerrainError(Exception):
    """The work could not be done (exit status 1)."""


class NotInstalledError(TerrainError):
    """An optional package is not installed. The message names the extra of setup.cfg that installs it."""

    def __init__(self, what: str, extra: str, reason: ImportError) -> None:
        super().__init__(f"{what} needs the extra [{extra}] ({reason}): pip install 'terrain-gl[{extra}]'")


class UsageError(TerrainError):
    """The request itself makes no sense (exit status 2)."""


def reason_of(error: BaseException) -> str:
    """Why something failed, in one line."""
    words = " ".join(str(error).split())
    return words if isinstance(error, TerrainError) else f"{type(error).__name__}: {words}"
