"""What is simulated: discs, walls and a scene of them; validated, immutable, loaded from and saved to TOML or JSON."""

from __future__ import annotations

import math
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    Strict,
    ValidationError,
    WithJsonSchema,
    model_serializer,
)

from carom.arguments import shown
from carom.data_files import read_data
from carom.disc_arrays import DiscArrays
from carom.display import Drawn
from carom.errors import InputError, Problem, SceneError
from carom.limits import LARGEST, MOST_BYTES, MOST_DISCS, MOST_STEPS, MOST_WALLS, ORDINARY, SMALLEST, beyond
from carom.sizes import span_problems

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator

    from pydantic_core import ErrorDetails

__all__ = ["Disc", "Need", "Scene", "Wall", "load_scene", "save_scene", "scene_schema", "steps_to_cover"]

#: What a file may hold of each; a scene that a program makes may have more.
MOST_BODIES = {"discs": MOST_DISCS, "walls": MOST_WALLS}


def _plain(value: object) -> object:
    """Accept NumPy scalars and arrays wherever a plain number or list is accepted."""
    tolist = getattr(value, "tolist", None)
    return tolist() if callable(tolist) else value


def _infinity_from_text(value: object) -> object:
    return math.inf if value == "inf" else _plain(value)


def _mass_of_size(mass: float) -> float:
    if LARGEST < mass < math.inf:
        raise ValueError(beyond(SMALLEST, LARGEST))
    return mass


def _inertia_of_size(factor: float) -> float:
    if not (1.0 / ORDINARY <= factor <= 1.0 or factor == math.inf):
        least = f"{1.0 / ORDINARY:.3g}"
        raise ValueError(f'must lie between {least} and 1, where all mass is in the rim, or be "inf" for no turning')
    return factor


def _non_zero(vector: tuple[float, float]) -> tuple[float, float]:
    if vector == (0.0, 0.0):
        raise ValueError("must not be of length zero")
    return vector


def _unit(vector: tuple[float, float]) -> tuple[float, float]:
    x, y = _non_zero(vector)
    # What this function returned comes back as it was, so that a saved wall loads equal. Its length is within 3 units
    # of relative rounding (2^-53) of 1: two from the length divided by, one from the division. Computing it costs two
    # more.
    if abs(math.hypot(x, y) - 1.0) <= 6 * 2.0**-53:
        return (x, y)
    # Scaling by the larger component first keeps 1e-200 and 1e200 from under- and overflowing in the length.
    largest = max(abs(x), abs(y))
    x, y = x / largest, y / largest
    length = math.hypot(x, y)
    return (x / length, y / length)


def _at_least_one(discs: tuple[Disc, ...]) -> tuple[Disc, ...]:
    if not discs:
        raise ValueError("must hold at least one disc")
    return discs


# The bounds stand before the validator: behind it they are enforced, but missing from the JSON Schema.
_Finite = Annotated[float, Strict(), Field(allow_inf_nan=False), BeforeValidator(_plain)]
_Number = Annotated[float, Strict(), Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False), BeforeValidator(_plain)]
_Vector = Annotated[tuple[_Number, _Number], BeforeValidator(_plain)]
_Positive = Annotated[float, Strict(), Field(ge=SMALLEST, le=LARGEST, allow_inf_nan=False), BeforeValidator(_plain)]
_Coefficient = Annotated[float, Strict(), Field(ge=0, le=1, allow_inf_nan=False), BeforeValidator(_plain)]
_Friction = Annotated[float, Strict(), Field(ge=0, le=LARGEST, allow_inf_nan=False), BeforeValidator(_plain)]
_SignedCoefficient = Annotated[float, Strict(), Field(ge=-1, le=1, allow_inf_nan=False), BeforeValidator(_plain)]
# JSON has no infinity, so an immovable disc's mass is written as the string "inf" there.
_InfinityAsText = PlainSerializer(lambda value: "inf" if math.isinf(value) else value, when_used="json")
_Mass = Annotated[
    float,
    Strict(),
    Field(ge=SMALLEST, allow_inf_nan=True),
    BeforeValidator(_infinity_from_text),
    AfterValidator(_mass_of_size),
    _InfinityAsText,
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": SMALLEST, "maximum": LARGEST}, {"const": "inf"}]}),
]
_Inertia = Annotated[
    float,
    Strict(),
    BeforeValidator(_infinity_from_text),
    AfterValidator(_inertia_of_size),
    _InfinityAsText,
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 1.0 / ORDINARY, "maximum": 1}, {"const": "inf"}]}),
]

