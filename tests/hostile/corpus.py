"""The corpus of hostile inputs: commands with the files they are given, and what must come of them.

Each case stands for a kind of input that somebody might be sent, or make by mistake. What a case may do is told by its `codes`; all cases
must besides keep the promises of docs/robustness.md, which `hostile-inputs` checks.
"""

import dataclasses
import json
import random
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclasses.dataclass
class Case:
    name: str
    command: list
    files: dict = dataclasses.field(default_factory=dict)
    stdin: bytes = b""
    codes: tuple = (0, 1, 2)
    told: str = ""  # part of what standard error must say
    outputs: tuple = ()  # files or directories that a run may leave
    named: bool = False  # in the small version too
    links: dict = dataclasses.field(default_factory=dict)


MODEL = """name = "m"
convention = "ito"
[parameters]
a = 0.5
[state]
x = { initial = 1.0 }
[drift]
x = "-a*x"
[diffusion]
x = ["1"]
[observation]
kind = "continuous"
h = ["x"]
"""
DISCRETE = MODEL.replace('kind = "continuous"', 'kind = "discrete"\nnoise = { law = "gaussian", sd = 1.0 }')
ROWS = "t,y1\n0,0\n0.1,0.05\n0.2,0.1\n0.3,0.2\n"
FORMULA = (ROOT / "data/cubature_formulas/lyons-victoir-5-1.json").read_text()
STUDY = """title = "s"
command = "filter"
quantity = "mean_x"
measure = ["absolute"]
reference = "exact"
[observations]
horizon = 1.0
steps = 100
keep = 100
[options]
model = "./m.toml"
nodes = [10, 20]
"""
METHODS = ["klv", "euler", "gaussian-mixture", "grid", "kalman-bucy", "full-tree"]


def filter_case(name, model=MODEL, rows=ROWS, options=(), **more):
    return Case(name, ["filter", "m.toml", "--observations", "Y.csv", *options], {"m.toml": model, "Y.csv": rows}, **more)


def swapped(text, old, new):
    assert old in text, old
    return text.replace(old, new, 1)


