"""Writes a scene and settings as a program for ODE, which users can copy."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Scene, Setting
from carom_adapters.ode.limits import check_inputs
from carom_adapters.shared.settings_code import PYTHON_END, count_steps, format_body_lines, format_comment


def write_code(scene: Scene, settings: Mapping[str, Setting], heading: str) -> str:
    """Return a program that builds the same world as `OdeWorld`.

    Raises:
        AdapterError: ODE does not support the scene or a setting.
    """
    check_inputs(scene, settings)
    setters = {"cfm": "setCfm", "erp": "setErp", "quick_step_iterations": "setQuickStepNumIterations"}
    setter_lines = [f"world.{setter}({settings[name]!r})\n" for name, setter in setters.items() if name in settings]
    end = PYTHON_END.format(step="step()", state="*list(body.getPosition())[:2], *list(body.getLinearVel())[:2], 0.0")
    return f"""{format_comment(heading)}
from panda3d import core, ode

dt, steps = {float(settings["dt_s"])!r}, {count_steps(scene, settings)}
world, space, group = ode.OdeWorld(), ode.OdeHashSpace(), ode.OdeJointGroup()
world.setGravity({scene.gravity_m_s2[0]!r}, {scene.gravity_m_s2[1]!r}, 0.0)
{"".join(setter_lines)}discs, geoms, walls = [], [], set()


def add_disc(position, radius, mass=None, velocity=(0.0, 0.0)):
    geom = ode.OdeSphereGeom(space, radius)
    geoms.append(geom)
    if mass is None:
        geom.setPosition(*position, 0.0)
        discs.append(Still(position))
        return
    body, its = ode.OdeBody(world), ode.OdeMass()
    its.setSphereTotal(mass, radius)
    body.setMass(its)
    geom.setBody(body)
    body.setPosition(*position, 0.0)
    body.setLinearVel(*velocity, 0.0)
    discs.append(body)


class Still:  # an immovable disc is a geom without a body
    def __init__(self, position):
        self.position = position

    def getPosition(self):
        return self.position

    def getLinearVel(self):
        return (0.0, 0.0)


def add_wall(point, normal):
    (x, y), (nx, ny) = point, normal
    geoms.append(ode.OdePlaneGeom(space, core.LVecBase4f(nx, ny, 0.0, nx * x + ny * y)))
    walls.add(geoms[-1].getId().this)


def surface_of(bounce):
    surface = ode.OdeSurfaceParameters()
    surface.setMode(ode.OdeSurfaceParameters.MFContactBounce)
    surface.setBounce(bounce)
    return surface


of_discs, of_walls = surface_of({scene.restitution!r}), surface_of({scene.wall_restitution!r})


def near(_, first, second):
    if not first.hasBody() and not second.hasBody():
        return
    found = ode.OdeUtil.collide(first, second, 1)
    for k in range(found.getNumContacts()):
        contact = ode.OdeContact()
        contact.setGeom(found.getContactGeom(k))
        walled = first.getId().this in walls or second.getId().this in walls
        contact.setSurface(of_walls if walled else of_discs)
        ode.OdeContactJoint(world, group, contact).attach(first.getBody(), second.getBody())


def step():
    group.empty()
    space.collide("", near)
    world.{settings.get("stepper", "step")}(dt)


{format_body_lines(scene)}
{end}"""
