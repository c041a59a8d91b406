"""Links and addresses of a station that runs in a container's image."""

from __future__ import annotations

import socket

import pytest

from telepresence.station import container_image
from telepresence.station.pilot_page import OwnPage


def test_the_page_is_where_published_ports_lead():
    address = container_image.page_settings({"gui": "false"})["page"]
    with socket.socket() as probe:
        probe.bind((address, 0))


def test_who_says_where_the_page_is_is_obeyed():
    assert container_image.page_settings({"page": "false"}) == {"page": "false"}


@pytest.mark.parametrize(
    "host, link",
    [("localhost", "localhost:8443"), ("robots.example:443", "robots.example:443"), ("", "127.0.0.1:8443")],
)
def test_links_have_the_name_by_which_people_reach_the_page(monkeypatch: pytest.MonkeyPatch, host: str, link: str):
    monkeypatch.setenv(container_image.PAGE_HOST, host)
    page = OwnPage({"page": "127.0.0.1", "sign_in": "false"}, simulated=True)
    assert page.open().startswith(f"https://{link}/#k=")
    assert page.url == "https://127.0.0.1:8443/", "what this machine itself opens"
    page.close()


def test_a_checkout_is_no_image():
    assert not container_image.in_image()
