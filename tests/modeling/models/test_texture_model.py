"""TextureModel: interpolation, edges of the grid, files."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tactileq.modeling import InputError, TextureModel
from tactileq.modeling.models.parameter_table import LARGEST_STEP, LOWEST_GAIN_SHARE, MOST_PARTS
from tests.refusals import refused

ModelMaker = Callable[..., TextureModel]
SPEEDS = np.array([50.0, 120.0, 350.0])
FORCES = np.array([0.5, 1.5, 3.5])


def bilinear_model(*, n_layers: int = 2) -> TextureModel:
    """Every parameter is β + α₁v + α₂F + α₃vF, so interpolation must give it exactly."""
    v, f = SPEEDS[:, None], FORCES[None, :]
    gains = [gain_at(v, f, sign) for sign in (1.0, -0.5)]
    frequencies = [frequency_at(v, f), 400 + frequency_at(v, f)]
    bandwidths = [20 + 0.01 * v * f, 60 - 0.02 * v + 0 * f]
    return TextureModel(
        texture="bilinear",
        rate_hz=5000.0,
        speeds_mm_s=SPEEDS,
        forces_n=FORCES,
        noise_gains=noise_at(v, f),
        frequencies_hz=np.stack(frequencies, axis=-1)[:, :, :n_layers],
        bandwidths_hz=np.stack(bandwidths, axis=-1)[:, :, :n_layers],
        gains=np.stack(gains, axis=-1)[:, :, :n_layers],
        level_sd_db=np.full((3, 3, n_layers), 0.3),
        estimator="planted",
    )


def noise_at(v: np.ndarray, f: np.ndarray) -> np.ndarray:
    return 0.1 + 2e-4 * v + 0.01 * f + 1e-5 * v * f


def frequency_at(v: np.ndarray, f: np.ndarray) -> np.ndarray:
    return 30 + 0.5 * v + 4 * f - 0.01 * v * f


def gain_at(v: np.ndarray, f: np.ndarray, sign: float) -> np.ndarray:
    return sign * (0.2 + 1e-3 * v - 0.02 * f + 3e-4 * v * f)


def one_force(model: TextureModel) -> TextureModel:
    """The model as it would be had only the lowest force been recorded."""
    names = ("noise_gains", "frequencies_hz", "bandwidths_hz", "gains", "level_sd_db")
    names += ("inherited", "unresolved", "interpolated")
    kept = {name: getattr(model, name)[:, :1] for name in names}
    return replace(model, forces_n=model.forces_n[:1], **kept)


inside_speed, inside_force = st.floats(50, 350), st.floats(0.5, 3.5)


@settings(deadline=None)
@given(inside_speed, inside_force)
def test_bilinear_truth_is_reproduced_inside_the_grid(v: float, f: float) -> None:
    peq = bilinear_model().peq(v, f)
    assert peq.noise_gain == pytest.approx(noise_at(v, f), rel=1e-12)
    assert peq.frequencies_hz[0] == pytest.approx(frequency_at(v, f), rel=1e-12)
    assert peq.frequencies_hz[1] == pytest.approx(400 + frequency_at(v, f), rel=1e-12)
    assert peq.bandwidths_hz == pytest.approx([20 + 0.01 * v * f, 60 - 0.02 * v], rel=1e-12)
    assert peq.gains == pytest.approx([gain_at(v, f, 1.0), gain_at(v, f, -0.5)], rel=1e-12)


@settings(deadline=None)
@given(st.floats(-1e4, 1e4), st.floats(-2, 1e3))
def test_edges_of_the_grid(v: float, f: float) -> None:
    """Clamped above; below, the product of both ramps scales all gains and nothing else."""
    peq = bilinear_model().peq(v, f)
    ramp = min(abs(v) / 50, 1) * min(max(f, 0) / 0.5, 1)
    vc, fc = min(max(abs(v), 50), 350), min(max(f, 0.5), 3.5)
    assert peq.noise_gain == pytest.approx(ramp * noise_at(vc, fc), rel=1e-9, abs=1e-15)
    assert peq.gains[0] == pytest.approx(ramp * gain_at(vc, fc, 1.0), rel=1e-9, abs=1e-15)
    assert peq.frequencies_hz[0] == pytest.approx(frequency_at(vc, fc), rel=1e-9)
    assert peq.bandwidths_hz[0] == pytest.approx(20 + 0.01 * vc * fc, rel=1e-9)


def test_corner_is_the_product_of_both_ramps() -> None:
    model = bilinear_model()
    whole, part = model.peq(50.0, 0.5), model.peq(25.0, 0.1)
    assert part.noise_gain == pytest.approx(whole.noise_gain * 0.5 * 0.2)
    assert part.gains == pytest.approx(whole.gains * 0.5 * 0.2)


def test_grid_points_are_reproduced() -> None:
    model = bilinear_model()
    for i, v in enumerate(SPEEDS):
        for j, f in enumerate(FORCES):
            assert model.peq(v, f).gains == pytest.approx(model.gains[i, j], rel=1e-14)


@pytest.mark.parametrize(
    ("v", "f"), [(np.nan, 1.0), (np.inf, 1.0), (100.0, np.nan), (100.0, np.inf), (-np.inf, np.nan)]
)
def test_speeds_and_forces_that_are_no_numbers_are_lift_off(v: float, f: float) -> None:
    peq = bilinear_model().peq(v, f)
    assert peq.noise_gain == 0
    assert not peq.gains.any()


@pytest.mark.parametrize("layer", [(0.49 * 5000, 50.0), (100.0, 0.45 * 5000), (1.0, 0.1)])
def test_interpolation_between_legal_limits_stays_legal(
    make_model: ModelMaker, layer: tuple[float, float]
) -> None:
    model = make_model(
        0.1, [(*layer, 1.0)], speeds_mm_s=(50.0, 110.0, 333.3), forces_n=(0.5, 1.1, 3.5)
    )
    rng = np.random.default_rng(0)
    for v, f in zip(rng.uniform(40, 400, 300), rng.uniform(0.4, 4, 300), strict=True):
        assert model.peq(v, f).frequencies_hz[0] == pytest.approx(layer[0], rel=1e-12)


def test_no_layers() -> None:
    model = bilinear_model(n_layers=0)
    assert (model.n_layers, model.n_parameters) == (0, 1)
    assert model.peq(100.0, 1.0).response([50.0]) == pytest.approx(noise_at(100.0, 1.0))
    assert model.inherited.shape == (3, 3, 0)


def test_numbers_per_condition() -> None:
    assert [bilinear_model(n_layers=m).n_parameters for m in range(3)] == [1, 4, 7]


@pytest.mark.parametrize("rate_hz", [2000.0, 10000.0, 22704.0])
def test_at_rate_keeps_the_density(rate_hz: float) -> None:
    """response²·2/rate is the output's density; below both Nyquist frequencies it agrees.

    To 1 %: the bilinear transform warps the flanks a little differently.
    """
    model = bilinear_model(n_layers=1)
    peq, other = model.peq(200.0, 2.0), model.at_rate(rate_hz).peq(200.0, 2.0)
    near_peak = peq.frequencies_hz[0] + np.array([-15.0, 0.0, 15.0])
    assert other.response(near_peak) ** 2 / rate_hz == pytest.approx(
        peq.response(near_peak) ** 2 / 5000, rel=1e-2
    )
    assert other.noise_gain**2 / rate_hz == pytest.approx(peq.noise_gain**2 / 5000)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, np.nan, np.inf])
def test_at_rate_refuses_rates_that_are_none(rate_hz: float) -> None:
    with refused(InputError, expected=["rate", 1, "10000000 Hz"], got=rate_hz):
        bilinear_model().at_rate(rate_hz)


def test_at_rate_refuses_layers_that_do_not_fit() -> None:
    with refused(InputError, expected=["frequency", "1…392 Hz", "800 Hz"], got=456.75):
        bilinear_model().at_rate(800.0)


def test_with_layers_selects_and_orders() -> None:
    model = bilinear_model()
    swapped = model.with_layers([1, 0])
    assert np.array_equal(swapped.gains, model.gains[:, :, ::-1])
    assert np.array_equal(swapped.frequencies_hz, model.frequencies_hz[:, :, ::-1])
    assert model.with_layers([1]).n_layers == 1
    assert model.with_layers([]) == bilinear_model(n_layers=0)
    assert swapped.with_layers([1, 0]) == model


@st.composite
def models(draw: st.DrawFn) -> TextureModel:
    s, f, m = (draw(st.integers(low, 3)) for low in (2, 2, 0))
    text = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)

    def array(shape: tuple[int, ...], low: float, high: float) -> np.ndarray:
        return draw(hnp.arrays(float, shape, elements=st.floats(low, high)))

    def marks(shape: tuple[int, ...]) -> np.ndarray:
        return draw(hnp.arrays(bool, shape))

    def axis(n: int) -> list[float]:
        values = st.lists(st.floats(1e-3, 1e3), min_size=n, max_size=n, unique=True)
        return sorted(draw(values))

    return TextureModel(
        texture=draw(text.filter(lambda t: t.strip() and t.isprintable())),
        rate_hz=5000.0,
        speeds_mm_s=axis(s),
        forces_n=axis(f),
        noise_gains=array((s, f), 0, 1e9),
        frequencies_hz=array((s, f, m), 1, 2450),
        bandwidths_hz=array((s, f, m), 0.1, 2250),
        gains=array((s, f, m), -1e9, 1e9),
        level_sd_db=array((s, f, m), 0, 50),
        estimator=draw(text),
        unit=draw(st.sampled_from(["g", "arbitrary"])),
        simulated=draw(st.booleans()),
        inherited=marks((s, f, m)),
        unresolved=marks((s, f, m)),
        interpolated=marks((s, f)),
    )


@settings(deadline=None, max_examples=50)
@given(model=models())
def test_file_loads_back_equal(model: TextureModel, tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("model") / "deep" / "model.json"
    model.save(path)
    assert TextureModel.load(path) == model
    values = json.loads(path.read_text(encoding="utf-8"))
    assert values["gains"] == model.gains.tolist()


def test_models_that_differ_are_not_equal() -> None:
    model = bilinear_model()
    assert model == bilinear_model()
    assert model != bilinear_model(n_layers=1)
    assert model != model.at_rate(6000.0)
    assert model != "model"


@pytest.mark.parametrize(
    ("change", "facts"),
    [
        (lambda v: v.update(gains=[[1, 2], [3]]), ["gains", "speeds × forces × layers"]),
        (lambda v: v.update(noise_gains=[[0.1]]), ["noise_gains", "shape"]),
        (lambda v: v.update(speeds_mm_s=[50, 350]), "shape"),
        (lambda v: v.update(forces_n=[3, 2, 1]), ["forces_n", "rising"]),
        (lambda v: v["frequencies_hz"][0][0].__setitem__(0, 0.5), "frequency"),
        (lambda v: v["inherited"].pop(), "inherited"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(
    change: Callable[[dict[str, object]], object], facts: object
) -> None:
    values = bilinear_model().to_dict()
    change(values)
    with refused(InputError, expected=facts):
        TextureModel.read(values)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"3", b"\xff\xfe\x00", b'{"version": 1}'])
def test_files_that_are_no_model_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "model.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match="expected"):
        TextureModel.load(path)


def test_truncated_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    bilinear_model().save(path)
    path.write_text(path.read_text()[:-40])
    with refused(InputError, expected=["JSON", path], got="line 49"):
        TextureModel.load(path)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with refused(InputError, expected=tmp_path / "model.json", got="nothing"):
        TextureModel.load(tmp_path / "model.json")


@pytest.mark.parametrize("grid", [((), (1.0, 2.0)), ((100.0, 200.0), ())])
def test_grids_without_conditions_are_refused(
    make_model: ModelMaker, grid: tuple[tuple[float, ...], tuple[float, ...]]
) -> None:
    with refused(InputError, expected=["speeds_mm_s" if not grid[0] else "forces_n", 0], got="[]"):
        make_model(0.1, [(100.0, 20.0, 1.0)], speeds_mm_s=grid[0], forces_n=grid[1])


@settings(deadline=None, max_examples=50)
@given(st.floats(1.0, 500.0), st.floats(0.01, 20.0))
@example(264.765625, 0.703125)
def test_one_force_holds_at_every_force(speed: float, force: float) -> None:
    """Of others nothing is known: the one recorded is kept, and lift-off fades it."""
    one = one_force(bilinear_model())
    expected = one.peq(speed, float(one.forces_n[0]))
    peq = one.peq(speed, force)
    fade = min(force / one.forces_n[0], 1.0)
    # The same value is blended with itself, which may round: a·(1 − x) + a·x.
    assert peq.frequencies_hz == pytest.approx(expected.frequencies_hz, rel=1e-15)
    assert peq.bandwidths_hz == pytest.approx(expected.bandwidths_hz, rel=1e-15)
    assert peq.gains == pytest.approx(fade * expected.gains, rel=1e-12)
    assert peq.noise_gain == pytest.approx(fade * expected.noise_gain, rel=1e-12)


@pytest.mark.parametrize(
    ("speeds", "got"),
    [
        ((0.0, 1.0), 0.0),
        ((2.0, 1.0), "[2.0, 1.0]"),
        ((1.0, 1.0), "[1.0, 1.0]"),
        ((1.0, np.inf), "inf"),
        ((-1.0, 2.0), -1.0),
    ],
)
def test_axes_that_do_not_rise_are_refused(
    make_model: ModelMaker, speeds: tuple[float, ...], got: object
) -> None:
    with refused(InputError, expected=["speeds_mm_s", 0], got=got):
        make_model(0.1, [], speeds_mm_s=speeds)


def test_failed_save_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "model.json"
    bilinear_model().save(path)
    before = path.read_bytes()

    def full_disk(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", full_disk)
    with pytest.raises(OSError, match="disk full"):
        bilinear_model(n_layers=1).save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


# --- blending in logarithms


def power_law_model(*, gain_exponent: float = 0.7) -> TextureModel:
    """Every parameter is c·v^a·F^b, so blending in logarithms must give it."""
    v, f = SPEEDS[:, None], FORCES[None, :]
    return TextureModel(
        texture="powers",
        rate_hz=5000.0,
        speeds_mm_s=SPEEDS,
        forces_n=FORCES,
        noise_gains=law(v, f, 1e-3, 0.6, 0.3),
        frequencies_hz=np.stack([law(v, f, 8, 0.7, -0.1), 1500 + 0 * v * f], axis=-1),
        bandwidths_hz=np.stack([law(v, f, 4, 0.5, 0.2), 60 + 0 * v * f], axis=-1),
        gains=np.stack([law(v, f, 0.01, gain_exponent, 0.5), -law(v, f, 0.1, -0.2, 0.1)], axis=-1),
        level_sd_db=np.zeros((3, 3, 2)),
        estimator="planted",
        blending="logarithmic",
    )


def law(v: np.ndarray, f: np.ndarray, c: float, a: float, b: float) -> np.ndarray:
    return np.asarray(c * v**a * f**b)


@settings(deadline=None)
@given(inside_speed, inside_force)
def test_power_laws_are_reproduced_inside_the_grid(v: float, f: float) -> None:
    """To 0.27 dB along each axis: the table's cells are that small."""
    peq = power_law_model().peq(v, f)
    a, b = np.array(v), np.array(f)
    near = {"rel": 10 ** (2 * 0.27 / 20) - 1}
    assert peq.noise_gain == pytest.approx(float(law(a, b, 1e-3, 0.6, 0.3)), **near)
    assert peq.frequencies_hz == pytest.approx(
        np.array([float(law(a, b, 8, 0.7, -0.1)), 1500]), **near
    )
    assert peq.bandwidths_hz == pytest.approx(np.array([float(law(a, b, 4, 0.5, 0.2)), 60]), **near)
    assert peq.gains == pytest.approx(
        np.array([float(law(a, b, 0.01, 0.7, 0.5)), -float(law(a, b, 0.1, -0.2, 0.1))]), **near
    )


