"""Targets: bytes of NAOqi's messaging, as peers send them, and values that are to be sent to them."""

from __future__ import annotations

import struct
from typing import Any

from fuzz_harness import Target
from fuzz_values import Values, packed

SIGNATURES = (
    *("m", "[m]", "{sm}", "(ii)", "(IIL)", "(IILs)", "[f]", "[s]", "{mm}", "(is[f])<P,a,b,c>", "+[r]", "#m", "[(v)]"),
    "(sIsI[s]ss)<ServiceInfo,name,serviceId,machineId,processId,endpoints,sessionId,objectUid>",
    *("b", "c", "L", "d", "s", "r", "{r(+b)}", "(mmm)", "o", "(io)", "[[[m]]]"),
)
"""Inputs of `naoqi_payload` and `naoqi_value` begin with the index of one."""
MOST_PIECES = 50


class _References:
    """Objects are numbers here."""

    def write(self, value: Any) -> bytes:
        from telepresence.naoqi.signature import WireError

        if not isinstance(value, int):
            raise WireError("no object")
        return struct.pack("<Q", value % (1 << 64))

    def read(self, payload: memoryview, offset: int) -> tuple[int, int]:
        return struct.unpack_from("<Q", payload, offset)[0], offset + 8


def naoqi_messages() -> Target:
    """Streams of messages: in pieces they are the same as in one."""
    from telepresence.naoqi.message import CALL, CANCEL, EVENT, Header, MessageReader
    from telepresence.naoqi.signature import WireError

    most = 40_000

    def read(data: bytes, sizes: list[int]) -> tuple[list, str]:
        reader, got, at, scratch = MessageReader(most), [], 0, bytearray(max(sizes))
        try:
            while at < len(data):
                size = min(sizes[len(got) % len(sizes)], len(data) - at)
                scratch[:size] = data[at : at + size]
                at += size
                got += reader.feed(memoryview(scratch)[:size])
        except WireError as error:
            return got, str(error)
        return got, ""

    def feed(data: bytes) -> None:
        values = Values(data)
        small = 1 + values.byte()
        stream = values.rest()
        least = len(stream) // MOST_PIECES
        pieces = [max(small, least), max(data[-1] if data else 1, 1 + least), 30_000]
        whole, in_pieces = list[Any](), read(stream, pieces)
        error = ""
        try:
            for message in MessageReader(most).feed(stream):
                whole.append(message)
        except WireError as refusal:
            error = str(refusal)
        assert in_pieces == (whole, error), "pieces make a difference"
        for header, payload in whole:
            assert len(payload) == header.size <= most and Header.unpack(header.pack()) == header
        if error:
            assert "\n" not in error
            raise WireError(error)

    def message(kind: int, payload: bytes) -> bytes:
        return Header(11, len(payload), kind, 0, 2, 1, 100).pack() + payload

    seeds = (
        b"\x1b" + message(CALL, b"\1\0\0\0\2\0\0\0") + message(CANCEL, b"\x28\0\0\0"),
        b"\0" + message(EVENT, b"\3\0\0\0\3\0\0\0hey") + message(8, b"") * 3,
        b"\xff" + message(2, bytes(range(256)) * 100) + message(1, b""),
    )
    return Target(feed, seeds, (WireError,), 60_000)


def naoqi_signature() -> Target:
    """Signatures: what is one can be compiled, and is the same when it is read again."""
    from telepresence.naoqi.codec import decode
    from telepresence.naoqi.metaobject import METAOBJECT
    from telepresence.naoqi.signature import MAX_DEPTH, WireError, convertibility, parse, split

    def feed(data: bytes) -> None:
        text = data.decode("latin-1")
        try:
            split(text)
        except WireError as error:
            assert "\n" not in str(error) and len(str(error)) < 300
        one, *others = split(text.rpartition("::")[2])[:4] or ("",)
        kind = parse(one)
        assert parse(kind.full) == parse(kind.text) == kind and kind.depth <= MAX_DEPTH
        for other in (one, *others):
            assert 0.0 <= convertibility(one, other) <= 1.0
        decode(one, bytes(300))

    seeds = (
        METAOBJECT.encode(),
        b"(sIsI[s]ss)<ServiceInfo,name,a,b,c,d,e,f>",
        b"say::v(s)",
        b"{s+[m]}#i~m",
        b"((b)[(cC)])",
    )
    return Target(feed, seeds, (WireError,), 20_000)


