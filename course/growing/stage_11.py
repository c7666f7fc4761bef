# Lesson 11: shadows. The sun stands in the west.


def light(heights, posts):
    """Light (n,): posts whose western horizon hides the sun have only the sky's light."""
    west = map_horizons(heights, SPACING)[0][posts[:, 1], posts[:, 0]]
    seen = sunlit(west, SUN[2] / np.hypot(*SUN[:2]) * 0.6)
    return np.where(seen, footprint_light(heights, posts), 0.22)
