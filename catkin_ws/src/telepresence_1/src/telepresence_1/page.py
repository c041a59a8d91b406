"""The page on the robot's tablet, and the pictures in it.

    GET /                    the page; /?k=KEY leads there by way of a cookie
    GET /video_feed          multipart/x-mixed-replace; ?adv=1 in the layout that browsers paint without delay,
                             ?v=NAME gives the stream a name for /status
    GET /frame.jpg?after=N   the newest picture as soon as its number is not N, or after a second the same again;
                             its number is in the header X-Sequence
    GET /status              JSON: name, state, text, looking, sequence, age [s], viewers, run; with ?v=NAME also
                             stalled [s], null when there is no such stream
    GET /blank               nothing, for a tablet that is to forget the page

Every address takes ?k=KEY as well; what else keeps others out is in `telepresence.web.page_auth`.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterable, Sequence

from flask import Flask, Response, jsonify, render_template, request

from telepresence.video.mjpeg import CONTENT_TYPE, MjpegStream, TooManyViewers
from telepresence.web.json_app import Application
from telepresence.web.page_auth import PageAuth, ProtectedPage
from telepresence_1.tablet_link import BLANK

KEY_VARIABLE = "TELEPRESENCE_PAGE_KEY"
"""Environment variable that holds the key to the pages of this package."""
POLL_TIMEOUT = 1.0
"""Seconds after which a long poll is answered with the picture that the client has already."""
_CSP = (
    "default-src 'none'; img-src 'self' data:; connect-src 'self'; "
    "style-src 'unsafe-inline'; script-src 'unsafe-inline'"
)


def create_app(
    stream: MjpegStream,
    *,
    name: str,
    describe: Callable[[], tuple[str, str]],
    looking: Callable[[], Sequence[str]] = tuple,
    token: str | None = None,
    hosts: Iterable[str] = (),
) -> Application:
    """The page for the pictures of `stream`; to be answered by `telepresence.web.server.WebServer`.

    Args:
        name: Whom the pictures show.
        describe: The state of their source ("live", "opening", "lost") and the same for people.
        looking: Who looks through the robot besides: by the pilot's page.
        token: Who has it may see them; None for everybody.
        hosts: Further names under which clients reach this machine.
    """
    app = Flask(__name__, static_folder=None)
    app.config["MAX_CONTENT_LENGTH"] = 4096
    run = secrets.token_hex(8)

    @app.get("/")
    def page() -> Response:
        return Response(render_template("index.html", name=name, viewer=secrets.token_hex(4), run=run))

    @app.get("/video_feed")
    def video_feed() -> Response:
        try:
            viewing = stream.view(
                advance=request.args.get("adv", "0") not in ("", "0"),
                address=request.remote_addr or "",
                name=request.args.get("v", "")[:32],
            )
        except TooManyViewers as error:
            return Response(f"{error}\n", 503, {"Retry-After": "5"}, content_type="text/plain")
        return Response(viewing, content_type=CONTENT_TYPE)

    @app.get("/frame.jpg")
    def frame() -> Response:
        picture = stream.newer(request.args.get("after", 0, type=int), POLL_TIMEOUT) or stream.image.peek()
        if picture is None:
            return Response("There is no picture yet.\n", 503, {"Retry-After": "1"}, content_type="text/plain")
        headers = {"X-Sequence": str(picture.sequence), "X-Timestamp": f"{picture.stamp:.6f}"}
        return Response(picture.content, headers=headers, content_type="image/jpeg")

    @app.get("/status")
    def status() -> Response:
        state, text = describe()
        picture = stream.image.peek()
        answer = {
            "name": name,
            "state": state,
            "text": text,
            "looking": list(looking()),
            "sequence": picture.sequence if picture else 0,
            "age": round(stream.image.age(), 3) if picture else None,
            "viewers": stream.viewers,
            "run": run,
        }
        viewer = request.args.get("v")
        if viewer:
            stalled = stream.stalled(viewer)
            answer["stalled"] = None if stalled is None else round(stalled, 3)
        return jsonify(answer)

    @app.get(BLANK)
    def blank() -> Response:
        return Response("<!DOCTYPE html><title></title><body style='background: black'>", content_type="text/html")

    return ProtectedPage(app, PageAuth(token, hosts), _CSP)
