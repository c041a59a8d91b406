"""The pilot's page in this process, and Chromium on it: one of each for the tests of a file."""

import pytest
from page_in_process import PageBrowser, PageInProcess


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    page = PageInProcess(tmp_path_factory.mktemp("page"))
    yield page
    page.close()


@pytest.fixture(scope="module")
def chromium(page):
    browser = PageBrowser(page.url)
    yield browser
    browser.close()
    assert browser.errors == []
