"""Messages for people who write Python: `--spacing 30` becomes `spacing_m=30`."""

import re

from ..renderer.options import OPTIONS

OF_FILES = {  # arguments of `Heightmap.open`, by flag
    "--spacing": "spacing_m",
    "--z-scale": "z_scale",
    "--z-offset": "z_offset_m",
    "--nodata": "nodata",
    "--encoding": "encoding",
    "--band": "band",
    "--raw": "raw",
    "--byte-order": "byte_order",
    "--trust": "trusted",
}
_NAMES = OF_FILES | {flag.name: name for name, option in OPTIONS.items() for flag in option.flags}
_SPECIAL = {"--trust": "trusted=True", "--raw WxH": "raw=(W, H)", "--nodata none": "nodata=nan"}
_WORDS: dict[str, tuple[str, ...]] = {"--encoding": ("terrarium", "mapbox", "gsi"), "--byte-order": ("little", "big")}
_WORDS |= {flag.name: option.choices for option in OPTIONS.values() for flag in option.flags if option.choices}
_FLAG = re.compile(r"(--[a-z][a-z-]*)(?:[ =]([-+\w.]*\w))?")


def in_python(text: str) -> str:
    """A message with the names of Python arguments instead of the flags of the command line."""
    for words, argument in _SPECIAL.items():
        text = re.sub(re.escape(words) + r"\b", argument, text)
    return _FLAG.sub(_argument, text)


def _argument(found: re.Match[str]) -> str:
    flag, word = found.groups()
    if flag not in _NAMES:
        return found[0]
    if word is None:
        return _NAMES[flag]
    if word in _WORDS.get(flag, ()):
        return f'{_NAMES[flag]}="{word}"'
    is_number = re.fullmatch(r"[-+]?\d[\w.+-]*", word)
    return f"{_NAMES[flag]}={word}" if is_number else f"{_NAMES[flag]} {word}"
