"""Light: sun and sky as a few lobes, the ground's merged lobes, and the share of the light that reaches the ground."""
