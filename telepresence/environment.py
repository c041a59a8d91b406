"""Lets any python3 start a program of the project: one without the project's packages restarts it in the project's
environment, as `./stack exec` does, which installs first what is missing. It needs nothing but the standard library.
"""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_RESTARTED = "TELEPRESENCE_RESTARTED"


def require(*modules: str) -> None:
    """Return when `modules` can be imported; else restart this program, with its arguments, where they can.

    Raises:
        SystemExit: They cannot be imported in the project's environment either.
    """
    missing = [module for module in modules if find_spec(module) is None]
    restarted = os.environ.pop(_RESTARTED, "")
    if not missing:
        return
    if restarted:
        sys.exit(f"{Path(sys.argv[0]).name}: not installed: {', '.join(missing)}. Install with:  {ROOT}/stack build")
    os.environ[_RESTARTED] = "1"
    stack = str(ROOT / "stack")
    os.execv(stack, [stack, "exec", "python", os.path.abspath(sys.argv[0]), *sys.argv[1:]])
