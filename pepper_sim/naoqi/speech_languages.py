"""Languages of speech: those that the documentation lists for Pepper, as if every language pack were installed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Language:
    """How a language is spoken.

    Attributes:
        voice: NAOqi's name of its voice.
        speaker: espeak-ng's voice, which speaks in its stead.
        rate: Sample rate of the files that ALTextToSpeech writes [Hz].
    """

    locale: str
    voice: str
    speaker: str
    rate: int = 22050


LANGUAGES: dict[str, Language] = {
    "Japanese": Language("ja_JP", "maki_n16", "ja", 16000),
    "English": Language("en_US", "naoenu", "en-us"),
    "French": Language("fr_FR", "naofrf", "fr-fr"),
    "Italian": Language("it_IT", "naoiti", "it"),
    "German": Language("de_DE", "naoged", "de"),
    "Spanish": Language("es_ES", "naospe", "es"),
    "Chinese": Language("zh_CN", "naomnc", "cmn", 16000),
    "MandarinTaiwan": Language("zh_TW", "naomnt", "cmn", 16000),
    "Dutch": Language("nl_NL", "naodun", "nl"),
    "Arabic": Language("ar_SA", "naoarw", "ar"),
}
"""NAOqi's name -> how it is spoken. Source: NAOqi 2.8 documentation, Pepper, "Supported languages". The names of the
voices follow "nao" + QiChat's code of the language, as robots show for English, French and Chinese."""
PREFERRED = "English"
"""The language that the robot comes back to."""


def language_of(voice: str) -> str:
    """Return the language that an installed voice speaks."""
    return next(name for name, language in LANGUAGES.items() if language.voice == voice)
