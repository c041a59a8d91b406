"""The services that ALDialog asks for an answer to what no rule understands."""

from __future__ import annotations

import contextlib
import logging

from pepper_sim.dialog.conversation import Conversation
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.dialog_settings import known_language
from pepper_sim.naoqi.service import remote

log = logging.getLogger(__name__)

METHOD = "findOutput"
"""What a service is asked by: METHOD(language, input) returns the answer, or nothing."""


class DialogFallbacks:
    """Remote methods of ALDialog."""

    def __init__(self, conversation: Conversation, clients: ClientServices) -> None:
        self._conversation = conversation
        self._clients = clients
        self._fallbacks: dict[str, list[str]] = {}

    @remote("s(ss)")
    def addFallback(self, language: str, serviceName: str) -> str:
        """Asks a service's findOutput(language, input) for the answer to what no rule understands."""
        services = self._fallbacks.setdefault(known_language(language), [])
        if serviceName not in services:
            services.append(serviceName)
        return serviceName

    @remote("s(ss)")
    def removeFallback(self, language: str, serviceName: str) -> str:
        """Asks a service no more."""
        with contextlib.suppress(ValueError):
            self._fallbacks.get(known_language(language), []).remove(serviceName)
        return serviceName

    def answer(self, text: str) -> str:
        """Return the first answer that a service has in the language of the conversation; empty without one."""
        for service in list(self._fallbacks.get(self._conversation.language, [])):
            try:
                answer = self._clients.call(service, METHOD, self._conversation.language, text).result()
            except (RuntimeError, TimeoutError) as error:
                log.warning("%s has no answer: %s", service, error)
                continue
            if isinstance(answer, str) and answer:
                return answer
        return ""
