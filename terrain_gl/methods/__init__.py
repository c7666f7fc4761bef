"""The other ways to draw a terrain, to compare `lod` with: clipmaps, tessellated clipmaps, and the truth itself."""
