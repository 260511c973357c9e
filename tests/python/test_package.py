"""What is typed, documented and named is what is there."""

import ast
import inspect
import pathlib

import pytest

import wienertree as wt
from wienertree import _core

STUB = ast.parse((pathlib.Path(wt.__file__).parent / "_core.pyi").read_text())


def stubs():
    return {node.name: node for node in STUB.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}


def keywords(function):
    return [argument.arg for argument in function.args.kwonlyargs]


def options_in(docstring):
    return [line.split(":")[0].strip() for line in docstring.split("\n") if line.startswith("    ") and ":" in line
            and line.split(":")[0].strip().isidentifier()]


def test_the_version_is_the_programs():
    import os
    import subprocess
    told = subprocess.run([os.environ["WIENERTREE_PROGRAM"], "--version"], capture_output=True, text=True, check=True)
    assert told.stdout == f"wienertree {wt.__version__}\n"


def test_everything_public_is_there_and_documented():
    for name in wt.__all__:
        assert inspect.getdoc(getattr(wt, name)), name
    assert (pathlib.Path(wt.__file__).parent / "py.typed").exists()


def test_everything_compiled_has_a_stub_and_the_other_way_round():
    compiled = {n for n in dir(_core) if not n.startswith("_")}
    assert set(stubs()) == compiled
    for name, node in stubs().items():
        if isinstance(node, ast.ClassDef):
            members = {n.name for n in node.body if isinstance(n, ast.FunctionDef) and not n.name.startswith("_")}
            assert members == {n for n in dir(getattr(_core, name)) if not n.startswith("_")}, name


@pytest.mark.parametrize("name", ["filter", "weak"])
def test_the_stubs_have_every_option(name):
    assert sorted(keywords(stubs()[name])) == sorted(options_in(getattr(_core, name).__doc__) + ["set"])


def test_the_filters_stub_has_every_option():
    initialiser = next(n for n in stubs()["Filter"].body if isinstance(n, ast.FunctionDef) and n.name == "__init__")
    assert sorted(keywords(initialiser)) == sorted(options_in(_core.Filter.__doc__) + ["set"])
