"""The type of every number that clients get, read from the bytes by a reader of its own.

A strict C++ client asks a dynamic value `as<int>()` and `asFloat()`; naoqi_driver ends when it gets an int64. The table
has what a real robot sends (NAOqi 2.8 documentation; the picture as ros-naoqi/naoqi_driver checks it).
"""

from __future__ import annotations

import itertools
import re
import socket
import struct
import time
from urllib.parse import urlsplit

import pytest

HEADER = struct.Struct("<4sIIHBBIII")
CALL, REPLY, ERROR, POST, EVENT = 1, 2, 3, 4, 5
NUMBERS = dict(zip("bcCwWiIlLfd", "?bBhHiIqQfd", strict=True))


class Reader:
    """Reads one payload: values, and what types its dynamics have."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def number(self, code):
        (value,) = struct.unpack_from("<" + code, self.data, self.at)
        self.at += struct.calcsize("<" + code)
        return value

    def octets(self):
        size = self.number("I")
        self.at += size
        assert self.at <= len(self.data)
        return self.data[self.at - size : self.at]

    def read(self, signature):
        """Return (value, types): in `types` a list is "[" and each element's type, a dynamic the type it holds."""
        value, types, rest = self._read(signature)
        assert not rest
        return value, types

    def _read(self, kind):
        """Read the first type of `kind`; also return what follows it there."""
        head, rest = kind[0], kind[1:]
        if head in NUMBERS:
            return self.number(NUMBERS[head]), head, rest
        if head in "sr":
            data = self.octets()
            return (data.decode() if head == "s" else data), head, rest
        if head == "v":
            return None, head, rest
        if head == "m":
            return *self.read(self.octets().decode()), rest
        if head in "[{":
            values, types = [], ""
            for _ in range(self.number("I")):
                inside = rest
                while inside[0] not in "]}":
                    value, found, inside = self._read(inside)
                    values.append(value)
                    types += found
            return values, head + types + "]}"["[{".index(head)], _after(kind)
        assert head == "(", kind
        values, types, inside = [], "", rest
        while inside[0] != ")":
            value, found, inside = self._read(inside)
            values.append(value)
            types += found
        return values, "(" + types + ")", _after(kind)


def _after(kind):
    """What follows the bracket that `kind` begins with, and its annotation."""
    depth = 0
    for index, char in enumerate(kind):
        depth += (char in "[({<") - (char in "])}>")
        if depth == 0 and kind[index + 1 : index + 2] != "<":
            return kind[index + 1 :]
    raise AssertionError(kind)


def text(value):
    return struct.pack("<I", len(value.encode())) + value.encode()


def dynamic(signature, data=b""):
    return text(signature) + data


def texts(*values):
    return struct.pack("<I", len(values)) + b"".join(map(text, values))


def integers(*values):
    return struct.pack(f"<{len(values)}i", *values)


