#!/usr/bin/env python3
"""Drive with the keyboard; see twist_keyboard.node.

The modules are not called teleop_twist_keyboard: this file has that name, and Python would find it first.
"""

import telepresence_ros.without_numpy  # noqa: F401  before genpy

# isort: split

import sys

from twist_keyboard.node import main

sys.exit(main())