# The faults that were found, each of which is mended and stays so.
def named_cases():
    for method in METHODS:
        yield filter_case(f"atoms nearer than doubles, {method}", rows="t,y1\n0,0\n5e-324,0.1\n", options=["--method", method], named=True)
        yield filter_case(f"rows 1e308 apart, {method}", rows="t,y1\n-1e308,0\n1e308,0.1\n", options=["--method", method], codes=(1, 2), named=True)
        yield filter_case(f"observations of 1e308, {method}", rows="t,y1\n0,-1.7e308\n1,1.7e308\n2,0\n", options=["--method", method], codes=(1, 2), named=True)
    extinct = swapped(swapped(MODEL, '"-a*x"', '"-x"'), '["1"]', '["0.1*x"]')
    unit_rows = "t,y1\n" + "".join(f"{i},0\n" for i in range(761))
    for method in ["klv", "euler"]:
        yield filter_case(f"extinct population, {method}", extinct, unit_rows, ["--method", method, "--nodes", "20"], named=True)
    wide = swapped(swapped(MODEL, '["1"]', '["1e308"]'), '"-a*x"', '"0"')
    for method in ["euler", "klv", "kalman-bucy"]:
        yield filter_case(f"particles over the range of doubles, {method}", wide, "t,y1\n0,0\n1,1\n", ["--method", method], codes=(1, 2), named=True)
    for parts in [33, 1000, 40000, 400000]:
        dotted = ".".join(["a"] * parts)
        for kind, text in [("header", f"[{dotted}]\nb = 1\n"), ("key", f"{dotted} = 1\n"), ("inline", f"a = {{ {dotted} = 1 }}\n")]:
            yield Case(f"{kind} of {parts} parts", ["model", "show", "m.toml"], {"m.toml": MODEL + text}, codes=(2,), named=parts == 40000)
            yield Case(f"study {kind} of {parts} parts", ["study", "s.toml", "--output", "out"], {"s.toml": STUDY + text, "m.toml": MODEL}, codes=(2,), named=parts == 40000)
    for depth in [33, 1000, 100000]:
        for kind, text in [("lists", "a = " + "[" * depth + "]" * depth), ("tables", "a = " + "{b=" * depth + "1" + "}" * depth), ("open lists", "a = " + "[" * depth)]:
            yield Case(f"{kind} {depth} deep", ["model", "show", "m.toml"], {"m.toml": text + "\n" + MODEL}, codes=(2,), named=depth == 100000)
        yield Case(f"expression {depth} deep", ["model", "show", "m.toml"], {"m.toml": swapped(MODEL, "-a*x", "(" * depth + "x" + ")" * depth)}, codes=(0, 2))
        yield Case(f"JSON {depth} deep", ["formulas", "verify", "f.json"], {"f.json": '{"name":' + "[" * depth + "]" * depth + "}"}, codes=(2,), named=depth == 100000)
    for dof in ["1e8", "1e12", "1e16", "1e17", "1e300"]:
        model = swapped(DISCRETE, '{ law = "gaussian", sd = 1.0 }', f'{{ law = "student-t", dof = {dof}, scale = 1.0 }}')
        yield filter_case(f"student-t with dof {dof}", model, codes=(0,), options=["--quiet"], named=True)
    for gamma in ["1e300", "1e5", "1e-300"]:
        yield Case(f"gamma {gamma}", ["weak", "m.toml", "--payoff", "x", "--horizon", "1", "--steps", "8", "--grid", "kusuoka", "--gamma", gamma], {"m.toml": MODEL},
                   codes=(2,) if gamma != "1e5" else (0, 1, 2), named=True)
    for horizon in ["5e-324", "1e-310", "1.7e308", "1e300"]:
        yield Case(f"simulate to {horizon}", ["simulate", "m.toml", "--horizon", horizon, "--steps", "10", "--observations", "-"], {"m.toml": MODEL}, codes=(1, 2), named=True)
    explosive = swapped(MODEL, '"-a*x"', '"x^3"')
    yield Case("simulate an explosion", ["simulate", "m.toml", "--horizon", "100", "--steps", "100", "--observations", "-"], {"m.toml": explosive}, codes=(1,), named=True)
    yield Case("simulate a sensor that overflows", ["simulate", "m.toml", "--horizon", "1", "--steps", "10", "--observations", "-"],
               {"m.toml": swapped(MODEL, 'h = ["x"]', 'h = ["1e200*exp(400+x)*exp(300)"]')}, codes=(1, 2), named=True)
    for field in ["0.", "1e", "1e+", "-", "0.1e-", ""]:
        yield filter_case(f"last row cut off behind '{field}'", rows=ROWS + "0.4," + field, codes=(2,), told="cut off" if field else "", named=True)
    yield filter_case("last row whole, without its end", rows=ROWS + "0.4,0.25", codes=(0,), options=["--quiet"], named=True)
    for until in [5, -1, 1e300]:
        yield Case(f"study until {until:g}", ["study", "s.toml", "--output", "out"], {"s.toml": STUDY + f"until = {until}\n", "m.toml": MODEL}, codes=(2,), told="within the record",
                   outputs=("out",), named=True)
    for method in ["klv", "euler", "gaussian-mixture", "grid"]:
        for nodes in ["1e9", "1000000000", "100000000000000000000"]:
            yield filter_case(f"{nodes} nodes, {method}", options=["--method", method, "--nodes", nodes], codes=(2,), named=nodes == "1000000000")
    yield filter_case("levelwise with a billion nodes", options=["--thin", "levelwise", "--nodes", "1000000000"], codes=(2,), named=True)
    yield Case("weak with a billion nodes", ["weak", "m.toml", "--payoff", "x", "--horizon", "1", "--steps", "4", "--nodes", "1000000000"], {"m.toml": MODEL}, codes=(2,), named=True)
    yield Case("weak without thinning", ["weak", "m.toml", "--payoff", "x", "--horizon", "1", "--steps", "1000000", "--thin", "none"], {"m.toml": MODEL}, codes=(2,), named=True)
    yield Case("a billion rows to simulate", ["simulate", "m.toml", "--horizon", "1", "--steps", "1000000000", "--observations", "Z.csv"], {"m.toml": MODEL}, codes=(2,), told="memory", named=True)
    yield filter_case("a billion steps", DISCRETE, options=["--steps", "1000000000"], codes=(2,), told="memory", named=True)
    for steps in ["10000000000", "1e10", "9007199254740993"]:
        yield Case(f"study of {steps} steps", ["study", "s.toml", "--output", "out"], {"s.toml": swapped(STUDY, "steps = 100", f"steps = {steps}"), "m.toml": MODEL}, codes=(2,), outputs=("out",), named=True)
    yield Case("study of many runs", ["study", "s.toml", "--output", "out"], {"s.toml": swapped(STUDY, "keep = 100", "keep = 100\npaths = 1000000"), "m.toml": MODEL}, codes=(2,), outputs=("out",), named=True)
    many = "[" + ", ".join(str(i) for i in range(1, 2000)) + "]"
    yield Case("study of many combinations", ["study", "s.toml", "--output", "out"],
               {"s.toml": STUDY.replace("nodes = [10, 20]", f"nodes = {many}\nsteps = {many}"), "m.toml": MODEL}, codes=(2,), outputs=("out",), named=True)
    for file in ["/dev/zero", "/dev/urandom", "/dev/null", "/", "/proc/self/mem", "missing.csv"]:
        yield Case(f"observations {file}", ["filter", "m.toml", "--observations", file], {"m.toml": MODEL}, codes=(2,), named=True)
        yield Case(f"model {file}", ["model", "show", file], codes=(2,))
        yield Case(f"formula {file}", ["formulas", "verify", file], codes=(2,))
        yield Case(f"study {file}", ["study", file, "--output", "out"], codes=(2,), named=file == "/dev/zero")
        yield filter_case(f"resume {file}", options=["--resume", file], codes=(2,), named=file == "/dev/zero")
        yield filter_case(f"signal {file}", options=["--signal", file, "--plot", "p.svg"], codes=(2,), named=file == "/dev/zero")
    yield filter_case("a line of megabytes", rows="t,y1\n0," + "1" * 3_000_000 + "\n1,2\n", codes=(2,), told="longer than", named=True)
    yield filter_case("a header of megabytes", rows="t" + "," * 3_000_000 + "\n", codes=(2,), named=True)
    yield Case("a line of megabytes from standard input", ["filter", "m.toml", "-"], {"m.toml": MODEL}, stdin=b"t,y1\n0," + b"1" * 3_000_000, codes=(1, 2), named=True)
    cosines = "*".join(f"cos({k}*x)" for k in range(1, 151))
    yield Case("a diffusion of 150 cosines", ["model", "show", "m.toml"], {"m.toml": swapped(MODEL, '["1"]', f'["{cosines}"]')}, codes=(2,), told="derivative", named=True)
    yield Case("a drift of 150 cosines", ["model", "show", "m.toml"], {"m.toml": swapped(MODEL, "-a*x", cosines)}, named=True)
    yield Case("a power of a power", ["model", "show", "m.toml"], {"m.toml": swapped(MODEL, "-a*x", "((x+1)^100+x)^100")}, named=True)
    yield Case("towers of exponentials", ["model", "show", "m.toml"], {"m.toml": swapped(MODEL, '["1"]', '["' + "exp(" * 100 + "x" + ")" * 100 + '"]')}, named=True)
    for d in [200, 2000, 20000]:
        for noises in [1, 4]:
            names = [f"x{i}" for i in range(d)]
            text = 'name = "m"\nconvention = "ito"\n[state]\n' + "".join(f"{n} = {{ initial = 1.0 }}\n" for n in names)
            text += "[drift]\n" + "".join(f'{n} = "-{n}"\n' for n in names)
            text += "[diffusion]\n" + "".join(f'{n} = [{", ".join(["1"] * noises)}]\n' for n in names)
            yield Case(f"{d} states, {noises} motions", ["model", "show", "m.toml"], {"m.toml": text}, codes=(0,) if d == 200 else (2,), named=d == 2000)
    for nodes in [60, 200, 231]:
        two = MODEL.replace("x = { initial = 1.0 }", "x = { initial = 1.0 }\nz = { initial = 0.0 }").replace('x = "-a*x"', 'x = "x - x^3/3 - z"\nz = "0.1*(x + 0.7 - 0.8*z)"').replace(
            'x = ["1"]', 'x = ["0.3"]\nz = ["0.1"]')
        yield Case(f"levelwise with {nodes} nodes", ["weak", "m.toml", "--payoff", "x", "--horizon", "1", "--steps", "8", "--thin", "levelwise", "--nodes", str(nodes), "--quiet"], {"m.toml": two},
                   codes=(0,), named=True)
    for degree, dimension in [("99", "99"), ("99", "1"), ("5", "99"), ("3", "1000000")]:
        yield Case(f"construct degree {degree} dimension {dimension}", ["formulas", "construct", "--degree", degree, "--dimension", dimension], codes=(0, 1, 2))


