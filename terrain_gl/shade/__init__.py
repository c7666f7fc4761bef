"""The colours of a picture.

picture        one frame: the place of the map that each sample sees, and the colour of each pixel
programs       the shader of each style
surroundings   the plain or sea around the map, and the walls of its block
contours       lines of equal height
"""
