"""The behaviours installed on the simulated robot; ALBehaviorManager runs them, ALAutonomousLife puts them in focus."""

INSTALLED_BEHAVIORS = ("robotvideo/behaviour", ".lastUploadedChoregrapheBehavior/behavior_1")
"""The telepresence application's own activity, and where Choregraphe puts what it uploads."""
