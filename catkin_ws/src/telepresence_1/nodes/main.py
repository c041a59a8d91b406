#!/usr/bin/env python3
"""A page on the robot's tablet; see telepresence_1.main_program."""

import sys

from telepresence_1.main_program import main

sys.exit(main())