class Bytes:
    """A client that knows bytes alone. Calls are answered in order; what else arrives is kept in `others`."""

    def __init__(self, url):
        address = urlsplit(url)
        self.socket = socket.create_connection((address.hostname, address.port), timeout=20)
        self.others = []
        self.numbers = itertools.count(1)
        self.call(0, 0, 8, struct.pack("<I", 0))
        self.methods = {}

    def send(self, kind, service, obj, action, payload=b"", identity=None):
        number = next(self.numbers) if identity is None else identity
        header = HEADER.pack(b"\x42\xde\xad\x42", number, len(payload), 0, kind, 0, service, obj, action)
        self.socket.sendall(header + payload)
        return number

    def receive(self):
        magic, number, size, _, kind, flags, *place = HEADER.unpack(self._exactly(HEADER.size))
        assert magic == b"\x42\xde\xad\x42" and flags == 0
        return kind, number, tuple(place), self._exactly(size)

    def _exactly(self, size):
        data = b""
        while len(data) < size:
            piece = self.socket.recv(size - len(data))
            assert piece, "the connection was closed"
            data += piece
        return data

    def call(self, service, obj, action, payload=b""):
        wanted = self.send(CALL, service, obj, action, payload)
        while True:
            kind, number, place, answer = self.receive()
            if number == wanted and kind in (REPLY, ERROR):
                assert kind == REPLY, Reader(answer).read("m")
                return answer
            self.others.append((kind, number, place, answer))

    def until(self, kind):
        """The next message of this kind that is no answer: (number, place, payload)."""
        while True:
            for index, (found, *rest) in enumerate(self.others):
                if found == kind:
                    del self.others[index]
                    return rest
            self.others.append(self.receive())

    def service(self, name):
        """Number of a service; its methods by (name, parameters): (action, result)."""
        payload = self.call(1, 1, 100, text(name))
        reader = Reader(payload)
        reader.octets()
        number = reader.number("I")
        self.methods[name] = _methods(Reader(self.call(number, 1, 2, struct.pack("<I", 0))))
        return number

    def ask(self, name, method, parameters, arguments=b""):
        """Call a method: (payload, declared result)."""
        number = self.service(name)
        action, result = self.methods[name][method, parameters]
        return self.call(number, 1, action, arguments), result

    def close(self):
        self.socket.close()


METHODS, MEMBERS = "{I(Issss[(ss)]s)}", "{I(Iss)}"


def _methods(reader):
    rows = reader.read(METHODS)[0][1::2]
    return {(name, parameters): (uid, result) for uid, result, name, parameters, *_ in rows}


@pytest.fixture
def raw(naoqi):
    client = Bytes(naoqi.simulation.url)
    yield client
    client.close()


HEAD_YAW = "Device/SubDeviceList/HeadYaw/Position/Sensor/Value"
TABLE = [
    ("ALMemory", "getData", "(s)", text(HEAD_YAW), "f"),
    ("ALMemory", "getData", "(s)", text("DCM/Time"), "i"),
    ("ALMemory", "getData", "(s)", text("RobotConfig/Body/Type"), "s"),
    ("ALMemory", "getData", "(s)", text("BatteryTrapIsOpen"), "b"),
    ("ALTouch", "getStatus", "()", b"", "[[sb[]]]"),
    (
        *("ALMemory", "getListData", "(m)"),
        dynamic("[s]", texts(HEAD_YAW, "No/Such/Key", "DCM/Time", "RobotConfig/Body/Type", "BatteryTrapIsOpen")),
        "[fvisb]",
    ),
    ("ALMemory", "getTimestamp", "(s)", text("DCM/Time"), "[iii]"),
    ("ALMemory", "getTimestamp", "(s)", text(HEAD_YAW), "[fii]"),
    ("ALMemory", "getEventHistory", "(s)", text("Test/History"), "[[f[ii]ii]]"),
    ("ALMemory", "getDescriptionList", "([s])", texts("DCM/Time"), "[[sss]]"),
    ("ALMotion", "getAngles", "(mb)", dynamic("s", text("Head")) + b"\1", "[ff]"),
    ("ALMotion", "getLimits", "(s)", text("Head"), "[[ffff]]"),
    ("ALMotion", "getRobotConfig", "()", b"", "[[ssssssssssss][sssbbbbbsiii]]"),
    ("ALMotion", "getBreathConfig", "()", b"", "[[sf]]"),
    ("ALMotion", "getMoveConfig", "(s)", text("Max"), "[[sf]]"),
    ("ALMotion", "getTaskList", "()", b"", "[]"),
    ("ALMotion", "getMotionCycleTime", "()", b"", "i"),
    ("ALMotion", "getRobotPosition", "(b)", b"\1", "[fff]"),
    ("ALMotion", "getMass", "(s)", text("Body"), "f"),
    ("ALMotion", "robotIsWakeUp", "()", b"", "b"),
    ("ALAutonomousLife", "getStateHistory", "()", b"", "[[s[ii]]]"),
    ("ALAutonomousLife", "getLifeTime", "()", b"", "i"),
    ("ALTracker", "getRelativePosition", "()", b"", "[ffffff]"),
    ("ALTracker", "getMaximumDistanceDetection", "()", b"", "f"),
    ("ALBattery", "getBatteryCharge", "()", b"", "i"),
    ("ALLeds", "getIntensity", "(s)", text("ChestLedsRed"), "[f]"),
    ("ALVideoDevice", "getCameraIndexes", "()", b"", "[iii]"),
    ("ALVideoDevice", "getParameterRange", "(ii)", integers(0, 0), "[ii]"),
    ("ALVideoDevice", "getHorizontalFOV", "(i)", integers(0), "f"),
    ("ALVideoDevice", "getImageRemote", "(s)", text("nobody"), "v"),
    ("ALAudioDevice", "getOutputVolume", "()", b"", "i"),
    ("ALSystem", "freeMemory", "()", b"", "i"),
]


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row[1]}-{row[4]}")
def test_an_answer_has_a_real_robots_types(naoqi, raw, row):
    *question, types = row
    naoqi.ALMemory.raiseEvent("Test/History", 1.5)
    payload, result = raw.ask(*question)
    reader = Reader(payload)
    found = reader.read(result)[1]
    assert reader.at == len(payload), "nothing follows the answer"
    assert ALIKE.sub(r"\1", found) == types


