"""`python -m terrain_gl` is `terrain-gl`."""

import signal
import sys

# Python answers Ctrl-C with a traceback. Until the command line handles it, Ctrl-C simply ends the process.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from .cli import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
