"""The versions of the libraries that the installed wheels bring along, as JSON: {name: version, or null where unknown}.

    .venv/bin/python telepresence/station/bundled_versions.py

Debian keeps its own libraries up to date; these it does not know. A library that says its version is asked, of the
others it stands in the file. `telepresence.station.doctor_security` judges them.
"""

from __future__ import annotations

import importlib
import json
import re
import sysconfig
from collections.abc import Callable
from pathlib import Path

SITE = Path(sysconfig.get_paths()["purelib"])


def in_file(pattern: str, text: str) -> Callable[[], str]:
    """Return what reads the first group of `text` in the first file of `pattern` that has it."""

    def read() -> str:
        for path in sorted(SITE.glob(pattern)):
            if found := re.search(text.encode(), path.read_bytes()):
                return found[1].decode()
        raise LookupError(f"{text} is in no file {pattern}")

    return read


def of_opencv(text: str) -> Callable[[], str]:
    """Return what reads the first group of `text` in OpenCV's account of its build."""

    def read() -> str:
        found = re.search(text, importlib.import_module("cv2").getBuildInformation())
        if found is None:
            raise LookupError(f"OpenCV's build names no {text}")
        return found[1]

    return read


def of_module(module: str, name: str) -> Callable[[], str]:
    """Return what reads an attribute of a module."""
    return lambda: str(getattr(importlib.import_module(module), name))


def of_pillow(name: str) -> Callable[[], str]:
    """Return what asks Pillow for the version of a library."""
    return lambda: str(importlib.import_module("PIL.features").version(name))


def _cryptography_openssl() -> str:
    return importlib.import_module("cryptography.hazmat.backends.openssl").backend.openssl_version_text()


OPENSSL = r"OpenSSL (\d+\.\d+\.\d+\w?) "
READERS: dict[str, Callable[[], str]] = {
    "FFmpeg in PyAV": in_file("av.libs/libavutil*", r"FFmpeg version n?(\d+\.\d+(?:\.\d+)?)\0"),
    "libvpx in PyAV": in_file("av.libs/libvpx*", r"VP8 Decoder v(\d+\.\d+\.\d+)"),
    "OpenSSL in cryptography": lambda: _cryptography_openssl().split()[1],
    "libsrtp in pylibsrtp": in_file("pylibsrtp/_binding*", r"srtp2? (\d+\.\d+\.\d+)"),
    "OpenSSL in pylibsrtp": in_file("pylibsrtp/_binding*", OPENSSL),
    "OpenCV": of_module("cv2", "__version__"),
    "libjpeg-turbo in OpenCV": of_opencv(r"libjpeg-turbo \(ver (\d+\.\d+\.\d+)"),
    "libpng in OpenCV": of_opencv(r"PNG:.*\(ver (\d+\.\d+\.\d+)"),
    "libtiff in OpenCV": of_opencv(r"TIFF:.*- (\d+\.\d+\.\d+)"),
    "OpenJPEG in OpenCV": of_opencv(r"JPEG 2000:.*\(ver (\d+\.\d+\.\d+)"),
    "OpenEXR in OpenCV": of_opencv(r"OpenEXR:.*\(ver (\d+\.\d+\.\d+)"),
    "FFmpeg in OpenCV": in_file("opencv_python_headless.libs/libavutil*", r"FFmpeg version n?(\d+\.\d+(?:\.\d+)?)\0"),
    "OpenSSL in OpenCV": in_file("opencv_python_headless.libs/libcrypto*", OPENSSL),
    "libjpeg-turbo in Pillow": of_pillow("libjpeg_turbo"),
    "libtiff in Pillow": of_pillow("libtiff"),
    "libwebp in Pillow": of_pillow("webp"),
    "FreeType in Pillow": of_pillow("freetype2"),
    "FreeType in Matplotlib": of_module("matplotlib.ft2font", "__freetype_version__"),
    "Qt in PyQt5": in_file("PyQt5/Qt5/lib/libQt5Core*", r"Qt (5\.\d+\.\d+) \("),
    "libjpeg-turbo in Qt": in_file("PyQt5/Qt5/plugins/imageformats/libqjpeg*", r"libjpeg-turbo version (\d+\.\d+\.\d)"),
}
OF_QT = {"Qt in PyQt5", "libjpeg-turbo in Qt"}
"""What is Debian's, and looked after by Debian, where there is no wheel of PyQt5: on arm64."""


def versions() -> dict[str, str | None]:
    """Return the version of each library that a wheel brought; None if it is not installed or does not tell."""
    found: dict[str, str | None] = {}
    from_debian = set() if (SITE / "PyQt5").is_dir() else OF_QT
    for name, read in READERS.items():
        if name in from_debian:
            continue
        try:
            found[name] = read().partition("-")[0]
        except (ImportError, LookupError, OSError, AttributeError):
            found[name] = None
    return found


if __name__ == "__main__":
    print(json.dumps(versions()))
