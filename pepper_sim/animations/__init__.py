"""Animations: the library that a Pepper carries, curves for it, and timelines that users drew in Choregraphe."""
