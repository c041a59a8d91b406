"""The lexicon: common concepts that topics include, "include: lexicon_enu.top". The phrases are our own.

A robot's lexicon has hundreds of concepts; these are the ones that talks are mostly made of.
"""

from __future__ import annotations

FOLDER = "/usr/share/naoqi/dialog"
"""Where the robot's disk holds the lexicons; they are found from every folder."""

_CONCEPTS: dict[str, dict[str, str]] = {
    "enu": {
        "yes": 'yes yeah yep sure okay ok "of course" "yes please" absolutely certainly right',
        "no": 'no nope "no thanks" "not now" "not really" "of course not" never',
        "maybe": "maybe perhaps possibly",
        "hello": 'hello hi hey "good morning" "good afternoon" "good evening" "nice to meet you"',
        "goodbye": 'goodbye bye "bye bye" "see you" "see you later" "good night"',
        "thanks": 'thanks "thank you" "thanks a lot" "thank you very much"',
        "please": "please",
        "sorry": 'sorry "excuse me" pardon',
        "dontknow": '"I don\'t know" "I do not know" "no idea"',
        "repeat": 'repeat "say it again" "say that again" "once more" "come again"',
        "stop": 'stop "stop it" enough quit cancel',
        "help": 'help "help me" "what can I say"',
        "want_to": '"want to" "wish to" "would like to" wanna "need to"',
        "i_am": 'I\'m "I am"',
        "i_have": '"I have" I\'ve',
        "you_are": 'you\'re "you are"',
        "it_is": 'it\'s "it is" that\'s "that is"',
        "dont": 'don\'t "do not"',
        "tell_me": '"tell me"',
    },
    "frf": {
        "yes": 'oui ouais "bien sûr" "d\'accord" ok volontiers exactement',
        "no": 'non "pas du tout" "non merci" "pas maintenant" jamais',
        "maybe": '"peut-être"',
        "hello": "bonjour salut bonsoir coucou",
        "goodbye": '"au revoir" "à bientôt" "bonne nuit" "bonne journée"',
        "thanks": 'merci "merci beaucoup"',
        "please": '"s\'il te plaît" "s\'il vous plaît"',
        "sorry": "pardon désolé désolée",
        "dontknow": '"je ne sais pas" "je sais pas" "aucune idée"',
        "repeat": 'répète répétez "encore une fois"',
        "stop": "stop arrête arrêtez assez",
        "help": 'aide "aide moi"',
    },
    "ged": {
        "yes": 'ja jawohl klar natürlich gerne okay ok "ja bitte" genau',
        "no": 'nein nee "nein danke" "jetzt nicht" "auf keinen Fall" niemals',
        "maybe": "vielleicht möglicherweise",
        "hello": 'hallo "guten Morgen" "guten Tag" "guten Abend" servus',
        "goodbye": '"auf Wiedersehen" tschüss "bis bald" "gute Nacht"',
        "thanks": 'danke "danke schön" "vielen Dank"',
        "please": "bitte",
        "sorry": "Entschuldigung Verzeihung",
        "dontknow": '"ich weiß nicht" "weiß ich nicht" "keine Ahnung"',
        "repeat": 'wiederhole "noch einmal" "sag das noch einmal"',
        "stop": "stopp halt aufhören genug",
        "help": 'hilfe "hilf mir"',
    },
}
"""QiChat's code of a language -> concept -> what stands for it."""
_OTHER_NAMES = {"confirmation": "yes", "negation": "no", "greetings": "hello", "bye": "goodbye", "thank_you": "thanks"}


def files() -> dict[str, str]:
    """Return the lexicons: name of the file -> its text."""
    return {f"lexicon_{code}.top": _text(code, concepts) for code, concepts in _CONCEPTS.items()}


def _text(code: str, concepts: dict[str, str]) -> str:
    lines = [f"concept:({name}) [{phrases}]" for name, phrases in concepts.items()]
    lines += [f"concept:({name}) [~{concept}]" for name, concept in _OTHER_NAMES.items()]
    return "\n".join(["topic: ~lexicon()", f"language: {code}", "", *lines, ""])