def model_cases():
    expressions = [
        "1/0", "0/0", "x/0", "log(-1)", "sqrt(-x)", "1e999", "1e-999", "0^0", "0^-1", "x^1e9", "x^x^x^x^x", "1" * 500, "9" * 399 + "^999", "nan", "inf", "-inf", "x y", "x**2", "x^^2", "(((", ")))", "()",
        "", " ", "+", "x+", "*x", "x,y", "min(x)", "max(x,1,2)", "sin", "sin()", "foo(x)", "__import__('os')", "`touch PWNED`", "$(touch PWNED)", "x; system('touch PWNED')", "pi(x)", "t(x)", "x[0]", "x.y",
        "\\u0000", "\\n", "x\\ty", "é*x", "𝒙", "x" * 5000, "x+" * 4999 + "x", "-" * 5000 + "x", "x*" * 4999 + "x", "x^" * 300 + "x", "sin(" * 300 + "x" + ")" * 300, "exp(exp(exp(exp(x))))",
        "1e308*1e308*x", "tan(1.5707963267948966)", "log(0)", "log(x-1)", "1/(x-1)", "sqrt(x-1)", "abs(x)^-1", "max(x,1/0)", "y1", "y0", "y99999", "a" * 100, "2x", "x2", "1.2.3", "1e", "1e+", ".", "0x10", "1_000",
    ]
    for i, expression in enumerate(expressions):
        for key, old in [("drift", '"-a*x"'), ("diffusion", '["1"]'), ("sensor", 'h = ["x"]'), ("parameter", "a = 0.5"), ("initial", "initial = 1.0")]:
            new = {"drift": f'"{expression}"', "diffusion": f'["{expression}"]', "sensor": f'h = ["{expression}"]', "parameter": f'a = "{expression}"', "initial": f'initial = "{expression}"'}[key]
            command = ["model", "show", "m.toml"] if i % 2 else ["filter", "m.toml", "--observations", "Y.csv", "--quiet", "--nodes", "10"]
            if (i + len(key)) % 3 == 0:
                yield Case(f"{key} {expression[:30]!r}", command, {"m.toml": swapped(MODEL, old, new), "Y.csv": ROWS})
        if i % 2 == 0:
            yield Case(f"payoff {expression[:30]!r}", ["weak", "m.toml", "--payoff", expression, "--horizon", "1", "--steps", "2", "--quiet"], {"m.toml": MODEL})
    for name in ["a`touch PWNED`b", "$(touch PWNED)", "'; system 'touch PWNED'; '", '\\" ; system \\"touch PWNED\\" ; \\"', "</text><script>alert(1)</script>", "\\u001b[31mred", "\\u0000", "\\n", "../../PWNED", "%s%n%s",
                 "A" * 5000, "\\\\", "@{x}", "{/Symbol a}"]:
        yield filter_case(f"model named {name[:30]!r}", swapped(MODEL, 'name = "m"', f'name = "{name}"'), options=["--plot", "p.svg", "--quiet"], outputs=("p.svg",))
    for line in ["[state]\n", "x = 1\n", "[observation]\nkind = \"sideways\"\n", "[[state]]\n", "a.b.c = 1979-05-27T07:32:00Z\n", "\x00", "\xff\xfe", "[state", "= 1\n", "[]\n", "[a]\n[a]\n", 'x = "\\q"\n', "x = '''\n", "# " + "c" * 100000]:
        yield Case(f"model and {line[:20]!r}", ["model", "show", "m.toml"], {"m.toml": MODEL + line})
        yield Case(f"{line[:20]!r} and model", ["model", "show", "m.toml"], {"m.toml": line + MODEL})