ALIKE = re.compile(r"(\[(?:[^][]|\[[^][]*\])+\])\1+")
"""Rows of the same types, one after the other: the table has one of them."""


def test_answers_byte_for_byte(naoqi, raw):
    def payload(*question):
        return raw.ask(*question)[0]

    assert payload("ALMotion", "getMotionCycleTime", "()") == integers(20)
    assert payload("ALMotion", "getBodyNames", "(s)", text("Head")) == texts("HeadYaw", "HeadPitch")
    assert payload("ALMemory", "getListData", "(m)", dynamic("[s]", texts("No/Such/Key"))) == bytes.fromhex(
        "03000000 5b6d5d 01000000 01000000 76"
    )
    raw.ask("ALMemory", "insertData", "(sm)", text("Test/Wire") + dynamic("l", struct.pack("<q", 5)))
    assert payload("ALMemory", "getData", "(s)", text("Test/Wire")) == bytes.fromhex("01000000 69 05000000")
    raw.ask("ALMemory", "insertData", "(sm)", text("Test/Wire") + dynamic("d", struct.pack("<d", 0.5)))
    assert payload("ALMemory", "getData", "(s)", text("Test/Wire")) == bytes.fromhex("01000000 66 0000003f")
    naoqi.ALMotion.setBreathConfig([["Bpm", 15.0], ["Amplitude", 1.0]])
    breath = payload("ALMotion", "getBreathConfig", "()")
    assert breath == dynamic(
        "[m]",
        struct.pack("<I", 2)
        + dynamic("[m]", struct.pack("<I", 2) + dynamic("s", text("Bpm")) + dynamic("f", struct.pack("<f", 15.0)))
        + dynamic("[m]", struct.pack("<I", 2) + dynamic("s", text("Amplitude")) + dynamic("f", struct.pack("<f", 1.0))),
    )


def test_no_answer_holds_an_int64_or_a_float64(naoqi, raw):
    """Every method that needs no argument and answers with a dynamic."""
    found = {}
    for info in naoqi.session.services():
        name = info["name"]
        if name == "ServiceDirectory":
            continue
        number = raw.service(name)
        for (method, parameters), (action, result) in raw.methods[name].items():
            if action >= 100 and parameters == "()" and result == "m" and method not in REFUSED:
                found[f"{name}.{method}"] = Reader(raw.call(number, 1, action)).read("m")[1]
    assert len(found) > 40
    assert not {method: types for method, types in found.items() if set("lLdWwcC") & set(types)}


REFUSED = {"relocalizeInMap", "getRobotPositionInMap", "getMetricalMap", "getExplorationPath", "getFootSteps"} | {
    "stopRecording"
}
"""What the simulated robot has not, or not now."""


