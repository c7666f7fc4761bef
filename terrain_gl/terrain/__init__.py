"""A map on the GPU: quantised heights with voids filled, and marks of voids and water.

terrain    heights as integers in a range, and the sizes of all levels
filling    voids are filled smoothly from their rim
water      which posts are lakes or the sea
"""

from .terrain import Terrain, block_of, quantisation_range, sea_of, steps_of, steps_per_m, units_hold

__all__ = ["Terrain", "block_of", "quantisation_range", "sea_of", "steps_of", "steps_per_m", "units_hold"]
