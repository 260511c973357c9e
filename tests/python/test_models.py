import pickle

import numpy as np
import pytest

import wienertree as wt

OU = """
name = "ou"
convention = "ito"
[parameters]
theta = 0.5
[state]
x = { initial = 1.0 }
[drift]
x = "-theta*x"
[diffusion]
x = ["1"]
[observation]
kind = "continuous"
h = ["x"]
"""

OU_DICT = {
    "name": "ou",
    "convention": "ito",
    "parameters": {"theta": np.float64(0.5)},
    "state": {"x": {"initial": 1.0}},
    "drift": {"x": "-theta*x"},
    "diffusion": {"x": ["1"]},
    "observation": {"kind": "continuous", "h": ("x",)},
}


def test_a_name_a_text_a_file_and_a_dict_make_the_same_model(tmp_path, record):
    file = tmp_path / "ou.toml"
    file.write_text(OU)
    results = [wt.filter(source, record).mean for source in (OU, file, str(file), OU_DICT, wt.Model(OU))]
    for mean in results[1:]:
        assert np.array_equal(mean, results[0])
    assert wt.Model("benes").name == "benes"
    assert "benes" in wt.models() and "heston" in wt.models()


def test_what_a_model_says_of_itself():
    heston = wt.Model("heston")
    assert heston.states == ["s", "v"]
    assert heston.noise_dimension == 2
    assert heston.observation == "none"
    assert heston.parameters["kappa"] == 2
    assert np.array_equal(heston.initial, [1, 0.09])
    benes = wt.Model("benes").analysis()
    assert benes["exact_filter"] == "benes"
    assert len(benes["fields"]) == 2


def test_correlated_brownian_motions():
    model = {
        "convention": "ito",
        "parameters": {"rho": 0.5},
        "state": {"x": {"initial": 0.0}, "y": {"initial": 0.0}},
        "drift": {"x": 0, "y": 0},
        "diffusion": {"x": ["1", "0"], "y": ["0", "2"]},
        "noise": {"correlation": [[1, "rho"], ["rho", 1]]},
    }
    shown = wt.Model(model).analysis()
    assert shown["correlation"] == [["1", "rho"], ["rho", "1"]]
    assert wt.Model("heston").analysis()["correlation"] == []
    # E[x y] = rho 2 T
    assert wt.weak(model, "x*y", horizon=3.0, steps=2).value == pytest.approx(3.0, rel=1e-12)
    with pytest.raises(wt.InputError, match="between -1 and 1"):
        wt.Model(model, set={"rho": 1.5})


INPUTS = OU.replace("[state]", '[inputs]\nu = { between = "linear" }\n[state]').replace("-theta*x", "theta*(u - x)")


def test_inputs_are_functions_of_time():
    model = wt.Model(INPUTS)
    assert model.analysis()["inputs"] == {"u": "linear"}
    assert model.inputs == (None, {})
    with pytest.raises(wt.InputError, match="the input u of this model has no values"):
        wt.weak(model, "x", horizon=1, steps=2)
    known = model.with_inputs([0, 1, 2], u=np.array([1.0, 3.0, 0.0]))
    # x' = (u - x)/2 from 1, u = 1 + 2 t: x = 2 t - 3 + 4 exp(-t/2)
    expected = 2 - 3 + 4 * np.exp(-0.5)
    assert wt.weak(known, "x", horizon=1, steps=4).value == pytest.approx(expected, abs=1e-9)
    assert wt.weak(known.replace(theta=0.5), "x", horizon=1, steps=4).value == pytest.approx(expected, abs=1e-9)
    again = pickle.loads(pickle.dumps(known))
    assert np.array_equal(again.inputs[0], [0, 1, 2]) and np.array_equal(again.inputs[1]["u"], [1, 3, 0])
    drawn = wt.simulate(known, horizon=2, steps=200, keep=20)
    assert np.isfinite(wt.filter(known, drawn).log_evidence).all()
    with pytest.raises(wt.InputError, match="the observations end at t = 3"):
        wt.filter(known, ([0.0, 1.0, 3.0], [0.0, 0.1, 0.2]))
    with pytest.raises(wt.InputError, match="row 2, column t"):
        model.with_inputs([0, 0, 1], u=[1, 2, 3])
    with pytest.raises(wt.InputError, match="no such input"):
        model.with_inputs([0, 1], u=[1, 2], v=[1, 2])


def test_parameters_are_replaced():
    model = wt.Model(OU, set={"theta": 2})
    assert model.parameters == {"theta": 2}
    assert model.replace(theta=3).parameters == {"theta": 3}
    assert model.parameters == {"theta": 2}


def test_models_are_pickled_with_their_parameters():
    for source in (OU, OU_DICT, "ornstein-uhlenbeck"):
        model = wt.Model(source, set={"theta": 0.25})
        assert pickle.loads(pickle.dumps(model)).parameters == model.parameters


def test_mistakes_name_line_column_key_and_value():
    with pytest.raises(wt.InputError) as caught:
        wt.Model(OU.replace("-theta*x", "-teta*x"))
    assert caught.value.where.startswith("text:9:")
    assert "theta" in caught.value.what  # the nearest name
    with pytest.raises(wt.InputError, match="dict.*drift"):
        wt.Model(OU_DICT | {"drift": {"x": "-theta*"}})
    with pytest.raises(wt.InputError, match="benes"):
        wt.Model("bens")
    with pytest.raises(wt.InputError, match="kapa"):
        wt.Model("heston", set={"kapa": 1})
    with pytest.raises(wt.InputError, match="state.x"):
        wt.Model(OU_DICT | {"state": {"x": {1, 2}}})


def test_strings_of_a_dict_survive_any_printable_character():
    odd = 'a "quoted" \\ name with \u00e9\U0001d6fc'
    assert wt.Model(OU_DICT | {"name": odd}).name == odd
    for control in "\t\n\x1b\x7f":
        with pytest.raises(wt.InputError):
            wt.Model(OU_DICT | {"name": "a" + control})


def test_simulation_is_a_function_of_its_seed():
    one, same, other = (wt.simulate("benes", horizon=1, steps=100, seed=s) for s in (1, 1, 2))
    assert one.t.shape == (101,) and one.signal.shape == (101, 1) and one.observations.shape == (101, 1)
    assert np.array_equal(one.signal, same.signal)
    assert not np.array_equal(one.signal, other.signal)
    assert wt.simulate("heston", horizon=1, steps=10).observations.shape[0] == 0
