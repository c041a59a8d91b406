"""The simulated Pepper, whose calls cannot be cancelled, as those of a robot whose methods know nothing of it."""

import sys

from pepper_sim.__main__ import main
from telepresence.naoqi.connection import Connection

Connection._cancelled = lambda self, payload: None

if __name__ == "__main__":
    sys.exit(main())
