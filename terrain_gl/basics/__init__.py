"""Helpers that every other module may use.

exceptions, inputs     errors of one line, and checks of input files
rect, steps            rectangles of posts, and work in steps
replacing, resources   files that appear when complete, and the folders that come with the code
limits                 the largest maps
words, boxes, version  lengths as text, sums over boxes, and the package's version
"""
