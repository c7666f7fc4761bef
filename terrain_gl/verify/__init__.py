"""Facts about a drawn frame: its achieved error, its holes, why a patch has its level."""
