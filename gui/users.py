"""Who may sign in:  python -m gui.users add NAME --role pilot

The command line that people type; the accounts themselves are `telepresence.teleop.accounts`.
"""

import sys

from telepresence.teleop.accounts import main

if __name__ == "__main__":
    sys.exit(main())
