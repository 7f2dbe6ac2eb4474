"""The session behind the cockpit, without a browser: what is asked for is done between two steps, and told."""

import numpy as np
import pytest

from quadpips_drake.cockpit.choices import BY_VELOCITY, SAMPLE_RATE, Choice, possibilities
from quadpips_drake.cockpit.controls import Enough
from quadpips_drake.cockpit.live_trial import LiveTrial
from quadpips_drake.cockpit.session import Session
from quadpips_drake.cockpit.stock import OF_EACH
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.observation import read

WALK = Choice(robot="go2", terrain="flat", planner=BY_VELOCITY)
PATIENCE = 300.0
"""Nothing is measured by the clock; this only ends a test that hangs [s]."""


@pytest.fixture(scope="module")
def session():
    """A Go2 that walks by velocity, and stands still at first."""
    session = Session(WALK, speed=None, paused=True)
    yield session
    session.close()


def at(session, time):
    """The snapshot in which the session stands still at ``time`` [s]."""
    snapshot = session.wait_for(lambda s: s.state == "paused" and abs(s.time - time) < 1e-6, PATIENCE)
    assert (snapshot.state, snapshot.time) == ("paused", pytest.approx(time)), snapshot
    return snapshot


def after(session, steps):
    """The snapshot after so many steps from now."""
    session.wait_for(lambda s: s.state == "paused", PATIENCE)
    time = session.snapshot.time + steps / SAMPLE_RATE
    session.step(steps)
    return at(session, time)


def said(snapshot, kind):
    return [happening.text for happening in snapshot.happenings if happening.kind == kind]


def test_steps_let_time_go_on_exactly(session):
    assert at(session, 0.0).choice == WALK
    assert after(session, 1).time == pytest.approx(0.01)
    assert after(session, 7).time == pytest.approx(0.08)
    session.pause(False)
    assert session.wait_for(lambda s: s.time > 0.1, PATIENCE).state == "running"
    session.pause()
    stood = session.wait_for(lambda s: s.state == "paused", PATIENCE)
    assert after(session, 0).time == stood.time


def test_a_push_moves_the_robot(session):
    after(session, 40)
    session.push(0.0, 60.0, 0.0, 0.1)
    pushed = after(session, 9)
    assert pushed.push == pytest.approx((0.0, 60.0, 0.0), abs=3.0), "the robot looks along x of the world"
    assert pushed.velocity[1] > 0.05
    moved = after(session, 2)
    assert moved.push == (0.0, 0.0, 0.0)
    assert said(moved, "you")[-1] == "pushed with 60 N for 0.1 s (6 N s)"


def test_what_is_spawned_is_there(session):
    session.spawn("block", 1.2, 0.5)
    there = session.wait_for(lambda s: s.stock["block"] == OF_EACH - 1, PATIENCE)
    assert said(there, "you")[-1] == "a block at 1.20, 0.50"
    assert there.pictures["map"] != "" and session.picture("map").startswith(b"\x89PNG")
    x, y, _ = there.position
    session.spawn("wall", x, y)
    refused = session.wait_for(lambda s: s.happenings[-1].kind == "trouble", PATIENCE)
    assert "the robot is there" in refused.happenings[-1].text
    assert refused.stock["wall"] == OF_EACH, "what could not be put there can be put elsewhere"


def test_a_command_makes_it_walk(session):
    before = after(session, 0)
    assert before.goal is None and before.gait in ("stance", "trot")
    session.command("trot", (0.4, 0.0, 0.0))
    walking = after(session, 100)
    assert walking.gait == "trot" and walking.command == (0.4, 0.0, 0.0)
    assert walking.position[0] > before.position[0] + 0.1
    session.move_goal(1.0, 0.0)
    assert "has no goal" in session.wait_for(lambda s: "goal" in s.happenings[-1].text, PATIENCE).happenings[-1].text


def test_the_camera_is_looked_through_and_layers_are_switched(session):
    shown = after(session, 1)
    assert "camera" in shown.pictures and session.picture("camera").startswith(b"\x89PNG")
    assert shown.timings["centroidal_mpc"][1] > 0.0
    session.show_layer("pushes", False)
    assert session.wait_for(lambda s: not s.layers["pushes"], PATIENCE).layers["command"]


def test_another_trial_begins_and_the_last_one_is_over(session):
    session.begin(Choice(robot="go2", terrain="flat", planner=BY_VELOCITY, seed=3, duration=0.05))
    over = session.wait_for(lambda s: s.number == 2 and s.state == "over", PATIENCE)
    assert over.note == "upright" and over.time == pytest.approx(0.05)
    session.begin(Choice(terrain="moon"))
    refused = session.wait_for(lambda s: s.number == 3 and s.state == "over", PATIENCE)
    assert "unknown terrain 'moon'" in refused.note


def test_a_moved_goal_is_what_the_next_plan_is_for():
    live = LiveTrial(Choice(robot="go2", terrain="flat"))
    trial = live.trial

    def look(trial):
        planning = trial.diagram.planning
        request = read(planning, "plan_request", planning.GetMyContextFromRoot(trial.context))
        if request.id:
            requests.append(request)
            raise Enough
        if trial.context.get_time() == pytest.approx(0.2):
            live.move_goal(0.5, 2.0)

    requests = []
    with pytest.raises(Enough):
        trial.run(look=look)
    np.testing.assert_allclose(requests[0].goal, [0.5, 2.0])
    assert live.world().goal == pytest.approx([0.5, 2.0])
    with pytest.raises(UserInputError, match="nothing"):
        live.move_goal(100.0, 0.0)
    assert live.goal == pytest.approx([0.5, 2.0]), "a goal that nobody can walk to changes nothing"


def test_a_file_that_was_chosen_stays_among_the_possibilities():
    lists = possibilities(Choice(terrain="mine.yaml"))
    assert "mine.yaml" in lists["terrain"] and "flat" in lists["terrain"] and "go2" in lists["robot"]
    assert lists["planner"][-1] == BY_VELOCITY and lists["gait"][0] == "stance"
