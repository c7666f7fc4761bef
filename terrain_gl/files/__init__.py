"""Files: writers of maps, meshes and edits, the bundled maps, and generated land."""
