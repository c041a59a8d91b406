"""The two ends that `fuzz_conversations` plays against: a live server, and a live client, of ours."""

from __future__ import annotations

import contextlib
import hashlib
import os
import random
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from fuzz_harness import FOUND
from fuzz_mutations import Mutator
from messaging.resets import usage
from naoqi_bytes import (
    CALL,
    CANCEL,
    CAPABILITY,
    ERROR,
    EVENT,
    LOGIN,
    POST,
    REPLY,
    Message,
    RawPeer,
    dynamic,
    members,
    text,
)
from naoqi_services import OURS, RETURNS_MEMORY, ROOT, SIGNATURES, ServerProcess

NAME = "naoqi-conversation"
PROGRAM = Path(__file__).with_name("fuzz_conversations.py")
BATCH = 50
"""Damaged messages between two honest calls."""
EXTRA = 9
"""Damaged messages that a client gets besides each damaged answer."""
PATIENCE = 60.0
"""Seconds after which one end counts as hanging; the machine is shared."""
PING = Message(CALL, 1, 1, 108, identity=0x7F000001)
"""machineId of the directory."""


class Found(Exception):
    """Something broke; the text says what.

    Args:
        batch: The bytes that did it, with the login in front.
    """

    def __init__(self, what: str, batch: bytes) -> None:
        super().__init__(what)
        self.batch = batch

    def save(self, side: str) -> Path:
        path = FOUND / NAME / f"{side}-{hashlib.sha256(self.batch).hexdigest()[:16]}.bin"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.batch)
        return path


class Damage:
    """Damages messages: payloads mostly, sometimes a field of the header, sometimes the bytes as a whole."""

    def __init__(self, honest: Sequence[Message], seed: int) -> None:
        self._random = random.Random(seed)
        self._honest = honest
        self._payloads = Mutator([message.payload for message in honest if message.payload], 4096, seed)

    def new(self) -> bytes:
        """One of the honest messages, damaged."""
        return self.damaged(self._random.choice(self._honest))

    def damaged(self, message: Message) -> bytes:
        kind = self._random.random()
        if kind < 0.75:
            payload = message.payload
            for _ in range(self._random.choice((1, 1, 2, 5))):
                payload = self._payloads.changed(payload)
            return message._replace(payload=payload, identity=message.identity).pack()
        if kind < 0.95:
            field = self._random.choice(("kind", "service", "object", "action", "flags", "identity", "version"))
            small = field in ("kind", "flags")
            value = self._random.choice((0, 1, 2, 3, 8, 100, 255, self._random.getrandbits(8 if small else 16)))
            return message._replace(**{field: value}).pack()
        return message._replace(payload=self._payloads.new()).pack()

    def broken(self) -> bytes:
        """A message whose header may lie: what follows it is no message any more."""
        return self._payloads.changed(self._random.choice(self._honest).pack())


# --- against the server ----------------------------------------------------------------------------------------------


def client_messages(peer: RawPeer) -> list[Message]:
    """What a client says, of every kind; `peer` looks up the numbers."""
    number = struct.unpack_from("<I", peer.answer(Message(CALL, 1, 1, 100, text("Conversation"))).payload, 16)[0]
    talk = members(peer.answer(Message(CALL, number, 1, 2, bytes(4))).payload)
    values = members(peer.answer(Message(CALL, 3, 1, 2, bytes(4))).payload)
    mixed = dynamic(
        "[m]", struct.pack("<I", 3) + dynamic("i", bytes(4)) + dynamic("s", text("x")) + dynamic("{sm}", bytes(4))
    )
    record = text("Mine") + struct.pack("<I", 0) + text("machine") + struct.pack("<I", 1)
    record += struct.pack("<I", 1) + text("tcp://127.0.0.1:1") + text("session") + text(bytes(20))
    calls = [
        LOGIN,
        Message(CAPABILITY, 0, 0, 0, LOGIN.payload),
        Message(CALL, 1, 1, 100, text("Recorded")),
        Message(CALL, 1, 1, 101),
        Message(CALL, 1, 1, 102, record),
        Message(CALL, 1, 1, 104, struct.pack("<I", 9)),
        Message(CALL, 1, 1, 105, record),
        Message(CALL, 2, 1, 2, bytes(4)),
        Message(CALL, 2, 1, 0, struct.pack("<IIQ", 2, 115, 13)),
        Message(CALL, 2, 1, 8, struct.pack("<IIQ", 2, 114, 14) + text("(d)")),
        Message(CALL, 2, 1, 1, struct.pack("<IIQ", 2, 115, 13)),
        Message(CALL, 2, 1, 5, dynamic("I", struct.pack("<I", 114))),
        Message(CALL, 2, 1, 6, dynamic("s", text("level")) + dynamic("f", struct.pack("<f", 2.5))),
        Message(CALL, 2, 1, 7),
        Message(CALL, 2, 1, 100, struct.pack("<ii", 1, 2)),
        Message(CALL, 2, 1, 100, dynamic("(md)", dynamic("i", bytes(4)) + bytes(8)), flags=1),
        Message(CALL, 2, 1, 100, struct.pack("<ii", 1, 2) + text("d"), flags=2),
        Message(CALL, 2, 1, 113, mixed),
        Message(CALL, 2, 1, 117, identity=40),
        Message(CANCEL, 2, 1, 0, struct.pack("<I", 40)),
        Message(POST, 2, 1, 115, struct.pack("<i", 3) + text("hey")),
        Message(POST, number, 1, talk["anything"], mixed),
        Message(CALL, number, 1, talk["subscriber"], text("x")),
        Message(CALL, number, 1, talk["subscriber_inside"], text("x")),
        Message(POST, number, 3, 3, struct.pack("<I", number)),
        Message(CALL, number, 1, talk["size"], text(bytes(200))),
        Message(REPLY, 2, 1, 100, struct.pack("<i", 3)),
        Message(ERROR, 2, 1, 100, dynamic("s", text("no"))),
        Message(EVENT, 2, 1, 115, struct.pack("<i", 3) + text("hey")),
    ]
    calls += [Message(CALL, 3, 1, action, bytes(64)) for name, action in values.items() if name.startswith("echo")]
    return [
        message._replace(identity=1 + place) if message.identity == 1 else message
        for place, message in enumerate(calls)
    ]


