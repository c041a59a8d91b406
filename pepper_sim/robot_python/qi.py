"""The module `qi` where the vendor's package is not installed: `telepresence.naoqi` under that name."""

import sys

import telepresence.naoqi

sys.modules[__name__] = telepresence.naoqi
