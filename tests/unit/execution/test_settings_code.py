"""What of a program says how long a step is: statements that read it, and what those take."""

import textwrap

from carom.engines.api import CodedAdapter
from carom.engines.registry import load_adapter
from carom.execution.pool import InProcessPool
from carom.execution.settings_code import find_changed_code, find_changed_lines, find_step_code, find_step_lines
from carom.model.scene import Disc, Scene

#: A program as an adapter writes one, with a place for the step, its number, and what depends on it.
PROGRAM = textwrap.dedent("""
    # A heading.
    import engine

    dt, steps = {dt}, {steps}
    unused = 3.0
    scale = 8.0
    world = engine.World()
    world.iterations = 10
    world.margin({margin})


    def add_disc(position, step=None):
        if step is None:
            world.add(position, dt)


    add_disc((1.0, 2.0))
    for _ in range(steps):
        world.step(dt / scale)
    print(world)
""").lstrip()


def test_statements_that_read_the_step_or_change_with_it_are_given_with_the_constants_that_they_take() -> None:
    """The step, its number, the scale of the loop, what differs, and the loop; no disc, no import, nothing else."""
    here, finer = (PROGRAM.format(dt=dt, steps=n, margin=m) for dt, n, m in ((0.1, 2, 5), (0.05, 4, 7)))
    assert find_step_lines(here, finer).splitlines() == [
        "dt, steps = 0.1, 2",
        "scale = 8.0",
        "world.margin(5)",
        "for _ in range(steps):",
        "    world.step(dt / scale)",
    ]
    assert find_step_lines(here, here).splitlines()[2] == "for _ in range(steps):"


def test_of_a_model_the_lines_that_differ_are_given_without_comments() -> None:
    """An element that names the step is given, one that does not is not, and a comment of several lines is none."""
    model = '<!-- {n} steps\n of it -->\n<mujoco>\n  <option timestep="{dt}"/>\n  <geom size="1"/>\n</mujoco>\n'
    found = find_step_lines(model.format(n=3, dt=0.1), model.format(n=6, dt=0.05))
    assert found == '<option timestep="0.1"/>'


def test_a_module_of_node_has_no_lines_of_its_own() -> None:
    """It steps a world of its own making."""
    assert find_step_lines("// A module.\nconst steps = 3;\n", "// A module.\nconst steps = 6;\n") == ""


def test_a_frame_of_a_scene_is_what_the_code_is_of() -> None:
    """At six steps a frame the program takes six, whatever the scene's length; who writes no code has no lines."""
    scene = Scene(name="one", discs=[Disc(position_m=(0, 0), radius_m=1.0)], duration_s=7.0, frame_rate_hz=60)
    with InProcessPool() as pool:
        found = find_step_code("pymunk", "tuned", scene, 1 / 360, pool)
        assert find_step_code("pit", "tuned", scene, 1 / 360, pool) == ""
    assert found.splitlines() == [f"dt, steps = {1 / 360!r}, 6", "for _ in range(steps):", "    space.step(dt)"]
    adapter = load_adapter("pymunk")
    assert isinstance(adapter, CodedAdapter)
    whole = adapter.code(scene, adapter.profiles["tuned"].settings(1 / 360), "A heading.").splitlines()
    assert set(found.splitlines()[1:]) <= set(whole)


def test_statements_that_change_are_given_with_those_that_read_them() -> None:
    """A setting that is turned brings its own statement, and a scale those that are computed with it; no more."""
    here = PROGRAM.format(dt=0.1, steps=2, margin=5)
    assert find_changed_lines(here, here) == ""
    assert find_changed_lines(here.replace("iterations = 10", "iterations = 30"), here) == "world.iterations = 30"
    assert find_changed_lines(here.replace("scale = 8.0", "scale = 2.0"), here).splitlines() == [
        "scale = 2.0",
        "for _ in range(steps):",
        "    world.step(dt / scale)",
    ]


def test_what_is_not_python_gives_its_changed_lines() -> None:
    """Lines of a model, without comments, and of a module of node."""
    model = '<!-- a\n {n} -->\n<mujoco>\n  <option iterations="{n}"/>\n</mujoco>\n'
    assert find_changed_lines(model.format(n=2), model.format(n=1)) == '<option iterations="2"/>'
    module = "// {n}\nimport a\nconst slop = {n};\n"
    assert find_changed_lines(module.format(n=2), module.format(n=1)) == "const slop = 2;"


def test_settings_that_are_tried_are_said_in_the_engines_own_code() -> None:
    """Twenty iterations are one line of pymunk's; who writes no code has none."""
    scene = Scene(name="one", discs=[Disc(position_m=(0, 0), radius_m=1.0)], duration_s=0.1)
    with InProcessPool() as pool:
        assert (
            find_changed_code("pymunk", "default", (("iterations", 20),), scene, 1 / 60, pool)
            == "space.iterations = 20"
        )
        assert find_changed_code("pit", "tuned", (), scene, 1 / 60, pool) == ""