class ServerSide:
    """Damaged messages to a live server."""

    def __init__(self, seed: int) -> None:
        self._process = ServerProcess(OURS, "--release", "2.8")
        self._address = ("127.0.0.1", int(self._process.urls["2.8"].rpartition(":")[2]))
        with self._connect() as peer:
            self._damage = Damage(client_messages(peer), seed)
        self._random = random.Random(seed)
        self.connections = 0

    def _connect(self) -> RawPeer:
        peer = RawPeer(self._address, PATIENCE)
        peer.log_in()
        return peer

    def usage(self) -> tuple[float, int, int]:
        return usage(self._process.pid)

    def run(self, messages: int, told: Callable[[int], None]) -> None:
        peer: RawPeer | None = None
        done = 0
        while done < messages:
            batch = b"".join(self._damage.new() for _ in range(BATCH))
            last = self._random.random() < 0.2
            if last:
                batch += self._damage.broken()
            done += BATCH + last
            try:
                if peer is None:
                    peer = self._connect()
                    self.connections += 1
                if not self.survives(peer, batch, last):
                    peer.close()
                    peer = None
            except (TimeoutError, AssertionError) as error:
                raise Found(f"no answer within {PATIENCE:g} s: {error!r}", batch) from error
            if self._process.process.poll() is not None:
                raise Found(f"the server ended: {self._process.process.returncode}", batch)
            told(done)
        if peer:
            peer.close()
        self.served(batch)

    def play(self, batch: bytes) -> None:
        """One batch on a connection of its own.

        Raises:
            TimeoutError: No answer, and the connection stays open.
        """
        with self._connect() as peer:
            self.survives(peer, batch, last=True)

    def served(self, batch: bytes) -> None:
        """A new client can call."""
        with self._connect() as peer:
            if peer.answer(Message(CALL, 2, 1, 100, struct.pack("<ii", 1, 2))).payload != struct.pack("<i", 3):
                raise Found("add(1, 2) is not 3 any more", batch)

    @staticmethod
    def survives(peer: RawPeer, batch: bytes, last: bool = False) -> bool:
        """Send a batch; whether the connection is open afterwards.

        An honest call behind it is answered, or the connection is closed. After the `last` batch there is none.
        """
        try:
            peer.send(batch if last else batch + PING.pack())
            if last:
                peer.socket.shutdown(socket.SHUT_WR)
                if not peer.gone(PATIENCE):
                    raise TimeoutError("the connection is not closed")
                return False
            while peer.receive().identity != PING.identity:
                pass
        except TimeoutError:
            raise
        except OSError:
            return False
        return True

    def close(self) -> None:
        self._process.close()


# --- against the client ----------------------------------------------------------------------------------------------


