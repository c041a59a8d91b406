"""What Caddy makes of the configuration that a site's file leads to."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

import pytest

from telepresence.page.certificate import server_files
from telepresence.site.caddyfile import Files, caddyfile, names_of
from telepresence.site.proxy import CADDY, write_caddyfile
from telepresence.site.site_file import Site, SiteError, parse_site

ROBOTS = (
    "[robot.anna]\n[robot.ben]\nkind = 'robotino'\nimage = 'telepresence'\n[robot.dora]\nurl = 'https://10.8.0.21/'\n"
)


def adapted(site: Site, folder: Path) -> dict:
    """Return the configuration as Caddy reads it."""
    path = folder / "Caddyfile"
    path.write_text(caddyfile(site, Files(folder / "own.crt", folder / "own.key", folder)))
    words = [CADDY, "adapt", "--config", str(path), "--adapter", "caddyfile"]
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True, timeout=60.0).stdout)


@pytest.mark.parametrize(
    ("head", "listens", "names"),
    [
        ("", "127.0.0.1:8443", ["localhost", "127.0.0.1"]),
        ("address = '10.0.0.5'\nport = 443\n", "10.0.0.5:443", ["10.0.0.5"]),
        ("address = '10.0.0.5'\nname = 'robots.example'\n", "10.0.0.5:8443", ["robots.example", "10.0.0.5"]),
    ],
)
def test_it_listens_at_the_sites_address_alone_and_answers_to_its_names(tmp_path, head, listens, names):
    site = parse_site(head + ROBOTS, tmp_path)
    config = adapted(site, tmp_path)
    (server,) = config["apps"]["http"]["servers"].values()
    assert server["listen"] == [f"tcp/{listens}"] or server["listen"] == [listens]
    hosts = [match["host"] for route in server["routes"] for match in route.get("match", ())]
    assert [sorted(each) for each in hosts] == [sorted(names)] == [sorted(names_of(site))]
    assert config["admin"] == {"disabled": True}


def test_each_robot_has_one_way_and_those_elsewhere_are_checked(tmp_path):
    folder = tmp_path / "a folder"
    folder.mkdir()
    config = adapted(parse_site(ROBOTS, folder), folder)

    def found(part, key):
        if isinstance(part, dict):
            yield from ([part[key]] if key in part else [])
            part = part.values()
        for each in part if not isinstance(part, str | int | bool | float) else ():
            yield from found(each, key)

    dials = [upstream["dial"] for upstreams in found(config, "upstreams") for upstream in upstreams]
    assert sorted(dials) == ["10.8.0.21:443", f"unix/{folder}/anna.socket", f"unix/{folder}/units/ben/page.socket"]
    assert "insecure_skip_verify" not in json.dumps(config)
    assert [*found(config, "server_name")] == ["10.8.0.21"]


@pytest.mark.parametrize(
    ("name", "says"),
    [("a" * 90, r"too long a path .* Set TMPDIR"), ("a{b}", "without quotes, braces")],
)
def test_a_folder_for_temporary_files_that_caddy_cannot_use_is_named(name, says):
    with tempfile.TemporaryDirectory() as place:  # pytest's own is long itself
        folder = Path(place, name)
        folder.mkdir()
        site = parse_site("[robot.anna]", folder)
        files = Files(*server_files(Path(place), names_of(site), "site"), folder)
        with pytest.raises(SiteError, match=says):
            write_caddyfile(site, files)


def test_what_caddy_refuses_is_said(tmp_path):
    site = parse_site(ROBOTS, tmp_path)
    files = Files(*server_files(tmp_path, names_of(site), "site"), tmp_path)
    assert write_caddyfile(site, files) == tmp_path / "Caddyfile"
    with pytest.raises(SiteError, match="caddy refuses the site"):
        write_caddyfile(site, Files(tmp_path / "none.crt", tmp_path / "none.key", tmp_path))


def test_without_caddy_it_is_said_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SiteError, match="sudo apt install caddy"):
        write_caddyfile(parse_site(ROBOTS, tmp_path), Files(tmp_path, tmp_path, tmp_path))
