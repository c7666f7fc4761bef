"""Films: a camera's path through keyframes, and what writes the frames down."""
