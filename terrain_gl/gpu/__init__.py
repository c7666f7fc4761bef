"""OpenGL itself: contexts, shaders, block layouts, timers."""
