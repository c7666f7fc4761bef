"""`python -m terrain_gl` is `terrain-gl`."""

import signal
import sys

# Python's own answer to Ctrl-C is a traceback; until the command line listens, the process just ends.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .cli import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
