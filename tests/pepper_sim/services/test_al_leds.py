"""ALLeds over the wire."""

import time

import pytest

KEY = "Device/SubDeviceList/Face/Led/{}/Left/0Deg/Actuator/Value"


def test_intensity_of_leds_and_groups_shows_in_the_memory(naoqi):
    leds = naoqi.ALLeds
    leds.off("AllLeds")
    leds.on("FaceLeds")
    assert leds.getIntensity("Face/Led/Red/Left/0Deg") == 1.0
    assert leds.getIntensity("Ears/Led/Left/0Deg") == 0.0
    assert naoqi.ALMemory.getData(KEY.format("Red")) == 1.0
    leds.setIntensity("EarLeds", 0.4)
    assert leds.getIntensity("EarLeds") == pytest.approx([0.4] * 20)
    leds.reset("ChestLeds")


@pytest.mark.parametrize("colour", [(0x8000FF,), ("magenta",), (1.0, 0.0, 1.0)])
def test_colours_in_every_form_take_their_time(naoqi, colour):
    leds = naoqi.ALLeds
    leds.off("FaceLeds")
    begin = time.monotonic()
    leds.fadeRGB("FaceLeds", *colour, 0.3)
    assert time.monotonic() - begin > 0.28
    red, green, blue = naoqi.ALMemory.getListData([KEY.format(name) for name in ("Red", "Green", "Blue")])
    assert red > 0.4 and green == 0.0 and blue == 1.0


def test_a_fade_is_under_way_meanwhile(naoqi, wait_until):
    leds = naoqi.ALLeds
    leds.off("FaceLeds")
    call = leds.fade("FaceLeds", 1.0, 4.0, _async=True)
    wait_until(lambda: 0.1 < leds.getIntensity("FaceLed0")[0] < 0.9, "the light is half on")
    leds.off("FaceLeds")
    assert leds.getIntensity("FaceLed0")[0] == 0.0
    call.value(10_000)


def test_groups(naoqi, refused):
    leds = naoqi.ALLeds
    assert {"FaceLeds", "EarLeds", "ChestLeds", "FaceLed7"} <= set(leds.listGroups())
    leds.createGroup("Mine", ["FaceLed0", "Ears/Led/Left/0Deg"])
    assert len(leds.listGroup("Mine")) == 7
    assert len(leds.listLEDs()) == 48 + 20 + 3
    assert "Tail" in refused(leds.createGroup, "Bad", ["Tail"])
    assert "groupName" in refused(leds.listGroup, "Nothing")


def test_shows_and_wrong_values(naoqi, refused):
    leds = naoqi.ALLeds
    leds.fadeListRGB("FaceLeds", [0xFF0000, 0x0000FF], [0.05, 0.1])
    leds.rotateEyes(0x00FF00, 0.5, 0.1)
    leds.randomEyes(0.05)
    leds.rasta(0.05)
    assert "rgb" in refused(leds.fadeRGB, "FaceLeds", 0x1000000, 0.1)
    assert "colorName" in refused(leds.fadeRGB, "FaceLeds", "mauve", 0.1)
    assert "duration" in refused(leds.fade, "FaceLeds", 1.0, -1.0)
    assert "intensity" in refused(leds.setIntensity, "FaceLeds", 2.0)
    assert "rgbList" in refused(leds.fadeListRGB, "FaceLeds", [0xFF], [])


def test_the_body_shows_the_eyes_colour(naoqi, wait_until, monkeypatch):
    shown = {}
    monkeypatch.setattr(naoqi.robot.lights, "colour", lambda part, *rgb: shown.__setitem__(part, rgb))
    naoqi.ALLeds.fadeRGB("FaceLeds", 0x00FF00, 0.2)
    wait_until(lambda: shown.get("eyes") == (0.0, 1.0, 0.0), "the eyes are green")
    naoqi.ALLeds.off("ChestLeds")
    wait_until(lambda: shown.get("shoulders") == (0.0, 0.0, 0.0), "the shoulders are dark")