class ClientSide:
    """A server that learns honest answers from ours, and gives them damaged to a live client."""

    def __init__(self, seed: int) -> None:
        self._process = ServerProcess(OURS, "--release", "2.8")
        self._honest_port = int(self._process.urls["2.8"].rpartition(":")[2])
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._answers: dict[tuple[int, int, int], Message] = {}
        self._seed = seed
        self._damage: Damage | None = None
        self.connections = 0
        self._sent = 0
        self._last: list[bytes] = []
        threading.Thread(target=self._accept, daemon=True).start()
        url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self._client = subprocess.Popen(
            [sys.executable, str(PROGRAM), "--client", url, "--seed", str(seed)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, **RETURNS_MEMORY, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        if self._line(self._client) != "ready":
            raise RuntimeError("the client does not talk to an honest server")
        events = [Message(EVENT, 2, 1, 115, struct.pack("<i", 3) + text("hey"))]
        events += [Message(CALL, 2, 1, 100, bytes(8)), Message(CAPABILITY, 0, 0, 0, LOGIN.payload)]
        self._damage = Damage([*self._answers.values(), *events], seed)

    @staticmethod
    def _line(process: subprocess.Popen) -> str:
        assert process.stdout
        return process.stdout.readline().strip()

    def usage(self) -> tuple[float, int, int]:
        return usage(self._client.pid)

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client = RawPeer(self._listener.accept()[0], PATIENCE)
                self.connections += 1
                threading.Thread(target=self._talk, args=(client,), daemon=True).start()

    def _talk(self, client: RawPeer) -> None:
        with contextlib.suppress(OSError, AssertionError), client:
            with RawPeer(("127.0.0.1", self._honest_port), PATIENCE) as honest:
                while True:
                    asked = client.receive()
                    if asked.kind != CALL:
                        continue
                    key = asked.service, asked.object, asked.action
                    if key not in self._answers or asked.service < 2 or asked.action < 3:
                        honest.send(asked)
                        answer = honest.next()
                        if answer.service > 1:
                            self._answers[key] = answer
                        client.send(answer)
                        continue
                    answer = self._answers[key]._replace(identity=asked.identity)
                    if self._damage is None:
                        client.send(answer)
                        continue
                    wrong = [self._damage.damaged(answer), *(self._damage.new() for _ in range(EXTRA))]
                    self._last = (self._last + wrong)[-BATCH:]
                    self._sent += 1 + EXTRA
                    # Whatever was made of it, the call ends.
                    client.send(b"".join(wrong) + answer._replace(kind=ERROR, payload=dynamic("s", text("no"))).pack())

    def run(self, messages: int, told: Callable[[int], None]) -> None:
        assert self._client.stdin
        while self._sent < messages:
            self._client.stdin.write("go\n")
            self._client.stdin.flush()
            said = self._line(self._client)
            if said != "done":
                raise Found(f"the client: {said or f'ended with {self._client.wait(5.0)}'}", b"".join(self._last))
            told(self._sent)

    def close(self) -> None:
        for stream in (self._client.stdin, self._client.stdout):
            if stream:
                stream.close()
        self._client.terminate()
        self._client.wait(10.0)
        self._listener.close()
        self._process.close()


def client(url: str, seed: int) -> None:
    """The live client: rounds of calls of every kind, each of which must end."""
    import telepresence.naoqi as naoqi

    naoqi.logging.setLevel(0)
    chance = random.Random(seed)
    milliseconds = int(PATIENCE * 1000)

    def connect() -> tuple:
        session = naoqi.Session()
        session.connect(url)
        values, talk, recorded = (session.service(name) for name in ("Values", "Conversation", "Recorded"))
        recorded.told.connect(lambda *_: None)
        return session, values, talk, recorded

    def calls(values: object, talk: object, recorded: object) -> list:
        made = [
            recorded.add(1, 2, _async=True),
            recorded.call("f113", [1, "x", {"a": 2.5}], _async=True),
            talk.subscriber("x", _async=True),
            talk.subscriber_inside("x", _async=True),
            talk.data(200, _async=True),
            talk.picture(200, _async=True),
            talk.fail("no", _async=True),
            talk.later(0, _async=True),
        ]
        samples = {
            "b": True,
            "s": "text",
            "r": b"raw",
            "m": [1, "a"],
            "[m]": [1, None],
            "{ss}": {"a": "b"},
            "{sm}": {"a": 1},
        }
        samples |= {
            "[s]": ["a"],
            "[[i]]": [[1]],
            "{is}": {1: "a"},
            "(is)": (1, "a"),
            "(fs[i])": (1.0, "a", [1]),
            "+s": "a",
        }
        samples |= {
            "[(is)]": [(1, "a")],
            "{s[f]}": {"a": [0.5]},
            "(is)<Named,number,text>": (1, "a"),
            "[i]": [1],
            "[f]": [0.5],
        }
        for number, signature in enumerate(SIGNATURES):
            made.append(values.call(f"echo{number}", samples.get(signature, 1), _async=True))
        return made

    session, *services = connect()
    for future in calls(*services):
        future.wait(milliseconds)
    print("ready", flush=True)
    for _ in sys.stdin:
        for _round in range(5):
            with contextlib.suppress(RuntimeError):
                if not session.isConnected():
                    session.close()
                    session, *services = connect()
                for future in calls(*services):
                    future.wait(milliseconds)
                    if future.isRunning():
                        print("a call has no end", flush=True)
                        return
                    with contextlib.suppress(RuntimeError):
                        future.value()
        if chance.random() < 0.1:
            session.close()
        print("done", flush=True)
