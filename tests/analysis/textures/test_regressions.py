"""Tables 1 and 2, figure 5 and the driven models, on models whose regressions are known exactly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from tactileq.analysis.chapters.parameters.figure import figure_centroid, plot_centroid
from tactileq.analysis.chapters.parameters.section import parameter_section
from tactileq.analysis.textures.compared import comparisons
from tactileq.analysis.textures.regressions import (
    NAMES,
    centroid_amplitude_table,
    centroid_table,
    centroids_over_speed,
    coefficient_table,
    driving_table,
    regression_table,
    support_table,
)
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import TextureModel, Threshold, regressed, similarity, simplify
from tactileq.modeling.fitting.conditions import recording_spectra

pytestmark = pytest.mark.filterwarnings("error")
SPEEDS, FORCES = np.linspace(50, 350, 4), np.linspace(0.5, 3.5, 4)
V, F = (x[:, :, None] for x in np.meshgrid(SPEEDS, FORCES, indexing="ij"))
FLAT = np.ones((4, 4, 1))


def known(
    texture: str, *, noise=FLAT, frequency=100 * FLAT, amplitude=FLAT, **more
) -> TextureModel:
    """A model of as many layers as `frequency` has, without any noise in its parameters."""
    layers = frequency.shape[2]
    values = {
        "texture": texture,
        "rate_hz": 5000.0,
        "speeds_mm_s": SPEEDS,
        "forces_n": FORCES,
        "noise_gains": noise[:, :, 0],
        "frequencies_hz": frequency,
        "bandwidths_hz": np.full((4, 4, layers), 25.0),
        "gains": np.broadcast_to(amplitude, (4, 4, layers)),
        "level_sd_db": np.zeros((4, 4, layers)),
        "estimator": "planted",
    }
    return TextureModel(**(values | more))


@pytest.fixture(scope="module")
def models() -> list[TextureModel]:
    """Three textures with four layers in all."""
    two = np.concatenate([100 + 0.5 * V, 400 + 0.1 * V + 2 * F], axis=2)
    return [
        known("one", noise=0.2 - 1e-4 * V, frequency=two, amplitude=-(0.1 + 1e-3 * V)),
        known("two", noise=0.3 - 3e-4 * V, amplitude=0.2 + 0.01 * V * F),
        known("three", frequency=200 + 0.3 * V),
    ]


def test_table_one_has_a_row_for_every_regression(models) -> None:
    table = regression_table(models)
    assert len(table) == 3 + 3 * 4
    one = table[table["texture"] == "one"]
    assert one["peak"].tolist() == ["–", *"111", *"222"]
    assert one["parameter"].tolist()[:4] == [*NAMES]
    frequency = one.iloc[4]
    assert frequency["speed_coefficient"] == pytest.approx(0.1)
    assert frequency["force_coefficient"] == pytest.approx(2)
    assert frequency["intercept"] == pytest.approx(400)
    assert [frequency[f"p_{t}"] for t in ("speed", "force", "speed_force")] == [0, 0, 1]
    assert [frequency[f"mark_{t}"] for t in ("speed", "force", "speed_force")] == ["***", "***", ""]
    assert (frequency["multiple_r"], frequency["adjusted_r_squared"]) == pytest.approx((1, 1))
    assert (frequency["reduced"], frequency["unit"]) == ("v, F", "Hz")
    width = one.iloc[3]
    assert (width["mark"], width["reduced"]) == ("", "constant")
    assert np.isnan(width["adjusted_r_squared"])
    assert not table["simulated"].any()


def test_inherited_and_interpolated_conditions_are_told(models) -> None:
    inherited, interpolated = np.zeros((4, 4, 1), dtype=bool), np.zeros((4, 4), dtype=bool)
    inherited[0], interpolated[3, 3] = True, True
    table = regression_table([replace(models[1], inherited=inherited, interpolated=interpolated)])
    assert table["inherited"].tolist() == [0, 4, 0, 0]
    assert table["conditions"].tolist() == [15, 11, 15, 15]


def test_support_is_the_share_of_what_responds(models) -> None:
    every = regression_table(models).assign(own_peak=True)
    table = support_table(every).set_index("parameter")
    assert table["of"].tolist() == [3, 4, 4, 4]
    support = table[["support_speed", "support_force", "support_speed_force"]]
    wanted = [[200 / 3, 0, 0], [75, 25, 0], [50, 0, 25], [0, 0, 0]]
    assert support.to_numpy() == pytest.approx(np.array(wanted))
    # Constants have no R²; whatever else was planted is explained entirely.
    assert table["adjusted_r_squared"].tolist()[:3] == [1, 1, 1]
    assert np.isnan(table["adjusted_r_squared"].iloc[3])


def test_what_only_fills_another_shape_takes_no_part_in_support(models) -> None:
    """The second layer of "one" digs a hole into the noise: no response has its maximum there."""
    table = regression_table(models)
    assert table.loc[
        ~table["own_peak"], ["texture", "peak"]
    ].drop_duplicates().to_numpy().tolist() == [["one", "2"]]
    support = support_table(table).set_index("parameter")
    assert support["of"].tolist() == [3, 3, 3, 3]
    others = table[~((table["texture"] == "one") & (table["peak"] == "2"))]
    alone = support_table(others.assign(own_peak=True)).set_index("parameter")
    pd.testing.assert_frame_equal(support, alone)


def test_mean_coefficients_over_all_and_over_the_significant_ones(models) -> None:
    table = coefficient_table(regression_table(models)).set_index(["parameter", "coefficient"])

    def means(parameter: str, coefficient: str) -> list[float]:
        return table.loc[(parameter, coefficient), ["mean", "mean_significant"]].tolist()

    assert means("noise gain n", "α1 (v)") == pytest.approx([-4e-4 / 3, -2e-4])
    assert means("frequency f", "α1 (v)") == pytest.approx([0.9 / 4, 0.3])
    assert means("frequency f", "α2 (F)") == pytest.approx([0.5, 2])
    assert means("amplitude a", "α1 (v)") == pytest.approx([2e-3 / 4, 1e-3])
    assert means("amplitude a", "α3 (v·F)") == pytest.approx([0.01 / 4, 0.01])
    assert means("bandwidth b", "α1 (v)") == pytest.approx([0, np.nan], nan_ok=True)
    units = table["unit"].tolist()
    assert units[:4] == ["g per mm/s", "g per N", "g per (mm/s·N)", "Hz per mm/s"]


def test_published_values_are_those_of_the_paper(models) -> None:
    """PAPER table 2, row by row, and the mean adjusted R² of section IV-B."""
    found = regression_table(models)
    support = support_table(found)
    published = support[[name for name in support if name.startswith("published")]].to_numpy()
    assert published.tolist() == [
        [85.7, 14.3, 42.9, 0.68],
        [40.0, 32.0, 8.0, 0.40],
        [92.0, 72.0, 88.0, 0.88],
        [24.0, 20.0, 4.0, 0.20],
    ]
    coefficients = coefficient_table(found)
    assert coefficients["published"].tolist() == [
        *(-5.7e-8, -1.0e-7, 1.3e-10),
        *(1.6e-1, 6.0e-3, 1.7e-6),
        *(4.0e-4, -1.7e-5, 1.3e-7),
        *(-2.6e-4, -5.9e-6, 1.3e-8),
    ]
    ratio = coefficients["published_for_n"] / coefficients["published"]
    assert ratio.tolist() == pytest.approx([1, 1000, 1000] * 4)
    # Their support ratings are whole numbers of 7 textures and of 25 layers.
    shares = published[:, :3] / 100 * np.array([[7], [25], [25], [25]])
    assert shares == pytest.approx(shares.round(), abs=0.005)


def test_gains_in_two_units_have_no_mean(models) -> None:
    mixed = [models[0], replace(models[1], unit="arbitrary")]
    table = coefficient_table(regression_table(mixed)).set_index("parameter")
    assert table.loc[["noise gain n", "amplitude a"], "mean"].isna().all()
    assert table.loc["frequency f", "mean"].notna().all()
    assert table.loc["amplitude a", "unit"].iloc[1] == "arbitrary or g per N"


def test_a_two_by_two_grid_supports_nothing_and_denies_nothing(results) -> None:
    table = support_table(regression_table([result.model for result in results]))
    # Inherited or not, four conditions and four coefficients leave no test.
    for term in ("speed", "force", "speed_force"):
        assert table[f"support_{term}"].isna().all()
    assert (table["of"] == 0).all()


def test_the_centroid_of_one_layer_is_its_frequency(models) -> None:
    bare = known("bare", frequency=np.zeros((4, 4, 0)), amplitude=np.zeros((4, 4, 0)))
    table = centroid_table([models[2], bare, models[1]])
    assert table["texture"].tolist() == ["three", "two"]
    three, still = table.iloc[0], table.iloc[1]
    assert (three["slope_speed_alone"], three["speed_coefficient"]) == pytest.approx((0.3, 0.3))
    assert (three["mark_speed_alone"], three["p_force"]) == ("***", 1)
    assert three["mean_centroid_hz"] == pytest.approx(260)
    assert np.isnan([three["amplitude_r"], still["amplitude_r"], still["multiple_r"]]).all()


def test_centroid_and_amplitude_by_peak(models) -> None:
    moving = replace(models[2], gains=0.1 + 0.01 * V)
    table = centroid_amplitude_table([moving])
    assert table["peak"].tolist() == ["all peaks", "1"]
    assert table["amplitude_r"].tolist() == pytest.approx([1, 1])
    assert table["mark"].tolist() == ["***", "***"]
    falling = centroid_amplitude_table([replace(models[2], gains=-(9.0 - 0.01 * V))])
    assert falling["amplitude_r"].tolist() == pytest.approx([-1, -1])


def test_courses_hold_mean_and_deviation_over_the_forces() -> None:
    holes = np.zeros((4, 4), dtype=bool)
    holes[0, 1:], holes[1] = True, True
    model = known("rough", frequency=100 + V + 10 * F, interpolated=holes)
    (course,) = centroids_over_speed([model])
    assert course.mean_hz == pytest.approx([155, np.nan, 370, 470], nan_ok=True)
    deviation = np.std(10 * FORCES, ddof=1)
    assert course.sd_hz == pytest.approx([np.nan, np.nan, deviation, deviation], nan_ok=True)
    centroid = [155, *(350 + 10 * FORCES), *(450 + 10 * FORCES)]
    line = np.polynomial.Polynomial.fit([50, *[250] * 4, *[350] * 4], centroid, 1)
    assert course.regression_hz == pytest.approx(line(SPEEDS))


def test_figure_five_shows_every_texture_with_units(models, tmp_path) -> None:
    courses = centroids_over_speed([*models[:2], replace(models[2], simulated=True)])
    figure = figure_centroid(courses)
    ax = figure.axes[0]
    assert ax.get_xlabel() == "probing speed (mm/s)"
    assert ax.get_ylabel() == "spectral centroid SC (Hz)"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["one", "two", "three"]
    assert len(ax.containers) == 3
    assert "SIMULATED" in [text.get_text() for text in ax.texts]
    dashed = [line for line in ax.lines if line.get_linestyle() == "--"]
    assert dashed[2].get_ydata().tolist() == pytest.approx((200 + 0.3 * SPEEDS).tolist())
    figure.savefig(tmp_path / "centroid.png")
    assert (tmp_path / "centroid.png").stat().st_size > 10_000
    real = plot_centroid(courses[:2])
    assert not real.texts
    assert isinstance(real.figure, Figure)


def driving_of(results):
    compared = comparisons(results, np.random.default_rng(3).spawn(len(results)))
    return driving_table([comparison.driven for comparison in compared])


def test_driven_models_are_compared_on_the_same_recordings(results) -> None:
    table = driving_of(results)
    assert table["driven_by"].tolist() == ["grid", "conditions", "centroid"] * 3
    assert table["texture"].tolist()[6:] == ["all textures"] * 3
    first = results[0]
    ways = [first.model, regressed(first.model), regressed(first.model, by="centroid")]
    sizes = [4 * first.model.n_parameters, *(model.n_parameters for model in ways[1:])]
    assert table["numbers"].tolist()[:3] == sizes
    assert sizes[0] >= sizes[1] > sizes[2]
    for row, model in zip(table.to_dict("records"), ways, strict=False):
        reports = [
            similarity.report(measured, model.peq(*recording.condition))
            for recording, measured in recording_spectra(first.recordings)
        ]
        assert row["gfc30_mean"] == pytest.approx(np.mean([r.gfc30 for r in reports]))
        distance = np.mean([r.log_spectral_distance_db for r in reports])
        assert row["log_spectral_distance_db"] == pytest.approx(distance)
    assert table["gfc30_expected"][:3].nunique() == 1
    means = table.iloc[6:].reset_index()
    for number, way in enumerate(("grid", "conditions", "centroid")):
        chosen = table[:6][table[:6]["driven_by"] == way]
        assert means["gfc30_mean"][number] == pytest.approx(chosen["gfc30_mean"].mean())
        assert means["numbers"][number] == round(chosen["numbers"].mean())


def bare_result(result: TextureResult) -> TextureResult:
    bare = result.model.with_layers([])
    return TextureResult(result.recordings, bare, simplify(bare, Threshold.shipped("codec")))


def test_a_texture_without_layers_is_driven_by_its_noise_alone(results) -> None:
    table = driving_of([bare_result(results[0])])
    assert table["driven_by"].tolist() == ["grid", "conditions"]
    assert table["numbers"].tolist()[0] == 4
    assert "all textures" not in table["texture"].tolist()


def test_the_section_says_what_came_out(results) -> None:
    section = parameter_section(results, driving_of(results))
    (driven,) = section.outcomes  # nothing could be tested on 2 × 2 conditions
    for way in ("the grid", "regressions", "the centroid alone"):
        assert way in driven.sentence
    without_layers = [bare_result(results[0])]
    bare = parameter_section(without_layers, driving_of(without_layers))
    assert bare.outcomes == ()
    assert all(item.simulated for item in bare.items if not hasattr(item, "items"))


def test_the_section_reports_published_values_beside_ours(models, results) -> None:
    textures = [replace(results[0], model=replace(models[0], texture="leather"), truth=None)]
    # The recordings are of other conditions; only the tables' sentences matter here.
    section = parameter_section(textures, driving_of(textures))
    assert (
        "noise gain n 1.00 (0.68); frequency f (Hz) 1.00 (0.40); amplitude a 1.00 (0.88)"
        in section.outcomes[0].sentence
    )
    tables = {item.name: item for item in section.items if hasattr(item, "frame")}
    assert "not corrected for multiple testing" in tables["regression_support"].note
    assert "forces in mN" in tables["regression_coefficients"].note
    assert isinstance(tables["driving"].frame, pd.DataFrame)
