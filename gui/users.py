"""Who may sign in:  python -m gui.users add NAME --role pilot

The command line that people type; the accounts themselves are `telepresence.teleop.accounts`. Root goes on as the user
who would run the station if it were started the same way; with --users it stays root.
"""

import sys

from telepresence.station.unprivileged import must_leave_root, replace_by
from telepresence.teleop.accounts import main

if __name__ == "__main__":
    words = sys.argv[1:]
    if must_leave_root() and not any(word.startswith(("--users", "--file")) for word in words):
        sys.exit(replace_by([sys.executable, "-P", "-m", "gui.users", *words]))
    sys.exit(main())
