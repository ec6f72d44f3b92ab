"""A bench, a stress campaign, advice and a growth bench, built by hand for the default engines."""

import math
from functools import partial

from carom.engines.registry import EngineInfo
from carom.execution.environment import Environment
from carom.execution.job import Method
from carom.model.scene import Disc, Scene
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.run import Advice
from carom.studies.advise.sampling_limit import Cause, ContactWindow, HardImpact
from carom.studies.advise.step_search import SearchEnding, StepAdvice, StepRange, count_steps_per_frame
from carom.studies.advise.step_trial import StepTrial
from carom.studies.bench.convergence import fit_order
from carom.studies.bench.growth import Growth, GrowthCurve, GrowthPoint
from carom.studies.bench.machine_noise import Noise, Spread
from carom.studies.bench.options import BenchPlan
from carom.studies.bench.result import Bench, Curve, Point, SceneBench, find_cheapest, find_pareto_front
from carom.studies.bench.timing_pass import CellTiming
from carom.studies.stress import run as campaign
from carom.studies.stress.result import CellEnding, CellResult, StressResults, StressRow

METHODS = (
    Method("pic", "default"),
    Method("pic", "tuned"),
    Method("pit", "tuned"),
    *(Method(engine, name) for engine in ("box2d", "mujoco", "pybullet", "pymunk") for name in ("default", "tuned")),
)
STEPS = (1 / 24, 1 / 67, 1 / 186, 1 / 517, 1 / 1438, 1 / 4000)
HERE = Environment("2026-01-02T03:04:05+00:00", "0.1.0", "CPython 3.11", "Linux", "A processor", 2, {})


def build_scene(name: str = "paper/late") -> Scene:
    """Return two discs that meet."""
    moving = Disc(position_m=(-1.0, 0.0), velocity_m_s=(3.0, 0.2), radius_m=0.3)
    return Scene(name=name, discs=[moving, Disc(position_m=(1.0, 0.2), radius_m=0.3)], duration_s=1.0)


def build_point(method: Method, k: int) -> Point:
    """Return a point whose error is that of sampling, of a method that loses an impact at the coarsest step."""
    rank = METHODS.index(method)
    error = 0.0 if method.engine == "pic" else 0.03 * STEPS[k] * (1 + rank / 10)
    run_s = (1e-6 if method.engine == "pic" else 1e-6 / STEPS[k]) * (1 + rank)
    clock = Spread(run_s, 0.9 * run_s, 1.2 * run_s)
    timing = CellTiming(24 << k, 7, clock, clock, clock, 1e-7, clock, clock, clock, clock)
    missed = int(k == 0 and method.engine == "mujoco")
    return Point(method.engine, method.profile, STEPS[k], error, error / 2, error / 9, 4, 4, missed, 0, timing=timing)


def build_bench(*names: str) -> Bench:
    """Return a bench of scenes of these names, or of one."""
    plan, found = BenchPlan(), []
    for name in names or ("paper/late",):
        curves = []
        for method in METHODS:
            own = tuple(build_point(method, k) for k in range(len(STEPS)))
            order = fit_order([p.dt_s for p in own if p.is_correct], [p.error for p in own if p.is_correct])
            curves.append(Curve(method.engine, method.profile, own, order, find_cheapest(own, plan.target)))
        every = [p for curve in curves for p in curve.points]
        front = find_pareto_front([p for p in every if p.engine != "pic"])
        noise = Noise(1e-3, 0.05, 1.4, 100)
        found.append(
            SceneBench(build_scene(name), tuple(curves), front, find_cheapest(every, plan.target), noise, 7, HERE.date)
        )
    return Bench(tuple(found), plan, HERE, "carom bench paper/late", 80.0)


