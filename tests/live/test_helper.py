"""The channel to the helper process never blocks, and `--watch` works through a real process."""

import asyncio
import time

import pytest

from companion.config.files import load
from companion.live.channel import Channel
from companion.live.helper import Helper, HelperTasks
from tests.live.pages import status


def test_a_process_that_does_not_read_costs_the_flight_nothing():
    channel, theirs = Channel.pair()
    slowest = 0.0
    for number in range(3000):
        began = time.perf_counter()
        channel.send({"kind": "status", "number": number, "text": "x" * 500})
        slowest = max(slowest, time.perf_counter() - began)
    assert channel.is_open
    assert channel.dropped > 1000
    assert slowest < 0.5
    theirs.close()
    assert not channel.send({"kind": "event"})
    assert not channel.is_open


@pytest.mark.parametrize("size", [200_000, 3_000_000])  # the socket takes 212 kB
def test_a_message_that_is_too_large_is_dropped(size):
    channel, theirs = Channel.pair()
    assert not channel.send({"text": "x" * size})
    assert channel.is_open
    assert channel.send({"text": "x"})
    theirs.close()


@pytest.mark.timeout(120)
def test_edits_of_the_file_reach_the_flight(tmp_path):
    path = tmp_path / "flown.yaml"
    path.write_text("planner: {gain_per_s: 5.0}\n")
    helper = Helper(HelperTasks(path, load(path), None, None, True, None), load(path))
    notes = []
    helper.note = helper.changes.note = notes.append

    async def until(text):
        for _ in range(600):
            helper.status(status(1.0))
            if any(text in note for note in notes):
                return
            await asyncio.sleep(0.1)
        raise AssertionError(notes)

    async def edit():
        await until("edits of flown.yaml are applied from now on")
        path.write_text("planner: {gain_per_s: 50.0}\n")
        await until("must be at most 20")
        path.write_text("planner: {gain_per_s: 4.0}\n")
        await until("planner.gain_per_s from 5 to 4")

    asyncio.run(helper.run_while_serving(edit()))
    assert [str(change) for change in helper.changes.all_changes] == [
        "changed by flown.yaml: planner.gain_per_s from 5 to 4"
    ]
    helper.close("over")
    assert helper._process.wait(30.0) == 0
