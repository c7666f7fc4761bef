"""`python -m terrain_gl` is `terrain-gl`."""

import signal
import sys

# By default, Ctrl-C prints a traceback. Until the command line handles Ctrl-C, it ends the process silently.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .cli import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
