"""`./stack up` as a module: `python -m telepresence.station`. See `telepresence.station.up`."""

import sys

from telepresence.station.up import main

if __name__ == "__main__":
    sys.exit(main())