def row_cases():
    rows = ["", "t\n", "t,y1\n", "t,y1", "t,y1\n0\n", "t,y1\n0,1,2\n", "t,y1\n0,nan\n1,0\n", "t,y1\n0,inf\n1,0\n", "t,y1\nnan,0\n1,0\n", "t,y1\n1,0\n0,0\n", "t,y1\n0,0\n0,0\n", "t,y1\n0,1e999\n1,0\n", "t,y1\n0,0x10\n1,0\n",
            "t,y1\n0,0\n1e308,1\n", "t,y1\n1e15,0\n1000000000000001,1\n", "t;y1\n0;0\n", "t,y1\r0,0\r1,1\r", "\ufefft,y1\n0,0\n1,1\n", "t,y1\n0,0\n1,\x00\n", "t,y1\n0,0\n1,1`touch PWNED`\n", "t,y1\n0,\x1b[31m\n", '"t","y1"\n0,0\n1,1\n',
            "t,y1,y2\n0,0,0\n", "y1,t\n0,0\n1,1\n", "t,y1\n" + "\n" * 100000, "t,y1\n" + "0,0\n" * 1000, "t,y1\n-5,0\n-4,1\n", "t,y1\n0,-1e200\n1,1e200\n2,0\n", "t,y1\n0,0\n1,1" + " " * 100000 + "\n", "t,y1\n1e-320,0\n2e-320,1\n"]
    for i, text in enumerate(rows):
        for method in ["klv", "euler", "kalman-bucy", "grid"][i % 2 :: 2]:
            yield filter_case(f"rows {text[:25]!r}, {method}", rows=text, options=["--method", method, "--quiet"])
        yield filter_case(f"discrete rows {text[:25]!r}", DISCRETE, text, ["--quiet"])
        yield Case(f"standard input {text[:25]!r}", ["filter", "m.toml", "-", "--quiet"], {"m.toml": DISCRETE}, stdin=text.encode())
        if i % 3 == 0:
            yield Case(f"compare on {text[:25]!r}", ["compare", "m.toml:a=0.5", "m.toml:a=1", "--observations", "Y.csv", "--quiet"], {"m.toml": DISCRETE, "Y.csv": text})
            yield Case(f"tree on {text[:25]!r}", ["tree", "m.toml", "--observations", "Y.csv", "--dot", "-", "--quiet"], {"m.toml": DISCRETE, "Y.csv": text})


