"""Numbers as text for users."""

UNITS = {"m": 1.0, "ft": 0.3048}  # metres in the units that pictures may have


def metres(value: float) -> str:
    """A length as text, with about three digits: 0.85 m, 12.4 m, 870 m, 5.2 km."""
    if abs(value) >= 10000:
        return f"{value / 1000:,.1f} km"
    return f"{value:,.0f} m" if abs(value) >= 100 else f"{value:.3g} m"
