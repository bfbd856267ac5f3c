"""Foreign text is shown with every hidden character as an escape."""

import unicodedata

import pytest

from gensig.text.escaping import escaped, one_line

HOSTILE = {
    "\x1b[31mred": "\\x1b[31mred",
    "whole\rNOT whole": "whole\\rNOT whole",
    "a\nb": "a\\nb",
    "a\tb": "a\\tb",
    "\x07\x08\x7f": "\\x07\\x08\\x7f",
    "\x9b31m": "\\x9b31m",
    "\x85": "\\x85",
    "a\u2028b\u2029": "a\\u2028b\\u2029",
    "\u202egnp.exe": "\\u202egnp.exe",
    "\u2066x\u2069": "\\u2066x\\u2069",
    "cra\u200bck": "cra\\u200bck",
    "\ufeffcrack": "\\ufeffcrack",
    "\u3164": "\\u3164",
    "\U000e0041": "\\U000e0041",
    b"\xff.h5".decode("utf-8", "surrogateescape"): "\\xff.h5",
    "\ud800": "\\ud800",
}


@pytest.mark.parametrize("text", HOSTILE)
def test_hidden_characters_are_shown(text):
    assert escaped(text) == HOSTILE[text]


@pytest.mark.parametrize(
    "text",
    ["", "crack, 3.2 mm", "m/s\u00b2 \u00b5m", "Z\u00e4hne", "\u9f7f\u8f6e", "C:\\new"],
)
def test_ordinary_text_is_shown_as_it_is(text):
    assert escaped(text) == text


def test_no_control_character_of_unicode_is_left():
    """The rule, not a list: also what Unicode adds later."""
    hidden = {"Cc", "Cf", "Cs", "Zl", "Zp"}
    for code in range(0x110000):
        character = chr(code)
        if unicodedata.category(character) in hidden:
            assert escaped(character).isascii(), hex(code)


def test_a_message_is_one_line_and_cannot_return_to_its_beginning():
    text = "out of\n  memory\r gensig: all is whole\x1b[2K"
    assert one_line(text) == "out of memory\\r gensig: all is whole\\x1b[2K"
    assert " ".join(text.split()).endswith("\x1b[2K")  # as it was