def option_cases():
    values = ["", "-1", "0", "nan", "inf", "1e400", "99999999999999999999", "1.5", "x", "--", "-", "1,2", " 1", "0x10", "1e9"]
    for option in ["--nodes", "--degree", "--steps", "--rtol", "--atol", "--launches", "--seed", "--threads", "--moments", "--recombination-degree", "--density-at", "--memory", "--checkpoint-every", "--set", "--formula", "--thin", "--method",
                   "--flow", "--functional"]:
        for i, value in enumerate(values):
            if (i + len(option)) % 2 == 0:
                yield filter_case(f"{option} {value!r}", options=["--quiet", option, value])
    for option in ["--horizon", "--steps", "--payoff", "--average", "--integral", "--discount", "--tolerance", "--kink-width", "--gamma", "--nodes", "--memory"]:
        for i, value in enumerate(values):
            if (i + len(option)) % 3 == 0:
                base = {"--payoff": "x", "--horizon": "1", "--steps": "2"}
                base[option] = value
                yield Case(f"weak {option} {value!r}", ["weak", "m.toml", "--quiet", *[word for pair in base.items() for word in pair]], {"m.toml": MODEL})
    for option in ["--horizon", "--steps", "--keep", "--seed", "--memory"]:
        for i, value in enumerate(values):
            if (i + len(option)) % 3 == 1:
                base = {"--horizon": "1", "--steps": "10", "--observations": "-"}
                base[option] = value
                yield Case(f"simulate {option} {value!r}", ["simulate", "m.toml", *[word for pair in base.items() for word in pair]], {"m.toml": MODEL})
    driven = DISCRETE.replace("[state]", '[inputs]\nu = { between = "previous" }\n[state]').replace("-a*x", "u - a*x")
    for name, text in {"good": "t,u\n0,1\n0.1,2\n0.3,3\n", "empty": "", "no column": "t,v\n0,1\n", "no rows": "t,u\n", "nan": "t,u\n0,nan\n1,2\n", "inf": "t,u\n0,1\n0.3,inf\n",
                       "unsorted": "t,u\n0,1\n0.2,2\n0.1,3\n", "short": "t,u\n0,1\n0.2,2\n", "late": "t,u\n0.1,1\n0.3,2\n", "cut off": "t,u\n0,1\n0.3,", "twice": "t,u,u\n0,1,2\n",
                       "bytes": b"t,u\n0,\xff\x00\n", "wide": "t,u" + ",z" * 100000 + "\n0,1" + ",2" * 100000 + "\n", "huge": "t,u\n0,1e308\n0.1,-1e308\n0.3,1e308\n",
                       "tiny steps": "t,u\n0,1\n5e-324,2\n0.3,3\n", "many jumps": "t,u\n" + "".join(f"{i / 1e5},{i % 2}\n" for i in range(30001))}.items():
        codes = {"good": (0,), "huge": (0, 1, 2), "tiny steps": (0, 1, 2), "many jumps": (0,)}.get(name, (2,))
        yield Case(f"inputs {name}", ["filter", "m.toml", "--observations", "Y.csv", "--inputs", "u.csv", "--quiet"], {"m.toml": driven, "Y.csv": ROWS, "u.csv": text}, codes=codes, named=name in ("nan", "cut off"))
    yield Case("inputs of a directory", ["filter", "m.toml", "--observations", "Y.csv", "--inputs", "."], {"m.toml": driven, "Y.csv": ROWS}, codes=(2,))
    yield Case("inputs that are the output", ["filter", "m.toml", "--observations", "Y.csv", "--inputs", "u.csv", "--output", "u.csv"], {"m.toml": driven, "Y.csv": ROWS, "u.csv": "t,u\n0,1\n1,2\n"}, codes=(2,))
    for rows in ["[[1]]", "[[2]]", "[[1, 0], [0, 1]]", "[]", "[[]]", "1", '[["x"]]', '[["1/0"]]', "[[nan]]", "[[" + "1," * 100000 + "1]]"]:
        codes = (0,) if rows == "[[1]]" else (2,)
        yield Case(f"correlation {rows[:20]}", ["model", "show", "m.toml"], {"m.toml": MODEL + f"[noise]\ncorrelation = {rows}\n"}, codes=codes)
    for words in [[], ["--help"], ["nonsense"], ["filter"], ["filter", "m.toml"], ["filter", "nonsense", "--observations", "Y.csv"], ["format"], ["format", "nonsense"], ["model"], ["model", "show"], ["model", "show", "../../../etc/passwd"],
                  ["study"], ["study", "nonsense"], ["study", "cpu"], ["formulas", "show", "../benes"], ["tree", "benes"], ["tree", "benes", "--steps", "1000000", "--horizon", "1", "--dot", "-"], ["compare", "benes"], ["completion", "nonsense"],
                  ["filter", "A" * 10000, "--observations", "Y.csv"], ["filter", "m.toml", "--observations", "Y.csv", "--output", "no/such/folder/x.csv"], ["filter", "m.toml", "--observations", "Y.csv", "--output", "A" * 300],
                  ["filter", "m.toml", "--observations", "Y.csv", "--output", ""], ["filter", "m.toml", "--observations", "Y.csv", "--plot", "p.exe"], ["filter", "m.toml", "--observations", "Y.csv", "--plot", "/dev/full.svg"],
                  ["filter", "m.toml", "--observations", "Y.csv", "--output", "/dev/full"]]:
        yield Case(f"words {' '.join(words)[:50]!r}", words, {"m.toml": MODEL, "Y.csv": ROWS})


