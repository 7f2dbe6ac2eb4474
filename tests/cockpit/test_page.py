"""The page in a real browser: a click sets the goal and the robot turns towards it, a push moves it; no error anywhere.

One cockpit for all tests, in their order: to build a robot and to open a browser takes longer than most of them.
"""

import threading

import numpy as np
import pytest

from quadpips_drake.cockpit.choices import BY_VELOCITY, Choice
from quadpips_drake.cockpit.server import address, open_port, run
from quadpips_drake.cockpit.session import Session
from tests.browser import browser, complaints

PATIENCE = 240.0
"""Only ends a test that hangs [s]."""


@pytest.fixture(scope="module")
def cockpit():
    """(page, session, complaints) of a Go2 that walks by velocity; in the end its page ends it.

    Without a 3-D view: drawn in software it would take the processor from the simulation.
    """
    with browser() as chromium:
        sockets = open_port("localhost", 0)
        session = Session(
            Choice(robot="go2", planner=BY_VELOCITY, terrain="flat"), meshcat_host="localhost", speed=None, paused=True
        )
        thread = threading.Thread(target=run, args=(session, sockets), kwargs={"host": "localhost", "ready": lambda: None})
        thread.start()
        try:
            page = chromium.new_context(viewport={"width": 1500, "height": 900}).new_page()
            page.set_default_timeout(1000 * PATIENCE)
            found = complaints(page)
            page.goto(address("localhost", sockets[0].getsockname()[1]) + "?view=off")
            yield page, session, found
            page.click("#end")
            page.wait_for_selector("text=the cockpit has ended")
        finally:
            session.close()
        thread.join(PATIENCE)
        assert not thread.is_alive()


def click_map(page, session, x, y):
    """Clicks where the map shows x, y [m]."""
    low, high, bottom, top = session.wait_for(lambda s: s.view, PATIENCE).view
    page.wait_for_function("map.snapshot && map.snapshot.view.length")
    box = page.locator("#map").bounding_box()
    page.mouse.click(
        box["x"] + (x - low) / (high - low) * box["width"], box["y"] + (top - y) / (top - bottom) * box["height"]
    )


def test_the_robot_is_paused_pushed_and_goes_on_step_by_step(cockpit):
    page, session, found = cockpit
    session.wait_for(lambda s: s.time > 0.05, PATIENCE)
    page.click("#pause")
    stood = session.wait_for(lambda s: s.state == "paused", PATIENCE)
    page.fill("#force", "60")
    page.click("[data-push='0,1,0']")
    page.click("#leap")
    pushed = session.wait_for(lambda s: s.state == "paused" and s.time > stood.time + 0.095, PATIENCE)
    assert pushed.time == pytest.approx(stood.time + 0.1)
    assert pushed.velocity[1] > stood.velocity[1] + 0.05
    page.click("#step")
    moved = session.wait_for(lambda s: s.state == "paused" and s.time > stood.time + 0.105, PATIENCE)
    assert moved.time == pytest.approx(stood.time + 0.11)
    page.wait_for_selector("#events li.you:has-text('pushed with 60 N')")
    assert found == []


def test_a_click_puts_a_wall_there_and_layers_and_the_view_are_switched(cockpit):
    page, session, found = cockpit
    page.check("#kinds input[value=wall]")
    click_map(page, session, 1.5, 0.5)
    assert session.wait_for(lambda s: s.stock["wall"] == 2, PATIENCE).stock["wall"] == 2
    page.uncheck("[data-layer=pushes] input")
    assert not session.wait_for(lambda s: not s.layers["pushes"], PATIENCE).layers["pushes"]
    assert not page.locator("[data-layer=regions]").is_visible(), "who sees nothing has none"
    page.check("#view")  # while time stands still
    page.frame_locator("#meshcat").locator("canvas").first.wait_for()
    page.uncheck("#view")
    page.locator("#no-view").wait_for()
    assert found == []


def test_a_slider_makes_it_walk_while_a_second_page_comes_and_goes(cockpit):
    page, session, found = cockpit
    session.wait_for(lambda s: s.position, PATIENCE)
    before = session.snapshot.position[0]
    page.uncheck("[data-layer=command] input")
    page.locator("[data-axis=forward]").fill("0.4")
    if session.snapshot.state == "paused":
        page.click("#pause")
    asked = session.wait_for(lambda s: s.command == (0.4, 0.0, 0.0), PATIENCE)
    assert (asked.gait, asked.command) == ("trot", (0.4, 0.0, 0.0))
    second = page.context.new_page()
    second.set_default_timeout(1000 * PATIENCE)
    found_there = complaints(second)
    second.goto(page.url)
    second.wait_for_function("settled > 0")
    assert second.locator("[data-axis=forward]").input_value() == "0.4", "it shows what the first page has set"
    assert not second.locator("[data-layer=command] input").is_checked()
    for sent, told in (
        ("link.send('['.repeat(9000))", "no JSON"),
        ("send({ do: 'goal', x: NaN, y: 0 })", "must be a number"),
        ("link.send('x'.repeat(20000))", "too large"),
    ):
        second.evaluate(sent)
        second.wait_for_function("told => document.getElementById('notice').textContent.includes(told)", arg=told)
    second.wait_for_function("link.readyState === WebSocket.OPEN && settled > 0")  # it has linked anew
    second.close()
    walking = session.wait_for(lambda s: s.state == "over" or s.position[0] > before + 0.15, PATIENCE)
    assert walking.position[0] > before + 0.15 and np.abs(walking.rpy[:2]).max() < 0.3
    assert found == [] and found_there == []


@pytest.mark.slow
def test_a_click_sets_the_goal_and_the_robot_turns_towards_it(cockpit):
    page, session, found = cockpit
    page.select_option("#choice [name=planner]", "quadpips")
    page.click("#choice button")
    session.wait_for(lambda s: s.number == 2 and s.view, PATIENCE)
    page.wait_for_function("settled === 2")
    page.check("#click input[value=goal]")
    click_map(page, session, 0.3, 1.8)
    moved = session.wait_for(lambda s: s.goal and s.goal[1] > 1.0, PATIENCE)
    assert moved.goal == pytest.approx((0.3, 1.8), abs=0.05)
    turned = session.wait_for(lambda s: s.state == "over" or (s.rpy and s.rpy[2] > 0.2), PATIENCE)
    assert turned.rpy[2] > 0.2, turned
    page.wait_for_selector("#events li.you:has-text('goal at')")
    page.wait_for_selector("#timings td:has-text('torso')")
    for picture in ("camera", "labels"):
        page.wait_for_function(f"document.getElementById('{picture}').naturalWidth > 0")
    assert page.locator("[data-layer=regions]").is_visible()
    assert found == []
