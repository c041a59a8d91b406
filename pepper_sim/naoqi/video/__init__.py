"""Parts of ALVideoDevice: settings and parameters of the cameras, streams of pictures, the calls that wait for
them, picture formats."""
