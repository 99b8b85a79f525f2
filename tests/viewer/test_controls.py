"""What a page may ask: on the wire, in the inbox, and by hand in a real browser with a real run behind it."""

import json
import math
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.browser import Browser, find_chromium
from tests.viewer.fake_run import DUST, dust, fake_scene
from tests.viewer.playing import Playing
from tests.viewer.watcher import Watcher, eventually
from warpsim import Scene, Simulation
from warpsim.observers.viewer import Command, Status, Viewer
from warpsim.observers.viewer.controls import FASTEST, LAST_FRAME, MOST_COMMANDS, SLOWEST, Bulletin, Inbox
from warpsim.observers.viewer.protocol import read_reply

SLIDERS = (("gravity.1", -20.0, 0.0, -9.81), ("flow.<b>.circulation", 0.0, 4.0, None))


@pytest.mark.parametrize(
    ("message", "command"),
    [
        ({"type": "play"}, Command("play")),
        ({"type": "step"}, Command("step")),
        ({"type": "seek", "value": 12}, Command("seek", 12)),
        ({"type": "seek", "value": -3}, Command("seek", 0)),
        ({"type": "seek", "value": 10**40}, Command("seek", LAST_FRAME)),
        ({"type": "speed", "value": 99}, Command("speed", FASTEST)),
        ({"type": "speed", "value": -1}, Command("speed", SLOWEST)),
        ({"type": "set", "control": 1, "value": 2}, Command("set", (1, 2.0))),
    ],
)
def test_commands_are_read(message, command):
    assert read_reply(json.dumps(message)) == command


@pytest.mark.parametrize(
    "message",
    [
        '{"type": "play", "value": 1}',
        '{"type": "speed", "value": NaN}',
        '{"type": "speed", "value": 1e999}',
        '{"type": "speed", "value": true}',
        '{"type": "speed", "value": "1"}',
        '{"type": "seek", "value": 1.5}',
        '{"type": "seek", "value": true}',
        '{"type": "seek"}',
        '{"type": "set", "control": "gravity", "value": 1}',
        '{"type": "set", "control": 0}',
        '{"type": "set", "control": 0, "value": Infinity}',
        '{"type": "set", "control": 0, "value": 1' + "0" * 400 + "}",
        '{"type": "set", "path": "gravity", "value": 1}',
        '{"type": "eval", "value": "1"}',
    ],
)
def test_other_wishes_are_refused(message):
    with pytest.raises(ValueError):
        read_reply(message)


def controls():
    return fake_scene({}, sliders=SLIDERS).sliders


@given(st.lists(st.tuples(st.integers(-3, 5), st.floats(allow_nan=False, allow_infinity=False))))
def test_only_listed_numbers_within_their_range_come_through(wishes):
    inbox = Inbox(controls())
    for wish in wishes:
        inbox.put(Command("set", wish))
    ranges = {path: (low, high) for path, low, high, _ in SLIDERS}
    for command in inbox.drain():
        path, value = command.value
        assert ranges[path][0] <= value <= ranges[path][1]


def test_a_slider_overwrites_itself_and_steps_count():
    inbox = Inbox(controls())
    for value in (-1.0, -2.0, -3.0):
        inbox.put(Command("set", (0, value)))
    inbox.put(Command("step"))
    inbox.put(Command("step"))
    for frame in range(50):
        inbox.put(Command("seek", frame))
    assert inbox.drain() == [Command("set", ("gravity.1", -3.0)), Command("step"), Command("step"), Command("seek", 49)]
    assert inbox.drain() == []
    for _ in range(10 * MOST_COMMANDS):
        inbox.put(Command("step"))
    assert len(inbox.drain()) == MOST_COMMANDS


def test_words_go_out_ten_times_a_second_and_changes_at_once():
    bulletin, sent = Bulletin(), []
    for tick in range(200):  # two seconds of a run that tells a hundred times a second
        status = Status(index=tick, values={"a": float(tick >= 55)})
        if bulletin.worth(status, tick * 0.01):
            sent.append(tick)
    assert 55 in sent and 15 <= len(sent) <= 22
    paused = Status(playing=False, index=7)
    assert bulletin.worth(paused, 2.001) and not bulletin.worth(paused, 9.0)
    assert bulletin.worth(Status(playing=False, index=8), 2.002)


def status_of(watcher: Watcher) -> dict | None:
    """Return the last status a page was told."""
    return next((c for c in reversed(watcher.commands) if c["type"] == "warpsim_status"), None)


def test_every_page_hears_the_last_status_and_lines_once():
    with Viewer(fake_scene({"dust": ("points", "alpha")}, sliders=SLIDERS), port=0) as viewer:
        with Watcher(viewer.url) as first:
            viewer.tell(Status(index=1, values={"gravity.1": -9.81, "broken": math.nan}))
            viewer.show_lines(np.zeros((2, 5, 3)))
            viewer.show_lines(np.ones((3, 5, 3)))
            assert eventually(viewer.wants_frame)
            viewer.publish(dust(1))
            first.read_frame()
            told = status_of(first)
            assert told["index"] == 1 and told["values"] == {"gravity.1": -9.81}
            with Watcher(viewer.url) as late:
                late.read_frame()
                assert status_of(late) == told
                lines = [c for c in late.commands if c["type"] == "warpsim_lines"]
                assert len(lines) == 1 and np.frombuffer(lines[0]["places"], np.float32).tolist() == [1.0] * 45
        with pytest.raises(ValueError):
            viewer.show_lines(np.zeros((5, 3)))


