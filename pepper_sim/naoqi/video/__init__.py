"""Parts of ALVideoDevice: settings and parameters of the cameras, streams of pictures, picture formats."""
