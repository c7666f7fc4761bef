"""Files: writers of maps and meshes, the bundled maps, generated land."""
