"""The topics of ALDialog: read from the robot's disk or from text, with the files that they include."""

from __future__ import annotations

import logging
import threading
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path

from pepper_sim.dialog import lexicon
from pepper_sim.dialog.answers import unknown_functions
from pepper_sim.dialog.conversation import Conversation
from pepper_sim.dialog.nodes import Topic, TopicError
from pepper_sim.dialog.reader import read_topic
from pepper_sim.disk import APPS, RobotDisk
from pepper_sim.naoqi.installed_packages import Package
from pepper_sim.naoqi.service import ServiceError, shown

log = logging.getLogger(__name__)

MAX_INCLUDES = 50


class DialogTopics:
    """Loads and unloads the topics of a conversation.

    Args:
        lock: Held while the conversation is used.
    """

    def __init__(self, disk: RobotDisk, conversation: Conversation, lock: threading.RLock) -> None:
        self._disk = disk
        self._conversation = conversation
        self._lock = lock
        self._includes: dict[str, list[str]] = {}
        folder = disk.path(lexicon.FOLDER)
        folder.mkdir(parents=True)
        for name, text in lexicon.files().items():
            (folder / name).write_text(text, encoding="utf-8")

    def read(self, name: str) -> tuple[Topic, Path]:
        """Return a topic of the robot's disk, and where it is on this machine.

        Args:
            name: A path of the robot's; a relative one begins at the applications.
        Raises:
            ServiceError: There is no such file, or it cannot be read; the text names line and column.
        """
        path = self._disk.path(name if name.startswith("/") else f"{APPS}/{name}")
        if not path.is_file():
            raise ServiceError(f"topic file '{shown(name)[1:-1]}' was not found")
        return _read(path, name), path

    def collaborative(self, packages: Iterable[Package]) -> list[tuple[Topic, Path]]:
        """Return the topics that packages name in their manifests, <dialogContent path="folder/name.dlg"/>.

        Raises: ServiceError: See `read`.
        """
        found = []
        for package in packages:
            root = ElementTree.parse(package.folder / "manifest.xml").getroot()
            for content in root.iterfind("contents/dialogContent"):
                folder = self._disk.path(f"{APPS}/{package.uuid}/{content.get('path', '')}").parent
                found += [(_read(path, path.name), path) for path in sorted(folder.glob("*.top"))]
        return found

    def load(self, topic: Topic, path: Path | None = None) -> str:
        """Load a topic with all that it includes, or nothing if one of them cannot be read; return its name.

        Raises: ServiceError: See `read`.
        """
        topics, waiting, seen = [topic], [(include, path) for include in topic.includes], set()
        while waiting:
            name, origin = waiting.pop(0)
            found = self._included(name, origin)
            if found in seen:
                continue
            seen.add(found)
            if len(topics) > MAX_INCLUDES:
                raise ServiceError(f"more than {MAX_INCLUDES} files are included")
            topics.append(_read(found, name))
            waiting += [(inner, found) for inner in topics[-1].includes]
        for each in topics:
            if unknown := unknown_functions(each):
                log.warning("topic %s: sentences with ^%s are not said", each.name, ", ^".join(unknown))
        with self._lock:
            for each in topics:
                self._conversation.add(each)
            self._includes[topic.name] = [each.name for each in topics[1:]]
        return topic.name

    def unload(self, name: str) -> None:
        """Unload a topic with all that it includes.

        Raises: ServiceError: It is included itself.
        """
        with self._lock:
            if any(name in included for included in self._includes.values()):
                raise ServiceError(f"topic '{name}' is included by another one and cannot be unloaded")
            gone = self.with_included(name)
            self._includes.pop(name, None)
            needed = {each for included in self._includes.values() for each in included}
            for each in gone:
                if each not in needed:
                    self._conversation.remove(each)

    def with_included(self, name: str) -> list[str]:
        """Return the names of a topic and of those that it includes."""
        return [name, *self._includes.get(name, [])]

    def known(self, name: str) -> str:
        """Return the name of a loaded topic.

        Raises: ServiceError: There is none.
        """
        if name not in self._conversation.loaded():
            raise ServiceError(f"topic '{shown(name)[1:-1]}' is not loaded")
        return name

    def _included(self, name: str, origin: Path | None) -> Path:
        self._disk.path(name)
        places = [origin.parent / name] if origin is not None else []
        places += [self._disk.path(f"{folder}/{name}") for folder in (APPS, lexicon.FOLDER)]
        found = next((place for place in places if place.is_file()), None)
        if found is None:
            raise ServiceError(f"included file '{shown(name)[1:-1]}' was not found")
        return found


def _read(path: Path, name: str) -> Topic:
    try:
        return read_topic(path.read_text(encoding="utf-8"))
    except TopicError as error:
        raise ServiceError(f"{shown(name)[1:-1]}: {error}") from None
    except UnicodeDecodeError as error:
        raise ServiceError(f"{shown(name)[1:-1]} is no text in UTF-8: {error.reason}") from None