def test_nodes_of_a_logarithmic_model_are_exact() -> None:
    model = power_law_model(gain_exponent=3.0)
    for i, v in enumerate(SPEEDS):
        for j, f in enumerate(FORCES):
            peq = model.peq(v, f)
            assert np.array_equal(peq.gains, model.gains[i, j])
            assert np.array_equal(peq.frequencies_hz, model.frequencies_hz[i, j])


@settings(deadline=None, max_examples=50)
@given(
    hnp.arrays(np.float64, (3, 3, 1), elements=st.one_of(st.just(0.0), st.floats(1e-9, 1e3))),
    st.sampled_from([1.0, -1.0]),
)
def test_any_gains_blend_between_their_neighbours(amplitudes: np.ndarray, sign: float) -> None:
    """One of 0 is blended as a millionth of the largest; tables stay small."""
    base = power_law_model()
    model = replace(base.with_layers([0]), gains=sign * amplitudes, level_sd_db=np.zeros((3, 3, 1)))
    table = model.table
    assert table.values.shape[0] <= 1 + 2 * MOST_PARTS
    assert table.values.shape[1] <= 1 + 2 * MOST_PARTS
    gains = sign * table.values[..., -1]
    assert (gains >= 0).all()
    assert gains.max(initial=0.0) <= amplitudes.max() * (1 + 1e-12)
    largest = amplitudes.max()
    if largest > 0:
        middle = np.sqrt(np.prod(np.maximum(amplitudes[:2, 0, 0], LOWEST_GAIN_SHARE * largest)))
        speed = np.sqrt(SPEEDS[0] * SPEEDS[1])
        found = sign * model.peq(float(speed), FORCES[0]).gains[0]
        if (amplitudes[:2, 0, 0] > LOWEST_GAIN_SHARE * largest).all():
            # Half-way through a cell whose ends differ by a factor e^change, read linearly.
            step = abs(np.log(amplitudes[0, 0, 0] / amplitudes[1, 0, 0]))
            change = max(LARGEST_STEP, step / MOST_PARTS)
            lower = 1 / (1 + np.exp(LARGEST_STEP / 2))
            assert found <= middle * (
                (1 - lower) * np.exp(change / 2) + lower * np.exp(-change / 2)
            ) * (1 + 1e-9)
            assert found >= middle * 10 ** (-0.04 / 20)


