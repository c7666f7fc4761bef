"""The colours of a picture.

picture        one frame: which place of the map each sample sees, and the colour of each pixel
programs       the shader of each style
surroundings   what lies around the map
contours       lines of equal height
"""
