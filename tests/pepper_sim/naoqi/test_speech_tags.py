"""The speech engine's tags are found in a text, whatever a client sends."""

import pytest
from reading_cost import grows_in_proportion

from pepper_sim.naoqi.speech_tags import Tag, bookmarks, lasting_tags, read, spoken, styled
from pepper_sim.sound.speech import SpeechStyle


def test_words_and_tags_are_told_apart():
    assert read(r"Hi \rspd=80\ you \\pau=500\\ there") == (
        "Hi you , there",
        [Tag("rspd", "80", 1), Tag("pau", "500", 2)],
    )
    assert read("^start(animations/Stand/Gestures/Hey_1) Hi") == ("Hi", [])
    assert spoken(r"Hi \rspd=80\ you \\pau=500\\ there") == "Hi you there"


@pytest.mark.parametrize(
    ("text", "lasting"),
    [
        ("Hi /rspd=80/ you //VCT=120///vol=50/ there", "/rspd=80///VCT=120///vol=50/"),
        ("Hi /mrk=5/ /pau=900/ you", ""),
        ("/rspd=80/ Hi /rst/ you /vol=50/ there", "/vol=50/"),
        ("/rspd=80/ Hi /RST/", ""),
    ],
)
def test_only_the_style_since_the_last_reset_holds_for_what_follows(text, lasting):
    assert lasting_tags(text.replace("/", "\\")) == lasting.replace("/", "\\")


@pytest.mark.parametrize("backslash", ["\\", "\\\\"])
def test_tags_stand_side_by_side(backslash):
    text = "/rspd=50//VCT=150//vol=40/Hello/rst/".replace("/", backslash)
    assert [tag.name for tag in read(text)[1]] == ["rspd", "vct", "vol", "rst"]
    assert read(text)[0] == "Hello"


def test_backslashes_without_a_tag_are_not_pronounced():
    assert read("\\")[0] == read("\\\\\\")[0] == ""
    assert read(r"\\rspd=80\ and \or")[0] == "and or"


def test_bookmarks_are_counted_in_words():
    _, tags = read(r"\mrk=1\One two ^start(a/b) \mrk=2\ three\mrk=3\ \mrk=x\\mrk\ ")
    assert bookmarks(tags) == [(0, 1), (2, 2), (3, 3)]
    _, tags = read(rf"\mrk={'9' * 5000}\ ")
    assert bookmarks(tags) == [], "more digits than Python reads"


def test_the_last_value_of_a_tag_counts_until_the_reset():
    default = SpeechStyle(volume=0.5)
    assert styled(default, read(r"\vol=30\a \rspd=90\ b \vol=40\ c")[1]) == SpeechStyle(speed=90.0, volume=0.4)
    assert styled(default, read(r"\vol=30\a \rst\ b")[1]) == default


def test_a_value_beyond_what_the_voice_can_do_is_as_much_as_it_can():
    assert styled(SpeechStyle(), read(r"\rspd=1\ \vct=5\ \vol=0\ a")[1]) == SpeechStyle(
        speed=20.0, pitch=50.0, volume=0.0
    )
    digits = "9" * 500
    tags = read(rf"\rspd={digits}\ \vct=300\ \vol=101\ a")[1]
    assert styled(SpeechStyle(), tags) == SpeechStyle(speed=400.0, pitch=200.0, volume=1.0)


@pytest.mark.parametrize("part", ["\\", "\\a", "\\a=  ", "\\ ", "\\mrk=1\\a ", "^", "^a(", "^a", "\\\\a \\"])
def test_a_text_is_read_in_time_proportional_to_its_length(part):
    """Python holds all threads while it matches a pattern: the whole robot stood for seconds."""
    assert grows_in_proportion(read, part)
    assert grows_in_proportion(spoken, part)


def test_one_tag_without_an_end_is_read_in_proportion_too():
    assert grows_in_proportion(lambda text: read("\\a" + text), " ")
    assert grows_in_proportion(lambda text: read("\\a=" + text), " ")
