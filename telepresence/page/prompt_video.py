"""Pictures that browsers show as soon as they have them.

A browser keeps each picture for a while, longer when the network or its own machine is busy, so that films run
smoothly. Who drives by them wants the newest. The header extension "playout-delay" of RTP, which Chromium and Firefox
know, asks for no such wait at each packet; `jitterBufferTarget` of a page is a wish that they outvote. aiortc neither
negotiates nor sends it, so its private map of extensions is replaced, in the version that this was written for.
"""

from __future__ import annotations

import importlib.metadata
import logging
from typing import Any

from aiortc.codecs import HEADER_EXTENSIONS
from aiortc.rtcrtpparameters import RTCRtpHeaderExtensionParameters
from aiortc.rtp import HeaderExtensionsMap

from telepresence.video.webrtc import KNOWN_VERSION

log = logging.getLogger(__name__)

PLAYOUT_DELAY = "http://www.webrtc.org/experiments/rtp-hdrext/playout-delay"
_ONE_BYTE = 0xBEDE
"""Profile of extensions with headers of one byte (RFC 8285, 4.2)."""
_OWN_ID = 4
"""The extension's number in aiortc's list; each offer has a number of its own."""


class PromptExtensions(HeaderExtensionsMap):
    """Adds to every packet: at least 0 ms, at most 0 ms (twelve bits each)."""

    _prompt = b""

    def configure(self, parameters: Any) -> None:
        super().configure(parameters)
        for extension in parameters.headerExtensions:
            if extension.uri == PLAYOUT_DELAY and extension.id < 15:
                self._prompt = bytes((extension.id << 4 | 2, 0, 0, 0))

    def set(self, values: Any) -> tuple[int, bytes]:
        profile, extensions = super().set(values)
        return profile, self._prompt + extensions if profile == _ONE_BYTE else extensions


def show_at_once(sender: Any) -> None:
    """Let the browser show an `RTCRtpSender`'s pictures without waiting; call it before the connection is made."""
    if importlib.metadata.version("aiortc") == KNOWN_VERSION:
        sender._RTCRtpSender__rtp_header_extensions_map = PromptExtensions()


def negotiate_playout_delay() -> None:
    """Let answers accept the extension; once, at the start of the program."""
    if all(extension.uri != PLAYOUT_DELAY for extension in HEADER_EXTENSIONS["video"]):
        HEADER_EXTENSIONS["video"].append(RTCRtpHeaderExtensionParameters(id=_OWN_ID, uri=PLAYOUT_DELAY))


negotiate_playout_delay()
