"""ALDialog: topics in QiChat, and the answers to what `forceInput` and people in the room say.

A topic comes from the robot's disk or from text; "include:" takes files from the same folder. Not there: %script, ^wiki
and topics before or after others (^preProcess).
"""

from __future__ import annotations

import concurrent.futures
import logging
import time
from pathlib import Path
from typing import Any

from pepper_sim.dialog.conversation import Conversation, Reaction
from pepper_sim.dialog.nodes import Topic
from pepper_sim.dialog.reader import read_topic
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.dialog_concepts import DialogConcepts
from pepper_sim.naoqi.dialog_fallbacks import DialogFallbacks
from pepper_sim.naoqi.dialog_knowledge import DialogKnowledge
from pepper_sim.naoqi.dialog_settings import DialogSettings, known_language
from pepper_sim.naoqi.dialog_topics import DialogTopics
from pepper_sim.naoqi.dialog_turns import DialogTurns, as_text
from pepper_sim.naoqi.dialog_users import DialogUsers
from pepper_sim.naoqi.installed_packages import InstalledPackages
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown
from pepper_sim.naoqi.speech_languages import LANGUAGES, PREFERRED
from pepper_sim.naoqi.tasks import Alarm, Workers
from pepper_sim.services.al_animated_speech import ALAnimatedSpeech
from pepper_sim.services.al_knowledge import ALKnowledge
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_speech_recognition import CONFIDENCE, ALSpeechRecognition
from pepper_sim.services.al_text_to_speech import ALTextToSpeech

log = logging.getLogger(__name__)


