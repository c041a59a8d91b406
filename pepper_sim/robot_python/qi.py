"""The name `qi`, where the vendor's package is not installed: it is `telepresence.naoqi`."""

import sys

import telepresence.naoqi

sys.modules[__name__] = telepresence.naoqi
