"""A readable ASCII form of any text, for outputs that accept only ASCII."""

import unicodedata

_REPLACEMENTS = {
    "°": " deg",
    "√": "sqrt",
    "∫": "integral of ",
    "⊗": "(x)",
    "×": "x",
    "⁄": "/",
    "→": "->",
    "←": "<-",
    "…": "...",
    "±": "+-",
    "≤": "<=",
    "≥": ">=",
    "≈": "~",
    "█": "#",
    **dict.fromkeys("µμ", "u"),
    **dict.fromkeys("−–—─━", "-"),
    **dict.fromkeys("·●★•", "*"),
    **dict.fromkeys("‘’“”", "'"),
    **dict.fromkeys("│┃", "|"),
}
"""ASCII for some characters, without double quotes and backslashes, so JSON stays valid."""


def ascii_for(text: str) -> str:
    """A readable ASCII form of a text: m/s² as m/s^2, ω as omega, ċ as c."""
    ascii_characters: list[str] = []
    is_super = False
    for char in text:
        was_super, is_super = is_super, unicodedata.decomposition(char).startswith("<super>")
        if is_super and not was_super:
            ascii_characters.append("^")
        ascii_characters.append(char if char.isascii() else _ascii_for_char(char))
    return "".join(ascii_characters)


def _ascii_for_char(char: str) -> str:
    """ASCII for one non-ASCII character: a replacement, else its base letter or `_ascii_name`."""
    if char in _REPLACEMENTS:
        return _REPLACEMENTS[char]
    base_characters = [
        base for base in unicodedata.normalize("NFKD", char) if not unicodedata.combining(base)
    ]
    return "".join(
        base if base.isascii() else _REPLACEMENTS.get(base) or _ascii_name(base)
        for base in base_characters
    )


def _ascii_name(char: str) -> str:
    """ASCII for a character without a replacement, by its Unicode name.

    A Greek letter becomes its name, a box-drawing character `+`, a Braille pattern `*`, and
    anything else `?`.
    """
    name = unicodedata.name(char, "")
    if name.startswith("GREEK "):
        letter = name.split(" WITH ")[0].rsplit(" ", 1)[-1].lower()
        return letter.capitalize() if "CAPITAL" in name else letter
    if name.startswith("BOX DRAWINGS"):
        return "+"
    return "*" if name.startswith("BRAILLE PATTERN") else "?"
