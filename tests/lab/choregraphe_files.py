"""Behaviours as Choregraphe writes them, and packages of them."""

import zipfile
from xml.sax.saxutils import escape

PORTS = (
    '<Input name="onLoad" type="1" type_size="1" nature="0" inner="1" id="1" />'
    '<Input name="onStart" type="1" type_size="1" nature="2" inner="0" id="2" />'
    '<Input name="onStop" type="1" type_size="1" nature="3" inner="0" id="3" />'
    '<Output name="onStopped" type="1" type_size="1" nature="1" inner="0" id="4" />'
)
START, STOPPED = 2, 4
NAMESPACE = 'xmlns="http://www.aldebaran-robotics.com/schema/choregraphe/project.xsd" xar_version="3"'


def curve(joint, keys, unit=0, mute=0):
    points = "".join(f'<Key frame="{frame}" value="{value}" />' for frame, value in keys)
    return f'<ActuatorCurve name="value" actuator="{joint}" mute="{mute}" unit="{unit}">{points}</ActuatorCurve>'


def diagram(boxes, links):
    lines = "".join(
        f'<Link inputowner="{target}" indexofinput="{into}" outputowner="{source}" indexofoutput="{out}" />'
        for source, out, target, into in links
    )
    return f"<Diagram>{''.join(boxes)}{lines}</Diagram>"


def layer(content, index=1):
    keyframe = f'<BehaviorKeyframe name="keyframe1" index="{index}">{content}</BehaviorKeyframe>'
    return f'<BehaviorLayer name="behavior_layer1">{keyframe}</BehaviorLayer>'


def timeline_box(number, curves, end=-1, layers="", name="Timeline"):
    drawn = f'<ActuatorList model="juliette">{"".join(curves)}</ActuatorList>'
    return (
        f'<Box name="{name}" id="{number}" localization="8">{PORTS}'
        f'<Timeline enable="1" fps="25" start_frame="1" end_frame="{end}" size="100">{layers}{drawn}</Timeline></Box>'
    )


def script_box(number, script, name="Script", parameters=""):
    return (
        f'<Box name="{name}" id="{number}" localization="8">'
        f'<script language="4"><content>{escape(script)}</content></script>{PORTS}{parameters}</Box>'
    )


def flow_box(number, content, name="Flow"):
    inside = f'<Timeline enable="0">{layer(content)}</Timeline>'
    return f'<Box name="{name}" id="{number}" localization="8">{PORTS}{inside}</Box>'


def in_turn(*boxes):
    """A diagram of boxes 1, 2, ... that start one after the other."""
    count = len(boxes)
    links = [(number, STOPPED if number else START, number + 1, START) for number in range(count)]
    return diagram(boxes, [*links, (count, STOPPED, 0, STOPPED)])


def behavior(content):
    root = flow_box(-1, content, "root")
    return f'<?xml version="1.0" encoding="UTF-8" ?><ChoregrapheProject {NAMESPACE}>{root}</ChoregrapheProject>'


def package(path, uuid, files, tags=()):
    """A package whose behaviours are the folders of its files."""
    names = dict.fromkeys(name.removesuffix("/behavior.xar").removesuffix(".qianim") for name in files)
    tagged = "".join(f"<tag>{tag}</tag>" for tag in tags)
    contents = "".join(
        f'<behaviorContent path="{name}"><nature>solitary</nature><tags>{tagged}</tags></behaviorContent>'
        for name in names
    )
    manifest = f'<package uuid="{uuid}" version="1.0"><contents>{contents}</contents></package>'
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("manifest.xml", manifest)
        for name, text in files.items():
            archive.writestr(name, text)
    return path
