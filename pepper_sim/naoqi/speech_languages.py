"""Languages of speech: NAOqi's names, locales, and the voices of espeak-ng that speak them."""

LANGUAGES: dict[str, tuple[str, str]] = {
    "English": ("en_US", "en-us"),
    "French": ("fr_FR", "fr-fr"),
    "German": ("de_DE", "de"),
    "Italian": ("it_IT", "it"),
    "Spanish": ("es_ES", "es"),
    "Dutch": ("nl_NL", "nl"),
    "Japanese": ("ja_JP", "ja"),
    "Chinese": ("zh_CN", "cmn"),
    "Polish": ("pl_PL", "pl"),
    "Portuguese": ("pt_PT", "pt"),
}
"""NAOqi's name -> (locale, espeak-ng voice)."""