class ALDialog(Module):
    """Talks with humans by the rules of topics."""

    name = "ALDialog"

    def __init__(
        self,
        memory: ALMemory,
        speech: ALAnimatedSpeech,
        voice: ALTextToSpeech,
        recognition: ALSpeechRecognition,
        disk: RobotDisk,
        packages: InstalledPackages,
        knowledge: ALKnowledge,
        clients: ClientServices,
        workers: Workers,
        alarm: Alarm,
    ) -> None:
        self._memory = memory
        self._speech = speech
        self._voice = voice
        self._recognition = recognition
        self._disk = disk
        self._packages = packages
        self._users = DialogUsers(memory)
        self._conversation = Conversation(
            lambda name: as_text(memory.read(name)),
            self._users.write,
            self._users.info,
            knowledge=DialogKnowledge(knowledge),
        )
        self._turns = DialogTurns(self._conversation, memory, workers, alarm, clients, self._say, voice.stopAll)
        self._fallbacks = DialogFallbacks(self._conversation, clients)
        self._turns.answer_otherwise = self._fallbacks.answer
        self._concepts = DialogConcepts(self._conversation, self._turns.lock)
        self._subscribers: set[str] = set()
        self._collaborative: list[str] | None = None
        self._topics = DialogTopics(disk, self._conversation, self._turns.lock)
        self._settings = DialogSettings(memory, self._turns, self._users)
        for key, value in (("Dialog/RobotModel", "juliette"), ("Dialog/RobotName", "pepper"), ("Dialog/TalkTime", "0")):
            memory.store(key, value)
        for language in LANGUAGES:
            memory.store(f"Dialog/Language/{language}", 1)
        recognition.on_sentence(self._listen)

    def parts(self) -> tuple[Any, ...]:
        return self, self._settings, self._concepts, self._fallbacks

    def close(self) -> None:
        self._turns.close()

    # --- language ----------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def setLanguage(self, language: str) -> None:
        """Sets the language of dialogue, recognition and speech."""
        self._conversation.language = self._settings.language = known_language(language)
        self._recognition.setLanguage(self._conversation.language)
        self._voice.setLanguage(self._conversation.language)
        self._turns.follow()

    @remote("s()")
    def getLanguage(self) -> str:
        """Returns the language."""
        return self._conversation.language

    @remote("v()")
    def resetLanguage(self) -> None:
        """Goes back to the robot's preferred language."""
        self.setLanguage(PREFERRED)

    # --- topics ------------------------------------------------------------------------------------------------------

    @remote("s(s)")
    def loadTopic(self, topicPath: str) -> str:
        """Loads a topic from the robot's disk and returns its name. A relative path begins at the applications."""
        return self._load(*self._topics.read(topicPath))

    @remote("s(s)")
    def loadTopicContent(self, topicContent: str) -> str:
        """Loads a topic from its text and returns its name."""
        return self._load(read_topic(topicContent), None)

    @remote("v(s)")
    def unloadTopic(self, topicName: str) -> None:
        """Unloads a topic in every language."""
        self._topics.unload(self._topics.known(topicName))
        self._turns.follow()

    @remote("[s]()")
    def getAllLoadedTopics(self) -> list[str]:
        """Lists the topics of all languages."""
        return self._conversation.loaded()

    @remote("[s](s)")
    def getLoadedTopics(self, language: str) -> list[str]:
        """Lists the topics of a language."""
        return self._conversation.loaded(known_language(language))

    @remote("v(s)")
    def activateTopic(self, topicName: str) -> None:
        """Lets a topic answer, and those that it includes."""
        with self._turns.lock:
            for name in self._topics.with_included(self._topics.known(topicName)):
                self._conversation.activate(name)
                self._memory.announce("Dialog/ActivateTopic", name)
        self._turns.follow()

    @remote("v(s)")
    def deactivateTopic(self, topicName: str) -> None:
        """Lets a topic answer no more."""
        with self._turns.lock:
            for name in self._topics.with_included(self._topics.known(topicName)):
                self._conversation.deactivate(name)
                self._memory.announce("Dialog/DeactivateTopic", name)
        self._turns.follow()

    @remote("[s]()")
    def getActivatedTopics(self) -> list[str]:
        """Lists the active topics of the present language."""
        return [topic.name for topic in self._conversation.active]

    @remote("[s]([s])")
    def runTopics(self, topicsPathName: list[str]) -> list[str]:
        """Loads and activates topics and starts the dialogue; returns their names."""
        read = [self._topics.read(path) for path in topicsPathName]
        names = [self._load(*topic) for topic in read]
        for name in names:
            self.activateTopic(name)
            self.subscribe(f"runTopics/{name}")
        return names

    @remote("v([s])")
    def stopTopics(self, topicsName: list[str]) -> None:
        """Ends what runTopics has started."""
        for name in [self._topics.known(name) for name in topicsName]:
            self.unsubscribe(f"runTopics/{name}")
            self.deactivateTopic(name)
            self.unloadTopic(name)

    @remote("v()")
    def compileAll(self) -> None:
        """Prepares the recognition for the loaded topics. Topics are ready as soon as they are loaded."""

    # --- running -----------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def subscribe(self, subscriberName: str) -> None:
        """Starts the dialogue for a program."""
        self._subscribers.add(subscriberName)
        self._report_running()

    @remote("v(s)")
    def unsubscribe(self, subscriberName: str) -> None:
        """Ends the dialogue for a program; it stops with the last one."""
        self._subscribers.discard(subscriberName)
        self._report_running()

    @remote("v()")
    def runDialog(self) -> None:
        """Starts the topics of the installed packages."""
        if self._collaborative is None:
            read = self._topics.collaborative(self._packages.packages)
            self._collaborative = [
                self._load(*found) for found in read if found[0].language in ("", self.getLanguage())
            ]
            for name in self._collaborative:
                self.activateTopic(name)
            self._memory.announce("Dialog/MainDialogStarted", 1)
            self.subscribe("runDialog")

    @remote("v()")
    def stopDialog(self) -> None:
        """Ends what runDialog has started."""
        if self._collaborative is not None:
            self.unsubscribe("runDialog")
            for name in self._collaborative:
                if name in self._conversation.loaded():
                    self.unloadTopic(name)
            self._collaborative = None
            self._memory.announce("Dialog/MainDialogStarted", 0)

    @remote("v(s)")
    def forceInput(self, input: str) -> concurrent.futures.Future:
        """Acts as if a human had said a sentence; ends when the robot has answered."""
        return self._turns.sentence(input)

    @remote("v(s)")
    def tell(self, sentence: str) -> concurrent.futures.Future:
        """Older name of forceInput."""
        return self._turns.sentence(sentence)

    @remote("v()")
    def forceOutput(self) -> concurrent.futures.Future:
        """Says the next proposal of the topic that has the focus; ends when it has been said."""
        return self._turns.ask(self._conversation.propose)

    @remote("v(ss)")
    def say(self, topicPathAndName: str, tagName: str) -> concurrent.futures.Future:
        """Says the sentence of a topic that has a tag; the conversation stays as it is."""
        topic, _ = self._topics.read(topicPathAndName)
        apart = Conversation(lambda name: as_text(self._memory.read(name)), self._users.write, self._users.info)
        apart.language = self.getLanguage()
        topic.language = apart.language
        apart.add(topic)
        apart.activate(topic.name)
        reaction = apart.tagged(topic.name, tagName)
        if reaction is None:
            raise ServiceError(f"topic '{topic.name}' has no sentence with the tag '{shown(tagName)[1:-1]}'")
        return self._turns.ask(lambda: Reaction(reaction.answer))

    @remote("v()")
    def startPush(self) -> None:
        """Adds a proposal to every answer."""
        self._conversation.pushing = True

    @remote("v()")
    def stopPush(self) -> None:
        """Adds no proposals to answers."""
        self._conversation.pushing = False

    @remote("v()")
    def resetAll(self) -> None:
        """Makes all proposals new again and leaves the scopes; topics stay loaded."""
        with self._turns.lock:
            self._conversation.reset()

    # --- focus and tags ----------------------------------------------------------------------------------------------

    @remote("v(s)")
    def setFocus(self, topicName: str) -> None:
        """Gives a topic the focus: its rules come first, and its proposals are said."""
        with self._turns.lock:
            self._conversation.set_focus(self._topics.known(topicName))
        self._turns.report_focus()

    @remote("s()")
    def getFocus(self) -> str:
        """Returns the topic that has the focus."""
        return self._conversation.focus

    @remote("v(ss)")
    def gotoTag(self, tagName: str, topicName: str) -> concurrent.futures.Future:
        """Gives a topic the focus and says its sentence with a tag; ends when it has been said."""
        self.setFocus(topicName)
        return self._turns.ask(lambda: self._conversation.tagged(topicName, tagName))

    @remote("v(s)")
    def gotoTopic(self, topicName: str) -> concurrent.futures.Future:
        """Gives a topic the focus and says its next proposal; ends when it has been said."""
        self.setFocus(topicName)
        return self._turns.ask(lambda: self._conversation.propose(topicName))

    @remote("v(ss)")
    def activateTag(self, tagName: str, topicName: str) -> None:
        """Makes the rules and sentences with a tag usable."""
        self._conversation.set_tag(self._topics.known(topicName), tagName, True)

    @remote("v(ss)")
    def deactivateTag(self, tagName: str, topicName: str) -> None:
        """Makes the rules and sentences with a tag unusable."""
        self._conversation.set_tag(self._topics.known(topicName), tagName, False)

    # --- what topics hold --------------------------------------------------------------------------------------------

    @remote("v(sss)")
    def generateSentences(self, destination: str, topic: str, language: str) -> None:
        """Writes every sentence that a topic's rules wait for into a file on the robot's disk, one a line."""
        found = self._conversation.find(self._topics.known(topic), known_language(language))
        if found is None:
            raise ServiceError(f"topic '{topic}' is not loaded in {shown(language)[1:-1]}")
        sentences = self._conversation.sentences(found)
        path = self._disk.output(destination)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(f"{sentence}\n" for sentence in sentences), encoding="utf-8")

    @remote("[s](sss)")
    def setVariablePath(self, topicName: str, eventName: str, path: str) -> list[str]:
        """Gives an event of a topic another name in ALMemory; returns the names that the topic waits for."""
        with self._turns.lock:
            self._conversation.renamed[self._topics.known(topicName), eventName] = path
        self._turns.follow()
        return sorted(self._conversation.events)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _load(self, topic: Topic, path: Path | None) -> str:
        name = self._topics.load(topic, path)
        self._turns.follow()
        return name

    def _report_running(self) -> None:
        running = bool(self._subscribers)
        if running != self._turns.running:
            self._turns.running = running
            self._recognition.serve_dialog(running)
            self._memory.announce("Dialog/IsStarted", int(running))

    def _say(self, text: str) -> concurrent.futures.Future | None:
        return self._speech.say(text, self._settings.speech or None)

    def _listen(self, text: str) -> None:
        """Answer what a person in the room has said."""
        self._memory.store("Dialog/TalkTime", str(int(time.monotonic() - self._settings.talking_since)))
        if not self._turns.running or self._settings.getASRConfidenceThreshold() > CONFIDENCE:
            return
        try:
            self._turns.sentence(text)
        except ServiceError as error:
            log.warning("what was said is lost: %s", error)
