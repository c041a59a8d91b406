"""A pilot who listens to a robot's microphones, in a process that may be on another machine; see `talker.Caller`.

usage: listening_pilot.py URL QI_LISTEN_URL
"""

from __future__ import annotations

import json
import sys

from naoqi_driver.connection import Address, Connection
from telepresence_1.microphone_stream import MicrophoneStream


class ListeningPilot:
    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._stream = MicrophoneStream(connection, lambda *_: None, "front").start()

    def blocks(self) -> int:
        """Blocks of sound that have come."""
        return self._stream.blocks

    def problem(self) -> str:
        return self._stream.problem or ""

    def listens_at(self) -> str:
        return self._connection.listens_at


if __name__ == "__main__":
    with Connection(Address.parse(sys.argv[1]), listen=sys.argv[2]) as connection:
        pilot = ListeningPilot(connection)
        for line in sys.stdin:
            name, arguments = json.loads(line)
            print(json.dumps(getattr(pilot, name)(*arguments)), flush=True)
