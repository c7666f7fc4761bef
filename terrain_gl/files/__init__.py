"""Files of all kinds: what is written, the bundled maps, generated land."""
