"""Every target by its name."""

from __future__ import annotations

from collections.abc import Callable

import fuzz_media
import fuzz_naoqi
import fuzz_naoqi_ends
import fuzz_naoqi_wire
import fuzz_page
import fuzz_wires
from fuzz_harness import Target

TARGETS: dict[str, Callable[[], Target]] = {
    "drive-datagram": fuzz_wires.drive_datagram,
    "drive-session": fuzz_wires.drive_session,
    "robot-key": fuzz_wires.robot_key,
    "signed-request": fuzz_wires.signed_request,
    "rest-answer": fuzz_wires.rest_answer,
    "rest-http": fuzz_wires.rest_http,
    "robotino-sim": fuzz_wires.robotino_sim,
    "page-request": fuzz_wires.page_request,
    "page-drive": fuzz_page.page_drive,
    "page-floor": fuzz_page.page_floor,
    "page-look": fuzz_page.page_look,
    "page-ask": fuzz_page.page_ask,
    "page-forwarded": fuzz_page.page_forwarded,
    "lease-message": fuzz_wires.lease_message,
    "account-name": fuzz_wires.account_name,
    "sdp": fuzz_media.sdp,
    "sdp-offer": fuzz_media.sdp_offer,
    "pasted-line": fuzz_media.pasted_line,
    "jpeg": fuzz_media.jpeg,
    "jpeg-header": fuzz_media.jpeg_header,
    "camera-jpeg": fuzz_media.camera_jpeg,
    "vp8-frame": fuzz_media.vp8_frame,
    "tablet-picture": fuzz_media.tablet_picture,
    "multipart": fuzz_media.multipart,
    "shown-text": fuzz_media.shown_text,
    "naoqi-body": fuzz_naoqi.naoqi_body,
    "naoqi-sensors": fuzz_naoqi.naoqi_sensors,
    "naoqi-picture": fuzz_naoqi.naoqi_picture,
    "naoqi-messages": fuzz_naoqi_wire.naoqi_messages,
    "naoqi-signature": fuzz_naoqi_wire.naoqi_signature,
    "naoqi-payload": fuzz_naoqi_wire.naoqi_payload,
    "naoqi-value": fuzz_naoqi_wire.naoqi_value,
    "naoqi-metaobject": fuzz_naoqi_wire.naoqi_metaobject,
    "naoqi-robot-side": fuzz_naoqi_wire.robot_side,
    "naoqi-server": fuzz_naoqi_ends.naoqi_server,
    "naoqi-client": fuzz_naoqi_ends.naoqi_client,
}
"""What makes each; importing this imports none of the parsers."""
