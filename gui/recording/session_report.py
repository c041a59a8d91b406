"""The report of a recorded session:  python -m gui.session_report SESSION.bag  writes SESSION.html next to it."""

from __future__ import annotations

import html
import math
import sys
from collections import Counter
from datetime import datetime
from pathlib import Path

import numpy as np

from gui.recording.report_plots import path_plot, time_plot
from gui.recording.session import Session
from telepresence.security import private_files

HALTS = frozenset({"stopped", "fault", "sensor stale", "bumped", "blocked"})
"""States of the safety gate in which it passes nothing of a command, or next to nothing."""
MOST_ROWS = 40
STYLE = """
:root { color-scheme: light dark; --ground:#f4f6f9; --card:#fff; --text:#17202b; --quiet:#566476; --line:#d5dce5;
  --wanted:#94a0af; --given:#0a7fc2; --bad:#d0343a; --warn:#d98a11; --good:#1f9d66; }
@media (prefers-color-scheme: dark) { :root { --ground:#12161c; --card:#1a2028; --text:#e6eaf0; --quiet:#8a96a8;
  --line:#2a323e; --wanted:#5b6878; --given:#4cc2ff; --bad:#ff8a8d; --warn:#f3c06a; --good:#6fdca4; } }
body { margin: 0 auto; max-width: 920px; padding: 24px; background: var(--ground); color: var(--text);
  font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
h1 { font-size: 24px; margin: 0 0 4px } h2 { font-size: 17px; margin: 28px 0 8px }
p { margin: 4px 0; color: var(--quiet) }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(130px, 1fr)); gap: 10px; margin: 18px 0 }
.figures div, svg, table { background: var(--card); border: 1px solid var(--line); border-radius: 8px }
.figures div { padding: 10px 14px } .figures b { display: block; font-size: 20px }
svg { width: 100%; height: auto; display: block } svg.square { max-width: 420px }
svg text { font-size: 11px; fill: var(--quiet) } .grid { stroke: var(--line); stroke-width: 1 }
polyline { fill: none; stroke-width: 1.6; stroke-linejoin: round } polyline.wanted { stroke: var(--wanted) }
polyline.given { stroke: var(--given) } polyline.good { stroke: var(--good) } text.wanted { fill: var(--wanted) }
text.given { fill: var(--given) } text.good { fill: var(--good) } text.name { font-weight: 600 }
rect.halt { fill: var(--bad); opacity: .22 } rect.limited { fill: var(--warn); opacity: .18 }
circle.start { fill: var(--good) } circle.end { fill: var(--given) } circle.mark { fill: var(--bad) }
table { border-collapse: collapse; width: 100% } td, th { padding: 6px 12px; text-align: left;
  border-top: 1px solid var(--line) }
tr:first-child th { border-top: 0 } td.n { text-align: right; white-space: nowrap }
"""


def main(argv: list[str] | None = None) -> int:
    """Write the report; return the exit code."""
    arguments = sys.argv[1:] if argv is None else argv
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print("usage: ./stack exec python -m gui.session_report SESSION.bag", file=sys.stderr)
        return 2
    from gui.ros.bag import read_session  # the page itself needs no ROS

    bag = Path(arguments[0])
    try:
        text = report(read_session(bag), bag.name)
        target = bag.with_suffix(".html")
        private_files.write(target, text.encode())
    except (ValueError, OSError) as error:
        print(f"session_report: {error}", file=sys.stderr)
        return 1
    print(target)
    return 0


