<?xml version="1.0" encoding="UTF-8" ?>
<Package name="robotvideo" format_version="4">
    <Manifest src="manifest.xml" />
    <BehaviorDescriptions>
        <BehaviorDescription name="behavior" src="behaviour" xar="behavior.xar" />
    </BehaviorDescriptions>
    <Dialogs />
    <Resources>
        <File name="robotvideo" src="scripts/robotvideo.py" />
    </Resources>
    <Topics />
    <IgnoredPaths />
</Package>