def naoqi_payload() -> Target:
    """Payloads of all types: what is read can be written, and is then read the same."""
    from telepresence.naoqi.codec import decode_arguments, decode_from, encode
    from telepresence.naoqi.dynamics import PYTHON, ROBOT, Record, Typed
    from telepresence.naoqi.message import DYNAMIC_PAYLOAD
    from telepresence.naoqi.signature import WireError

    references = _References()

    def feed(data: bytes) -> None:
        index = data[0] if data else 0
        signature = SIGNATURES[index % len(SIGNATURES)]
        payload = data[1:]
        if index >= 200:
            arguments, end = decode_arguments(signature, payload, DYNAMIC_PAYLOAD, objects=references)
            assert end <= len(payload) and type(arguments) is tuple
        value, end = decode_from(signature, payload, objects=references)
        assert end <= len(payload)
        again = b"".join(encode(signature, value, objects=references, dialect=(PYTHON, ROBOT)[index // 100 % 2]))
        other, size = decode_from(signature, again, objects=references)
        assert size == len(again)
        if index < 100:
            assert other == value or "nan" in repr(value)

    def seed(signature: str, value: Any) -> bytes:
        return bytes((SIGNATURES.index(signature),)) + b"".join(encode(signature, value, objects=references))

    picture = [160, 120, 3, 11, 1, 2, bytes(3000), 0, 0.1, 0.2, -0.1, -0.2]
    info = {"name": "ALMotion", "serviceId": 5, "machineId": "m", "processId": 1, "endpoints": ["tcp://10.0.0.2:9559"]}
    seeds = (
        seed("m", picture),
        seed("[m]", [0.5] * 20),
        seed("[m]", ["key"] * 20),
        seed("[m]", [None, 1, "a", 0.5, True, [Typed("f", 0.5), (1, b"\xff")], {"a": 1, 2: []}, Typed("[f]", [1.0])]),
        seed("m", Typed("(if)<P,x,y>", (1, 2.0))),
        seed("{sm}", {"ClientServerSocket": True, "__qi_auth_state": Typed("I", 3)}),
        seed(SIGNATURES[13], Record(info, sessionId="0", objectUid=b"\x90\xbf\x6a")),
        seed("(is[f])<P,a,b,c>", (1, "x", [0.5])),
        seed("{r(+b)}", {b"k": (True,)}),
        seed("(io)", (1, 7)),
        seed("[[[m]]]", [[[1, "a"]], []]),
        b"\xe1" + b"".join(encode("m", (1, "x"))),
    )
    assert SIGNATURES[0xE1 % len(SIGNATURES)] == "m"
    return Target(feed, seeds, (WireError,), 6000)


def naoqi_value() -> Target:
    """Values to be sent: anything becomes bytes that a peer can read, or is refused."""
    from telepresence.naoqi.codec import decode, encode, encode_arguments
    from telepresence.naoqi.dynamics import PYTHON, ROBOT, Typed, signature_of
    from telepresence.naoqi.signature import WireError

    references = _References()

    def feed(data: bytes) -> None:
        values = Values(data)
        index = values.byte()
        signature = SIGNATURES[index % len(SIGNATURES)]
        dialect = (PYTHON, ROBOT)[index // 128]
        value = values.value()
        signature_of(value, dialect, resolve=True)
        for wanted in ("m", signature):
            data = b"".join(encode(wanted, value, objects=references, dialect=dialect))
            decode(wanted, data, objects=references)
        encode("m", Typed(signature, value), objects=references)
        encode_arguments(f"({signature}m)", (value, value), objects=references)

    seeds = (b"\0" + packed(1.0), b"\xe1" + packed(0.5), b"\xe1\xdb" + packed(*range(11)))
    return Target(feed, seeds, (WireError,), 2000)


def naoqi_metaobject() -> Target:
    """Descriptions of objects, and calls of what they describe."""
    from telepresence.naoqi.codec import decode, encode
    from telepresence.naoqi.metaobject import (
        BUILT_IN,
        METAOBJECT,
        MetaMethod,
        MetaObject,
        MetaProperty,
        MetaSignal,
        choose_overload,
    )
    from telepresence.naoqi.signature import WireError

    def feed(data: bytes) -> None:
        meta = MetaObject.from_value(decode(METAOBJECT, data))
        assert MetaObject.from_value(decode(METAOBJECT, b"".join(encode(METAOBJECT, meta.to_value())))) == meta
        for name in {method.name for method in meta.methods.values()}:
            for arguments in ((), (1,), ("a", [1.5]), ({"a": 1}, None, True)):
                try:
                    choose_overload(meta, name, arguments)
                except WireError:
                    raise
                except RuntimeError as refusal:
                    assert name in str(refusal)

    methods = {
        100: MetaMethod(100, "v", "say", "(s)", "Speak.", (("text", "what to say"),)),
        101: MetaMethod(101, "v", "say", "(ss)"),
        102: MetaMethod(102, "m", "say", "(m)"),
        103: MetaMethod(103, "[m]", "get", "([s])"),
    }
    signals, properties = {104: MetaSignal(104, "spoken", "(s)")}, {105: MetaProperty(105, "volume", "f")}
    small = MetaObject(methods, signals, properties, "A voice.")
    seeds = [b"".join(encode(METAOBJECT, meta.to_value())) for meta in (small, MetaObject(dict(BUILT_IN)))]
    return Target(feed, seeds, (WireError,), 4000)


def robot_side() -> Target:
    """What the client of the programs on a robot takes: answers of the directory, metaobjects, dynamics, signatures."""
    from telepresence.robot_side.naoqi_client import _METAOBJECT_SIGNATURE, _SERVICE_INFO, _methods
    from telepresence.robot_side.naoqi_connection import _text
    from telepresence.robot_side.naoqi_values import NaoqiError, decode, encode, parse

    signatures = ("m", _METAOBJECT_SIGNATURE, _SERVICE_INFO, "[[m]]", "{m+s}", "[v]")

    def feed(data: bytes) -> None:
        index, payload = data[0] % 7 if data else 0, data[1:]
        if index == 6:
            parse(payload.decode("latin-1"))
            return
        _text(payload)
        value = decode(parse(signatures[index]), payload)
        if index == 1:
            _methods(value)
        else:
            encode(parse("m"), value)

    method = (100, "v", "move", "(fff)", "", [("x", "")], "")
    seeds = (
        b"\0" + encode(parse("m"), [1, "a", 2.5, None, {"k": [True, b"raw"]}]),
        b"\1" + encode(parse(_METAOBJECT_SIGNATURE), ({100: method}, {86: (86, "trace", "(m)")}, {}, "")),
        b"\2" + encode(parse(_SERVICE_INFO), ("ALMotion", 5, "machine", 1, ["tcp://10.0.0.2:9559"])) + bytes(8),
        b"\3" + encode(parse("[[m]]"), [[1, 2], ["x"]]),
        b"\6({I(Iss)<P,a,b,c>}[m]+s)",
    )
    return Target(feed, seeds, (NaoqiError,), 20_000)
