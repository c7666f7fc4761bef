"""How the panels look: typeface, colours, sizes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..files.furniture import INK, OPACITY, PAPER

Colour = tuple[float, float, float, float]

FONT_PX = 15.0
ACCENT: Colour = (1.0, 0.80, 0.47, 1.0)
WARNING: Colour = (1.0, 0.45, 0.40, 1.0)
INK_OF_NAMES: Colour = (*(INK / 255).tolist(), 1.0)
PAPER_OF_NAMES: Colour = (*(PAPER / 255).tolist(), OPACITY)
_COLOURS: dict[str, Colour] = {
    "text": (0.93, 0.94, 0.95, 1.0),
    "text_disabled": (0.62, 0.66, 0.70, 1.0),
    "window_bg": (0.04, 0.055, 0.08, 0.86),
    "popup_bg": (0.05, 0.065, 0.09, 0.96),
    "title_bg": (0.04, 0.055, 0.08, 0.90),
    "title_bg_active": (0.04, 0.055, 0.08, 0.90),
    "title_bg_collapsed": (0.04, 0.055, 0.08, 0.80),
    "check_mark": ACCENT,
    "scrollbar_bg": (0.0, 0.0, 0.0, 0.0),
}
_OPACITY_OF_WHITE = {
    **{"border": 0.14, "frame_bg": 0.09, "frame_bg_hovered": 0.13, "frame_bg_active": 0.18, "button": 0.08},
    **{"header": 0.06, "tab": 0.06, "separator": 0.12, "scrollbar_grab": 0.15},
}
_OPACITY_OF_ACCENT = {
    **{"slider_grab": 0.62, "slider_grab_active": 0.75, "button_hovered": 0.30, "button_active": 0.50},
    **{"header_hovered": 0.20, "header_active": 0.30, "plot_histogram": 0.80},
    **{"tab_hovered": 0.30, "tab_selected": 0.20, "tab_selected_overline": 0.60},
}
_COLOURS |= {name: (1.0, 1.0, 1.0, opacity) for name, opacity in _OPACITY_OF_WHITE.items()}
_COLOURS |= {name: (*ACCENT[:3], opacity) for name, opacity in _OPACITY_OF_ACCENT.items()}
_ROUNDING = {"frame_rounding": 4, "grab_rounding": 4, "popup_rounding": 6, "window_rounding": 8}
_SPACING = ("window_padding", "frame_padding", "item_spacing", "item_inner_spacing", "cell_padding")


def load_typeface(imgui: Any) -> None:
    """Load Roboto, which comes with imgui_bundle; without it, ImGui's own typeface."""
    import imgui_bundle

    path = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    fonts = imgui.get_io().fonts
    if path.exists():
        fonts.add_font_from_file_ttf(str(path), FONT_PX)
    else:
        fonts.add_font_default()


def apply(imgui: Any, scale: float) -> None:
    """Set the look of the current context, with `scale` pixels per unit of length."""
    style = imgui.get_style()
    plain = imgui.Style()
    for name, units in _ROUNDING.items():
        setattr(style, name, units * scale)
    for name in _SPACING:
        x, y = getattr(plain, name)
        setattr(style, name, (x * scale, y * scale))
    style.indent_spacing = 12 * scale
    style.scrollbar_size = 10 * scale
    style.grab_min_size = 10 * scale
    style.window_border_size = style.popup_border_size = style.frame_border_size = 1.0
    style.font_size_base = FONT_PX
    style.font_scale_dpi = scale
    for name, colour in _COLOURS.items():
        style.set_color_(getattr(imgui.Col_, name), colour)