def build_cell_result(line: StressRow, method: Method) -> CellResult:
    """Return a cell: PIC passes, a default fails at once, and the others half way."""
    shown = (f"scenes/{line.name}-{method.engine}-{method.profile}.toml",)
    ended = partial(CellResult, scenes=shown)
    good = method.engine == "pic"
    if line.kind == "relation":
        return ended(CellEnding.HOLDS, 0.0) if good else ended(CellEnding.VIOLATED, 0.1)
    if line.kind == "complaint":
        seen = (CellEnding.NOT_SEEN, 0.0) if good else (CellEnding.SEEN, 2.0)
        return ended(*seen, reason="1 impact missed")
    first, last = line.ladder[0], line.ladder[-1]
    if good:
        return ended(CellEnding.PASSES, last, last, 1e-16)
    if method.profile == "default":
        return ended(CellEnding.FAILS_AT_START, first, reason="no impact")
    middle = [value for value in line.ladder if value > 0][len(line.ladder) // 2]
    return ended(CellEnding.FAILS_AT_SIZE, middle, first, 1e-3, "no impact")


def build_campaign_results(one_in: int = 1) -> StressResults:
    """Return the quick form of a campaign: all of its lines, or one of some."""
    lines = tuple(campaign.list_rows(quick=True))[::one_in]
    names = dict.fromkeys(method.engine for method in METHODS)
    engines = {name: EngineInfo(name, name, "1.0", "", None, {}, "carom") for name in names}
    cells = {(line.name, method.name): build_cell_result(line, method) for line in lines for method in METHODS}
    return StressResults(lines, METHODS, engines, cells, HERE, "carom stress --quick", True, 87.1)


def build_advice() -> Advice:
    """Return the advice on two discs: every step is found, except that MuJoCo's default never meets the demand."""
    answers = []
    for method in METHODS[3:]:
        last = 0.01 / (1 + METHODS.index(method) // 2)  # two and two tie
        first = [StepTrial(last * 2**k, 8, 9, 8, 9, 0.9, 40) for k in (2, 1)]
        fine = [
            StepTrial(last / 2**k, 64 if k == 0 else 8, 65 if k == 0 else 9, 0, 0, 0.017 / 2**k, 400) for k in range(3)
        ]
        framed = next((trial for trial in fine if count_steps_per_frame(trial.dt_s, build_scene().frame_rate_hz)), None)
        never = StepRange(fine[0], framed, first[-1], (), ())
        lost = method == Method("mujoco", "default")
        whole = StepRange(None, None, fine[-1], (), ()) if lost else never
        ending = SearchEnding.FLAT if lost else SearchEnding.FOUND
        answers.append(StepAdvice(method, (*first, *fine), never, whole, ending))
    window = ContactWindow.of(0.9, (0.9, 0.1), (6.0, 0.0))
    return Advice(
        scene=build_scene(),
        options=AdviceOptions(direction_error_rad=math.radians(1.0), phases=8, budget_steps=400_000),
        impacts=1,
        hardest=(HardImpact(0.379, 0, 1, Cause.TURN, window, 0.148, 0.0055),),
        pit_steps_s=(0.148, 0.0055),
        answers=tuple(answers),
        unable={},
        swept=frozenset({Method("box2d", "tuned")}),
        located=frozenset(),
        code={Method("pymunk", "tuned"): "dt, steps = 0.01, 2\nfor _ in range(steps):\n    space.step(dt)"},
        environment=HERE,
        command="carom advise paper/late",
        elapsed_s=1.0,
    )


def build_growth() -> Growth:
    """Return how cost grows: as the number of discs."""
    curves = []
    for method in METHODS[1:]:
        rank = METHODS.index(method)
        costs = ((n, 1e-5 * n * rank, 1e4 * n * rank) for n in (2, 10, 100, 1000, 10_000))
        own = tuple(GrowthPoint(n, 1e-3, run_s, grown, 6e7 + grown, 1.0) for n, run_s, grown in costs)
        law = (1.0, 0.9, 1.1)
        curves += [GrowthCurve(method.engine, method.profile, own, law, law, gravity) for gravity in (False, True)]
    return Growth(tuple(curves), HERE, 300.0, "carom bench --grow", 100.0)
