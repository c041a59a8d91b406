"""What a site's file may say, and that every mistake in it is a sentence that names it."""

from __future__ import annotations

from pathlib import Path

import pytest

from telepresence.site.site_file import FIRST_PORT, PORTS_OF_ONE, Elsewhere, SiteError, Unit, parse_site, read_site

ROOT = Path(__file__).resolve().parents[3]


def parse(text: str, folder: Path = ROOT):
    return parse_site(text, folder)


def test_the_example_in_the_docs_is_a_site():
    site = read_site(ROOT / "docs" / "site.toml")
    assert [robot.name for robot in site.robots] == ["anna", "ben"]


def test_a_robots_table_may_be_empty():
    site = parse("[robot.anna]\n[robot.ben]\nkind = 'robotino'\n")
    anna, ben = site.robots
    assert isinstance(anna, Unit) and (anna.kind, anna.title, anna.simulated) == ("pepper", "anna", True)
    assert isinstance(ben, Unit) and ben.first_port == FIRST_PORT + PORTS_OF_ONE
    assert site.url == "https://localhost:8443/" and site.page_url(ben) == "https://localhost:8443/ben/"


def test_settings_are_what_roslaunch_takes():
    (anna,) = parse("[robot.anna]\nsettings = {sim = false, nao_port = 9560, nao_ip = '10.0.0.7'}").units
    assert anna.settings == {"sim": "false", "nao_port": "9560", "nao_ip": "10.0.0.7"} and not anna.simulated


def test_a_robot_elsewhere_has_an_address_and_whom_it_is_believed(tmp_path):
    (tmp_path / "carl.crt").write_text("x")
    site = parse("[robot.carl]\ntitle = 'Carl'\nurl = 'https://10.8.0.21'\nauthority = 'carl.crt'", tmp_path)
    assert site.robots == (Elsewhere("carl", "Carl", "https://10.8.0.21:443/", tmp_path / "carl.crt"),)


def test_links_have_the_sites_name_or_its_address():
    assert parse("address = '10.0.0.5'\n[robot.anna]").url == "https://10.0.0.5:8443/"
    assert parse("name = 'Robots.example'\nport = 443\n[robot.anna]").url == "https://robots.example:443/"


REAL = "settings = {sim = false, nao_ip = '10.0.0.7'}\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "there is no robot"),
        ("[robot]", "there is no robot"),
        ("colour = 1\n[robot.anna]", "the site has no 'colour'"),
        ("port = 'a'\n[robot.anna]", "port is to be a whole number"),
        ("port = true\n[robot.anna]", "port is to be a whole number"),
        ("port = 0\n[robot.anna]", "port = 0 is no port"),
        ("first_port = 65530\n[robot.anna]", "first_port = 65530: 1 robots need 20 ports"),
        ("address = '0.0.0.0'\n[robot.anna]", "is not one IPv4 address"),
        ("address = 'here'\n[robot.anna]", "is not one IPv4 address"),
        ("name = 'a b'\n[robot.anna]", "is no name of a computer"),
        ("certificate_key = 'setup.py'\n[robot.anna]", "certificate_key without certificate"),
        ("certificate = 'no such'\n[robot.anna]", "there is no such file"),
        ("certificate = 'a{b}'\n[robot.anna]", "without quotes, braces"),
        ("[robot.Anna]", "robot.Anna: a robot's name"),
        ("[robot.static]", "robot.static: a robot's name"),
        ("[robot.'a/b']", "a robot's name"),
        ("[robot.anna]\n[robot.anna]", "there are two robots 'anna' (at line 2"),
        ("robot.anna = 1", "robot.anna is no table"),
        ("[robot.anna]\nkind = 'nao'", 'there is no kind "nao"; there are: pepper, robotino, both'),
        ("[robot.anna]\ncolor = 'red'", "robot.anna has no 'color'"),
        ("[robot.anna]\ntitle = ''", "a title has 1 to"),
        ("[robot.anna]\nsettings = {nao_pi = 'x'}", "pepper has no setting 'nao_pi'"),
        ("[robot.anna]\nsettings = {page = 'x'}", "page is the site's"),
        ("[robot.anna]\nsettings = {scene = 'moon'}", "robot.anna: there is no scene 'moon'; there are: apartment"),
        ("[robot.anna]\nsettings = {nao_ip = '10.0.0.7'}", "robot.anna: nao_ip:=10.0.0.7 is no simulated robot: add"),
        ("[robot.anna]\nsettings = {gui = true}", "gui is the site's"),
        ("[robot.anna]\nsettings = {people = ['x']}", "people is to be a text"),
        ("[robot.carl]\nurl = 'http://10.0.0.7'", "is not of the form https://HOST:PORT/"),
        ("[robot.carl]\nurl = 'https://10.0.0.7/x'", "is not of the form"),
        ("[robot.carl]\nurl = 'https://10.0.0.7:x'", "is not of the form"),
        ("[robot.carl]\nurl = 'https://10.0.0.7 {'", "is not of the form"),
        ("[robot.carl]\nurl = 'https://10.0.0.7'\nkind = 'pepper'", "robot.carl has no 'kind'"),
        (f"[robot.anna]\n{REAL}[robot.ben]\n{REAL}", "robot.anna and robot.ben are the same robot: 10.0.0.7:9559"),
        (
            "address = '10.0.0.5'\n[robot.anna]\nsettings = {sign_in = false}",
            "everybody who reaches 10.0.0.5 would drive",
        ),
        ("[robot.anna]\nimage = '--privileged'", "is no name of an image"),
        ("[robot.anna]\nimage = 'x'\nsettings = {sign_in = false}", "everybody who reaches its container would drive"),
        ("[robot.anna]\nimage = 'x'\nsettings = {sign_in = '0'}", "everybody who reaches its container would drive"),
        ("[robot.anna]\nsettings = {sign_in = 'yes'}", "sign_in:=yes: true or false"),
        ("volume = '/etc'\n[robot.anna]", "is no name of a volume"),
        ("= 1", "Invalid"),
    ],
)
def test_a_mistake_is_named(text, says):
    with pytest.raises(SiteError) as caught:
        parse(text)
    assert says in str(caught.value) and "\n" not in str(caught.value)


def test_a_file_that_is_none_is_named(tmp_path):
    with pytest.raises(SiteError, match=r"none\.toml: No such file"):
        read_site(tmp_path / "none.toml")
    (tmp_path / "site.toml").write_bytes(b"\xff")
    with pytest.raises(SiteError, match="no text in UTF-8"):
        read_site(tmp_path / "site.toml")