# Outputs that name inputs, links and foreign directories.
def file_cases():
    base = ["filter", "m.toml", "--observations", "Y.csv", "--quiet"]
    files = {"m.toml": MODEL, "Y.csv": ROWS}
    for option, target in [("--output", "Y.csv"), ("--output", "m.toml"), ("--checkpoint", "Y.csv"), ("--checkpoint", "m.toml"), ("--output", "./Y.csv"), ("--output", "link.csv")]:
        yield Case(f"{option} over {target}", [*base, option, target], files, codes=(2,), links={"link.csv": "Y.csv"}, named=True)
    yield Case("output and checkpoint are one", [*base, "--output", "o.csv", "--checkpoint", "o.csv"], files, codes=(2,), named=True)
    yield Case("output is a folder", [*base, "--output", "folder"], {**files, "folder/x": ""}, codes=(1, 2))
    yield Case("a study into a foreign folder", ["study", "s.toml", "--output", "out"], {"s.toml": STUDY, "m.toml": MODEL, "out/runs.csv": "mine\n", "out/index.html": "mine\n"}, codes=(2,), named=True)
    yield Case("a study into a folder with a link", ["study", "s.toml", "--output", "out"], {"s.toml": STUDY, "m.toml": MODEL, "out/x": "mine\n", "precious": "mine\n"}, codes=(2,), links={"out/runs.csv": "../precious"}, named=True)


