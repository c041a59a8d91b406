"""The proxy's certificate and configuration, before it starts."""

from __future__ import annotations

import pytest

from telepresence.site import proxy
from telepresence.site.site_file import SiteError, parse_site


def test_a_certificate_that_is_none_is_named(tmp_path):
    (tmp_path / "own.crt").write_text("x")
    site = parse_site("certificate = 'own.crt'\n[robot.anna]", tmp_path)
    with pytest.raises(SiteError, match=r"own\.crt .* are no certificate and key"):
        proxy.certificate_files(site, tmp_path)
