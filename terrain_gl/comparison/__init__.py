"""Methods and ways of shading side by side: tables, curves and figures."""