def test_a_file_without_blending_means_linear(tmp_path: Path) -> None:
    """Models of earlier versions are read as they were written."""
    path = tmp_path / "model.json"
    power_law_model().save(path)
    stored = json.loads(path.read_text())
    assert stored["blending"] == "logarithmic"
    del stored["blending"]
    path.write_text(json.dumps(stored))
    old = TextureModel.load(path)
    assert old.blending == "linear"
    middle = old.peq((SPEEDS[0] + SPEEDS[1]) / 2, FORCES[0])
    assert middle.gains == pytest.approx(old.gains[:2, 0].mean(axis=0), rel=1e-12)


def test_layers_that_change_their_sign_are_not_blended_in_logarithms() -> None:
    model = power_law_model()
    gains = model.gains.copy()
    gains[0, 0, 1] = 0.1
    with refused(InputError, expected="sign", got="layer 2"):
        replace(model, gains=gains)
    assert replace(model, gains=gains, blending="linear").blending == "linear"
    with refused(InputError, expected=["linear", "logarithmic"], got="'cubic'"):
        replace(model, blending="cubic")  # type: ignore[arg-type]


def test_levels_above_6_db_are_not_identifiable() -> None:
    model = power_law_model()
    level_sd = model.level_sd_db.copy()
    level_sd[1, 2, 0], level_sd[0, 0, 1] = 6.1, 6.0
    marked = replace(model, level_sd_db=level_sd).not_identifiable
    assert np.argwhere(marked).tolist() == [[1, 2, 0]]
