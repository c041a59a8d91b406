"""The tablet on Pepper's chest: a web view, a picture viewer, a screen. No NAOqi words."""
