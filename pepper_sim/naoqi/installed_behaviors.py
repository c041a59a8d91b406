"""The behaviours installed on the simulated robot; ALBehaviorManager runs them, ALAutonomousLife switches focus to them."""

INSTALLED_BEHAVIORS = ("robotvideo/behaviour", ".lastUploadedChoregrapheBehavior/behavior_1")
"""The telepresence application's own activity, and where Choregraphe puts what it uploads."""