def study_cases():
    for old, new in [("filter", "fliter"), ('"mean_x"', '"mean_q"'), ('"mean_x"', '""'), ('["absolute"]', '["nonsense"]'), ('["absolute"]', "[]"), ('"exact"', '"nonsense"'), ('"exact"', '"1/0"'), ("horizon = 1.0", "horizon = -1"),
                     ("horizon = 1.0", "horizon = nan"), ("horizon = 1.0", "horizon = 1e-320"), ("steps = 100", "steps = 0"), ("keep = 100", "keep = 7"), ("[10, 20]", "[]"), ("[10, 20]", "[0]"), ("[10, 20]", "[10, 10]"),
                     ("./m.toml", "../../m.toml"), ("./m.toml", "/dev/zero"), ("./m.toml", ""), ("./m.toml", "`touch PWNED`"), ("[10, 20]", "[1000000000]"), ("horizon = 1.0", 'file = "/dev/zero"'), ("title = \"s\"", "title = 5"),
                     ("keep = 100", "keep = 100\nseed = -1"), ("[options]", "[[options]]")]:
        yield Case(f"study with {new[:30]!r}", ["study", "s.toml", "--output", "out", "--quiet"], {"s.toml": swapped(STUDY, old, new), "m.toml": MODEL}, outputs=("out",))
    for label in ["a`touch PWNED`b", "</title><script>", "\\n", "../x", "A" * 2000]:
        yield Case(f"study series {label[:20]!r}", ["study", "s.toml", "--output", "out", "--quiet"],
                   {"s.toml": STUDY + f'[[series]]\nlabel = "{label}"\ndegree = 5\n[[series]]\nlabel = "other"\ndegree = 3\n[[plot]]\nx = "nodes"\ny = "absolute"\ntitle = "{label}"\n', "m.toml": MODEL}, outputs=("out",))


