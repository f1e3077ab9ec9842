"""Our words as STATUSTEXT frames: pymavlink reads them, and the assembler joins them again."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.mavlink.texts import TextAssembler, TextFrames


def read(frames):
    parser = dialect.MAVLink(None)
    return [parser.parse_char(frame) for frame in frames]


@pytest.mark.parametrize("length", [0, 1, 49, 50, 51, 99, 100, 101, 250])
def test_a_text_of_any_length_comes_back_whole(length):
    words = ("abcdefghi " * 30)[:length].strip()
    messages = read(TextFrames(7).frames(words))
    assembler = TextAssembler()
    for message in messages:
        assert (message.get_srcSystem(), message.get_srcComponent()) == (7, 155)
        assembler.take(message, 1.0)
    assert [text.text for text in assembler.texts] == ([words] if words else [])


def test_two_long_texts_are_told_apart_and_numbered_without_gaps():
    writer = TextFrames(1)
    messages = read([*writer.frames("a" * 70), *writer.frames("b" * 70), *writer.frames("c")])
    assert [message.id for message in messages] == [1, 1, 2, 2, 0]
    assert [message.chunk_seq for message in messages] == [0, 1, 0, 1, 0]
    assert [message.get_seq() for message in messages] == [1, 2, 3, 4, 5]


def test_what_is_not_ascii_is_transliterated():
    (message,) = read(TextFrames(1).frames("35° → 2 µs"))
    assert message.text == "35 deg -> 2 us"
