"""A simulated Pepper at the address that is given, with a certificate behind TLS: writes its true position, 100 lines a
second, until it is ended."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from tls_front import TlsFront

from pepper_sim.simulation import Simulation

address, certificate = sys.argv[1], Path(sys.argv[2]) if len(sys.argv) > 2 else None
with Simulation("empty", port=9559, address="127.0.0.1" if certificate else address) as simulation:
    if certificate:
        TlsFront(9559, certificate, (address, 9503))
    while True:
        x, y = simulation.robot.truth()[:2]
        print(x, y, flush=True)
        time.sleep(0.01)
