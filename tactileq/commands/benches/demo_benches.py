"""The benches of the demo's report: scenes, a reduced chart and a reduced atlas, done beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from tactileq.printing import progress

if TYPE_CHECKING:
    from tactileq.analysis.page.sections import Mapped, Section
    from tactileq.analysis.textures.results import TextureResult
    from tactileq.benches.atlas.case import Case
    from tactileq.benches.atlas.edges import Examined
    from tactileq.benches.chart.judging import Judged
    from tactileq.modeling import ARModel

CHART_TURNS = 5
Result = TypeVar("Result")


class Benches(NamedTuple):
    """The reduced chart's textures and the reduced atlas's columns, done by others."""

    judged: Iterable[Judged]
    examined: Iterable[Examined]

    @classmethod
    def begun(cls, mapped: Mapped) -> Benches:
        """All of them, from now on."""
        from tactileq.benches.atlas.edges import columns_of, examine_column
        from tactileq.benches.chart.judging import judge
        from tactileq.benches.chart.methods import BRIEF
        from tactileq.benches.chart.surfaces import FEW_SURFACES, simulated_sources

        cases = own_cases()
        return cls(
            mapped(partial(judge, methods=BRIEF), simulated_sources(FEW_SURFACES)),
            mapped(partial(examine_column, cases, full=False), columns_of(cases, full=False)),
        )

    def sections(
        self, scenes: Iterable[Any], rivals: Iterable[ARModel], *, mapped: Mapped
    ) -> list[Section]:
        """What scenes need, speed against accuracy, and where methods fail, when all is done.

        `scenes` are those of `begun_scenes`, `rivals` the AR models of the planted textures'
        recordings.
        """
        from tactileq.benches.atlas.section import stability_section
        from tactileq.benches.chart.chart import chart_of
        from tactileq.benches.chart.page import chart_section
        from tactileq.benches.chart.surfaces import FEW_SURFACES
        from tactileq.benches.scenes.examples import Surface
        from tactileq.benches.scenes.section import scene_section
        from tactileq.stimuli.planted.textures import PlantedSurface

        surfaces = {m.texture: Surface(PlantedSurface(m.texture), m) for m in rivals}
        with progress("Compiling scenes", 2) as advance:
            compiled, drawn = reported(scenes, advance, lambda found: found[0].compiled.scene.name)
        compared = scene_section([*((one, surfaces) for one in compiled), drawn], mapped=mapped)
        with progress("Speed against accuracy", FEW_SURFACES.drawn) as advance:
            judged = list(reported(self.judged, advance, lambda one: one.source.name))
        with progress("Where methods fail", len(own_cases())) as advance:
            examined = list(reported(self.examined, advance, lambda one: one.case.family))
        # Rendering is timed now that no other process works.
        chart = chart_section(chart_of(judged, turns=CHART_TURNS))
        return [compared, chart, stability_section(examined)]


def begun_scenes(mapped: Mapped, made: Sequence[TextureResult]) -> Iterable[Any]:
    """Scenes of these models, and one of drawn surfaces, from now on."""
    from tactileq.benches.scenes.examples import DEMO_EXAMPLES, compile_examples, drawn_example

    models = {result.texture: result.model for result in made}
    # One call, as what has one item alone is done by this process.
    return mapped(_done, [partial(compile_examples, models, DEMO_EXAMPLES), drawn_example])


def own_cases() -> Sequence[Case]:
    """Of the atlas what the program does by default; tactileq stability examines everything."""
    from tactileq.benches.atlas.cases import CASES

    return [case for case in CASES if case.ours and case.axis.default is not None]


def _done(task: Any) -> Any:
    """What a task gives; by name, so that another process can be sent it."""
    return task()


def reported(
    results: Iterable[Result], advance: Callable[[str], None], name: Callable[[Result], str]
) -> Iterator[Result]:
    """The results, each reported by its name as it comes."""
    for result in results:
        advance(name(result))
        yield result