#: Fields that a file, and a digest, of a scene without friction and spin does not have.
_LEFT_OUT = ("friction", "wall_friction", "tangential_restitution", "wall_tangential_restitution")
_LEFT_OUT_OF_DISC = ("spin_rad_s", "inertia_factor")


class Need(StrEnum):
    """Something a scene asks of whoever simulates it; its value is how a report names it."""

    WALLS = "walls"
    IMMOVABLE = "immovable discs"
    RESTITUTION = "restitution below 1"
    GRAVITY = "gravity"
    SPIN = "spinning discs"
    FRICTION = "friction"
    TANGENTIAL_RESTITUTION = "tangential restitution"


class _Model(BaseModel):
    """Frozen, closed to unknown fields, and raising SceneError where Pydantic would raise its own error."""

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="strings")

    def __init__(self, /, **data: Any) -> None:  # a field of a file may be called "self", too
        try:
            super().__init__(**data)
        except ValidationError as error:
            items = error.errors(include_url=False)
            more = any(getattr(item.get("ctx", {}).get("error"), "more", False) for item in items)
            raise SceneError([*_problems(items)], more=more) from None

    @model_serializer(mode="wrap")
    def _without_defaults(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what says nothing of a scene without friction and spin."""
        fields: dict[str, Any] = handler(self)
        for name in (*_LEFT_OUT, *_LEFT_OUT_OF_DISC):
            if name in fields and fields[name] == type(self).model_fields[name].default:
                del fields[name]
        return fields


def _problems(items: Iterable[ErrorDetails]) -> Iterator[Problem]:
    for item in items:
        location = tuple(item["loc"])
        cause = item.get("ctx", {}).get("error")
        if isinstance(cause, SceneError):  # raised by a model nested in this one: only its place is still missing
            for problem in cause.problems:
                yield Problem(location + problem.field, problem.message)
            continue
        match item["type"]:
            case "missing":
                yield Problem(location, "is required, but missing")
            case "extra_forbidden":
                yield Problem(location, "is not a field of a scene; see `carom scenes --schema`")
            case "too_long" | "too_short":
                yield Problem(location, f"must hold two numbers, got {shown(item['input'])}")
            case "tuple_type":
                yield Problem(location, f"must be a list, got {shown(item['input'])}")
            case "greater_than_equal" if item["ctx"]["ge"] == SMALLEST and not item["input"] > 0:
                yield Problem(location, f"must be greater than 0, got {shown(item['input'])}")
            case "greater_than_equal" if item["ctx"]["ge"] == SMALLEST:
                yield Problem(location, f"{beyond(SMALLEST, LARGEST)}, got {shown(item['input'])}")
            case "greater_than_equal" | "less_than_equal" if LARGEST in map(abs, item["ctx"].values()):
                yield Problem(location, f"{beyond(0.0, LARGEST)}, got {shown(item['input'])}")
            case _:
                message = item["msg"]
                for prefix in ("Value error, ", "Input should ", "String should "):
                    message = message.removeprefix(prefix)
                message = message if message.startswith("must") else f"must {message}"
                yield Problem(location, f"{message}, got {shown(item['input'])}")


class Disc(_Model):
    """A circular rigid body that moves in a straight line between impacts.

    Attributes:
        position_m: Centre at time 0, metres.
        velocity_m_s: Velocity at time 0, metres a second.
        radius_m: Radius, metres, above 0.
        mass_kg: Mass, kilograms, above 0; ``inf`` (in JSON the string ``"inf"``) is an immovable disc.
        spin_rad_s: Rate of turning at time 0, counterclockwise, radians a second.
        inertia_factor: Moment of inertia over mass times radius squared, above 0 to 1: 1/2 for a disc of even density,
            2/5 for a sphere, 1 for a hoop; ``inf`` (in JSON the string ``"inf"``) does not turn.
    """

    position_m: _Vector
    velocity_m_s: _Vector = (0.0, 0.0)
    radius_m: _Positive
    mass_kg: _Mass = 1.0
    spin_rad_s: _Number = 0.0
    inertia_factor: _Inertia = 0.5

    def model_post_init(self, _context: object, /) -> None:
        """Refuse a disc that moves although nothing can stop it: it would give others energy without end.

        Raises:
            SceneError: The mass is infinite and velocity or spin is not zero; or the inertia is, and the spin is not.
        """
        problems = []
        if self.immovable and self.velocity_m_s != (0.0, 0.0):
            message = f"must be (0, 0) for an immovable disc (mass_kg = inf), got {self.velocity_m_s}"
            problems.append(Problem(("velocity_m_s",), message))
        if self.spin_rad_s != 0.0 and (self.immovable or math.isinf(self.inertia_factor)):
            cause = "immovable disc (mass_kg = inf)" if self.immovable else "unturnable one (inertia_factor = inf)"
            problems.append(Problem(("spin_rad_s",), f"must be 0 for an {cause}, got {self.spin_rad_s}"))
        if problems:
            raise SceneError(problems)

    @property
    def immovable(self) -> bool:
        """Whether no impact moves this disc."""
        return math.isinf(self.mass_kg)


class Wall(_Model):
    """A half-plane that no disc may enter.

    Attributes:
        point_m: Any point on the wall's surface, metres.
        normal: Direction into the free side, of any length but zero; stored as a unit vector.
    """

    point_m: _Vector
    normal: Annotated[tuple[_Finite, _Finite], BeforeValidator(_plain), AfterValidator(_unit)]


class Scene(Drawn, _Model):
    """Discs, walls, and the laws that hold between them. Immutable; two equal scenes compare equal.

    Attributes:
        name: What reports call the scene.
        description: One or two sentences for a reader; free text.
        discs: At least one disc.
        walls: Half-planes; none by default.
        restitution: Coefficient of restitution of every pair of discs, 0 to 1.
        wall_restitution: Coefficient of restitution between any disc and any wall, 0 to 1.
        friction: Coulomb's coefficient of friction of every pair of discs, 0 or more.
        wall_friction: Coulomb's coefficient of friction between any disc and any wall, 0 or more.
        tangential_restitution: What becomes of the slip of two discs where friction holds them, -1 to 1: 0 ends it, 1
            turns it round. It says nothing where there is no friction.
        wall_tangential_restitution: The same between any disc and any wall.
        gravity_m_s2: Uniform acceleration of every movable disc, metres a second squared.
        duration_s: How long the scene is simulated, seconds, above 0.
        frame_rate_hz: Frames a second at which a frame-sampled method looks, unless it is told otherwise.
    """

    # Control characters would reach terminals and reports as they are.
    name: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")]
    description: str = ""
    discs: Annotated[tuple[Disc, ...], AfterValidator(_at_least_one), Field(json_schema_extra={"minItems": 1})]
    walls: tuple[Wall, ...] = ()
    restitution: _Coefficient = 1.0
    wall_restitution: _Coefficient = 1.0
    friction: _Friction = 0.0
    wall_friction: _Friction = 0.0
    tangential_restitution: _SignedCoefficient = 0.0
    wall_tangential_restitution: _SignedCoefficient = 0.0
    gravity_m_s2: _Vector = (0.0, 0.0)
    duration_s: _Positive
    frame_rate_hz: _Positive = 60.0

    def model_post_init(self, _context: object, /) -> None:
        """Refuse a start in which bodies overlap: such a state has no past, so its future has no unique answer.

        Raises:
            SceneError: Two discs, or a disc and a wall, overlap by more than rounding can explain; or sizes span more
                than `carom.limits` allows.
        """
        start = self.arrays
        problems = list(span_problems(start, self.gravity_m_s2, self.duration_s))
        found, more = start.overlaps("discs[{}]", "walls[{}]")
        problems += [Problem(("discs", overlap.disc, "position_m"), overlap.message) for overlap in found]
        if problems:
            raise SceneError(problems, more=more)

    @cached_property
    def arrays(self) -> DiscArrays:
        """The start of the scene as read-only arrays, which every solver takes; its gravity is not part of them."""
        discs = self.discs
        return DiscArrays.of_valid(
            position_m=np.array([disc.position_m for disc in discs]),
            velocity_m_s=np.array([disc.velocity_m_s for disc in discs]),
            radius_m=np.array([disc.radius_m for disc in discs]),
            mass_kg=np.array([disc.mass_kg for disc in discs]),
            walls=tuple((*wall.point_m, *wall.normal) for wall in self.walls),
            restitution=self.restitution,
            wall_restitution=self.wall_restitution,
            spin_rad_s=np.array([disc.spin_rad_s for disc in discs]),
            inertia_factor=np.array([disc.inertia_factor for disc in discs]),
            **{name: getattr(self, name) for name in _LEFT_OUT},
        )

    # The arrays are no field; a copy may have other discs, and a process that a scene is sent to makes its own.

    def __iter__(self) -> Generator[tuple[str, Any], None, None]:
        return ((name, value) for name, value in super().__iter__() if name != "arrays")

    def __copy__(self) -> Self:
        copied = super().__copy__()
        copied.__dict__.pop("arrays", None)
        return copied

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        copied = super().__deepcopy__(memo)
        copied.__dict__.pop("arrays", None)
        return copied

    def __getstate__(self) -> dict[Any, Any]:
        state = super().__getstate__()
        fields = {name: value for name, value in state["__dict__"].items() if name != "arrays"}
        return {**state, "__dict__": fields}

    @property
    def needs(self) -> frozenset[Need]:
        """What this scene asks of a method, to be held against what the method declares."""
        wanted = {
            Need.WALLS: bool(self.walls),
            Need.IMMOVABLE: any(disc.immovable for disc in self.discs),
            Need.RESTITUTION: self.restitution < 1 or (bool(self.walls) and self.wall_restitution < 1),
            Need.GRAVITY: self.gravity_m_s2 != (0.0, 0.0),
            Need.SPIN: any(disc.spin_rad_s for disc in self.discs),
            Need.FRICTION: self.arrays.rubs,
            Need.TANGENTIAL_RESTITUTION: (self.arrays.rubs_discs and self.tangential_restitution != 0.0)
            or (self.arrays.rubs_walls and self.wall_tangential_restitution != 0.0),
        }
        return frozenset(need for need, is_needed in wanted.items() if is_needed)

    def step_count(self, dt_s: float) -> int:
        """Number of steps of length `dt_s` that cover the duration: see `steps_to_cover`.

        Raises:
            InputError: `dt_s` is not a finite number above 0, or it gives more than `carom.limits.MOST_STEPS` steps.
        """
        return steps_to_cover(self.duration_s, dt_s)


def steps_to_cover(duration_s: float, dt_s: float) -> int:
    """Return the number of steps of length `dt_s` that cover a duration, 0 or more; the last one may reach beyond it.

    The quotient is taken exactly. When both are the nearest float to what was meant (2 and 1/240, say) the exact
    quotient misses the whole number meant by up to 2 units of its relative rounding (2^-53 for each of the two), which
    must not cost a step.

    Raises:
        InputError: `dt_s` is not a finite number above 0, or it gives more than `carom.limits.MOST_STEPS` steps.
    """
    if not 0 < dt_s < math.inf:
        raise InputError(f"a step must be a finite number of seconds above 0, got {dt_s}")
    (a, b), (c, d) = duration_s.as_integer_ratio(), dt_s.as_integer_ratio()
    whole, part = a * d, b * c  # the quotient is whole / part
    if whole > MOST_STEPS * part:
        raise InputError(
            f"a step must be at least {1 / MOST_STEPS:.3g} of the scene's duration ({duration_s} s), "
            f"got {dt_s}: lengthen it, or shorten the scene"
        )
    nearest = (2 * whole + part) // (2 * part)
    if nearest > 0 and abs(whole - nearest * part) * 2**52 <= whole:
        return nearest
    return -(-whole // part)


def scene_schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file (the one published as ``carom/scene.schema.json``)."""
    schema = Scene.model_json_schema()
    for name, most in MOST_BODIES.items():
        schema["properties"][name]["maxItems"] = most
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def load_scene(path: str | Path) -> Scene:
    """Load and validate the scene in a ``.toml`` or ``.json`` file.

    Raises:
        SceneError: The file can't be read, is no TOML or JSON, is too large, or holds no valid scene. The message
            names the file, the field with its index, and the value.
    """
    path = Path(path)
    try:
        return Scene(**_few_problems(_parse(path)))
    except SceneError as error:
        more = error.more or len(error.problems) > SceneError.SHOWN  # nobody looked for all of them
        raise SceneError(error.problems, source=str(path), more=more) from None


def _parse(path: Path) -> dict[str, Any]:
    if path.suffix not in MOST_BYTES:
        raise SceneError([Problem((), f"a scene file ends in .toml or .json, not in {path.suffix or 'nothing'!r}")])
    try:
        content = read_data(path, path.suffix)
    except InputError as error:
        raise SceneError([Problem((), str(error))]) from None
    for name, most in MOST_BODIES.items():
        bodies = content.get(name)
        if isinstance(bodies, list) and len(bodies) > most:
            raise SceneError([Problem((name,), f"a file of a scene holds {most} of them at most, got {len(bodies)}")])
    return content


def _few_problems(content: dict[str, Any]) -> dict[str, Any]:
    """Return what a file holds with no more in it that is wrong than a message shows; what is right is all there.

    Each problem takes a kilobyte, and a file has room for millions.
    """
    content = _few_unknown(content, Scene)
    if isinstance(walls := content.get("walls"), list):
        content["walls"] = [_few_unknown(wall, Wall) for wall in walls]
    if isinstance(discs := content.get("discs"), list):
        good: list[Any] = []
        for k, disc in enumerate(discs):
            try:
                good.append(Disc(**_few_unknown(disc, Disc)))
            except (SceneError, TypeError):
                good += [_few_unknown(one, Disc) for one in discs[k : k + SceneError.SHOWN]]
                break
        content["discs"] = good
    return content


def _few_unknown(fields: Any, model: type[_Model]) -> Any:
    if not isinstance(fields, dict) or len(fields) <= len(model.model_fields):
        return fields
    unknown = [name for name in fields if name not in model.model_fields]
    return {name: fields[name] for name in (*model.model_fields, *unknown[: SceneError.SHOWN]) if name in fields}


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene as TOML or JSON, by the path's ending; loading it again gives an equal scene.

    Raises:
        SceneError: The ending is neither ``.toml`` nor ``.json``.
        OSError: The file can't be written.
    """
    path = Path(path)
    if path.suffix == ".toml":
        import tomli_w

        text = tomli_w.dumps(scene.model_dump(mode="python"))
    elif path.suffix == ".json":
        text = scene.model_dump_json(indent=2) + "\n"
    else:
        message = f"a scene file ends in .toml or .json, not in {path.suffix or 'nothing'!r}"
        raise SceneError([Problem((), message)], source=str(path))
    path.write_text(text, encoding="utf-8")
