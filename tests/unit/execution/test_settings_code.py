"""Extracts from a program the lines that depend on the step, and the lines that a setting changes."""

import textwrap

from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, staged

from carom.execution.settings_code import find_changed_code, find_changed_lines, find_step_lines

#: A program like those of adapters, with fields for the step size, the number of steps, and values that depend on the
#: step.
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


def test_step_lines_are_statements_that_depend_on_the_step() -> None:
    """The step lines are the statements that change with the step, with the constants that they use."""
    here, finer = (PROGRAM.format(dt=dt, steps=n, margin=m) for dt, n, m in ((0.1, 2, 5), (0.05, 4, 7)))
    assert find_step_lines(here, finer).splitlines() == [
        "dt, steps = 0.1, 2",
        "scale = 8.0",
        "world.margin(5)",
        "for _ in range(steps):",
        "    world.step(dt / scale)",
    ]
    assert find_step_lines(here, here).splitlines()[2] == "for _ in range(steps):"


def test_models_and_javascript_modules_give_changed_lines() -> None:
    """XML models give their changed elements, and JavaScript modules their changed lines, both without comments."""
    model = '<!-- {n} steps\n of it -->\n<mujoco>\n  <option timestep="{dt}"/>\n  <geom size="1"/>\n</mujoco>\n'
    here, finer = model.format(n=3, dt=0.1), model.format(n=6, dt=0.05)
    assert find_step_lines(here, finer) == find_changed_lines(here, finer) == '<option timestep="0.1"/>'
    module = "// {n}\nimport a\nconst slop = {n};\n"
    assert find_changed_lines(module.format(n=2), module.format(n=1)) == "const slop = 2;"
    assert find_step_lines(module.format(n=2), module.format(n=1)) == ""


def test_changed_setting_of_an_engine_gives_its_statement() -> None:
    """A changed setting gives the statement of Pymunk that sets it; PIT has no code."""
    scene, pool = staged("one", disc_at(0, 0, r=1.0), duration_s=7.0), InProcessPool()
    changed = find_changed_code("pymunk", "default", (("iterations", 20),), scene, 1 / 60, pool)
    assert changed == "space.iterations = 20"
    assert find_changed_code("pit", "tuned", (), scene, 1 / 60, pool) == ""


def test_changed_lines_include_statements_that_use_them() -> None:
    """A changed setting gives its own statement, and a changed constant also the statements that use it."""
    here = PROGRAM.format(dt=0.1, steps=2, margin=5)
    assert find_changed_lines(here, here) == ""
    assert find_changed_lines(here.replace("iterations = 10", "iterations = 30"), here) == "world.iterations = 30"
    assert find_changed_lines(here.replace("scale = 8.0", "scale = 2.0"), here).splitlines() == [
        "scale = 2.0",
        "for _ in range(steps):",
        "    world.step(dt / scale)",
    ]
