#!/usr/bin/env python3
"""Drive with the keyboard, under the name of the telepresence report; see twist_keyboard.node."""

import sys

from twist_keyboard.node import main

sys.exit(main())
