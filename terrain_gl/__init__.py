"""Heightmaps drawn with OpenGL tessellation at a certified screen-space error."""

__version__ = "0.1.0"
