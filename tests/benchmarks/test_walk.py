"""The walk of a reader through files: what is a return to a room, and what a traced call is counted as."""

import palpate.mechanics.names
from tools.walk import Walk, returns, stretches

FILES = ["a.one", "a.two", "b.one", "a.three", "c.one", "b.two", "a.four"]


def test_a_return_is_another_file_of_a_room_that_was_left():
    assert [room for room, _ in stretches(FILES)] == ["a", "b", "a", "c", "b", "a"]
    assert returns(FILES) == {"a": 2, "b": 1}


def test_a_file_is_entered_once_by_its_first_call():
    with Walk() as walk:
        palpate.mechanics.names.unknown("on", "word", ["one", "two"])
        palpate.mechanics.names.unknown("to", "word", ["one", "two"])
    assert (
        list(walk.files) == ["palpate.mechanics.names"] and walk.files["palpate.mechanics.names"] == "unknown"
    )
