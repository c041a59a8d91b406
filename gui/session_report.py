"""The report of a recorded session:  python -m gui.session_report SESSION.bag

The command line that people type; see `gui.recording.session_report`.
"""

import sys

from gui.recording.session_report import main

if __name__ == "__main__":
    sys.exit(main())
