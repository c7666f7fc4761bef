"""Films: a camera's path through keyframes, and the recorder that writes the frames."""
