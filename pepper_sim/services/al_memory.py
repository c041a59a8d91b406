"""ALMemory: the robot's blackboard of data and events.

Keys of the body are computed from the robot's last snapshot when they are read; everything else is stored by services
and clients. `insertData` stores a value, `raiseEvent` stores it and calls the subscribers.

Source: NAOqi 2.8 documentation, ALMemory; behaviour of missing keys as naoqi_driver relies on it.
"""

from __future__ import annotations

import concurrent.futures
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.memory_changes import Changes
from pepper_sim.naoqi.memory_keys import Reader
from pepper_sim.naoqi.memory_size import MOMENT, size_of, weight_of
from pepper_sim.naoqi.memory_subscriptions import MemorySubscriptions, Topic
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown
from pepper_sim.naoqi.time_stamp import split_stamp
from telepresence.naoqi.incoming_call import NotNow

_KEY_ADDED, _KEY_REMOVED, _KEY_TYPE_CHANGED = "ALMemory/KeyAdded", "ALMemory/KeyRemoved", "ALMemory/KeyTypeChanged"
_MAX_KEYS = 100_000
"""More keys than this are refused: a client in a loop must not use up this machine's RAM."""
_MAX_BYTES = 256 << 20
"""Of all values that are not small; what a client stores beyond that is refused. The robot's own are bounded."""
_MAX_HISTORY_BYTES = 1 << 20
"""Of the last values of an event, but for the present value of its key."""
_MAX_HISTORIES_BYTES = 64 << 20
"""Of those of all events; beyond it an event that is raised keeps its newest value only."""
_MAX_LETTERS = 1000
"""Of a key or a description."""


@dataclass
class _Entry:
    value: Any = None
    stamp: float = 0.0
    description: str = ""
    weight: int = 0