def formula_cases():
    formula = json.loads(FORMULA)

    def changed(change):
        copy = json.loads(FORMULA)
        change(copy)
        return json.dumps(copy)

    texts = ["", "{", "[]", "null", "{}", '"x"', "1e999", '{"name": "x", "name": "y"}', "\x00", "{" * 10000, FORMULA[:100], FORMULA + "x", FORMULA.replace("5", "1e400"), "\ufeff" + FORMULA]
    texts += [changed(lambda f: f.update(degree=10**9)), changed(lambda f: f.update(dimension=10**6)), changed(lambda f: f.update(degree=-1)), changed(lambda f: f.update(paths=[])), changed(lambda f: f.update(name=5)),
              changed(lambda f: f["paths"][0].update(weight=-1)), changed(lambda f: f["paths"][0].update(weight=1e308)), changed(lambda f: f["paths"][0].update(segments=[[0]])), changed(lambda f: f["paths"][0].update(segments=[])),
              changed(lambda f: f.update(degree=99)), changed(lambda f: f.update(name="`touch PWNED`")), changed(lambda f: f.update(paths=f["paths"] * 2000))]
    assert formula
    for i, text in enumerate(texts):
        yield Case(f"verify formula {i}", ["formulas", "verify", "f.json"], {"f.json": text})
        yield filter_case(f"filter by formula {i}", options=["--formula", "./f.json", "--quiet"])
        yield Case(f"filter with formula {i}", ["filter", "m.toml", "--observations", "Y.csv", "--formula", "./f.json", "--quiet"], {"m.toml": MODEL, "Y.csv": ROWS, "f.json": text})


def checkpoint_cases():
    for i, content in enumerate([b"", b"x", b"wienertree checkpoint 1\n", b"wienertree checkpoint 1\n{}\n", b"wienertree checkpoint 2\n{}\n12345678", b"wienertree checkpoint 1\n" + b"[" * 100000 + b"\n12345678", b"\x00" * 1000,
                                  b"wienertree checkpoint 1\n{}\n" + b"\xff" * 1000]):
        yield filter_case(f"checkpoint {i}", options=["--resume", "c", "--quiet"], codes=(2,))
        yield Case(f"resumed checkpoint {i}", ["filter", "m.toml", "--observations", "Y.csv", "--resume", "c", "--quiet"], {"m.toml": MODEL, "Y.csv": ROWS, "c": content}, codes=(2,))


# Bundled and other valid files with a few bytes changed, by a fixed seed.
def mutated_cases(each=25):
    random_ = random.Random(20261130)

    def mutated(text):
        data = bytearray(text.encode())
        for _ in range(random_.randint(1, 6)):
            at = random_.randrange(len(data))
            what = random_.randrange(4)
            if what == 0:
                data[at] = random_.randrange(256)
            elif what == 1:
                del data[at : at + random_.randint(1, 20)]
            elif what == 2:
                data[at:at] = bytes(random_.choice(["0", "9" * 20, "-", "[", "]", "\n", '"', "e308", ".", ",", "nan", "x", "(", ")", "^", "="]), "ascii")
            else:
                other = random_.randrange(len(data))
                data[at:at] = data[other : other + random_.randint(1, 30)]
        return bytes(data)

    models = sorted((ROOT / "data/models").glob("*.toml"))
    formulas = [file for file in sorted((ROOT / "data/cubature_formulas").glob("*.json")) if file.stat().st_size < 10000]
    for i in range(each):
        model = random_.choice(models)
        yield Case(f"mutated model {i}", ["model", "show", "m.toml"], {"m.toml": mutated(model.read_text())})
        yield Case(f"mutated formula {i}", ["formulas", "verify", "f.json"], {"f.json": mutated(random_.choice(formulas).read_text())})
        yield filter_case(f"mutated rows {i}", rows=mutated(ROWS * 1), options=["--quiet", "--nodes", "10"])
        yield Case(f"mutated study {i}", ["study", "s.toml", "--output", "out", "--quiet"], {"s.toml": mutated(STUDY), "m.toml": MODEL}, outputs=("out",))


def corpus():
    cases = []
    for source in [named_cases, model_cases, row_cases, option_cases, file_cases, study_cases, formula_cases, checkpoint_cases, mutated_cases]:
        cases += source()
    return cases


def words_of(case):
    """The command as one would type it, long words cut."""
    return " ".join(word if re.fullmatch(r"[\w./=:,-]{1,60}", word) else repr(word[:60]) for word in case.command)
