"""What ALVisionExtractors share: pictures with the camera's pose, angles in a picture, and the marks they read."""