def test_a_hidden_page_gets_no_words_and_no_frames():
    with Viewer(DUST, port=0) as viewer, Watcher(viewer.url) as hidden:
        for index in (1, 2):
            assert eventually(viewer.wants_frame)
            viewer.publish(dust(index))
            hidden.read_frame()
        for index in range(50):
            viewer.tell(Status(playing=False, index=index))
        assert hidden.silent() and not viewer.wants_frame()
        hidden.ack(2)
        viewer.publish(dust(3))
        assert hidden.read_frame().time == 3 / 60 and status_of(hidden)["index"] == 49


def test_commands_reach_the_run_and_a_moment_is_shown_again_after_one():
    with Viewer(fake_scene({"dust": ("points", "alpha")}, sliders=SLIDERS), port=0) as viewer, Watcher(viewer.url) as watcher:
        assert eventually(viewer.wants_frame)
        viewer.publish(dust(1))
        watcher.ack(watcher.read_frame().number)
        for message in ({"type": "pause"}, {"type": "set", "control": 7, "value": 1}, {"type": "set", "control": 0, "value": 5}):
            watcher.say(message)
        commands = []
        assert eventually(lambda: commands.extend(viewer.commands()) or len(commands) == 2)
        assert commands == [Command("pause"), Command("set", ("gravity.1", 0.0))]
        viewer.publish(dust(1))
        watcher.read_frame()


def test_a_run_that_stands_still_shows_all_points():
    with Viewer(fake_scene({"dust": ("points", "alpha")}, max_points=300), port=0) as viewer, Watcher(viewer.url) as watcher:
        assert eventually(viewer.wants_frame)
        viewer.publish(dust(1))
        seen = watcher.read_frame()
        assert len(seen.blocks[0, 0]) <= 300 and seen.blocks[0, 7] == 1000
        watcher.ack(seen.number)
        viewer.publish(dust(1), full=True)
        assert len(watcher.read_frame().blocks[0, 0]) == 1000


SCENE = {
    "name": "Rain",
    "controls": [{"path": "gravity.1", "min": -20, "max": 0}, {"path": "systems.rain.emitters.0.rate", "min": 0, "max": 1000}],
    "camera": {"eye": [0, 1, 6], "target": [0, 0, 0]},
    "viewer": {"show": ["emitters"]},
    "systems": {
        "rain": {
            "type": "particles",
            "capacity": 5000,
            "emitters": [{"shape": {"type": "box", "center": [0, 2, 0], "size": [2, 0.1, 2]}, "rate": 600, "lifetime": 0.8}],
        }
    },
}


@pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")
def test_a_person_plays_pauses_steps_resets_seeks_and_moves_a_slider():
    simulation = Simulation(Scene.model_validate(SCENE), device="cpu", threads=1)
    press = "document.dispatchEvent(new KeyboardEvent('keydown', {{key: '{}', bubbles: true}}))"
    move = "(() => {{ const input = controls.sliders[{}].input; input.value = {}; input.dispatchEvent(new Event('input')); }})()"
    with Browser((640, 480)) as browser, Viewer(simulation.scene, port=0) as viewer, Playing(simulation, viewer) as run:
        page = browser.open(viewer.url)
        page.wait_for("controls.state !== null && stream.frames > 0")
        assert page.run("!document.getElementById('bar').hidden && !document.getElementById('panel').hidden")

        def press_key(key: str) -> None:
            page.run(press.format(key))

        press_key(" ")
        page.wait_for("controls.state.playing && controls.index > 40")
        press_key(" ")
        page.wait_for("!controls.state.playing")
        held = simulation.index
        time.sleep(0.1)
        assert simulation.index == held
        page.wait_for(f"controls.index === {held} && Math.round(stream.time * 60) === {held}")
        page.run("document.getElementById('step').click()")
        page.wait_for(f"controls.index === {held + 1} && Math.round(stream.time * 60) === {held + 1}")
        assert page.run("stream.clouds[0].live") == simulation.frame()["rain"].count
        before = page.run("stream.clouds[0].live")

        # The slider changes the simulation, the simulation's numbers come back, and the data shows it.
        page.run(move.format(0, -3.5))
        page.wait_for("controls.state.values['gravity.1'] === -3.5")
        assert simulation.scene.gravity[1] == -3.5
        page.run(move.format(1, 0))
        page.wait_for("controls.state.values['systems.rain.emitters.0.rate'] === 0")
        press_key("ArrowRight")  # a second on: all the rain has fallen
        page.wait_for(f"controls.index === {held + 61}")
        page.wait_for("stream.clouds[0].live === 0")
        press_key("r")
        page.wait_for("controls.index === 0 && stream.time === 0")
        page.run("(() => { const s = document.getElementById('seek'); s.value = 30; s.dispatchEvent(new Event('input')); })()")
        page.wait_for("controls.index === 30 && Math.round(stream.time * 60) === 30 && stream.clouds[0].live > 0")
        assert page.run("stream.clouds[0].live") == simulation.frame()["rain"].count != before

        # A second tab shows the same, sliders and all.
        second = browser.open(viewer.url)
        second.wait_for("controls.state !== null && controls.index === 30 && stream.clouds[0].count > 0")
        look = (
            "[controls.state.index, controls.sliders.map(s => s.input.value), stream.clouds[0].live, document.getElementById('seek').value]"
        )
        page.wait_for("controls.sliders[0].input.value === '-9.81'")  # at that moment the slider had not been moved yet
        assert second.run(look) == page.run(look)
        press_second = press.format(".")
        second.run(press_second)
        second.wait_for("controls.index === 31")
        page.command("Page.bringToFront")
        page.wait_for("controls.index === 31 && Math.round(stream.time * 60) === 31")
        assert page.run("stream.lines.drawn.get('emitters').visible")
        assert page.run("viewer.renderer.getContext().getError()") == 0
        assert page.complaints() == [] and second.complaints() == []
        assert {"play", "pause", "step", "set", "seek", "reset"} == {command.kind for command in run.log}
