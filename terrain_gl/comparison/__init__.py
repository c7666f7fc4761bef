"""Comparisons of methods, and of ways of shading: tables, curves and figures."""
