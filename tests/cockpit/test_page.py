"""The page in a real browser: a click sets the goal and the robot turns towards it, a push moves it; no error anywhere."""

import threading

import numpy as np
import pytest

from quadpips_drake.cockpit.choices import BY_VELOCITY, Choice
from quadpips_drake.cockpit.server import address, open_port, run
from quadpips_drake.cockpit.session import Session
from tests.browser import browser, complaints

pytestmark = pytest.mark.skip(reason="not seen to pass yet: Meshcat in software starves the simulation")
PATIENCE = 240.0
"""Only ends a test that hangs [s]."""


@pytest.fixture(scope="module")
def chromium():
    with browser() as chromium:
        yield chromium


@pytest.fixture
def opened(chromium):
    """Opens a page of a new cockpit: (page, session, complaints); the page's button ends the cockpit afterwards."""
    ends = []

    def make(choice):
        sockets = open_port("localhost", 0)
        session = Session(choice, meshcat_host="localhost", speed=None, paused=True)
        options = {"host": "localhost", "ready": lambda: None}
        thread = threading.Thread(target=run, args=(session, sockets), kwargs=options)
        thread.start()
        page = chromium.new_page(viewport={"width": 1500, "height": 900})
        page.set_default_timeout(1000 * PATIENCE)
        found = complaints(page)
        where = address("localhost", sockets[0].getsockname()[1])
        page.goto(where)
        ends.append((page, thread))
        return page, session, found

    yield make
    for page, thread in ends:
        page.click("#end")
        page.wait_for_selector("text=the cockpit has ended")
        page.close()
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


@pytest.mark.slow
def test_a_click_sets_the_goal_and_the_robot_turns_towards_it(opened):
    page, session, found = opened(Choice(robot="go2", terrain="flat"))
    click_map(page, session, 0.6, 1.6)
    moved = session.wait_for(lambda s: s.goal and s.goal[1] > 1.0, PATIENCE)
    assert moved.goal == pytest.approx((0.6, 1.6), abs=0.05)
    turned = session.wait_for(lambda s: s.state == "over" or (s.rpy and s.rpy[2] > 0.25), PATIENCE)
    assert turned.rpy[2] > 0.25, turned
    page.wait_for_selector("#events li:has-text('goal at')")
    page.wait_for_selector("#timings td:has-text('torso')")
    for picture in ("camera", "labels"):
        page.wait_for_function(f"document.getElementById('{picture}').naturalWidth > 0")
    page.frame_locator("#meshcat").locator("canvas").first.wait_for()
    assert found == []


def test_a_walk_is_pushed_paused_stepped_and_blocked(opened):
    page, session, found = opened(Choice(robot="go2", terrain="flat", planner=BY_VELOCITY))
    session.wait_for(lambda s: s.time > 0.3, PATIENCE)
    page.click("#pause")
    stood = session.wait_for(lambda s: s.state == "paused", PATIENCE)
    page.fill("#force", "60")
    page.click("[data-push='0,1,0']")
    page.click("#leap")
    pushed = session.wait_for(lambda s: s.state == "paused" and s.time > stood.time + 0.095, PATIENCE)
    assert pushed.time == pytest.approx(stood.time + 0.1)
    assert pushed.velocity[1] > 0.05
    page.click("#step")
    moved = session.wait_for(lambda s: s.state == "paused" and s.time > stood.time + 0.105, PATIENCE)
    assert moved.time == pytest.approx(stood.time + 0.11)

    page.check("#kinds input[value=wall]")
    click_map(page, session, 1.5, 0.5)
    assert session.wait_for(lambda s: s.stock["wall"] == 2, PATIENCE).stock["wall"] == 2
    page.uncheck("[data-layer=regions] input")
    assert not session.wait_for(lambda s: not s.layers["regions"], PATIENCE).layers["regions"]
    page.locator("[data-axis=forward]").fill("0.4")
    page.click("#pause")
    walking = session.wait_for(lambda s: s.position[0] > moved.position[0] + 0.1, PATIENCE)
    assert walking.command == (0.4, 0.0, 0.0)
    assert np.abs(walking.rpy[:2]).max() < 0.3

    second = page.context.new_page()
    second.goto(page.url)
    second.wait_for_function("last !== null")
    second.close()
    later = session.snapshot.time
    assert session.wait_for(lambda s: s.time > later + 0.1, PATIENCE).state == "running"
    assert found == []