class ALMemory(Module):
    """Data and events of the robot.

    Args:
        snapshot: Function that returns the robot's last snapshot.
        body: Keys that are computed from the snapshot.
        clients: Services of clients, called for `subscribeToEvent`.
        has_snapshot: Whether `snapshot` answers without waiting for the world.
    """

    name = "ALMemory"

    def __init__(
        self,
        snapshot: Callable[[], Any],
        body: dict[str, Reader],
        clients: ClientServices,
        has_snapshot: Callable[[], bool] = lambda: False,
    ) -> None:
        self._snapshot, self._has_snapshot = snapshot, has_snapshot
        self._body = body
        self._lock = threading.Lock()
        self._entries: dict[str, _Entry] = {}
        self._topics: dict[str, Topic] = {}
        self._bytes = self._past = 0
        """Weight of the keys' values, and of the events' histories besides these."""
        self._subscriptions = MemorySubscriptions(self._topics, self._lock, clients)
        self._micro_events: set[str] = set()
        self._changes = Changes(self.read)
        self.declare((_KEY_ADDED, _KEY_REMOVED, _KEY_TYPE_CHANGED), self.name)
        self.announce("NAOqiReady", True)

    def parts(self) -> tuple[Any, ...]:
        return self, self._subscriptions

    def close(self) -> None:
        """End what waits for a change."""
        self._changes.close()

    # --- for the other services --------------------------------------------------------------------------------------

    def forget_module(self, name: str) -> None:
        """Call a module at no event any more; extractors that ran for it alone end."""
        self._subscriptions.unregisterModuleReference(name)

    def store(self, key: str, value: Any) -> None:
        """Write a value without raising an event, but for those that tell of new keys and of values of another type."""
        self._store(key, value, size_of(value))

    def read(self, key: str) -> Any:
        """Return the value of a key; None if it is missing or void."""
        reader = self._body.get(key)
        if reader is not None:
            return reader(self._snapshot())
        return self._stored(key)

    def announce(self, key: str, value: Any) -> None:
        """Write a value and call every subscriber, on other threads."""
        self._announce(key, value, size_of(value))

    def follow(self, event: str, callback: Callable[[Any], None]) -> Callable[[], None]:
        """Call `callback(value)` at each event, on another thread; return the function that ends it."""
        with self._lock:
            self._make_room(event)
            signal = self._topics.setdefault(event, Topic()).event.signal
        link = signal.connect(callback)
        return lambda: signal.disconnect(link)

    def declare(self, events: Iterable[str], extractor: str = "") -> None:
        """Make events known before they are first raised; until then their value is void, unless it is stored."""
        with self._lock:
            for event in events:
                self._entry(event)
                self._topics.setdefault(event, Topic()).extractor = extractor

    def start_with(self, extractor: str, switch: Callable[[str, bool], None]) -> None:
        """Call switch(module, True) when a module subscribes to an event of this extractor, and False when it leaves:
        extractors start by themselves, as documented."""
        self._subscriptions.switches[extractor] = switch

    # --- data --------------------------------------------------------------------------------------------------------

    def quick_data(self, key: str, duration: int = 0) -> Any:
        """getData of a key of the body, while nobody has to wait for the world."""
        reader = self._body.get(key)
        if reader is None or not self._has_snapshot():
            raise NotNow
        return reader(self._snapshot())

    @remote("m(s)", "m(si)", quick="quick_data")
    def getData(self, key: str, duration: int = 0) -> Any:
        """Returns a key's value. The second argument, a cache time, is ignored: values are always fresh."""
        if not self._known(key):
            raise ServiceError(f"data not found for key '{shown(key)[1:-1]}'")
        return self.read(key)

    @remote("m(si)")
    def getDataOnChange(self, key: str, deprecatedParameter: int) -> concurrent.futures.Future:
        """Waits until a key's value changes, and returns it. The second argument has no effect."""
        if not self._known(key):
            raise ServiceError(f"data not found for key '{shown(key)[1:-1]}'")
        return self._changes.next(key)

    def quick_list_data(self, keyList: Any) -> list:
        """getListData of keys of the body, while nobody has to wait for the world."""
        if not self._has_snapshot() or not isinstance(keyList, list):
            raise NotNow
        snapshot, body = self._snapshot(), self._body
        try:
            return [body[key](snapshot) for key in keyList]
        except (KeyError, TypeError):
            raise NotNow from None

    @remote("m(m)", quick="quick_list_data")
    def getListData(self, keyList: Any) -> list:
        """Returns many values, all of the same instant; None for a missing key."""
        if not isinstance(keyList, list | tuple) or not {str}.issuperset(map(type, keyList)):
            raise ServiceError(f"keyList must be a list of strings, got {shown(keyList)}")
        snapshot, readers = self._snapshot(), self._body.get
        return [self._stored(key) if (reader := readers(key)) is None else reader(snapshot) for key in keyList]

    @remote("v(sm)")
    def insertData(self, key: str, value: Any) -> None:
        """Stores a value without raising an event. Ignored for keys of the body, which are computed."""
        self._store(key, value, self._admitted(key, value))

    @remote("v(m)")
    def insertListData(self, list: Any) -> None:
        """Stores many values: [[key, value], ...]."""
        pairs = _pairs(list)
        for key, value in pairs:
            self.insertData(key, value)

    @remote("v(s)")
    def removeData(self, key: str) -> None:
        """Removes a value."""
        with self._lock:
            entry = self._entries.pop(key, None)
            if entry is None:
                raise ServiceError(f"data not found for key '{shown(key)[1:-1]}'")
            self._bytes -= entry.weight
            self._weigh_history(key)
        self._report(_KEY_REMOVED, key)

    @remote("[s](s)")
    def getDataList(self, filter: str) -> list[str]:
        """Lists the keys that contain `filter`."""
        return [key for key in self.getDataListName() if filter in key]

    @remote("[s]()")
    def getDataListName(self) -> list[str]:
        """Lists all keys."""
        with self._lock:
            return sorted({*self._body, *self._entries, *self._topics})

    @remote("s(s)")
    def getType(self, key: str) -> str:
        """Returns the type of a key's value: Data, Event or MicroEvent."""
        if key in self._micro_events:
            return "MicroEvent"
        if key in self._topics:
            return "Event"
        if self._known(key):
            return "Data"
        raise ServiceError(f"data not found for key '{shown(key)[1:-1]}'")

    @remote("m(s)")
    def getTimestamp(self, key: str) -> list:
        """Returns [value, seconds, microseconds] of the last change."""
        if not self._known(key):
            raise ServiceError(f"data not found for key '{shown(key)[1:-1]}'")
        snapshot = self._snapshot()
        if key in self._body:
            return [self._body[key](snapshot), *split_stamp(snapshot.stamp)]
        entry = self._entries.get(key, _Entry())
        return [entry.value, *split_stamp(entry.stamp)]

    @remote("v(ss)")
    def setDescription(self, name: str, description: str) -> None:
        """Describes a key."""
        if len(description) > _MAX_LETTERS:
            raise ServiceError(f"a description has at most {_MAX_LETTERS} letters")
        with self._lock:
            self._entry(name).description = description

    @remote("m([s])")
    def getDescriptionList(self, keylist: list[str]) -> list:
        """Returns [[key, type, description], ...], of all keys if the list is empty."""
        keys = keylist or self.getDataListName()
        return [[key, self.getType(key), self._entries.get(key, _Entry()).description] for key in keys]

    # --- events ------------------------------------------------------------------------------------------------------

    @remote("v(sm)")
    def raiseEvent(self, name: str, value: Any) -> None:
        """Stores a value and calls every subscriber."""
        self._announce(name, value, self._admitted(name, value))

    @remote("v(sm)")
    def raiseMicroEvent(self, name: str, value: Any) -> None:
        """Like raiseEvent; on a robot it is delivered once per value change."""
        self.raiseEvent(name, value)
        self._micro_events.add(name)

    @remote("v(s)", "v(ss)")
    def declareEvent(self, eventName: str, extractorName: str = "") -> None:
        """Makes an event known before it is first raised."""
        self.declare([eventName], extractorName)

    @remote("o(s)")
    def subscriber(self, eventName: str) -> Any:
        """Returns an object whose signal `signal` fires with each value."""
        with self._lock:
            self._make_room(eventName)
            return self._topics.setdefault(eventName, Topic()).event.subscriber

    @remote("v(s)")
    def removeMicroEvent(self, name: str) -> None:
        """Forgets a micro-event and who has subscribed to it."""
        with self._lock:
            if name not in self._micro_events:
                raise ServiceError(f"there is no micro-event '{shown(name)[1:-1]}'")
            self._micro_events.discard(name)
            self._bytes -= self._entries.pop(name, _Entry()).weight
            self._past -= self._topics.pop(name, Topic()).past

    @remote("[s]()")
    def getEventList(self) -> list[str]:
        """Lists the events."""
        with self._lock:
            return sorted(set(self._topics) - self._micro_events)

    @remote("[s]()")
    def getMicroEventList(self) -> list[str]:
        """Lists the micro-events."""
        return sorted(self._micro_events)

    @remote("[s](s)")
    def getExtractorEvent(self, extractorName: str) -> list[str]:
        """Lists the events an extractor declares."""
        with self._lock:
            return sorted(name for name, topic in self._topics.items() if topic.extractor == extractorName)

    @remote("m(s)")
    def getEventHistory(self, key: str) -> list:
        """Returns the last values: [[value, [seconds, microseconds], 0, 0], ...]."""
        with self._lock:
            history = list(self._topics.get(key, Topic()).history)
        return [[value, split_stamp(stamp), 0, 0] for value, stamp, _ in history]

    # --- inside ------------------------------------------------------------------------------------------------------

    def _report(self, event: str, key: str) -> None:
        """Raise an event about a key; it leaves no value behind."""
        topic = self._topics[event]
        topic.event.signal(key)
        self._subscriptions.call(event, topic, key)

    def _admitted(self, key: str, value: Any) -> int:
        """Return the size of a value that a client stores [bytes].

        Raises:
            ServiceError: There is no room for it.
        """
        size = size_of(value)
        weight, known = weight_of(size), self._entries.get(key)
        more = weight - (known.weight if known is not None else 0)
        if weight and more > 0 and self._bytes + more > _MAX_BYTES:
            raise ServiceError(f"the memory is full ({_MAX_BYTES >> 20} MB)")
        return size

    def _store(self, key: str, value: Any, size: int) -> None:
        weight = weight_of(size)
        with self._lock:
            known = key in self._entries
            entry = self._entry(key)
            self._bytes += weight - entry.weight
            before, entry.value, entry.stamp, entry.weight = entry.value, value, time.time(), weight
            self._weigh_history(key)
        if not known:
            self._report(_KEY_ADDED, key)
        elif before is not None and value is not None and type(before) is not type(value):
            self._report(_KEY_TYPE_CHANGED, key)

    def _announce(self, key: str, value: Any, size: int) -> None:
        self._store(key, value, size)
        with self._lock:
            topic = self._topics.setdefault(key, Topic())
            topic.history.append((value, time.time(), size))
            self._weigh_history(key)
        topic.event.signal(value)
        self._subscriptions.call(key, topic, value)

    def _weigh_history(self, key: str) -> None:
        """Count what an event's history holds besides the present value of its key, which is counted there, and forget
        old values that are too large. Under the lock."""
        topic = self._topics.get(key)
        if topic is None or not topic.history:
            return
        present, history = self._stored(key), topic.history
        weights = deque(MOMENT + (0 if value is present else size) for value, _, size in history)
        past, others = sum(weights), self._past - topic.past
        fewest = 1 if history[-1][0] is present else 0
        while len(history) > fewest and (past > _MAX_HISTORY_BYTES or others + past > _MAX_HISTORIES_BYTES):
            history.popleft()
            past -= weights.popleft()
        topic.past, self._past = past, others + past

    def _stored(self, key: str) -> Any:
        entry = self._entries.get(key)
        return entry.value if entry is not None else None

    def _known(self, key: str) -> bool:
        return key in self._body or key in self._entries

    def _entry(self, key: str) -> _Entry:
        self._make_room(key)
        return self._entries.setdefault(key, _Entry())

    def _make_room(self, key: str) -> None:
        if len(key) > _MAX_LETTERS:
            raise ServiceError(f"a key has at most {_MAX_LETTERS} letters")
        if key not in self._entries and len(self._entries) + len(self._topics) >= _MAX_KEYS:
            raise ServiceError(f"the memory is full ({_MAX_KEYS} keys)")


def _pairs(value: Any) -> list[tuple[str, Any]]:
    if not isinstance(value, list | tuple):
        raise ServiceError(f"list must be [[key, value], ...], got {shown(value)}")
    for pair in value:
        if not isinstance(pair, list | tuple) or len(pair) != 2 or not isinstance(pair[0], str):
            raise ServiceError(f"list must be [[key, value], ...], got {shown(pair)} in it")
    return [(key, item) for key, item in value]
