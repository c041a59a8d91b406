"""ALKnowledge: an ontology of triples, subject, predicate and object, each in the domain of its predicate.

Triples of one domain may have metadata, and two of these act by themselves: expirationDate removes the triple when that
time has come, happeningDate adds it. "*" stands for anything, "?" for what a query asks for.
Source: NAOqi 2.8 documentation, ALKnowledge.
"""

from __future__ import annotations

import datetime
import itertools
import sys
import threading
from collections.abc import Iterator

from pepper_sim.naoqi.service import Service, ServiceError, remote, shown

LEARNING = "com.aldebaran.learning"
"""The domain whose triples may have metadata."""
EXPIRATION, HAPPENING = "expirationDate", "happeningDate"
_DATE = "%Y-%m-%dT%H:%M:%SZ"
_ANY, _ASKED = "*", "?"
_MOST_BYTES = 64 << 20
"""Of all triples, metadata and numbers: some hundred thousand of usual length."""
_OVERHEAD = 200
"""Of each of them, besides its words [bytes]."""

Triple = tuple[str, str, str, str]
"""Domain, subject, predicate, object."""


class ALKnowledge(Service):
    """Stores triples as long as the simulation runs."""

    name = "ALKnowledge"

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._triples: dict[Triple, None] = {}
        self._metadata: dict[Triple, dict[tuple[str, str], None]] = {}
        self._numbers: dict[Triple, str] = {}
        self._next = itertools.count(1)
        self._bytes = 0
        """At least what is held: what is removed is only noticed when this reaches its limit."""
        self._removed = False
        """Whether anything was, since this was counted."""

    # --- triples -----------------------------------------------------------------------------------------------------

    @remote("v(ssss)")
    def add(self, domain: str, subject: str, predicate: str, object: str) -> None:
        """Adds a triple."""
        self._insert(_plain(domain, subject, predicate, object))

    @remote("v(ssss)")
    def update(self, domain: str, subject: str, predicate: str, object: str) -> None:
        """Adds a triple in place of all with this subject and predicate."""
        self.remove(domain, subject, predicate, _ANY)
        self.add(domain, subject, predicate, object)

    @remote("v(ssss)")
    def remove(self, domain: str, subject: str, predicate: str, object: str) -> None:
        """Removes the triples that match. Their metadata stay."""
        found = self._matching(domain, subject, predicate, object)
        with self._lock:
            for triple in found:
                self._triples.pop(triple, None)
                self._removed = True

    @remote("b(ssss)")
    def contains(self, domain: str, subject: str, predicate: str, object: str) -> bool:
        """Whether a triple matches."""
        return bool(self._matching(domain, subject, predicate, object))

    @remote("v(s)")
    def resetKnowledge(self, domain: str) -> None:
        """Removes everything of a domain, metadata included."""
        with self._lock:
            self._triples = {triple: None for triple in self._triples if triple[0] != domain}
            self._metadata = {triple: held for triple, held in self._metadata.items() if triple[0] != domain}
            self._numbers = {triple: number for triple, number in self._numbers.items() if triple[0] != domain}
            self._removed = True

    @remote("[s](sss)")
    def getSubject(self, domain: str, predicate: str, object: str) -> list[str]:
        """Lists the subjects with this predicate and object."""
        return [triple[1] for triple in self._matching(domain, _ANY, predicate, object)]

    @remote("[s](sss)")
    def getPredicate(self, domain: str, subject: str, object: str) -> list[str]:
        """Lists the predicates between a subject and an object."""
        return [triple[2] for triple in self._matching(domain, subject, _ANY, object)]

    @remote("[s](sss)")
    def getObject(self, domain: str, subject: str, predicate: str) -> list[str]:
        """Lists the objects of a subject and predicate."""
        return [triple[3] for triple in self._matching(domain, subject, predicate, _ANY)]

    @remote("[s](ssss)")
    def query(self, domain: str, subject: str, predicate: str, object: str) -> list[str]:
        """Lists what stands in the place of the one "?"."""
        wanted = (subject, predicate, object)
        if wanted.count(_ASKED) != 1:
            raise ServiceError(f"one of subject, predicate and object must be '?', got {shown(list(wanted))}")
        place = wanted.index(_ASKED)
        found = self._matching(domain, *(_ANY if word == _ASKED else word for word in wanted))
        return list(dict.fromkeys(triple[1 + place] for triple in found))

    # --- metadata ----------------------------------------------------------------------------------------------------

    @remote("b(ssssss)")
    def addMetadata(
        self, domain: str, subject: str, predicate: str, object: str, metadataName: str, metadataValue: str
    ) -> bool:
        """Adds metadata of a triple, which need not exist; false if the domain takes none."""
        if domain != LEARNING:
            return False
        triple = _plain(domain, subject, predicate, object)
        with self._lock:
            if (metadataName, metadataValue) not in self._metadata.get(triple, {}):
                self._make_room(*triple, metadataName, metadataValue)
                self._metadata.setdefault(triple, {})[metadataName, metadataValue] = None
        return True

    @remote("b(ssssss)")
    def updateMetadata(
        self, domain: str, subject: str, predicate: str, object: str, metadataName: str, metadataValue: str
    ) -> bool:
        """Adds metadata of a triple in place of all of this name."""
        self.removeMetadata(domain, subject, predicate, object, metadataName, _ANY)
        return self.addMetadata(domain, subject, predicate, object, metadataName, metadataValue)

    @remote("b(ssssss)")
    def containsMetadata(
        self, domain: str, subject: str, predicate: str, object: str, metadataName: str, metadataValue: str
    ) -> bool:
        """Whether metadata match."""
        return any(self._metadata_of((domain, subject, predicate, object), metadataName, metadataValue))

    @remote("b(ssssss)")
    def removeMetadata(
        self, domain: str, subject: str, predicate: str, object: str, metadataName: str, metadataValue: str
    ) -> bool:
        """Removes the metadata that match."""
        found = list(self._metadata_of((domain, subject, predicate, object), metadataName, metadataValue))
        with self._lock:
            for triple, pair in found:
                self._metadata.get(triple, {}).pop(pair, None)
                self._removed = True
            self._drop_empty()
        return True

    @remote("[s](sssss)")
    def queryMetadata(self, domain: str, subject: str, predicate: str, object: str, metadataName: str) -> list[str]:
        """Lists the values of metadata of a name."""
        return [pair[1] for _, pair in self._metadata_of((domain, subject, predicate, object), metadataName, _ANY)]

    @remote("[[s]](ssssss)")
    def queryTriplet(
        self, domain: str, subject: str, predicate: str, object: str, metadataName: str, metadataValue: str
    ) -> list[list[str]]:
        """Lists the triples that match and have such metadata: [domain, subject, predicate, object]."""
        found = self._metadata_of((domain, subject, predicate, object), metadataName, metadataValue)
        return [list(triple) for triple in dict.fromkeys(triple for triple, _ in found) if self._has(triple)]

    @remote("[[s]](ssssssb)")
    def queryTripletWithMetadata(
        self,
        domain: str,
        subject: str,
        predicate: str,
        object: str,
        metadataName: str,
        metadataValue: str,
        tripleExist: bool,
    ) -> list[list[str]]:
        """Lists metadata that match with their triples: [domain, subject, predicate, object, name, value].

        Without `tripleExist` those of triples that are gone, too.
        """
        found = self._metadata_of((domain, subject, predicate, object), metadataName, metadataValue)
        return [[*triple, *pair] for triple, pair in found if not tripleExist or self._has(triple)]

    @remote("s(ssssss)")
    def getId(
        self, domain: str, subject: str, predicate: str, object: str, metadataName: str, metadataValue: str
    ) -> str:
        """Returns the number of the first triple that matches and has such metadata; "*" asks for none."""
        found = self._matching(domain, subject, predicate, object)
        if (metadataName, metadataValue) != (_ANY, _ANY):
            having = {triple for triple, _ in self._metadata_of((domain, *_ANY * 3), metadataName, metadataValue)}
            found = [triple for triple in found if triple in having]
        if not found:
            raise ServiceError("no triple matches")
        with self._lock:
            if found[0] not in self._numbers:
                self._make_room(*found[0])
                self._numbers[found[0]] = str(next(self._next))
            return self._numbers[found[0]]

    @remote("[s](ss)")
    def getTripletFromId(self, domain: str, tripleId: str) -> list[str]:
        """Returns [subject, predicate, object] of a number that getId answered."""
        for triple, number in list(self._numbers.items()):
            if number == tripleId and triple[0] == domain:
                return list(triple[1:])
        raise ServiceError(f"there is no triple {shown(tripleId)}")

    @remote("v(sssss)")
    def addExpirationDate(self, domain: str, subject: str, predicate: str, object: str, expirationDate: str) -> None:
        """Adds a triple and when it is to be removed; ignored if that is no date such as 2030-01-31T12:00:00Z."""
        self._add_date(EXPIRATION, (domain, subject, predicate, object), expirationDate)

    @remote("v(sssss)")
    def updateExpirationDate(self, domain: str, subject: str, predicate: str, object: str, expirationDate: str) -> None:
        """Like addExpirationDate, in place of an earlier date."""
        self._add_date(EXPIRATION, (domain, subject, predicate, object), expirationDate, replace=True)

    @remote("v(sssss)")
    def addHappeningDate(self, domain: str, subject: str, predicate: str, object: str, happeningDate: str) -> None:
        """Tells when a triple is to be added; ignored if that is no date such as 2030-01-31T12:00:00Z."""
        self._add_date(HAPPENING, (domain, subject, predicate, object), happeningDate)

    @remote("v(sssss)")
    def updateHappeningDate(self, domain: str, subject: str, predicate: str, object: str, happeningDate: str) -> None:
        """Like addHappeningDate, in place of an earlier date."""
        self._add_date(HAPPENING, (domain, subject, predicate, object), happeningDate, replace=True)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _add_date(self, name: str, triple: Triple, date: str, *, replace: bool = False) -> None:
        if _time(date) is None:
            return
        (self.updateMetadata if replace else self.addMetadata)(*triple, name, date)
        if name == EXPIRATION:
            self.add(*triple)

    def _insert(self, triple: Triple) -> None:
        with self._lock:
            if triple not in self._triples:
                self._make_room(*triple)
                self._triples[triple] = None

    def _make_room(self, *words: str) -> None:
        """Count what is about to be added.

        Raises:
            ServiceError: There is no room for it.
        """
        more = _size(words)
        if self._bytes + more > _MOST_BYTES and self._removed:
            self._removed = False
            self._bytes = sum(map(_size, (*self._triples, *self._numbers)))
            self._bytes += sum(_size((*triple, *pair)) for triple, pairs in self._metadata.items() for pair in pairs)
        if self._bytes + more > _MOST_BYTES:
            raise ServiceError(f"the knowledge is full ({_MOST_BYTES >> 20} MB)")
        self._bytes += more

    def _drop_empty(self) -> None:
        self._metadata = {triple: pairs for triple, pairs in self._metadata.items() if pairs}

    def _has(self, triple: Triple) -> bool:
        return triple in self._triples

    def _matching(self, *wanted: str) -> list[Triple]:
        """Return the triples that match, after what dates say has been done."""
        self._follow_dates()
        with self._lock:
            return [triple for triple in self._triples if _matches(triple, wanted)]

    def _metadata_of(self, wanted: Triple, name: str, value: str) -> Iterator[tuple[Triple, tuple[str, str]]]:
        self._follow_dates()
        with self._lock:
            held = [(triple, pair) for triple, pairs in self._metadata.items() for pair in pairs]
        return ((triple, pair) for triple, pair in held if _matches((*triple, *pair), (*wanted, name, value)))

    def _follow_dates(self) -> None:
        """Add and remove the triples whose time has come; whoever asks sees them so."""
        now = datetime.datetime.now(datetime.UTC)
        with self._lock:
            for triple, pairs in self._metadata.items():
                for name, date in [pair for pair in pairs if pair[0] in (EXPIRATION, HAPPENING)]:
                    due = _time(date)
                    if due is not None and due <= now:
                        del pairs[name, date]
                        self._removed = True
                        if name == HAPPENING:
                            self._triples[triple] = None
                        else:
                            self._triples.pop(triple, None)
            if not all(self._metadata.values()):
                self._drop_empty()


def _plain(domain: str, subject: str, predicate: str, object: str) -> Triple:
    """Return a triple that can be stored."""
    for word in (domain, subject, predicate, object):
        if word in (_ANY, _ASKED, ""):
            raise ServiceError(f"a triple cannot hold {shown(word)}")
    return domain, subject, predicate, object


def _size(words: tuple[str, ...]) -> int:
    """Return about how many bytes words take that are held together."""
    return _OVERHEAD + sum(map(sys.getsizeof, words))


def _matches(words: tuple[str, ...], wanted: tuple[str, ...]) -> bool:
    return all(want in (_ANY, word) for word, want in zip(words, wanted, strict=True))


def _time(date: str) -> datetime.datetime | None:
    try:
        return datetime.datetime.strptime(date, _DATE).replace(tzinfo=datetime.UTC)
    except ValueError:
        return None
