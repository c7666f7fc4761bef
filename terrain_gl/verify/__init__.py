"""Facts about a drawn frame: its achieved error, its holes, and why a patch has its level."""
