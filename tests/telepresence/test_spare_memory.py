"""What lies unused between blocks that live on goes back to the system."""

import subprocess
import sys

PROGRAM = """
import ctypes, threading, time
from pathlib import Path
from telepresence.spare_memory import SpareMemory

libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
libc.free.argtypes = [ctypes.c_void_p]

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

LARGE, SMALL = 1_000_000, 64
large, small = [], []
for _ in range(40):  # pictures, and what is asked for while they are there
    large.append(libc.malloc(LARGE))
    ctypes.memset(large[-1], 1, LARGE)
    small.append(libc.malloc(SMALL))
full = resident()
for block in large:
    libc.free(block)
kept = resident()
memory = SpareMemory(0.05)
deadline = time.monotonic() + 30.0
while resident() > full - 30 * LARGE and time.monotonic() < deadline:
    time.sleep(0.02)
memory.close()
print(full - kept < 2 * LARGE, full - resident() > 30 * LARGE, threading.active_count())
"""


def test_memory_between_blocks_that_live_on_is_returned():
    # As env.sh has it: large blocks are no mappings of their own, and what lies on top is kept.
    environment = {"MALLOC_MMAP_THRESHOLD_": "67108864", "MALLOC_TRIM_THRESHOLD_": "67108864"}
    told = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=environment, text=True, stdout=subprocess.PIPE, check=True, timeout=60.0
    )
    assert told.stdout.split() == ["True", "True", "1"]
