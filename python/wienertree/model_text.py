"""Models given as dicts, written as the text that the one parser of models reads."""

import json
import numbers
from collections.abc import Mapping

from ._core import Model
from .errors import InputError


def _value(value: object, where: str) -> str:
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_value(str(k), where)} = {_value(v, f'{where}.{k}')}" for k, v in value.items()) + " }"
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(v, where) for v in value) + "]"
    raise InputError("must be a string, a number, a list or a dict", where, repr(value))


def to_toml(model: Mapping) -> str:
    """The text of a model file with these keys and values."""
    lines = []
    for key, value in model.items():
        if not isinstance(value, Mapping):
            lines.append(f"{_value(str(key), str(key))} = {_value(value, str(key))}")
    for key, value in model.items():
        if isinstance(value, Mapping):
            lines.append(f"[{_value(str(key), str(key))}]")
            lines += [f"{_value(str(k), f'{key}.{k}')} = {_value(v, f'{key}.{k}')}" for k, v in value.items()]
    return "\n".join(lines) + "\n"


def rebuilt(source: str, set: dict, inputs: tuple = (None, {})) -> Model:
    """For pickle."""
    model = Model(source, set=set)
    times, values = inputs
    return model.with_inputs(times, **values) if values else model
