"""Comparisons of methods: tables, curves and figures; and of pictures that should be equal."""
