"""Light: sun and sky as a few lobes, the ground's merged lobes, and how much of the light reaches the ground."""
