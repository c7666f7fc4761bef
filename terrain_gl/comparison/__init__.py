"""Comparisons of methods and of kinds of shading: tables, curves and figures."""