def test_a_picture_byte_for_byte(naoqi, raw):
    handle = naoqi.ALVideoDevice.subscribeCamera("wire", 0, 7, 11, 10)
    payload, result = raw.ask("ALVideoDevice", "getImageRemote", "(s)", text(handle))
    naoqi.ALVideoDevice.unsubscribe(handle)
    value, types = Reader(payload).read(result)
    assert (result, types) == ("m", "[iiiiiiriffff]")
    seconds, microseconds, pixels, angles = value[4], value[5], value[6], value[8:]
    assert len(pixels) == 80 * 60 * 3 and abs(seconds + microseconds * 1e-6 - time.time()) < 60.0
    assert payload == dynamic(
        "[m]",
        struct.pack("<I", 12)
        + b"".join(dynamic("i", integers(number)) for number in (80, 60, 3, 11, seconds, microseconds))
        + dynamic("r", struct.pack("<I", len(pixels)) + pixels)
        + dynamic("i", integers(0))
        + b"".join(dynamic("f", struct.pack("<f", angle)) for angle in angles),
    )


def test_an_event_is_a_dynamic_of_a_real_robots_type(naoqi, raw):
    number = raw.service("ALMemory")
    reader = Reader(raw.ask("ALMemory", "subscriber", "(s)", text("FrontTactilTouched"))[0])
    reader.read(METHODS)
    signals = reader.read(MEMBERS)[0][1::2]
    reader.read(MEMBERS)
    reader.octets()
    service, obj = reader.number("I"), reader.number("I")
    assert reader.at == len(reader.data) and service == number
    ((uid, signature),) = [(uid, kind) for uid, name, kind in signals if name == "signal"]
    assert signature == "(m)"
    raw.call(service, obj, 0, struct.pack("<IIQ", obj, uid, uid << 32 | 1))
    naoqi.ALMemory.raiseEvent("FrontTactilTouched", 1.0)
    _, place, payload = raw.until(EVENT)
    assert place == (service, obj, uid)
    assert payload == dynamic("f", struct.pack("<f", 1.0))


CALLBACK = struct.pack("<III", 1, 100, 100) + text("v") + text("processRemote") + text("(mmmm)") + text("")
METAOBJECT = CALLBACK + struct.pack("<I", 0) + text("") + struct.pack("<II", 0, 0) + text("")


def test_sound_comes_as_int32_and_raw_over_the_clients_own_connection(raw, naoqi):
    """The client does not listen: its endpoints lead nowhere."""
    info = text("WireEars") + struct.pack("<I", 0) + text("a machine") + struct.pack("<I", 0)
    info += texts("tcp://127.0.0.1:9") + text("a session")
    (parameters,) = [kind for name, kind in _directory(raw) if name == "registerService"]
    info += text("") * parameters.startswith("((sIsI[s]ss)")
    (number,) = struct.unpack("<I", raw.call(1, 1, 102, info))
    raw.call(1, 1, 104, struct.pack("<I", number))
    raw.ask("ALAudioDevice", "setClientPreferences", "(siii)", text("WireEars") + integers(16000, 3, 0))
    raw.ask("ALAudioDevice", "subscribe", "(s)", text("WireEars"))
    question, place, _ = raw.until(CALL)
    assert place == (number, 1, 2), "the robot asks what the service looks like"
    raw.send(REPLY, *place, METAOBJECT, identity=question)
    _, place, payload = raw.until(POST)
    assert place == (number, 1, 100)
    value, types = Reader(payload).read("(mmmm)")
    assert types == "(ii[ii]r)" and value[:2] == [1, 1365] and len(value[3]) == 2 * 1365
    raw.ask("ALAudioDevice", "unsubscribe", "(s)", text("WireEars"))


def _directory(raw):
    methods = _methods(Reader(raw.call(1, 1, 2, struct.pack("<I", 0))))
    return list(methods)
