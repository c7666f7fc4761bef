"""`python -m terrain_gl` is `terrain-gl`."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