def report(session: Session, name: str) -> str:
    """Return the report as an HTML page that needs no other file and no network."""
    halts = session.stops(HALTS)
    limited = session.stops(frozenset({"limited"}))
    bands = [(stop.start, stop.start + stop.duration, "halt", f"{stop.state}: {stop.reason}") for stop in halts]
    bands += [(stop.start, stop.start + stop.duration, "limited", f"{stop.state}: {stop.reason}") for stop in limited]
    wanted = np.stack([session.commands[:, 0], np.hypot(session.commands[:, 1], session.commands[:, 2])], axis=1)
    given = np.stack([session.safety[:, 0], np.hypot(session.safety[:, 1], session.safety[:, 2])], axis=1)
    speed = [("wanted by the pilot", "wanted", wanted), ("given to the wheels", "given", given)]
    turning = [
        ("wanted by the pilot", "wanted", session.commands[:, [0, 3]]),
        ("given to the wheels", "given", session.safety[:, [0, 3]]),
    ]
    marks = [(stop.start, f"{stop.start:.1f} s, {stop.state}: {stop.reason}") for stop in halts]
    ages = session.pictures * (1.0, 1000.0)
    began = datetime.fromtimestamp(session.start).strftime("%Y-%m-%d %H:%M:%S")
    parts = [
        "<!doctype html><html lang='en'><meta charset='utf-8'><meta name='viewport' content='width=device-width'>",
        f"<title>Session {html.escape(name)}</title><style>{STYLE}</style>",
        f"<h1>Session of {began}</h1>",
        f"<p>{html.escape(name)}: {session.messages} messages in {session.duration:.0f} s</p>",
        _figures(session, len(halts)),
        "<h2>Path</h2>", path_plot(session.path, marks),
        "<p>Green: start. Blue: end. Red: the safety gate stopped the robot here.</p>",
        "<h2>Speed: wanted and given</h2>", time_plot(speed, "m/s", session.duration, bands),
        "<p>Red: stopped by the safety gate. Amber: slowed. Point at a band to read why.</p>",
        "<h2>Turning: wanted and given</h2>", time_plot(turning, "rad/s", session.duration, bands),
        "<h2>Why the robot was stopped</h2>", _reasons(halts),
        "<h2>What the safety gate did</h2>", _states(session),
        "<h2>Link health</h2>",
        _link(session, ages),
    ]  # fmt: skip
    return "\n".join(parts) + "\n"


def _figures(session: Session, stops: int) -> str:
    figures = [
        (f"{session.duration:.0f} s", "recorded"),
        (f"{session.distance():.2f} m", "driven"),
        (f"{session.top_speed():.2f} m/s", "top speed"),
        (_percent(session.passed()), "of the wanted speed passed"),
        (str(stops), "stops by the safety gate"),
        (f"{session.nearest():.2f} m" if math.isfinite(session.nearest()) else "–", "least free room"),
    ]
    cells = "".join(f"<div><b>{value}</b>{what}</div>" for value, what in figures)
    return f'<div class="figures">{cells}</div>'


def _reasons(halts: list) -> str:
    if not halts:
        return "<p>It was never stopped.</p>"
    rows = "".join(
        f'<tr><td class="n">{stop.start:.1f} s</td><td class="n">{stop.duration:.1f} s</td>'
        f"<td>{html.escape(stop.state)}</td><td>{html.escape(stop.reason)}</td></tr>"
        for stop in halts[:MOST_ROWS]
    )
    more = f"<p>and {len(halts) - MOST_ROWS} more</p>" if len(halts) > MOST_ROWS else ""
    counted = Counter(stop.state for stop in halts)
    summary = ", ".join(f"{state} {count}×" for state, count in counted.most_common())
    head = "<tr><th>at</th><th>for</th><th>state</th><th>reason</th></tr>"
    return f"<p>{html.escape(summary)}</p><table>{head}{rows}</table>{more}"


def _states(session: Session) -> str:
    times = session.time_in_states()
    if not times:
        return "<p>The recording holds no messages of a safety gate.</p>"
    total = sum(times.values()) or 1.0
    rows = "".join(
        f'<tr><td>{html.escape(state)}</td><td class="n">{seconds:.1f} s</td>'
        f'<td class="n">{_percent(seconds / total)}</td></tr>'
        for state, seconds in sorted(times.items(), key=lambda item: -item[1])
    )
    return f"<table><tr><th>state</th><th>time</th><th>share</th></tr>{rows}</table>"


def _link(session: Session, ages: np.ndarray) -> str:
    parts = []
    if len(session.pictures):
        late = float(np.percentile(ages[:, 1], 99))
        parts.append(
            f"<p>{len(ages)} pictures; age on arrival: median {np.median(ages[:, 1]):.0f} ms, "
            f"99 % below {late:.0f} ms.</p>"
        )
        parts.append(time_plot([("pictures per second", "good", session.picture_rate())], "1/s", session.duration))
        parts.append(time_plot([("age of pictures on arrival", "given", ages)], "ms", session.duration))
    else:
        parts.append("<p>The recording holds no pictures.</p>")
    if len(session.battery):
        share, voltage = session.battery[-1, 1:3]
        level = _percent(share) if math.isfinite(share) else f"{voltage:.1f} V"
        parts.append(f"<p>Battery at the end: {level}.</p>")
    return "".join(parts)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if math.isfinite(share) else "–"
